# SPDX-License-Identifier: GPL-2.0-or-later
"""tests/long.txt and tests/slow.txt: what `make test` and `make test-quick` leave out, and how tools/long_tests.py chooses it."""
import importlib.util
import re

import pytest
from support import ROOT

SPEC = importlib.util.spec_from_file_location("long_tests", ROOT / "tools/long_tests.py")
long_tests = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(long_tests)


@pytest.mark.parametrize("name", ("long", "slow"))
def test_every_line_names_a_test(name):
    """A renamed test would be forgotten here, and run in `make test`."""
    for line in (long_tests.TESTS / f"{name}.txt").read_text().splitlines():
        path, _, test = line.partition("::")
        text = (ROOT / path).read_text()
        assert not test or re.search(rf"def {re.escape(test)}\(", text), line


def test_groups():
    assert long_tests.group_of("tests.machine.test_stop", "test_stop_is_served[hole]@machine0") == "tests/machine/test_stop.py"
    assert long_tests.group_of("tests.check.test_check", "test_unusable[a-1]") == "tests/check/test_check.py::test_unusable"
    assert long_tests.group_of("tests.panel.test_panel.TestOne", "test_a@dask") == "tests/panel/test_panel.py::test_a"
    assert long_tests.group_of("tests.core.test_plunge.c", "test_plunge") == "tests/core/test_plunge.c"


SPENT = long_tests.seconds_of([
    ("tests.machine.test_a", "test_1", 3.0), ("tests.machine.test_a", "test_2", 3.0), ("tests.machine.test_b", "test_1", 5.0),
    ("tests.cli.test_c", "test_1[x]", 1.0), ("tests.cli.test_c", "test_1[y]", 1.0), ("tests.cli.test_c", "test_2", 1.5)])


def test_the_longest_are_left_out():
    assert long_tests.long_groups(SPENT, 10.0, 3.0) == {"tests/cli/test_c.py::test_1", "tests/machine/test_a.py"}
    assert long_tests.long_groups(SPENT, 11.0, 3.5) == set()


def test_the_quick_ones_need_no_sandbox():
    """What needs one is left out by its folder, so it has no line and takes nothing of the budget."""
    assert long_tests.slow_groups(SPENT, 3.4) == {"tests/cli/test_c.py::test_1"}
    assert long_tests.slow_groups(SPENT, 3.5) == set()
