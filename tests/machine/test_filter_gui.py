# SPDX-License-Identifier: GPL-2.0-or-later
"""The filter in a real AXIS, gmoccapy and QtDragon: one start of each, which opens a file of every kind.

The kinds are those of filter_rig.py.  How soon a GUI answers is measured by bench/bench_filter.py; here it only has to
answer.
"""

import os

import pytest

from support import filter_rig, samples

pytestmark = pytest.mark.machine

# of a file: whether it is opened; words on the screen, in a window or in a message
EXPECTED = {
    "it's clean.nc": (True, ""),
    "finding.NC": (True, "finding.NC: line 7, tool 1: a traverse meets 4 mm of stock"),
    "unknown.tap": (True, "unknown.tap: it is opened unchecked: no stock is defined"),
    "bad.nc": (False, "bad.nc: it is not opened: Attempt to divide by zero; correct the line (line 7)"),
    "endless.nc": (False, f"endless.nc: it is not opened: it takes more than {filter_rig.LIMIT_S} s to check"),
    "killed.nc": (False, ""),
    "binary.TAP": (False, "binary.TAP: it is not opened: it is not a text file"),
    "part.stl": (True, "part.stl: it is made into a program (tool 1: "),
    "picture.stl": (False, "picture.stl: the file is a JPEG picture"),
    "huge.nc": (False, "huge.nc: it is not opened: it has 200 MB, more than 100"),
}


def same(name, path, loaded):
    """Whether a GUI has loaded the text of a program, or the program that cuts a model."""
    if name.endswith(".stl"):
        return loaded.endswith("M5\nM2\n") and loaded.count("\nG1 ") > 50
    with open(path, "rb") as file:
        return loaded == file.read().decode("latin-1")


def verdict(records, paths, quiet):
    """'' if every file is what it should be.  quiet: the GUI's window has no reason, a message has."""
    if [record["path"] for record in records] != list(paths.values()):
        return f"{len(records)} of {len(paths)} files were opened"
    for name, record in zip(paths, records):
        opened, words = EXPECTED[name]
        said = "\n".join(record["messages"] if opened or quiet else [record["dialog"] or ""])
        if bool(record["loaded"]) != opened or (opened and not same(name, record["path"], record["content"])):
            return f"{name}: opened {record['loaded']!r}"
        if words not in said or (record["dialog"] is None) != opened:
            return f"{name}: said {said!r}, window {record['dialog']!r}"
        if name == "endless.nc" and not record["seconds"] >= filter_rig.LIMIT_S:
            return f"{name}: {record['seconds']} s"
    return ""


@pytest.mark.parametrize("name", ["axis", "gmoccapy", "qtdragon"])
def test_every_kind_of_file(name, tmp_path):
    sample = filter_rig.screens()[name]
    if filter_rig.missing(sample):
        pytest.skip(filter_rig.missing(sample))
    paths = filter_rig.make_programs(str(tmp_path / "nc"))
    quiet = name == "gmoccapy"
    result = filter_rig.open_all(
        sample,
        tmp_path,
        samples.stage(str(tmp_path)),
        [
            {
                "path": path,
                "kill": kind == "killed.nc",
                "expect": EXPECTED[kind][1] if EXPECTED[kind][0] or quiet else "",
            }
            for kind, path in paths.items()
        ],
    )
    assert result["trouble"] == "", result["output"][-4000:]
    assert verdict(result["records"], paths, quiet) == "", result["output"][-4000:]


def test_the_verdict_sees_what_is_wrong(tmp_path):
    """A file that was not opened, half a program, no message, no window, one that ended before the limit, one that is
    missing."""
    paths = filter_rig.make_programs(str(tmp_path))
    good = []
    for name, path in paths.items():
        opened, words = EXPECTED[name]
        with open(path, "rb") as file:
            text = "\nG1 X1" * 51 + "\nM5\nM2\n" if name.endswith(".stl") else file.read(10_000).decode("latin-1")
            good.append(
                {
                    "path": path,
                    "loaded": path if opened else "",
                    "content": text,
                    "seconds": filter_rig.LIMIT_S + 1,
                    "dialog": None if opened else f"/home/{words}",
                    "messages": [f"chipwise: {words}"] if opened else [],
                }
            )
    assert verdict(good, paths, False) == ""
    names = list(paths)
    for name, wrong in (
        ("it's clean.nc", {"loaded": ""}),
        ("it's clean.nc", {"content": "G21"}),
        ("part.stl", {"content": "G21"}),
        ("finding.NC", {"messages": []}),
        ("bad.nc", {"dialog": os.path.basename("/tmp/xyz/bad.nc: failed")}),
        ("bad.nc", {"loaded": "/tmp/bad.nc"}),
        ("endless.nc", {"seconds": 2}),
        ("killed.nc", {"dialog": None}),
    ):
        records = [{**record, **wrong} if names[k] == name else record for k, record in enumerate(good)]
        assert verdict(records, paths, False) != "", (name, wrong)
    assert verdict(good[:-1], paths, False) != ""
