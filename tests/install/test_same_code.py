# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/same_code: what moves only in the file counts as the same, and each kind of change is seen."""

import subprocess

import pytest

from support import ROOT

SOURCE = """
#include <stdio.h>
extern int one(int), two(int);
static int state;
int count(int a) { return one(a) + (state += 3); }
double scaled(double a) { return a * 1.25 + 7.5; }
int say(int a) { return printf("a text %d\\n", a); }
int choose(int a)
{
    switch (a) {
    case 0: return one(a);
    case 1: return two(a + 1);
    case 2: return one(a * 3) + 7;
    case 3: return two(a - 5) * 3;
    case 4: return one(one(a));
    default: return 9;
    }
}
"""
CHANGES = {
    "a constant": ("1.25", "1.26", "scaled"),
    "a string": ("a text", "a test", "say"),
    "a call": ("return one(a) + (state", "return two(a) + (state", "count"),
    "another case of a switch": ("case 4: return one", "case 5: return one", "choose"),
    "a number in an instruction": ("state += 3", "state += 4", "count"),
}


@pytest.fixture
def compare(tmp_path):
    """-> (exit status, the lines that name a function) for two sources."""

    def run(before, after):
        made = []
        for name, text in (("before", before), ("after", after)):
            folder = tmp_path / name
            folder.mkdir()
            (folder / "part.c").write_text(text)
            made.append(folder / "part.so")
            subprocess.run(["gcc", "-Os", "-g", "-fPIC", "-shared", "-o", made[-1], folder / "part.c"], check=True)
        done = subprocess.run([ROOT / "tools/same_code", tmp_path / "before", tmp_path / "after"], text=True, stdout=-1)
        return done.returncode, [line.split(":")[0].strip() for line in done.stdout.splitlines()[1:]]

    return run


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_seen(compare, change):
    old, new, function = CHANGES[change]
    assert old in SOURCE
    assert compare(SOURCE, SOURCE.replace(old, new)) == (1, [function])


def test_what_only_moves_is_the_same(compare):
    """Another function, string, constant and variable in front: all addresses are others."""
    more = SOURCE.replace(
        "static int state;",
        'static int state, others[40];\nint more(int a) { return printf("%d %f", others[a], a * 3.75) + two(a); }',
    )
    assert compare(SOURCE, more) == (1, ["more"])


def test_the_same_modules(tmp_path):
    done = subprocess.run(
        [ROOT / "tools/same_code", ROOT / "build/modules", ROOT / "build/modules"], text=True, stdout=-1
    )
    lines = done.stdout.splitlines()
    assert done.returncode == 0 and len(lines) == len(list((ROOT / "components").glob("*.comp")))
    assert all(line.split()[1] == line.split()[3] != "0" for line in lines)


def test_folders_of_other_modules_are_refused(tmp_path):
    done = subprocess.run([ROOT / "tools/same_code", tmp_path, ROOT / "build/modules"], text=True, stderr=-1)
    assert done.returncode == 1 and done.stderr.startswith("chipwise: ")
