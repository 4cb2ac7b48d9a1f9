# SPDX-License-Identifier: GPL-2.0-or-later
"""Every folder of tests/components in a HAL of its own, and every checker against traces that are wrong."""

import pytest

from support import halrig

FOLDERS = sorted(path.parent.name for path in halrig.SCENES.glob("*/check.py"))


@pytest.fixture(scope="session")
def trace_of(tmp_path_factory):
    """-> function: folder -> its trace, run once per process."""
    traces = {}

    def get(folder):
        if folder not in traces:
            traces[folder] = halrig.run(folder, tmp_path_factory.mktemp(folder))
        return traces[folder]

    return get


def checker(folder):
    return halrig.load_module(halrig.SCENES / folder / "check.py")


def grouped(cases):
    """pytest parameters (folder, ...); with xdist a folder's run in one process."""
    return [pytest.param(*case, id="-".join(case), marks=pytest.mark.xdist_group("hal_" + case[0])) for case in cases]


@pytest.mark.parametrize("folder", grouped((folder,) for folder in FOLDERS))
def test_folder(folder, trace_of):
    checker(folder).check(trace_of(folder))


@pytest.mark.parametrize(
    "folder, what", grouped((folder, what) for folder in FOLDERS for what in checker(folder).SABOTAGE)
)
def test_checker_refuses(folder, what, trace_of):
    check = checker(folder)
    worse = check.SABOTAGE[what](trace_of(folder))
    with pytest.raises(AssertionError) as said:
        check.check(worse)
    assert "allowed" in str(said.value), said.value


def test_every_folder_is_complete():
    for path in halrig.SCENES.glob("*/test.hal"):
        for name in ("README", "stimulus.py", "check.py"):
            assert (path.parent / name).exists(), f"{path.parent.name}/{name} is missing"


@pytest.mark.xdist_group("hal_tracker_inch")
def test_inch_and_metric_agree(trace_of):
    """The same tool on the same way: the same numbers, to the rounding of the inch positions."""
    mm, inch = trace_of("tracker_slot"), trace_of("tracker_inch")
    for name, scale, unit in (
        ("removed-volume", 1.0, "mm3"),
        ("section-area", 1.0, "mm2"),
        ("mrr", 1.0, "mm3/min"),
        ("depth", 25.4, "mm"),
    ):
        limit = 2e-4 * mm[name].max()
        halrig.within(mm, name, mm[name] - limit, mm[name] + limit, unit, scale * inch[name])
