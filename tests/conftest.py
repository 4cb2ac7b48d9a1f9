# SPDX-License-Identifier: GPL-2.0-or-later
"""What runs where.

@pytest.mark.machine    the test runs a whole LinuxCNC: first, with xdist in three processes, and other tests beside
                        them
@pytest.mark.long       the test takes long (support/durations.py); not in `make test`, but in `make test-all`
@pytest.mark.slow       the test takes some time (support/durations.py), or is one of SANDBOXED; not in tools/test
                        --quick
tests/components, tests/machine    refused where bin/chipwise-sandbox has no private namespaces
tests/shipped           needs namespaces as well, of its own, and is skipped without
@pytest.mark.inputs     the test is left out while its inputs are as they were when it passed (support/unchanged.py)
tests/core/*.c          collected as one test per program
"""

import gc
import json
import os
import subprocess
from pathlib import Path

import pytest

pytest.register_assert_rewrite("support")  # a judge's assert says as much as a test's

from support import ROOT, durations, unchanged  # noqa: E402
from support.scheduling import machine_units, niceness, scheduler  # noqa: E402

CORE_TIMEOUT_S = 300
RECORDED = durations.recorded()
LONG, SLOW = durations.long_tests(RECORDED), durations.slow_tests(RECORDED)
os.environ.setdefault("CHIPWISE_MONITOR_S", "60")  # a busy computer keeps chipwise-monitor waiting in any test
SANDBOXED = ("tests/components", "tests/machine")
IN_NAMESPACES = (*SANDBOXED, "tests/shipped")  # not proposed where there are none


@pytest.fixture
def root():
    """The repository's root."""
    return ROOT


@pytest.fixture
def answers(request, tmp_path_factory):
    """The answers of a test's scene (support/operate.py: Shared)."""
    from support.operate import scene_of

    return scene_of(request.node)[0].answers_of(request.node, lambda: tmp_path_factory.mktemp("shared"))


@pytest.fixture(scope="module")
def forked_readers():
    """The processes of chipwise that a module's tests start without a command are forked (support/forked.py)."""
    from support import forked

    with forked.here():
        yield


# --- what runs where --------------------------------------------------------


def pytest_configure(config):
    config.addinivalue_line("markers", "machine: runs a whole simulated LinuxCNC")
    config.addinivalue_line("markers", "long: takes long; not part of `make test`")
    config.addinivalue_line("markers", "slow: takes some time, or needs a sandbox; not part of tools/test --quick")
    config.addinivalue_line(
        "markers", "scene(shared, steps): steps in a LinuxCNC that several tests share (support/operate.py)"
    )
    config.addinivalue_line(
        "markers", "inputs(function): left out of `make test` and test-all while these are as they were when it passed"
    )
    config.addinivalue_line("markers", "together(name): machine tests that judge the same run (support/demo_runs.py)")
    config.addinivalue_line("markers", "xdist_group(name): tests of one name run in one process")
    config.times_to = os.environ.pop("CHIPWISE_DURATIONS", None)  # not for a pytest that a test runs
    if hasattr(config, "workerinput"):
        os.nice(niceness(config.workerinput["workerid"]))
    elif not config.option.collectonly:
        refuse_without_namespaces(config.args)


def refuse_without_namespaces(arguments):
    """Stop before the first test where those asked for run a LinuxCNC and it would be this machine's own."""
    asked = [Path(argument.partition("::")[0]).resolve() for argument in arguments]
    folders = [ROOT / name for name in SANDBOXED]
    if not any(folder in (path, *path.parents) or path in folder.parents for path in asked for folder in folders):
        return
    done = subprocess.run(
        [ROOT / "bin/chipwise-sandbox", "--require-isolation", "--", "true"],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
    )
    if done.returncode:
        others = sorted(
            str(path.relative_to(ROOT))
            for path in (ROOT / "tests").iterdir()
            if path.is_dir()
            and str(path.relative_to(ROOT)) not in (*IN_NAMESPACES, "tests/support", "tests/__pycache__")
        )
        raise pytest.UsageError(
            "%s; %s need that. The other tests run without: tools/test %s"
            % (done.stderr.strip(), ", ".join(IN_NAMESPACES), " ".join(others))
        )


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    if item.get_closest_marker("inputs") and unchanged.in_force() and unchanged.has_passed(item):
        pytest.skip("nothing it depends on has changed since it passed; `make test-long` runs it")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    if (
        call.when == "call"
        and item.get_closest_marker("inputs")
        and outcome.get_result().passed
        and unchanged.in_force()
    ):
        unchanged.keep(item)


def is_sandboxed(path):
    return any(ROOT / name in (path, *path.parents) for name in SANDBOXED)


def pytest_ignore_collect(collection_path, config):
    """With -m "not slow" what needs a sandbox is not even imported."""
    return True if "not slow" in (config.option.markexpr or "") and is_sandboxed(collection_path) else None


@pytest.hookimpl(hookwrapper=True)
def pytest_collection():
    """Modules and tests stay until the end: the garbage collector, which would look through all of them again and
    again, leaves them alone."""
    gc.disable()
    yield
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups (3.1)
def pytest_collection_modifyitems(items):
    """Machine tests first; the processes of xdist take them as support/scheduling.py says."""
    for item in items:
        path = str(item.path.relative_to(ROOT))
        names = {path, durations.test_of(item.nodeid)}
        if names & LONG or path.startswith(durations.SHIPPED):
            item.add_marker(pytest.mark.long)
        if names & SLOW or is_sandboxed(item.path):
            item.add_marker(pytest.mark.slow)
    machine = [item for item in items if item.get_closest_marker("machine")]
    names, ordered = machine_units(machine, unit_of, durations.unit_seconds(machine, RECORDED))
    for item in machine:
        item.add_marker(pytest.mark.xdist_group(names[unit_of(item)]))
    chosen = set(machine)
    items[:] = ordered + [item for item in items if item not in chosen]


def unit_of(item):
    """What a machine test shares with those that run in the same process: the LinuxCNC of its scene, its run, else
    nothing."""
    scene, together = item.get_closest_marker("scene"), item.get_closest_marker("together")
    return scene.args[0].name if scene else together.args[0] if together else item.nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return scheduler(config, log) if config.getvalue("dist") == "loadgroup" else None


def pytest_terminal_summary(terminalreporter, config):
    """Of a whole run (tools/test --all): new tests that take long, and the times for tools/durations."""
    if config.times_to:
        seconds = durations.spent(
            report
            for reports in terminalreporter.stats.values()
            for report in reports
            if isinstance(report, pytest.TestReport)
        )
        for line in durations.unrecorded(seconds, RECORDED):
            terminalreporter.write_line(line)
        Path(config.times_to).write_text(json.dumps(seconds), encoding="utf-8")


# --- C test programs --------------------------------------------------------


def pytest_collect_file(parent, file_path):
    if file_path.suffix == ".c" and file_path.parent.name == "core":
        return CoreFile.from_parent(parent, path=file_path)
    return None


class CoreFile(pytest.File):
    """tests/core/NAME.c, built by `make build` as build/tests/NAME."""

    def collect(self):
        yield CoreProgram.from_parent(self, name=self.path.stem)


class CoreProgram(pytest.Item):
    """Passes when the program exits with 0; what it printed is the failure's text."""

    def runtest(self):
        program = str(ROOT / "build" / "tests" / self.name)
        done = subprocess.run(
            [program],
            cwd=ROOT,
            text=True,
            errors="replace",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=CORE_TIMEOUT_S,
        )
        if done.returncode != 0:
            raise CoreFailure("%s exited with %d\n%s" % (program, done.returncode, done.stdout[-4000:]))

    def repr_failure(self, excinfo, style=None):
        if isinstance(excinfo.value, (CoreFailure, OSError)):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self):
        return self.path, None, "core: " + self.name


class CoreFailure(Exception):
    """A C test program failed; str() is what it printed."""
