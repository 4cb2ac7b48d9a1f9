# SPDX-License-Identifier: GPL-2.0-or-later
"""The tables tests/FOLDER/durations.txt: what is in them, what `make test` and `make test-quick` leave out by them, how
tools/durations writes them."""

import runpy
from types import SimpleNamespace

import pytest
from support import ROOT, durations

TOOL = runpy.run_path(str(ROOT / "tools/durations"))


def test_every_line_names_a_test():
    """A renamed test would be forgotten there, and run in `make test`."""
    known = durations.recorded()
    assert len(known) > 500 and not [test for test in known if not TOOL["there"](test)]
    assert not TOOL["there"]("tests/common/test_durations.py::test_none") and not TOOL["there"](
        "tests/common/test_none.py::test_none"
    )


def test_the_tables_are_as_the_tool_writes_them():
    for path in (ROOT / "tests").glob("*/durations.txt"):
        rows = [line.split() for line in path.read_text().splitlines()]
        assert len({name for _seconds, name in rows}) == len(rows), path
        assert path.read_text() == durations.table({name: float(seconds) for seconds, name in rows}), path


@pytest.mark.parametrize(
    "nodeid, test",
    [
        (
            "tests/machine/test_stop.py::test_stop_is_served[hole]@machine0",
            "tests/machine/test_stop.py::test_stop_is_served",
        ),
        ("tests/check/test_check.py::test_unusable[a::b-1@2]", "tests/check/test_check.py::test_unusable"),
        ("tests/panel/test_panel.py::TestOne::test_a@dask", "tests/panel/test_panel.py::test_a"),
        ("tests/core/test_plunge.c::test_plunge", "tests/core/test_plunge.c"),
    ],
)
def test_names(nodeid, test):
    assert durations.test_of(nodeid) == test


KNOWN = {
    "tests/machine/test_a.py::test_1": 40.0,
    "tests/machine/test_a.py::test_2": 20.5,
    "tests/machine/test_b.py::test_1": 60.0,
    "tests/cli/test_c.py::test_1": 4.1,
    "tests/cli/test_c.py::test_2": 4.0,
    "tests/core/test_d.c": 0.2,
}


def test_the_longest_are_left_out():
    assert durations.long_tests(KNOWN) == {"tests/machine/test_a.py", "tests/cli/test_c.py::test_1"}
    assert durations.slow_tests(KNOWN) == KNOWN.keys() - {"tests/core/test_d.c"}


def test_parameters_share_the_time_and_a_new_test_takes_the_mean():
    items = [
        SimpleNamespace(nodeid=f"tests/machine/{name}")
        for name in ("test_a.py::test_1[x]", "test_a.py::test_1[y]", "test_a.py::test_2", "test_new.py::test_1")
    ]
    assert list(durations.unit_seconds(items, KNOWN).values()) == [20.0, 20.0, 20.5, pytest.approx(60.5 / 3)]
    assert list(durations.unit_seconds(items, {}).values()) == [1.0] * 4


def report(nodeid, duration, skipped=False):
    return SimpleNamespace(nodeid=nodeid, duration=duration, skipped=skipped)


def test_a_new_test_that_takes_long_is_named():
    """All phases and parameters count; one that was skipped takes nothing now."""
    seconds = durations.spent(
        [
            report("tests/a/test_a.py::test_1[x]", 1.5),
            report("tests/a/test_a.py::test_1[y]@machine3", 0.6),
            report("tests/a/test_a.py::test_2", 2.0),
            report("tests/a/test_a.py::test_3", 9.0),
            report("tests/a/test_a.py::test_4[x]", 9.0),
            report("tests/a/test_a.py::test_4[y]", 0.0, skipped=True),
        ]
    )
    assert seconds == {
        "tests/a/test_a.py::test_1": pytest.approx(2.1),
        "tests/a/test_a.py::test_2": 2.0,
        "tests/a/test_a.py::test_3": 9.0,
    }
    (said,) = durations.unrecorded(seconds, {"tests/a/test_a.py::test_3": 0.3})
    assert said.startswith("tests/a/test_a.py::test_1 took 2.1 s and is not in its folder's durations.txt")


def test_a_whole_run_is_recorded(tmp_path):
    """The longest first; what is short has no line; what did not run keeps its time, unless it is gone."""
    for folder, name, text in (
        ("cli", "test_c.py", "def test_1():\ndef test_2(x):\n"),
        ("core", "test_d.c", ""),
        ("old", "test_e.py", ""),
    ):
        (tmp_path / "tests" / folder).mkdir(parents=True)
        (tmp_path / "tests" / folder / name).write_text(text)
    for folder, line in (
        ("cli", "3.0 test_c.py::test_1\n1.0 test_c.py::test_2\n"),
        ("core", "0.7 test_d.c\n"),
        ("old", "5.0 test_e.py::test_gone\n"),
    ):
        (tmp_path / "tests" / folder / "durations.txt").write_text(line)
    times = durations.write(
        {"tests/cli/test_c.py::test_2": 12.34, "tests/cli/test_f.py::test_3": 0.14},
        lambda test: TOOL["there"](test, tmp_path),
        tmp_path,
    )
    assert sum(times.values()) == pytest.approx(16.18)
    found = {path.parent.name: path.read_text() for path in tmp_path.glob("tests/*/durations.txt")}
    assert found == {"cli": "12.3 test_c.py::test_2\n3.0 test_c.py::test_1\n", "core": "0.7 test_d.c\n"}
    assert durations.recorded(tmp_path) == {
        "tests/cli/test_c.py::test_2": 12.3,
        "tests/cli/test_c.py::test_1": 3.0,
        "tests/core/test_d.c": 0.7,
    }
