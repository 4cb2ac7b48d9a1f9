# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite --flute where a contact lies between the needles of the stock's model; judged by needles written
apart."""

import pytest

from chipwise.program.reader import Machine, Unreadable
from chipwise.rewrite import depth_proof, read_back, sections
from chipwise.rewrite import run
from chipwise.rewrite.program import read
from chipwise.tool_data.geometry import load_tools
from support.rewrite_rig import HEAD, deep_program, judged, rewrite, verdict

POKE = (
    HEAD + "M250 P0 Q0 R-40 I100 J60 K40\nT1 M6\nS8000 M3\nG0 X40.3 Y-10 Z5\nG0 Z-30\nG1 Y-2.97 F400\nY-10\nG0 Z5\nM2\n"
)
POKE_LINE = 7  # 0.03 mm into the stock's side, 0.85 mm wide, 30 mm deep, with 12 mm of flutes
CELL = 0.25
FINE = 0.05  # mm from needle to needle of the verdict


def test_a_contact_between_needles_is_seen_and_shifted(tmp_path, machine):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(POKE)
    program, geometry = read(str(before), Machine(str(machine))), load_tools(str(machine.parent / "tools.toml"))
    ((section, stock),) = sections.in_stock(program, sections.sections(program, geometry), CELL)
    met = stock.cut(section.tool.shape, program.start(section.first), program.end[section.first : section.end])
    assert met["depth"].max() == 0.0  # so the model of the edits meets nothing: the case is what it is for
    found = depth_proof.too_deep(program, geometry, CELL, read_back.OVER_MM)
    assert found and all(
        w.depth == pytest.approx(30.0) and w.tool.flute_length == 12 and w.line == POKE_LINE for w in found
    )
    assert read_back.line_below(program, found[0].place) == POKE_LINE
    assert judged(program, geometry, FINE)[1][1] > 17.9
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0 and f"lines {POKE_LINE} to 8 in" in done.said, (done.said, done.errors)
    again = read(str(after), Machine(str(machine)))
    assert judged(again, geometry, FINE)[1][1] <= 0.006 and not depth_proof.too_deep(
        again, geometry, CELL, read_back.OVER_MM
    )


def test_what_cannot_be_proved_is_refused(tmp_path, machine, monkeypatch):
    """After the last repeat: the line of the user's program, the depth, the flutes and the remedy; no bytes."""
    before = tmp_path / "a.ngc"
    before.write_text(POKE)
    monkeypatch.setattr(run, "REPEATS", 1)
    with pytest.raises(
        Unreadable, match="tool 1 would still cut 30 mm deep, its flutes are 12 mm long; take smaller steps"
    ) as error:
        run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))
    assert error.value.line == POKE_LINE


@pytest.mark.parametrize("seed, was", ((96, 0.64), (156, 1.66), (70, 0.03)))
def test_random_programs_that_were_too_deep(tmp_path, machine, seed, was):
    """First contacts and tips of remainders between the needles of a map; `was`: mm deeper than the flutes before
    depths were proved."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(deep_program(seed))
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0, done.errors
    over, more, left, _rapid = verdict(before, after, machine)
    assert over <= 0.006 < was
    assert more <= 0.25 and left <= 0.25
