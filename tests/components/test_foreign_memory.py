# SPDX-License-Identifier: GPL-2.0-or-later
"""Shared memory that is not what its key promises: a stale or foreign block at motion's key or at the map's, another
program that writes into the map.  Nothing crashes; what is not plausible is not used, and the fault says so."""

import subprocess

import pytest

from support import ROOT, halrig

PYTHON = "/usr/bin/python3"
MAP_KEY = 0x43575354

TRACKER = (
    """
loadrt threads name1=servo period1=1000000
"""
    + halrig.COUNT_PERIODS
    + """loadrt stock_tracker cell=0.25 size_x=60 size_y=40
addf stock-tracker.0 servo
setp stock-tracker.0.acceleration 500
setp stock-tracker.0.tool-diameter 6
setp stock-tracker.0.enable 1
setp stock-tracker.0.motion-type 2
setp stock-tracker.0.min-z -10
setp stock-tracker.0.max-x 60
setp stock-tracker.0.max-y 40
setp stock-tracker.0.define 1
start
loadusr -w sh $(SUPPORT)/wait_pin stock-tracker.0.ready TRUE
getp stock-tracker.0.path-known
getp stock-tracker.0.ready
getp stock-tracker.0.fault-code
"""
)
REFUSED = "getp stock-tracker.0.path-refused\n"
NOT_MAPPED, FOREIGN = "4", "3"  # core/path_watch.h


@pytest.fixture(scope="session")
def foreign_motion(tmp_path_factory):
    """The program of foreign_motion.c."""
    program = tmp_path_factory.mktemp("foreign") / "foreign_motion"
    subprocess.run(
        ["gcc", "-DULAPI", "-I/usr/include/linuxcnc", "-w", "-o", program, halrig.SUPPORT / "foreign_motion.c"],
        check=True,
    )
    return program


def hal(where, text, shell):
    """HAL commands in a sandbox, with `shell` before halrun; -> (words it printed, all of the output)."""
    (where / "test.hal").write_text(text)
    done = halrig.halrun([], where, shell=f"{shell} halrun -f test.hal; echo status $?")
    lines = [
        line
        for line in done.stdout.splitlines()
        if line in ("TRUE", "FALSE") or line.lstrip("-").isdigit() or line.startswith("status")
    ]
    return lines, done.stdout


@pytest.mark.parametrize(
    "fill, stay", [("plausible", ""), ("plausible", "stay"), ("running", "stay"), ("noise", "stay"), ("open", "stay")]
)
def test_a_block_at_motions_key_that_is_not_motions(tmp_path, foreign_motion, fill, stay):
    """The path ahead is predicted; rtapi_app lives."""
    begin = (
        f"{foreign_motion} {fill} {stay} > said {'&' if stay else ';'} while ! grep -q ready said; do sleep 0.05; done;"
    )
    lines, out = hal(tmp_path, TRACKER + REFUSED, begin)
    assert lines == ["FALSE", "TRUE", "0", FOREIGN if fill == "open" else NOT_MAPPED, "status 0"], out


def test_no_motion_and_a_path_that_is_not_to_be_read(tmp_path):
    lines, out = hal(
        tmp_path,
        TRACKER + REFUSED + "setp stock-tracker.0.read-path 0\nloadusr -w sh $(SUPPORT)/wait_periods 4\n" + REFUSED,
        "",
    )
    assert lines == ["FALSE", "TRUE", "0", "1", "0", "status 0"], out


MOTION = """
loadrt threads name1=servo period1=1000000
loadrt trivkins
loadrt tpmod
loadrt homemod
loadrt motmod servo_period_nsec=1000000 num_joints=3
addf motion-command-handler servo
addf motion-controller servo
"""


def test_motion_is_unloaded(tmp_path):
    """Its queue is gone with it: the tracker, which runs on, does not look there any more."""
    text = (
        MOTION
        + TRACKER.replace("loadrt threads name1=servo period1=1000000", "")
        + """
unloadrt motmod
start
loadusr -w sh $(SUPPORT)/wait_periods 4
getp stock-tracker.0.path-known
getp stock-tracker.0.ready
"""
    )
    lines, out = hal(tmp_path, text, "")
    assert lines == ["FALSE", "TRUE", "0", "FALSE", "TRUE", "status 0"], out


@pytest.mark.parametrize("rights, size", [("0o1666", 4096), ("0o1660", 1 << 23), ("0o1622", 100)])
def test_a_block_at_the_maps_key_that_others_may_write(tmp_path, rights, size):
    """Not taken over, not removed: loading is refused with what to do."""
    begin = f"{PYTHON} -c 'import ctypes; assert ctypes.CDLL(None).shmget({MAP_KEY}, {size}, {rights}) >= 0';"
    lines, out = hal(tmp_path, "loadrt stock_tracker size_x=60 size_y=40\n", begin)
    assert (
        "status 1" in lines
        and "another user's or another program's" in out
        and "then run `ipcrm -M 0x43575354` as that user or as root" in out
    ), out


def test_an_old_map_that_is_still_attached(tmp_path):
    """Of a LinuxCNC that was killed, with a reader that lives: the tracker gets one of its own and the reader's is left
    alone."""
    (tmp_path / "reader.py").write_text(
        "import ctypes, os, time\nlibc = ctypes.CDLL(None)\nlibc.shmat.restype = ctypes.c_void_p\n"
        f"block = libc.shmat(libc.shmget({MAP_KEY}, 1 << 23, 0o1600), None, 0)\nctypes.memset(block, 5, 1 << 23)\n"
        "open('attached', 'w').close()\ntime.sleep(4)\n"
        "found = str(set(ctypes.string_at(block, 1 << 23)))\n"
        "with open('being written', 'w') as file:\n    file.write(found)\n"
        "os.rename('being written', 'seen')\n"
    )
    text = (
        TRACKER
        + f"loadusr -w {PYTHON} {halrig.SUPPORT}/read_map.py 0 once map\nloadusr -w sh {halrig.SUPPORT}/wait_for seen\n"
    )
    lines, out = hal(tmp_path, text, f"{PYTHON} reader.py & while ! [ -e attached ]; do sleep 0.05; done;")
    assert lines == ["FALSE", "TRUE", "0", "status 0"], out
    assert (tmp_path / "seen").read_text() == "{5}" and (tmp_path / "map.json").exists()


SCRIBBLE = """
import ctypes, sys
sys.path.insert(0, {remap!r})
from chipwise.clib.layout import Stock
libc = ctypes.CDLL(None)
libc.shmat.restype = ctypes.c_void_p
block = libc.shmat(libc.shmget({key}, 0, 0o600), None, 0)
head = Stock.from_address(block)
{what}
"""


@pytest.mark.parametrize(
    "what",
    [
        "head.nx = 1 << 30",
        "head.ny = -5",
        "head.cell = float('nan')",
        "head.cell = 1e-12",
        "head.capacity = 3",
        "head.x0 = 1e300",
        "head.drop_unit = 0",
        "head.z_max = float('inf')",
        "head.removed = float('nan')",
        "head.filled = 1 << 30; head.nx = head.ny = 46340",
        "ctypes.memset(block, 255, 4096)",
        "ctypes.memset(block + ctypes.sizeof(Stock), 255, 100000)",
    ],
)
def test_another_program_writes_into_the_map(tmp_path, what):
    """Head or cells: no crash, no NaN or infinity; the stock is unknown until it is defined again."""
    in_cells = "Stock)" in what
    (tmp_path / "scribble.py").write_text(SCRIBBLE.format(remap=str(ROOT / "remap"), key=MAP_KEY, what=what))
    outputs = "".join(
        f"getp stock-tracker.0.{name}\n"
        for name in ("section-area", "depth", "mrr", "removed-volume", "load-step-area-0", "load-step-distance-0")
    )
    text = (
        TRACKER.replace(
            "setp stock-tracker.0.min-z",
            "setp stock-tracker.0.pos-z -2\nsetp stock-tracker.0.pos-x 5\nsetp stock-tracker.0.pos-y 5\n"
            "setp stock-tracker.0.min-z",
        )
        + f"""
loadusr -w {PYTHON} scribble.py
loadusr -w sh $(SUPPORT)/{"wait_periods 50" if in_cells else "wait_pin stock-tracker.0.ready FALSE"}
getp stock-tracker.0.ready
getp stock-tracker.0.fault-code
{outputs}
setp stock-tracker.0.define 0
loadusr -w sh $(SUPPORT)/wait_periods 4
setp stock-tracker.0.define 1
loadusr -w sh $(SUPPORT)/wait_pin stock-tracker.0.ready TRUE
getp stock-tracker.0.ready
getp stock-tracker.0.fault-code
"""
    )
    lines, out = hal(tmp_path, text, "")
    assert "nan" not in out.lower().replace("name", "") and "inf" not in [
        line.strip() for line in out.lower().splitlines()
    ], out
    words = [line for line in lines]
    assert words[:3] == ["FALSE", "TRUE", "0"] and words[-3:] == ["TRUE", "0", "status 0"], out
    if not in_cells:  # cells may be anything a float can be, as long as nothing comes of it
        assert words[3:5] == ["FALSE", "4"], out
