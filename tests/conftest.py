"""Shared by every test: where things are, how many random cases, what runs where.

  remap/, tests/ and tests/python/ are on sys.path.
  random_count(default), random_seed(), write_replay(): for the random tests, with
      CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED from the environment
  @pytest.mark.machine    the test runs a whole LinuxCNC: at most two at once, first
  tests/hal, tests/machine    refused where bin/chipwise-sandbox has no private namespaces
  tests/core/*.c          collected as one test per program
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
for folder in (ROOT / "remap", ROOT / "tests", ROOT / "tests" / "python"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

DEFAULT_SEED = 7134
CORE_TIMEOUT_S = 300
SANDBOXED = ("tests/hal", "tests/machine")


# --- random tests -----------------------------------------------------------

def random_count(default):
    """How many random cases: CHIPWISE_RANDOM_COUNT, else the test's own default."""
    return int(os.environ.get("CHIPWISE_RANDOM_COUNT") or default)


def random_seed():
    """Seed of the random tests: CHIPWISE_SEED, else fixed."""
    return int(os.environ.get("CHIPWISE_SEED") or DEFAULT_SEED)


def write_replay(name, case):
    """Save a failing case under build/replay; -> its path."""
    path = ROOT / "build" / "replay" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(case, indent=1))
    return path


@pytest.fixture
def root():
    """The repository's root."""
    return ROOT


# --- what runs where --------------------------------------------------------

def pytest_configure(config):
    config.addinivalue_line('markers', 'machine: runs a whole simulated LinuxCNC')
    config.addinivalue_line('markers', 'xdist_group(name): tests of one name run in one process')
    if not hasattr(config, 'workerinput') and not config.option.collectonly:
        refuse_without_namespaces(config.args)


def refuse_without_namespaces(arguments):
    """Stop before the first test where those asked for run a LinuxCNC and it would be this machine's own."""
    asked = [Path(argument.partition('::')[0]).resolve() for argument in arguments]
    folders = [ROOT / name for name in SANDBOXED]
    if not any(folder in (path, *path.parents) or path in folder.parents for path in asked for folder in folders):
        return
    done = subprocess.run([ROOT / 'bin/chipwise-sandbox', '--require-isolation', '--', 'true'], text=True,
                          stdin=subprocess.DEVNULL, capture_output=True)
    if done.returncode:
        others = sorted(str(path.relative_to(ROOT)) for path in (ROOT / 'tests').iterdir()
                        if path.is_dir() and path not in folders and path.name not in ('lib', '__pycache__'))
        raise pytest.UsageError('%s; %s need that. The other tests run without: tools/test %s' % (
            done.stderr.strip(), ' and '.join(SANDBOXED), ' '.join(others)))


def pytest_collection_modifyitems(items):
    """Machine tests first, in as many processes as there are spare processors."""
    groups = 2 if len(os.sched_getaffinity(0)) > 2 else 1
    machine = [item for item in items if item.get_closest_marker('machine')]
    for number, item in enumerate(machine):
        item.add_marker(pytest.mark.xdist_group('machine%d' % (number % groups)))
    chosen = set(machine)
    items[:] = machine + [item for item in items if item not in chosen]


# --- C test programs --------------------------------------------------------

def pytest_collect_file(parent, file_path):
    if file_path.suffix == '.c' and file_path.parent.name == 'core':
        return CoreFile.from_parent(parent, path=file_path)
    return None


class CoreFile(pytest.File):
    """tests/core/NAME.c, built by `make build` as build/tests/NAME."""

    def collect(self):
        yield CoreProgram.from_parent(self, name=self.path.stem)


class CoreProgram(pytest.Item):
    """Passes when the program exits with 0; what it printed is the failure's text."""

    def runtest(self):
        program = str(ROOT / 'build' / 'tests' / self.name)
        done = subprocess.run([program], cwd=ROOT, text=True, errors='replace',
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=CORE_TIMEOUT_S)
        if done.returncode != 0:
            raise CoreFailure('%s exited with %d\n%s'
                              % (program, done.returncode, done.stdout[-4000:]))

    def repr_failure(self, excinfo, style=None):
        if isinstance(excinfo.value, (CoreFailure, OSError)):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self):
        return self.path, None, 'core: ' + self.name


class CoreFailure(Exception):
    """A C test program failed; str() is what it printed."""
