# SPDX-License-Identifier: GPL-2.0-or-later
"""How long the tests take, in the table of each folder, tests/FOLDER/durations.txt: the longest first.

    31.2 test_stop.py::test_stop_is_served      s of all its parameters and of what is set up for them, in a whole run
                                                on two cores

A test that is not there takes less than RECORDED_S, or is new.  tests/conftest.py orders machine tests by these times,
marks with them what `make test` and `make test-quick` leave out, and in a whole run names new tests that take NEW_S and
keeps the times for tools/durations, which writes the tables.
"""

from collections import Counter

from support import ROOT

TABLE = "durations.txt"
RECORDED_S = 0.2
NEW_S = 2.0  # a test that takes so long has to be in a table
SLOW_S = 0.2  # longer ones are not in `make test-quick`
LONG_S = 4.0  # longer ones are not in `make test`,
LONG_FILE_S = 60.0  # nor are files of tests/machine, whose tests share a LinuxCNC
MACHINE, SHIPPED = "tests/machine/", "tests/shipped/"


def test_of(nodeid):
    """tests/a/test_b.py::test_c of any of its parameters, classes and processes; a C program is its file."""
    path, *names = nodeid.partition("[")[0].split("::")
    return path if path.endswith(".c") else f"{path}::{names[-1].partition('@')[0]}"


def recorded(root=ROOT):
    """{test: s} of all tables."""
    found = {}
    for path in sorted((root / "tests").glob(f"*/{TABLE}")):
        for line in path.read_text().splitlines():
            seconds, name = line.split()
            found[f"tests/{path.parent.name}/{name}"] = float(seconds)
    return found


def unit_seconds(items, known):
    """{nodeid: s}: the test's time, shared by those of its parameters that run; of an unknown test the mean of
    these."""
    count = Counter(test_of(item.nodeid) for item in items)
    seconds = {item.nodeid: known[test] / count[test] for item in items if (test := test_of(item.nodeid)) in known}
    mean = sum(seconds.values()) / len(seconds) if seconds else 1.0
    return {item.nodeid: seconds.get(item.nodeid, mean) for item in items}


def long_tests(known):
    """{test, or file of tests/machine} that `make test` leaves out; those of tests/shipped are long whatever they
    take."""
    files = Counter()
    for test, seconds in known.items():
        files[test.partition("::")[0]] += seconds
    return {path for path, seconds in files.items() if path.startswith(MACHINE) and seconds > LONG_FILE_S} | {
        test for test, seconds in known.items() if not test.startswith((MACHINE, SHIPPED)) and seconds > LONG_S
    }


def slow_tests(known):
    """{test} that `make test-quick` leaves out, beside all that needs a sandbox."""
    return {test for test, seconds in known.items() if seconds > SLOW_S}


def spent(reports):
    """{test: s} of pytest's reports; without tests that were skipped, for they would take longer."""
    seconds, skipped = Counter(), set()
    for report in reports:
        seconds[test_of(report.nodeid)] += report.duration
        if report.skipped:
            skipped.add(test_of(report.nodeid))
    return {test: value for test, value in seconds.items() if test not in skipped}


def unrecorded(seconds, known):
    """Lines that name new tests which take long."""
    return [
        f"{test} took {value:.1f} s and is not in its folder's {TABLE}; tools/durations records a whole run"
        for test, value in sorted(seconds.items(), key=lambda pair: -pair[1])
        if value > NEW_S and test not in known
    ]


def table(times):
    """Text of a folder's table; times: {name: s}."""
    rows = sorted(
        ((round(value, 1), name) for name, value in times.items() if value >= RECORDED_S),
        key=lambda row: (-row[0], row[1]),
    )
    return "".join(f"{value:.1f} {name}\n" for value, name in rows)


def write(seconds, there, root=ROOT):
    """The tables, from {test: s} of a whole run; a test that was not in it keeps its time if it is there.  there:
    function of a test."""
    times = {test: value for test, value in recorded(root).items() if there(test)} | seconds
    folders = {}
    for test, value in times.items():
        _, folder, name = test.split("/", 2)
        folders.setdefault(folder, {})[name] = value
    for folder in (path for path in sorted((root / "tests").iterdir()) if path.is_dir()):
        text, path = table(folders.get(folder.name, {})), folder / TABLE
        path.write_text(text) if text else path.unlink(missing_ok=True)
    return times
