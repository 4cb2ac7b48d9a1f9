# SPDX-License-Identifier: GPL-2.0-or-later
"""What is left out while its inputs are unchanged (support/unchanged.py): any input that differs makes it run, and no
input is missing."""

import os
import re
import runpy
import shutil
import subprocess
import sys

import pytest

from support import ROOT, unchanged

PASSED = runpy.run_path(str(ROOT / "tools/passed"))
A_FAULT = "tests/core/test_sabotage.py::test_fault_is_seen[no arcs]"
ITS_TEST = "tests/surface/test_arcs.py"
OF_FAULTS = (
    "test_nothing_is_read_behind_the_last_station",
    "test_every_station_is_in_its_band",
    "test_a_circle_is_few_arcs_and_without_them_lines",
)
# The library says its version; the others decide which tests run, not what comes of one.
NO_INPUT = {
    "VERSION",
    "tests/conftest.py",
    "tests/support/durations.py",
    "tests/support/scheduling.py",
    "tests/support/unchanged.py",
}
# In a process of its own: what is opened below the root while pytest runs.
OPENED = """
import os, sys
root, seen = sys.argv[1] + '/', set()
def opened(event, arguments):
    if event == 'open' and isinstance(arguments[0], str):
        seen.add(os.path.abspath(arguments[0]))
sys.addaudithook(opened)
import pytest
status = pytest.main(['-q', '-p', 'no:xdist', '-p', 'no:cacheprovider', *sys.argv[2:]])
print(*sorted('opened ' + path[len(root):] for path in seen if path.startswith(root)), sep='\\n')
sys.exit(status)
"""


def outcome(passed, test=A_FAULT, **more):
    """The last line of pytest on a marked test, where `passed` is the file of what has passed."""
    env = {
        name: value
        for name, value in os.environ.items()
        if name not in ("CHIPWISE_SEED", "CHIPWISE_RANDOM_COUNT", "PYTEST_ADDOPTS")
    }
    env.update(CHIPWISE_UNCHANGED="skip", CHIPWISE_RANDOM_SHARE=unchanged.SHARE, CHIPWISE_PASSED=str(passed), **more)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", test],
        cwd=ROOT,
        env=env,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout.splitlines()[-1]


def test_it_runs_once_and_again_after_a_change(tmp_path):
    passed = tmp_path / "passed.txt"
    assert outcome(passed).startswith("1 passed")
    assert list(unchanged.read(passed)) == [A_FAULT]
    assert outcome(passed).startswith("1 skipped")
    for named in ({"CHIPWISE_UNCHANGED": ""}, {"CHIPWISE_SEED": "3"}):  # a test that is named; another seed
        assert not unchanged.in_force({"CHIPWISE_RANDOM_SHARE": unchanged.SHARE, "CHIPWISE_UNCHANGED": "skip", **named})
    passed.write_text(re.sub(r"^\w", "x", passed.read_text()))
    assert outcome(passed).startswith("1 passed")


@pytest.fixture
def copied(tmp_path):
    """digest(path, change): of a test with one of its inputs, a copy, changed."""
    inputs = unchanged.closure([*unchanged.c_files(), ROOT / ITS_TEST])

    def digest(changed=None, tools="gcc 12"):
        contents = {path: unchanged.content(path) for path in inputs}
        if changed:
            copy = tmp_path / "copy"
            shutil.copy(changed, copy)
            with open(copy, "ab") as file:
                file.write(b" ")
            contents[changed] = unchanged.content.__wrapped__(copy)
        return unchanged.digest_of_contents(contents, "test", tools)

    return inputs, digest


def test_each_input_counts(copied):
    inputs, digest = copied
    names = {str(path.relative_to(ROOT)) for path in inputs}
    assert {
        "components/core/fault.h",
        "components/offline/chain_fit.c",
        "components/registers.h",
        ITS_TEST,
        "remap/chipwise/clib/chain_fit.py",
        "tests/support/guarded.py",
    } <= names
    found = [digest(path) for path in inputs]
    assert len({digest(), digest(tools="gcc 13"), *found}) == len(inputs) + 2


def test_no_input_is_missing():
    """What Python opens below the root while the tests of the faults of a file run."""
    done = subprocess.run(
        [sys.executable, "-c", OPENED, str(ROOT), *(f"{ITS_TEST}::{name}" for name in OF_FAULTS)],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout
    opened = {
        re.sub(r"__pycache__/([^./]+)\..*pyc(\.\d+)?$", r"\1.py", name)
        for name in re.findall(r"^opened (.*)$", done.stdout, re.M)
    }
    inputs = unchanged.closure([*unchanged.c_files(), ROOT / ITS_TEST, ROOT / "pytest.ini"])
    assert ITS_TEST in opened and len(opened) > 20
    missing = (
        {name for name in opened if not name.startswith("build/") and not name.endswith("/durations.txt")}
        - {str(path.relative_to(ROOT)) for path in inputs}
        - NO_INPUT
    )
    assert not missing, missing


def test_no_marked_test_is_lost():
    """A mark with a function that has a name is put on that function, and the test is gone: only lambdas are
    allowed."""
    found = [
        word
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        for word in re.findall(r"^@pytest\.mark\.inputs\(\s*(\S+)", path.read_text(), re.M)
    ]
    assert len(found) >= 9 and all(re.match(r"lambda\b", word) for word in found), found


def test_what_is_not_of_this_tree_is_named():
    assert PASSED["differing"]({"a": "1", "gone": "2", "changed": "3"}, {"a": "1", "changed": "4", "new": "5"}) == [
        "changed",
        "gone",
        "new",
    ]


@pytest.mark.skipif(os.environ.get("CHIPWISE_UNCHANGED") != "check", reason="part of `make test-long`")
def test_the_committed_file_is_of_this_tree():
    if unchanged.committed_tools() != unchanged.tools():
        pytest.skip(f"tests/passed.txt is of {unchanged.committed_tools()}; this is {unchanged.tools()}")
    done = subprocess.run(
        [sys.executable, ROOT / "tools/passed", "--check"], stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
