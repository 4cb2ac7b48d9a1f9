# SPDX-License-Identifier: GPL-2.0-or-later
"""A turned part that is stopped by abort, E-stop or the end of LinuxCNC, and finished by the same program; another part
is never mistaken for it."""

import os

import numpy as np
import pytest

from chipwise.turning import resume, stock_file
from chipwise.turning import nc
from chipwise.turning.plan import make_plan, total_length
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_request
from chipwise.ini import Ini
from chipwise.settings import load_settings
from support import ROOT
from support.operate import Stopped, operate
from support.turning_oracle import moves
from support.turning_paths import distances

pytestmark = pytest.mark.machine
HOME = (100.0, 100.0)  # z, x where configs/lathe.ini begins, and changes tools
PART = """(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0.6)
(LATHE,ROUGH=1,FINISH=2)
G21 G18 G8 G94 G97 S500 M3
G26 Q100 I0.3 D1 F900 E600
M2
O100 sub
G0 X8 Z0
G1 Z-20
G1 X12
G1 Z-30
O100 endsub
"""
AWAY = [["mdi", "G0 X100"], ["mdi", "G0 Z100"]]


class Lathe:
    """configs/lathe.ini with the file of the stock, and the program, in a folder of the test."""

    def __init__(self, folder):
        self.folder, self.program, self.stock = folder, folder / "part.ngc", folder / "turning.stock"
        self.program.write_text(PART)
        self.begun = [["open", str(self.program)], ["begin"]]

    def operate(self, steps, stock=None, ini="lathe.ini"):
        return operate(
            self.folder, steps, ini=ini, edit=f"s#^TOOL_GEOMETRY = .*#&\\nTURNING_STOCK = {stock or self.stock}#"
        )

    def cut(self, count, said="1 face T1"):
        """Run the program until the task has said something, from when on the file is that of this run, and the file
        says that so many stages are done."""
        look = (
            f"for k in $(seq 3000); do [ $(grep -c '\"done\"' {self.stock}) -ge {count} ] && exit 0; sleep 0.1; "
            f"done; exit 1"
        )
        return [*self.begun, ["messages", said], ["program", "sh", "-c", look]]

    def plan(self, stage=None):
        """(plan, its path as points) of the whole blank, or of a stage."""
        ini = os.path.join(ROOT, "configs", "lathe.ini")
        machine, request = Machine(Ini(ini), load_settings(ini), ini), read_request(PART)
        order = make_order(job_of(str(self.program), request, machine), PART, request, machine)
        plan = (
            resume.choose(order, "", None).plan
            if stage is None
            else make_plan(resume.replace(order, blank=resume.blank_of(stage)))
        )
        text = f"G0 X{HOME[1]} Z{HOME[0]}\n" + nc.program(plan, request, "part")
        return plan, np.array([HOME, *(p for _, _, points in moves(text, 1.0, HOME, 0.02) for p in points)])


@pytest.fixture
def lathe(tmp_path):
    return Lathe(tmp_path)


def check_path(log, path):
    """The machine has followed a path, and nothing else."""
    rows = np.load(log)
    moving = np.column_stack((rows["z"], rows["x"]))[rows["motion_type"] > 0]
    assert distances(moving[:: max(len(moving) // 4000, 1)], path).max() < 0.001
    assert np.hypot(*(moving[-1] - HOME)) < 0.001


def test_an_aborted_part_is_finished(lathe):
    """After an abort and after an E-stop the rest is cut, and nothing of what has been cut; a finished part leaves no
    file."""
    keep = ["program", "cp", str(lathe.stock), str(lathe.folder / "kept")]
    found = lathe.operate(
        [
            *lathe.cut(4),
            ["abort"],
            ["errors"],
            *AWAY,
            *lathe.begun,
            ["messages", "press Resume"],
            ["position"],
            ["until", "spindle.0.on", "=", 0],
            ["resume"],
            ["until", "motion.motion-type", "=", 2],
            ["sleep", 3],
            ["estop"],
            ["on"],
            keep,
            *AWAY,
            ["log", str(lathe.program)],
            ["messages"],
            ["position"],
        ],
        ini="lathe_headless.ini",
    )
    assert found[3][0] == 0 and found[5] == []
    asked, place, log, said = found[10], found[11], found[-3], found[-2]
    assert place == pytest.approx(
        [100.0, 0.0, 100.0], abs=1e-6
    )  # nothing moves before Resume, and the spindle has stopped
    assert any("G26: planned from what the step rough outside has left (line 4)" in text for text in asked)
    assert sum("goes on from there; press Resume if it is in the chuck as it was" in text for text in said) == 2
    assert log[0] == [] and found[-1] == pytest.approx([100.0, 0.0, 100.0], abs=1e-6)
    stage = stock_file.read(str(lathe.folder / "kept")).stage
    second, path = lathe.plan(stage)
    check_path(log[1], path)
    with pytest.raises(AssertionError):
        check_path(log[1], lathe.plan()[1])
    assert total_length(second.steps) < 0.8 * total_length(lathe.plan()[0].steps)
    assert not lathe.stock.exists()


def test_another_part_is_never_mistaken_for_it(lathe):
    """Stop at the question, another WORKPIECE, another work offset, another program: the whole blank, and the reason is
    said."""
    wider = ["program", "sed", "-i", "s/DIAMETER=30/DIAMETER=32/", str(lathe.program)]
    other = lathe.folder / "other.ngc"
    other.write_text(PART)
    cutting = ["until", "motion.motion-type", "=", 2]
    found = lathe.operate(
        [
            *lathe.cut(3),
            ["abort"],
            *AWAY,
            *lathe.begun,
            ["messages", "press Resume"],
            ["abort"],
            *lathe.cut(3, "nobody has confirmed"),
            ["abort"],
            *AWAY,
            wider,
            *lathe.cut(3, "the blank is another one"),
            ["abort"],
            *AWAY,
            ["mdi", "G10 L2 P1 Z-0.002"],
            *lathe.cut(3, "the work offset has changed"),
            ["abort"],
            *AWAY,
            ["open", str(other)],
            ["begin"],
            cutting,
            ["messages", "it is of another program, part.ngc"],
            ["abort"],
            ["errors"],
        ]
    )
    said, errors = found[-3], found[-1]
    for words in (
        "nobody has confirmed that it is in the chuck",
        "the blank is another one",
        "the work offset has changed",
        "it is of another program, part.ngc",
    ):
        assert (
            sum(
                f"G26: the stock of the stopped part is not used: {words}" in text
                and "the whole blank is planned" in text
                for text in said
            )
            == 1
        ), (words, said)
    assert sum("press Resume" in text for text in said) == 1 and errors == []


def test_a_part_survives_the_end_of_linuxcnc(lathe):
    """kill -9 of the task; the next LinuxCNC asks and finishes the part."""
    try:
        lathe.operate([*lathe.cut(4), ["kill", "milltask"]])
    except Stopped:
        pass
    before = stock_file.read(str(lathe.stock))
    assert before.begun and not before.asked
    found = lathe.operate([*lathe.begun, ["messages", "press Resume"], ["resume"], ["finish"], ["position"]])
    assert found[-2] == [] and found[-1] == pytest.approx([100.0, 0.0, 100.0], abs=1e-6) and not lathe.stock.exists()


def test_a_folder_that_cannot_be_written_does_not_stop_the_program(lathe):
    """The part is turned, and what an abort would cost is said; MDI and G27 keep nothing."""
    nowhere = lathe.folder / "missing" / "turning.stock"
    found = lathe.operate([*lathe.begun, ["finish"], ["messages", "will not be known"], ["position"]], nowhere)
    assert found[2] == [] and found[-1] == pytest.approx([100.0, 0.0, 100.0], abs=1e-6)
    assert (
        sum(
            "G26: the stock of a part that is stopped will not be known: turning.stock: No such file" in text
            for text in found[-2]
        )
        == 1
    )
