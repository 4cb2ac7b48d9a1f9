#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Write tests/long.txt: the tests that `make test` leaves to `make test-all`, so that it ends in ten minutes on two cores.

    tools/test --all --junitxml=build/tests.xml; tools/long_tests.py build/tests.xml

A line is a file of tests/machine, whose tests share a LinuxCNC, or elsewhere a test with all its parameters (file::test; a C program is its file).  The
shortest are kept until a budget of seconds is full, the rest is long.  A test that was not in the run is not long.
"""

import argparse
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

LIST = Path(__file__).resolve().parent.parent / "tests/long.txt"
MACHINE_S, OTHERS_S = 650.0, 1350.0     # of a process of four that share two cores


def group_of(classname, name):
    """What a test case of a JUnit file is one of: a file of tests/machine, or a file and the test's name."""
    parts = classname.split(".")
    last = next((k + 1 for k, part in enumerate(parts) if part.startswith("test_")), len(parts))
    if parts[last:] == ["c"]:
        return "/".join(parts[:last]) + ".c"
    path = "/".join(parts[:last]) + ".py"
    return path if path.startswith("tests/machine/") else f"{path}::{name.partition('[')[0].partition('@')[0]}"


def long_groups(cases, machine_s=MACHINE_S, others_s=OTHERS_S):
    """[group] that are not in the budgets; cases: (classname, name, seconds)."""
    spent = Counter()
    for classname, name, seconds in cases:
        spent[group_of(classname, name)] += seconds
    left, result = {True: machine_s, False: others_s}, []
    for group, seconds in sorted(spent.items(), key=lambda item: (item[1], item[0])):
        machine = group.startswith("tests/machine/")
        left[machine] -= seconds
        if left[machine] < 0:
            result.append(group)
    return sorted(result)


def main():
    parser = argparse.ArgumentParser(description="Write tests/long.txt from the times of a run of all tests.")
    parser.add_argument("junit", help="what tools/test --all --junitxml=FILE has written")
    cases = [(case.get("classname"), case.get("name"), float(case.get("time"))) for case in ElementTree.parse(parser.parse_args().junit).iter("testcase")]
    found = long_groups(cases)
    LIST.write_text("".join(group + "\n" for group in found))
    spent = sum(seconds for classname, name, seconds in cases if group_of(classname, name) not in set(found))
    print(f"{len(found)} lines; {spent:.0f} of {sum(case[2] for case in cases):.0f} s are not long")


if __name__ == "__main__":
    main()
