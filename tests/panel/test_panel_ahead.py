# SPDX-License-Identifier: GPL-2.0-or-later
"""The path ahead and the contours of the loaded program for the page: what LinuxCNC's own interpreter makes of a
program."""

import json
import os
import time

import numpy as np
import pytest

from chipwise.check import in_force
from chipwise.panel import look_ahead, look_ahead_process
from chipwise.check.drawn_path import Path
from support import ROOT
from support.panel_client import follow
from support.panel_rig import scene, serving

MM, INCH = str(ROOT / "configs" / "mill.ini"), str(ROOT / "configs" / "mill_inch.ini")
SQUARE = "o100 sub\nG0 X10 Y10\nG1 X30\nG1 Y25\nG1 X10\nG1 Y10\no100 endsub\n"
HEAD = "G21 G90\nT1 M6\nS1000 M3\nF600\n"


def read(tmp_path, text, ini=MM, tip=(0.0, 0.0, 5.0), **changed):
    program = tmp_path / "part.ngc"
    program.write_text(text)
    return look_ahead_process.read(
        {"ini": ini, "program": str(program), "scene": scene(program, **changed), "tip": list(tip)}, str(tmp_path)
    )


# ---- what is read ------------------------------------------------------------------------------------------------


def test_moves_of_a_program(tmp_path):
    head, path = read(tmp_path, HEAD + "G0 X10 Y20\nG1 Z-2\nG1 X40\nG2 X40 Y20 I-5\nG0 Z5\nM2\n", tip=(1.0, 2.0, 3.0))
    assert (head["note"], head["relative"], head["loops"], head["points"]) == ("", False, [], len(path.points))
    assert path.points[:4].tolist() == [[1, 2, 3], [10, 20, 3], [10, 20, -2], [40, 20, -2]] and path.rapid[
        :4
    ].tolist() == [True, True, False, False]
    assert path.low[:4].tolist() == path.high[:4].tolist() == [0, 5, 6, 7]
    arc = path.points[4:-1]
    assert (
        len(arc) > 20
        and np.abs(np.hypot(arc[:, 0] - 35, arc[:, 1] - 20) - 5).max() < 1e-3
        and (path.low[4:-1] == 8).all()
    )
    assert path.points[-1].tolist() == [40, 20, 5] and path.rapid[-1]


@pytest.mark.parametrize(
    "ini, unit, words", [(MM, 1.0, "G21"), (INCH, 25.4, "G20"), (MM, 1.0, "G20"), (INCH, 25.4, "G21")]
)
def test_work_offsets_and_units(tmp_path, ini, unit, words):
    """Offset, G92 and rotation of the status in machine units; the program in either unit."""
    program = 25.4 if words == "G20" else 1.0
    head, path = read(
        tmp_path,
        f"{words} G90\nT1 M6\nS1000 M3\nF60\nG0 Z1\nG0 X2 Y1\nM2\n",
        ini,
        index=3,
        offset=[5.0, 7.0, -1.0],
        g92=[0.5, 0.0, 0.25],
        turn=90.0,
    )
    # program (2, 1) + G92, turned by 90 degrees, + offset
    there = [5.0 * unit - 1 * program, 7.0 * unit + 2 * program + 0.5 * unit, -1.0 * unit + 1 * program + 0.25 * unit]
    assert head["note"] == "" and path.points[-1].tolist() == pytest.approx(there, abs=1e-3)


@pytest.mark.parametrize("code", ["G77 Q100 P42 Z-4 R1 I0.3", "G78 Q100 P42 Z-4 R1", "G79 Q100 Z-4 R1"])
def test_contours_at_their_place(tmp_path, code):
    """Work offset, a rotation by 90 degrees, and G55 chosen by the program; depth of the cycle; the path ends where the
    cycle does."""
    head, path = read(tmp_path, SQUARE + HEAD + f"G10 L2 P2 X100 Y50 Z-3 R90\nG55\nG0 X0 Y0 Z5\n{code}\nM2\n")
    corners = {
        (round(x, 3), round(y, 3), round(z, 3)) for x, y, z in (loop for loops in head["loops"] for loop in loops)
    }
    assert head["note"] == "" and len(head["loops"]) == 1 and len(path.points) > 5
    assert corners == {(100 - y, 50 + x, -7.0) for x, y in ((10, 10), (30, 10), (30, 25), (10, 25))}
    outside = path.points[(path.low >= 15) & ~path.rapid]
    box = {"G77": (-3.3, 3.3), "G78": (-3.0, 3.0), "G79": (3.0, -3.0)}[code[:3]]
    assert outside[:, 0].min() == pytest.approx(75 + box[0], abs=0.02) or code[:3] != "G79"
    assert head["loops"][0][0] == head["loops"][0][-1]


def test_each_contour_once(tmp_path):
    head, _path = read(
        tmp_path, SQUARE + HEAD + "G0 X0 Y0 Z5\nG77 Q100 P42 Z-4 R1\nG78 Q100 P42 Z-4 R1\nG78 Q100 P42 Z-6 R1\nM2\n"
    )
    assert sorted(loop[0][2] for loop in head["loops"]) == [-6, -4]


@pytest.mark.parametrize(
    "text, note, line",
    [
        (
            HEAD + "G0 X10\nG38.2 Z-5 F50\nG1 X20\nM2\n",
            "the program probes (G38): what it finds is known on the machine only",
            6,
        ),
        (HEAD + "G0 X10\nG1 X20\nG1 X[1/0]\nM2\n", "", 7),
        (HEAD + "G0 X10\nG93\nG1 X20 F2\nM2\n", "G93 (inverse time) is not judged", 6),
        (HEAD + "G0 X10\nG79 Q7 Z-1\nM2\n", "G79: there is no sub O7", 0),
    ],
)
def test_the_path_up_to_what_cannot_be_known(tmp_path, text, note, line):
    head, path = read(tmp_path, text)
    assert head["note"].startswith(note) and head["note"] and head["line"] == line, head
    assert path.points[1].tolist() == [10, 0, 5] and path.points[:, 0].max() <= 20


@pytest.mark.parametrize("text", ["", "\0\1\2", "G1\nG93", "%%%", "M2\n", "o100 sub\n"])
def test_files_that_are_no_programs(tmp_path, text):
    head, path = read(tmp_path, text)
    assert path is None or len(path.points) < 3
    assert head["loops"] == []


def test_a_loop_without_an_end(tmp_path, monkeypatch):
    monkeypatch.setattr(look_ahead_process, "MOST_MOVES", 20_000)
    head, path = read(tmp_path, HEAD + "G0 X1\no1 while [1]\nG1 X[1+#1]\n#1=[#1+0.01]\no1 endwhile\nM2\n")
    assert head["note"] == "the program makes more than 20000 moves; the picture ends there" and 1000 < len(path.points)


def test_relative_programs_begin_where_the_tool_is(tmp_path):
    text = "G21\nT1 M6\nG91\nF600\nG1 X10\nG1 Z-5\nM2\n"
    head, path = read(tmp_path, text, tip=(7.0, 8.0, 9.0))
    assert head["relative"] and path.points.tolist() == [[7, 8, 9], [17, 8, 9], [17, 8, 4]]
    assert read(tmp_path, "G90.1 G91.1 (G91)\nG0 X1 ;G91\nM2\n")[0]["relative"] is False
    assert read(tmp_path, "G0 X1\nM2\n", codes="G21 G17 G91 G91.1", tip=(7.0, 8.0, 9.0))[1].points[-1].tolist() == [
        8,
        8,
        9,
    ]


def test_lines_that_are_left_out(tmp_path):
    text = HEAD + "G0 X10\n/G0 X20\nM2\n"
    assert (
        read(tmp_path, text)[1].points[-1, 0] == 20 and read(tmp_path, text, block_delete=True)[1].points[-1, 0] == 10
    )


def test_a_parameter_file_with_the_offsets_in_force():
    text = in_force.parameters(
        "5161\t1.5\n5241 7\nwords here\n\n5220\t1\n",
        scene("", index=2, offset=[1.0, -2.0, 3e-7], turn=45.0, g92=[0.0, 1.0, 0.0]),
    )
    rows = [row.split() for row in text.splitlines()]
    numbers = [int(row[0]) for row in rows]
    found = {int(n): float(v) for n, v in rows}
    assert numbers == sorted(numbers) and found[5161] == 1.5 and found[5220] == 2
    assert [found[n] for n in (5241, 5242, 5243, 5250, 5210, 5212)] == [1, -2, 3e-7, 45, 1, 1]


# ---- the whole of it ----------------------------------------------------------------------------------------------


def test_a_page_gets_path_and_contours(tmp_path):
    """The real process and the real server; a killed process leaves a note."""
    program = tmp_path / "part.ngc"
    program.write_text(SQUARE + HEAD + "G0 X0 Y0 Z5\nG78 Q100 P42 Z-4 R1\nM2\n")
    found = look_ahead.Ahead(MM)
    with serving(ahead=found) as rig:
        rig.machine.loaded = scene(program)
        rig.looks()
        page = page_with(rig, lambda page: page.ahead_points and page.loops)
        assert page.states[-1]["ahead"]["from"] == 0 and page.states[-1]["ahead"]["note"] == ""
        assert page.ahead_points[0] == (0, 0, 10, 1) and len(page.loops) == 1 and page.loops[0][0] == [10, 10, -4]
        program.write_text(HEAD + "o1 while [1]\no1 endwhile\nM2\n")
        rig.wait(lambda: page_of(rig, 1.0) and found._reading is not None)
        child = found._reading._child
        os.kill(child.pid, 9)
        rig.wait(lambda: json.loads(rig.watch.text)["ahead"]["note"] or page_of(rig, 0.3) is None)
        assert json.loads(rig.watch.text)["ahead"]["note"].startswith("it could not be read within the time")
        assert child.poll() is not None


def page_of(rig, seconds=0.5):
    return follow(rig.url, seconds=seconds)


def page_with(rig, there):
    """The first page for which there() is true."""
    found = []
    rig.wait(lambda: found.append(page_of(rig)) or there(found[-1]))
    return found[-1]


def test_close_ends_the_process(tmp_path):
    program = tmp_path / "part.ngc"
    program.write_text(HEAD + "o1 while [1]\no1 endwhile\nM2\n")
    found = look_ahead.Ahead(MM)
    found.look(0.1, scene(program), False, {"tip": (0, 0, 0), "line": 0, "current_vel": 0}, True)
    child = found._reading._child
    found.close()
    end = time.monotonic() + 300
    while child.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    assert child.poll() is not None


def test_answers_that_are_no_answers():
    for text in (b"", b"{}", b"not json\n", b'{"points": 3, "step": 0.1}\nabc'):
        with pytest.raises((ValueError, KeyError)):
            look_ahead.unpacked(text)
    assert isinstance(
        look_ahead.unpacked(json.dumps({"points": 1, "step": 0.1}).encode() + b"\n" + bytes(12 + 1 + 4 + 4))[1], Path
    )
