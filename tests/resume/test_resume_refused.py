# SPDX-License-Identifier: GPL-2.0-or-later
"""What `chipwise resume` refuses, --line, --time, --tool-broke, and the command."""

import errno
import os
import subprocess
import time

import numpy as np
import pytest

from chipwise import cli
from chipwise.cli import output
from chipwise.resume import run as resume
from chipwise.resume import running, stocks
from chipwise.stock import store
from support import ROOT
from support.resume_oracle import apart
from support.resume_programs import ARCS, DRILL, FINISH, INCREMENTAL, SUBS
from support.resume_stop import CHIPWISE, Stop

pytestmark = pytest.mark.usefixtures("forked_readers")

ARC = """\
G21 G90 G17 G40 G49 G54 G80 G94
M250 P0 Q0 R-20 I80 J60 K20
T1 M6
S8000 M3
G0 X20 Y10 Z5
G1 Z-2 F600
G3 X60 Y50 I0 J40
G1 Y55
G0 Z5
M2
"""


@pytest.fixture(name="stop")
def make_stop(tmp_path):
    return Stop(tmp_path)


def refused(stop, what, *options, program=None):
    status, said, errors = stop.resume("-o", str(stop.ini.parent / "out.ngc"), *options, program=program)
    assert status == 2 and not said and what in errors and errors.count("\n") == 1, (status, said, errors)
    assert not (stop.ini.parent / "out.ngc").exists() and not list((stop.ini.parent / "stock").glob("slot*"))


def test_another_program(stop, tmp_path):
    other = tmp_path / "other.ngc"
    other.write_text(DRILL)
    refused(stop, "the kept stock is of another program, part.ngc", program=other)


def test_another_program_of_the_same_name(stop, tmp_path):
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / "part.ngc"
    other.write_text(DRILL)
    os.utime(other, (1e9, 1e9))
    refused(stop, "its blank is", program=other)


def test_an_edited_program(stop):
    stop.program.write_text(SUBS.replace("S8000", "S7000"))
    os.utime(stop.program, (time.time() + 5.0,) * 2)
    refused(stop, "was edited after the stock was kept")


def test_an_edited_program_with_an_old_date(stop):
    stop.program.write_text(SUBS.replace("[40] [10] [3]", "[40] [10] [2.5]"))
    os.utime(stop.program, (1e9, 1e9))
    refused(stop, "the kept stock is cut where the program has not cut")


@pytest.mark.parametrize(
    "file, text, what",
    [
        ("mill.tbl", "T1 P1 D5.0\nT2 P2 D3.0\n", "the kept stock is cut where the program has not cut"),
        ("mill.tbl", "T1 P1 D7.0\nT2 P2 D3.0\n", "that the program has cut up to there"),
        ("mill.tbl", "T9 P9 D6.0\n", "tool 1"),
        ("tools.toml", "[tool.1]\nshape = 'ball'\n", "the kept stock is cut where the program has not cut"),
    ],
    ids=["thinner", "thicker", "missing", "ball"],
)
def test_another_tool(stop, file, text, what):
    (stop.ini.parent / file).write_text(text)
    refused(stop, what)


def test_other_offsets(stop):
    (stop.ini.parent / "mill.var").write_text("5220 1\n5221 2.5\n5222 0\n5223 0\n")
    refused(stop, "see that the work offsets are those of then")


def test_off_the_path(stop):
    stop.keep(stop.run.points[stop.index] + np.array([0.0, 0.0, 0.15]))
    refused(stop, "mm off the program's path, more than 0.1 mm")


def test_moved_by_hand(stop):
    stop.keep(stop.run.points[len(stop.run.points) // 8])
    refused(stop, "if the tool was moved by hand")


def test_a_damaged_file(stop):
    data = bytearray(stop.journal.read_bytes())
    data[200] ^= 255
    stop.journal.write_bytes(bytes(data))
    refused(stop, "the kept stock cannot be used")


def test_no_file(stop):
    stop.journal.unlink()
    refused(stop, f"no stock is kept in {stop.journal.parent}; if this is not the folder of your machine, name its INI")


def test_nothing_cut_and_all_cut(tmp_path):
    for name, share, what in (
        ("a", 0.001, "nothing of it is cut"),
        ("b", 0.9999, "everything that the program cuts is cut"),
    ):
        (tmp_path / name).mkdir()
        refused(Stop(tmp_path / name, share=share), what)


def test_m254_and_g92(tmp_path):
    for name, text, what in (
        ("a", SUBS.replace("M250 P0 Q0 R-20 I100 J80 K20", "M254 P1"), "M254 restores a stock"),
        ("b", SUBS.replace("#31=10", "#31=10\nG92 X0 Y0 Z0\nG92.1"), "G92"),
    ):
        (tmp_path / name).mkdir()
        stop = Stop(tmp_path / name)
        stop.program.write_text(text)
        os.utime(stop.program, (1e9, 1e9))
        refused(stop, what)


def test_the_plan_comes_first_and_writes_nothing(stop):
    status, said, errors = stop.resume("--plan")
    assert status == 0 and not errors and not list((stop.ini.parent / "stock").glob("slot*"))
    for part in (
        "The machine stopped at X",
        "0.000 mm off the path",
        "It goes on in line ",
        "tool 1",
        "retracts to Z90 mm",
        "spindle M3 S8000",
    ):
        assert part in said, (part, said)
    out = stop.ini.parent / "out.ngc"
    status, again, errors = stop.resume("-o", str(out))
    assert status == 0 and not errors and again.startswith(said.rstrip("\n")) and "M254 P9" in out.read_text()
    head, _cells = store.read(str(stop.ini.parent / "stock" / "slot9.stock"))
    assert abs(head.removed - stop.removed) < 1e-6
    assert (
        stop.resume("-o", str(out))[0] == 0 and not (stop.ini.parent / "stock" / "slot8.stock").exists()
    )  # its own slot again


def test_its_slot_is_one_that_nobody_else_uses(stop):
    """A stock that M253 has saved in the slot of the resume before stays; where the slot's number cannot be kept,
    nothing is written."""
    folder, out = stop.ini.parent / "stock", str(stop.ini.parent / "out.ngc")
    (folder / "resume.slot").mkdir()
    status, _said, errors = stop.resume("-o", out)
    assert status == 2 and errors.endswith("resume.slot: Is a directory; make room, or remove what has that name\n"), (
        errors
    )
    assert sorted(path.name for path in folder.iterdir()) == ["kept.journal", "resume.slot"] and not os.path.exists(out)
    (folder / "resume.slot").rmdir()
    assert stop.resume("-o", out)[0] == 0 and (folder / "resume.slot").read_text() == "9\n"
    other, later = (folder / "slot9.stock").read_bytes(), time.time() + 1.0
    os.utime(folder / "slot9.stock", (later, later))
    assert (
        stop.resume("-o", out)[0] == 0
        and (folder / "slot9.stock").read_bytes() == other
        and (folder / "slot8.stock").exists()
    )
    assert (folder / "resume.slot").read_text() == "8\n" and not list(folder.glob("*.new"))


def test_ended_while_it_works(stop, tmp_path):
    """SIGTERM leaves no temporary files."""
    stop.program.write_text(SUBS.replace("M2\n", "o77 while [1]\n#77=[#77+1]\no77 endwhile\nM2\n"))
    folder = tmp_path / "temporary"
    folder.mkdir()
    work = subprocess.Popen(
        [CHIPWISE, "resume", str(stop.program), "--plan", "--ini", str(stop.ini)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(folder)},
    )
    try:
        until = time.monotonic() + 300.0
        while not list(folder.glob("chipwise-*/*")) and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(0.5)  # its process is at work
        assert work.poll() is None and list(folder.iterdir())
        work.terminate()
        assert work.wait(300) == 143 and not list(folder.iterdir())
    finally:
        work.kill()
        work.wait()


def test_the_command_line(stop):
    for options, what in (
        ((), "-o OUT.ngc is missing"),
        (("--plan", "--time", "0"), "--time 0 is not from"),
        (("-o", str(stop.program)), "is the program itself"),
    ):
        status, _said, errors = stop.resume(*options)
        assert status == 2 and what in errors, errors


@pytest.mark.parametrize("text", [SUBS, DRILL, FINISH], ids=["subs", "drilling", "finish"])
def test_line_time_and_a_broken_tool(tmp_path, text):
    stop = Stop(tmp_path, text)
    lines = [
        n
        for n, line in enumerate(stop.program.read_text().splitlines(), 1)
        if line.startswith(("o<slot> call", "X25", "Y25", "X85", "Y62"))
    ]
    for order in (
        {"line": lines[-1]},
        {"line": lines[0], "broke": True},
        {"seconds": 6.0},
        {"seconds": 20.0, "broke": True},
        {"broke": True},
    ):
        made = stop.made(**order)
        whole = stop.whole(stocks.head_of(made.stock, 0.0))
        higher, lower = apart(whole, stop.final(made.data, made.stock))
        assert max(higher, lower) < 0.06, (order, higher, lower)
        assert (b"M0 (put a new tool" in made.data) == ("broke" in order)


def test_a_broken_tool_leaves_its_stock(tmp_path):
    """The stock has what the tool has not cut since it broke."""
    stop = Stop(tmp_path)
    made = stop.made(seconds=8.0, broke=True)
    assert made.removed < stop.removed - 10.0
    assert stocks.heights(made.stock).sum() > stocks.heights(stop.stock).sum()


def test_a_tool_that_broke_before_the_end_is_reported_after_it(tmp_path):
    """All is cut in the kept stock, as the machine saw it; not in the part."""
    stop = Stop(tmp_path, share=0.9999)
    for order in ({"seconds": 9.0}, {"seconds": 9.0, "broke": True}, {"broke": True}):
        made = stop.made(**order)
        assert made.removed < stop.removed - 10.0, order
        higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
        assert max(higher, lower) < 0.06, (order, higher, lower)


def test_a_program_that_goes_on_is_stopped_again(tmp_path):
    """The program that ran first goes on once more; ours names it."""
    stop = Stop(tmp_path, share=0.4)
    stop.program = stop.program.rename(tmp_path / "a (b).ngc")
    stop.keep()
    second = tmp_path / "second.ngc"
    status, _said, errors = stop.resume("-o", str(second))
    assert status == 0, errors
    at = stop.index + (len(stop.run.points) - stop.index) // 3
    stop.removed += stop.run.cut(stop.stock, stop.index, at)
    stop.index = at
    stop.keep(program=second)
    os.utime(second, (1e9, 1e9))
    made = stop.made()
    higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
    assert max(higher, lower) < 0.06 and made.removed == stop.removed, (higher, lower)
    status, _said, errors = stop.resume("--plan", program=second)
    assert status == 2 and "this program goes on with a  b .ngc; name that one" in errors, errors


@pytest.mark.parametrize("newer", [0, 12, None])
def test_the_bottom_of_a_hole_is_not_left_out(tmp_path, newer):
    """The retract goes through the place of the stop again; so does the note that is newer than the cells, and one that
    has no place."""
    stop = Stop(tmp_path, DRILL)
    points = stop.run.points
    stop.cut_to(next(k for k in range(len(points)) if points[k][2] < -11.85))
    stop.keep(tip=() if newer is None else points[stop.index + newer])
    made = stop.made()
    higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
    assert max(higher, lower) < 0.06, (higher, lower, made.data.decode())


def test_before_a_cycle_that_knows_the_stock(tmp_path):
    """G24 traverses down to the top of a blank that the program defines; after M254 it does not know it."""
    text = (
        (ROOT / "nc_files" / "relief.ngc")
        .read_text()
        .replace("FILE=relief.stl", f"FILE={ROOT}/nc_files/relief.stl")
        .replace("D0.8", "D4")
    )
    stop = Stop(tmp_path, text)
    made = stop.made(
        line=text.splitlines().index(next(line for line in text.splitlines() if line.startswith("G24"))) + 1
    )
    higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
    assert max(higher, lower) < 0.06, (higher, lower)


def test_an_arc_goes_on_at_a_vertex_wherever_it_is_stopped(tmp_path):
    """Chords of large arcs are longer than the segments in which the stop is looked for."""
    stop = Stop(tmp_path, ARC)
    whole = None
    for part in range(1, 12):
        stop.cut_to(next(k for k in range(len(stop.run.points)) if stop.run.points[k][0] > 20 + 3.17 * part))
        stop.keep()
        made = stop.made()
        whole = whole or stop.whole(stocks.head_of(made.stock, 0.0))
        higher, lower = apart(whole, stop.final(made.data, made.stock))
        assert max(higher, lower) < 0.06, (part, higher, lower, made.data.decode())


def test_before_a_compensated_path_behind_g64_in_inch(tmp_path):
    """G64 without P stays what it is, whatever units are chosen behind it."""
    stop = Stop(tmp_path, ARCS)
    line = ARCS.splitlines().index("N160 X3 Y0.3") + 1
    stop.cut_to(int(np.flatnonzero(stop.read.line[stop.run.move] == line)[-1]))
    stop.keep()
    made = stop.made()
    assert b"\nG64\n" in made.data
    higher, lower = apart(stop.whole(stocks.head_of(made.stock, 0.0)), stop.final(made.data, made.stock))
    assert max(higher, lower) < 0.06, (higher, lower)


@pytest.mark.parametrize(
    "said, mm", [("", 0.01), ("G64 P0.002", 0.0508), ("G21 G64 P0.1\nG20", 0.1), ("G64 P0.1", 2.54)]
)
def test_the_path_mode_of_a_program_in_inch(tmp_path, said, mm):
    """P of the start of the machine, or of the program, in mm: no corner is rounded more than it was."""
    stop = Stop(tmp_path, INCREMENTAL.replace("T3 M6", f"{said}\nT3 M6" if said else "T3 M6"))
    assert f"\nG64 P{mm:g} Q{mm:g}\n" in stop.made().data.decode()


class Linuxcnc:
    """entry/mdi.py of a LinuxCNC that runs with an INI file."""

    def __init__(self, ini, x):
        self.path, self.x = str(ini), x

    def read(self):
        return None

    def ini(self):
        return self.path

    def scene(self):
        return {
            "index": 1,
            "offset": [self.x, 0.0, 0.0],
            "g92": [0.0, 0.0, 0.0],
            "turn": 0.0,
            "tool": 2,
            "codes": "G91 G20",
            "block_delete": True,
        }


@pytest.mark.parametrize(
    "own, in_force, in_file, what", [(True, 2.5, 0.0, "work offsets"), (True, 0.0, 2.5, ""), (False, 2.5, 0.0, "")]
)
def test_the_work_offset_in_force_counts(stop, tmp_path, monkeypatch, capsys, own, in_force, in_file, what):
    """Of the LinuxCNC that runs with this INI file: its parameter file does not have yet what was touched off since."""
    (stop.ini.parent / "mill.var").write_text(f"5220 1\n5221 {in_file}\n5222 0\n5223 0\n")
    monkeypatch.setattr(running, "mdi", Linuxcnc(stop.ini if own else ROOT / "configs" / "mill.ini", in_force))
    status = cli.main(["resume", str(stop.program), "--plan", "--ini", str(stop.ini)])
    said, errors = capsys.readouterr()
    assert (status, what in errors, bool(said)) == (2 if what else 0, True, not what), (said, errors)


def test_a_linuxcnc_that_ends_meanwhile(stop, monkeypatch, tmp_path):
    """The parameter file counts then."""
    gone = Linuxcnc(stop.ini, 2.5)
    monkeypatch.setattr(
        gone,
        "scene",
        lambda: (_ for _ in ()).throw(type("error", (Exception,), {"__module__": "linuxcnc"})("gone")),
        raising=False,
    )
    monkeypatch.setattr(running, "mdi", gone)
    machine = running.machine_here(str(stop.ini), str(tmp_path))
    assert machine.parameters == str(stop.ini.parent / "mill.var")


@pytest.mark.parametrize("full", ["the stock", "the slot's number", "the program"])
def test_a_full_disk(stop, monkeypatch, capsys, full):
    """A sentence, no program and no half of a file, whichever file has no room; with room it goes on."""

    def no_room(*_values, **_names):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    where = {
        "the stock": (store, "write_durable"),
        "the slot's number": (resume, "write_durable"),
        "the program": (output, "write_whole"),
    }[full]
    out = stop.ini.parent / "out.ngc"
    arguments = ["resume", str(stop.program), "-o", str(out), "--ini", str(stop.ini)]
    with monkeypatch.context() as context:
        context.setattr(*where, no_room)
        assert cli.main(arguments) == 2
    errors = capsys.readouterr().err
    assert "No space left on device" in errors and "room" in errors and errors.count("\n") == 1 and not out.exists(), (
        errors
    )
    slots = list(stop.journal.parent.glob("slot*"))
    assert (
        bool(slots) == (full == "the program")
        and not list(stop.ini.parent.rglob("*.new"))
        and not list(stop.ini.parent.glob(".chipwise-*"))
    )
    assert (
        cli.main(arguments) == 0
        and out.exists()
        and [path.name for path in stop.journal.parent.glob("slot*")] == ["slot9.stock"]
    )
