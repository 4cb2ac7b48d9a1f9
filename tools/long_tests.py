#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Write tests/long.txt and tests/slow.txt: what `make test` leaves to `make test-all`, and what `make test-quick` leaves out.

    tools/test --all --junitxml=build/tests.xml; tools/long_tests.py build/tests.xml

So `make test` ends in ten minutes on two cores, and `make test-quick` in one.  A line is a file of tests/machine, whose tests share a LinuxCNC, or
elsewhere a test with all its parameters (file::test; a C program is its file).  The shortest are kept until a budget of seconds is full, the rest is in
the list.  A test that was not in the run is in neither.  The files of tests/shipped, which `make test-shipped` runs, are always long.
"""

import argparse
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent / "tests"
MACHINE_S, OTHERS_S = 650.0, 1350.0     # of a process of four that share two cores
QUICK_S = 60.0                          # of the two processes of `make test-quick`, which also build, and find the tests
SHIPPED = "tests/shipped/"
SANDBOXED = ("tests/components/", "tests/machine/", SHIPPED)        # never in `make test-quick` (tests/conftest.py; the last are marked machine)


def group_of(classname, name):
    """What a test case of a JUnit file is one of: a file of tests/machine, or a file and the test's name."""
    parts = classname.split(".")
    last = next((k + 1 for k, part in enumerate(parts) if part.startswith("test_")), len(parts))
    if parts[last:] == ["c"]:
        return "/".join(parts[:last]) + ".c"
    path = "/".join(parts[:last]) + ".py"
    return path if path.startswith(("tests/machine/", SHIPPED)) else f"{path}::{name.partition('[')[0].partition('@')[0]}"


def seconds_of(cases):
    """{group: seconds}; cases: (classname, name, seconds)."""
    spent = Counter()
    for classname, name, seconds in cases:
        spent[group_of(classname, name)] += seconds
    return spent


def over(spent, budget_s):
    """{group} that are not in the budget, which the shortest fill."""
    result, left = set(), budget_s
    for group, seconds in sorted(spent.items(), key=lambda item: (item[1], item[0])):
        left -= seconds
        if left < 0:
            result.add(group)
    return result


def long_groups(spent, machine_s=MACHINE_S, others_s=OTHERS_S):
    """{group} that `make test` leaves out; spent: {group: seconds}."""
    machine = {group: seconds for group, seconds in spent.items() if group.startswith("tests/machine/")}
    shipped = {group for group in spent if group.startswith(SHIPPED)}
    return shipped | over(machine, machine_s) | over({group: spent[group] for group in spent.keys() - machine.keys() - shipped}, others_s)


def slow_groups(spent, quick_s=QUICK_S):
    """{group} that `make test-quick` leaves out, beside all that needs a sandbox; spent: {group: seconds}."""
    return over({group: seconds for group, seconds in spent.items() if not group.startswith(SANDBOXED)}, quick_s)


def main():
    parser = argparse.ArgumentParser(description="Write tests/long.txt and tests/slow.txt from the times of a run of all tests.")
    parser.add_argument("junit", help="what tools/test --all --junitxml=FILE has written")
    cases = ElementTree.parse(parser.parse_args().junit).iter("testcase")
    spent = seconds_of((case.get("classname"), case.get("name"), float(case.get("time"))) for case in cases)
    for name, found in (("long", long_groups(spent)), ("slow", slow_groups(spent))):
        (TESTS / f"{name}.txt").write_text("".join(group + "\n" for group in sorted(found)))
        print(f"tests/{name}.txt: {len(found)} lines, {sum(spent[group] for group in found):.0f} of {sum(spent.values()):.0f} s")


if __name__ == "__main__":
    main()
