# SPDX-License-Identifier: GPL-2.0-or-later
"""Loading and unloading of the components, and the map as another process reads it."""

import ctypes
import json
import re

import pytest

from chipwise.clib import layout
from support import halrig

PYTHON = "/usr/bin/python3"
KEY = 0x43575354
SLOT = halrig.load_module(halrig.SCENES / "tracker_slot/stimulus.py")


def hal(where, text, shell="halrun -f test.hal", env=None):
    """Runs HAL commands; -> (exit status, output)."""
    (where / "test.hal").write_text(text)
    done = halrig.halrun([], where, env, shell=shell)
    return done.returncode, done.stdout


SEGMENTS = "sh $SUPPORT/count_maps at end"


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("cell=0", "cell=0 "),
        ("cell=-0.25", "cell=-0.25 "),
        ("cell=fine", "cell=fine "),
        ("cell=0.25mm", "cell=0.25mm "),
        ("cell=nan", "cell=nan "),
        ("cell=inf", "cell=inf "),
        ("cell=1e-400", "cell=1e-400 "),
        ("size_x=0", "size_x=0 "),
        ("size_y=-200", "size_y=-200 "),
        ("size_x=1e300", "size_x=1e300 "),
        ("cell=0.001", "cell=0.001 "),
    ],
)
def test_a_map_that_cannot_be_is_refused(tmp_path, arguments, said):
    """What, value with unit, rule, remedy; and nothing is loaded."""
    status, out = hal(
        tmp_path, f"loadrt stock_tracker {arguments}\n", "halrun -f test.hal; echo status $?; " + SEGMENTS
    )
    assert "status 1" in out.splitlines(), out
    line = next((line for line in out.splitlines() if line.startswith("chipwise:")), "")
    for words in ("stock_tracker", said, " mm", "> 0", "268435456 cells", "use a larger cell"):
        assert words in line, f"{words!r} is missing in {line!r}"
    assert out.splitlines()[-1] == "at end 0", "a map was left behind\n" + out


@pytest.mark.parametrize("percent, shown", [("9", None), ("101", None), ("10", "10"), ("35", "35"), (None, "100")])
def test_a_part_of_the_work(tmp_path, percent, shown):
    _status, out = hal(
        tmp_path,
        f"loadrt stock_tracker size_x=60 size_y=40{f' work={percent}' if percent else ''}\n"
        f"getp stock-tracker.0.work-percent\n",
    )
    if shown:
        assert shown in out.split(), out
    else:
        assert (
            f"chipwise: stock_tracker: work={percent} is not 10 to 100 per cent; correct it, or leave it out" in out
        ), out


def test_nothing_of_a_refused_tracker_is_there(tmp_path):
    _status, out = hal(
        tmp_path, "loadrt stock_tracker cell=0\nshow comp\nshow pin\nshow funct\n", "halrun -k -f test.hal"
    )
    shown = out[out.index("Loaded HAL Components") :]
    assert "stock_tracker" not in shown and "stock-tracker" not in shown, shown


def test_a_map_too_large_for_the_memory_is_refused(tmp_path):
    _status, out = hal(
        tmp_path,
        "loadrt stock_tracker cell=0.25 size_x=2000 size_y=1000\n",
        "ulimit -v 200000; halrun -f test.hal; echo status $?",
    )
    assert "status 1" in out.splitlines(), out
    line = next((line for line in out.splitlines() if line.startswith("chipwise:")), "")
    size = (
        ctypes.sizeof(layout.Stock)
        + 8002 * 4002 * ctypes.sizeof(layout.Cell)
        + ctypes.sizeof(layout.PathDone)
        + ctypes.sizeof(layout.ClampTable)
    )
    for words in (f"{size} bytes", "cell=0.25", "size_x=2000", "mm", "use a larger cell"):
        assert words in line, f"{words!r} is missing in {out!r}"


def test_maps_go_with_the_component(tmp_path):
    """Unloaded while its thread runs, loaded again with a larger map, and left by halrun's end."""
    status, out = hal(
        tmp_path,
        """
loadrt threads name1=servo period1=1000000
loadrt stock_tracker size_x=60 size_y=40 count=2
addf stock-tracker.0 servo
addf stock-tracker.1 servo
start
loadusr -w sleep 0.05
unloadrt stock_tracker
loadusr -w sh $(SUPPORT)/count_maps unloaded
loadrt stock_tracker size_x=90 size_y=80
loadusr -w sh $(SUPPORT)/count_maps loaded
""",
        "halrun -f test.hal; echo status $?; " + SEGMENTS,
    )
    lines = out.splitlines()
    assert "unloaded 0" in lines and "loaded 1" in lines and "status 0" in lines, out
    assert lines[-1] == "at end 0", "a map was left behind\n" + out


def test_the_map_of_a_killed_linuxcnc_is_in_nobodys_way(tmp_path):
    """One too small is left under the key."""
    (tmp_path / "leave.py").write_text(
        f"import ctypes\nlibc = ctypes.CDLL(None)\nassert libc.shmget({KEY}, 4096, 0o1600) >= 0\n"
    )  # IPC_CREAT | rw for the owner
    status, out = hal(
        tmp_path,
        "loadrt stock_tracker size_x=60 size_y=40\ngetp stock-tracker.0.shm-key\n",
        f"{PYTHON} leave.py && sh $SUPPORT/count_maps left && halrun -f test.hal; echo status $?; " + SEGMENTS,
    )
    lines = out.splitlines()
    assert lines[0] == "left 1" and str(KEY) in lines and "status 0" in lines and lines[-1] == "at end 0", out


TWO = """
loadrt threads name1=servo period1=1000000
loadrt streamer depth=$(DEPTH) cfg=fffb
loadrt stock_tracker cell=0.25 size_x=60 size_y=40 count=2
addf streamer.0      servo
addf stock-tracker.0 servo
addf stock-tracker.1 servo
net pos-x streamer.0.pin.0 => stock-tracker.0.pos-x stock-tracker.1.pos-x
net pos-y streamer.0.pin.1 => stock-tracker.0.pos-y stock-tracker.1.pos-y
net pos-z streamer.0.pin.2 => stock-tracker.0.pos-z stock-tracker.1.pos-z
net define streamer.0.pin.3 => stock-tracker.0.define
setp stock-tracker.0.tool-diameter 6
setp stock-tracker.1.tool-diameter 3
setp stock-tracker.0.enable 1
setp stock-tracker.1.enable 1
setp stock-tracker.0.min-z -10
setp stock-tracker.0.max-x 60
setp stock-tracker.0.max-y 40
setp stock-tracker.1.min-z -20
setp stock-tracker.1.max-x 50
setp stock-tracker.1.max-y 30
loadusr -w halstreamer stimulus.txt
loadusr -w $(PYTHON) $(SUPPORT)/read_map.py 1 once before
loadusr $(PYTHON) $(SUPPORT)/read_map.py 0 follow cutting
loadusr -w sh $(SUPPORT)/wait_for cutting.ready
start
setp stock-tracker.1.define 1
loadusr -w sh $(SUPPORT)/wait_for cutting.json
loadusr -w $(PYTHON) $(SUPPORT)/read_map.py 0 once after
loadusr -w $(PYTHON) $(SUPPORT)/read_map.py 1 once other
getp stock-tracker.0.shm-key
getp stock-tracker.1.shm-key
getp stock-tracker.0.removed-volume
"""


def looks_of(where, *names):
    return [json.loads((where / (name + ".json")).read_text()) for name in names]


def slot_file(where):
    """The slot of tracker_slot as a file for `cfg=fffb`; -> environment for halrun."""
    path = SLOT.stimulus()
    columns = [path.columns[name] for name in ("pos-x", "pos-y", "pos-z")]
    lines = ["%r %r %r %d\n" % (*map(float, row), define) for *row, define in zip(*columns, path.columns["define"])]
    (where / "stimulus.txt").write_text("".join(lines))
    return {"DEPTH": str(len(lines) + 100), "PYTHON": PYTHON}


def test_two_trackers_have_maps_of_their_own_that_can_be_read(tmp_path):
    """Read while the tool cuts: a snapshot of one moment misses just the volume removed so far, any other no more than
    was cut meanwhile."""
    for attempt in range(
        4
    ):  # a reader that waits for the processor looks less often, and collides with the tracker more often
        folder = tmp_path / str(attempt)
        folder.mkdir()
        status, out = hal(folder, TWO, env=slot_file(folder))
        assert status == 0, out
        before, cutting, after, other = looks_of(folder, "before", "cutting", "after", "other")
        assert before["none"] == before["looks"] == 1
        exact = cutting["looks"] - cutting["none"] - cutting["inexact"]
        if exact > 20:
            break
    assert exact > 20 and cutting["worst_inexact_mm3"] < 1e-2, cutting
    for look in (cutting, after, other):
        assert look["worst_mm3"] < 1e-3, look
    assert (after["low"], after["high"]) == ([0, 0, -10], [60, 40, 0])
    assert (other["low"], other["high"]) == ([0, 0, -20], [50, 30, 0])
    assert after["shape"] == [160, 240] and other["shape"] == [120, 200]
    assert cutting["first_removed"] < 0.5 * cutting["removed"] == 0.5 * after["removed"]
    assert cutting["generation"] == after["generation"]  # a tool that stands writes nothing
    assert after["lowest"] == pytest.approx(-SLOT.DEPTH, abs=1e-3)
    assert 0 < other["removed"] < 0.6 * after["removed"]  # a 3 mm tool in the other map
    lines = out.splitlines()
    assert str(KEY) in lines and str(KEY + 1) in lines, out
    assert any(line[:1].isdigit() and float(line) == pytest.approx(after["removed"], rel=1e-5) for line in lines), out


BIG = (
    TWO.replace("size_x=60 size_y=40", "size_x=300 size_y=200")
    .replace("0.max-x 60", "0.max-x 300")
    .replace("0.max-y 40", "0.max-y 200")
)


def test_a_large_map_is_read_while_the_tool_cuts(tmp_path):
    """Too large to be copied in a period: in bands, each of another moment while it is read."""
    status, out = hal(tmp_path, BIG, env=slot_file(tmp_path))
    assert status == 0, out
    cutting, after = looks_of(tmp_path, "cutting", "after")
    assert cutting["shape"] == [800, 1200], cutting
    assert cutting["inexact"] > 0 and cutting["first_removed"] < cutting["removed"], cutting
    assert cutting["worst_mm3"] < 1e-2 and after["worst_mm3"] < 1e-2, (cutting, after)
    assert cutting["worst_inexact_mm3"] < 1e-2, cutting  # no more is missing than was cut while it was read
    assert after["inexact"] == 0, after  # it stands: all of one moment


def test_an_assumed_stock_is_none_to_feed_and_codes(tmp_path):
    """certain FALSE: the feed is F as without a stock, and M251's status has none; the sums go on, and TRUE is the
    default."""
    text = f"""
loadrt threads name1=servo period1=1000000
{halrig.COUNT_PERIODS}loadrt volumetric_feed
loadrt chipwise_command
addf volumetric-feed.0 servo
addf chipwise-command.0 servo
setp volumetric-feed.0.mode 1
setp volumetric-feed.0.mrr-target 600
setp volumetric-feed.0.motion-type 2
setp volumetric-feed.0.requested-vel 20
setp volumetric-feed.0.programmed-vel 20
setp volumetric-feed.0.current-vel 20
setp volumetric-feed.0.section-area 10
setp volumetric-feed.0.depth 2
setp volumetric-feed.0.acceleration 500
setp volumetric-feed.0.ready 1
setp volumetric-feed.0.program-running 1
setp chipwise-command.0.stock-defined 1
start
"""
    looks = "".join(
        f"""
setp volumetric-feed.0.certain {certain}
setp chipwise-command.0.certain {certain}
loadusr -w sh $(SUPPORT)/wait_periods 200
getp volumetric-feed.0.adaptive-feed
getp volumetric-feed.0.limited-by
getp chipwise-command.0.status
getp volumetric-feed.0.cut-time
"""
        for certain in (0, 1)
    )
    status, out = hal(
        tmp_path, text + "loadusr -w sh $(SUPPORT)/wait_periods 200\ngetp volumetric-feed.0.adaptive-feed" + looks
    )
    assert status == 0, out
    default, *said = [float(line) for line in out.splitlines() if line[:1].isdigit()]
    (free, why, none, cut), (held, _why, defined, more) = said[:4], said[4:]
    assert (free, why, none) == (1.0, 5.0, 0.0), out
    assert held < 0.06 and default == held and defined == 10.0, out
    assert 0 < cut < more, out


@pytest.mark.parametrize("units", ["0", "-1", "nan", "inf"])
def test_units_that_cannot_be(tmp_path, units):
    """A fault, no crash; sound again with sound units and a stock."""
    text = f"""
loadrt threads name1=servo period1=1000000
{halrig.COUNT_PERIODS}loadrt stock_tracker size_x=60 size_y=40
loadrt volumetric_feed
addf stock-tracker.0 servo
addf volumetric-feed.0 servo
setp stock-tracker.0.tool-diameter 6
setp stock-tracker.0.min-z -10
setp stock-tracker.0.max-x 60
setp stock-tracker.0.max-y 40
setp stock-tracker.0.units-per-mm {units}
setp stock-tracker.0.mrr-window {units}
setp volumetric-feed.0.units-per-mm {units}
setp volumetric-feed.0.mode 1
setp volumetric-feed.0.motion-type 2
setp volumetric-feed.0.requested-vel 20
setp volumetric-feed.0.programmed-vel 8
setp stock-tracker.0.define 1
start
loadusr -w sh $(SUPPORT)/wait_pin stock-tracker.0.fault-code 22
getp stock-tracker.0.fault-code
getp stock-tracker.0.ready
getp stock-tracker.0.mrr
getp volumetric-feed.0.adaptive-feed
setp stock-tracker.0.define 0
setp stock-tracker.0.units-per-mm 1
loadusr -w sh $(SUPPORT)/wait_periods 4
setp stock-tracker.0.define 1
loadusr -w sh $(SUPPORT)/wait_pin stock-tracker.0.ready TRUE
getp stock-tracker.0.fault-code
getp stock-tracker.0.ready
"""
    status, out = hal(tmp_path, text)
    assert status == 0, out
    said = [line for line in out.splitlines() if line[:1].isdigit() or line in ("TRUE", "FALSE")]
    code, ready, rate, override, code_after, ready_after = said
    assert (code, ready, float(rate)) == ("22", "FALSE", 0.0), out
    assert 0.0 <= float(override) <= 1.0, out
    assert (code_after, ready_after) == ("0", "TRUE"), out


HALCMDS = """import sys
sys.path.insert(0, sys.argv[1])
from chipwise.errors import CycleError
from chipwise.host.halcmd import getp, halcmds
halcmds(("loadrt", "and2"), ("setp", "and2.0.in0", "1"), ("setp", "and2.0.in1", "1"), ("net", "both", "and2.0.out"))
some = [("setp", "and2.0.in0", "0"), ("setp", "and2.0.none", "1"), ("setp", "and2.0.in1", "0")]
for commands in (some, [("loadrt", "no_such")]):
    try:
        halcmds(*commands)
    except CycleError as error:
        print("refused", str(error).splitlines()[0])
print("pins", getp("and2.0.in0"), getp("and2.0.in1"))
"""


def test_several_commands_end_at_the_one_that_fails(tmp_path, root):
    """chipwise.host.halcmd.halcmds: what is before it is done, what is behind it is not, and the message names it."""
    (tmp_path / "several.py").write_text(HALCMDS)
    _status, out = hal(
        tmp_path, f"loadrt or2\nloadusr -w {PYTHON} several.py {root}/remap\n"
    )  # rtapi_app runs, as in LinuxCNC
    refused = [line for line in out.splitlines() if line.startswith("refused")]
    assert (
        len(refused) == 2 and "halcmd setp and2.0.none 1: " in refused[0] and "halcmd loadrt no_such: " in refused[1]
    ), out
    assert re.search("'and2.0.none':? not found", refused[0])  # 2.9, 2.10
    assert "pins FALSE TRUE" in out.splitlines(), out
