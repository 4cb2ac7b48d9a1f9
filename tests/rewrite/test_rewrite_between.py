# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite --flute where a contact lies between the needles of the stock's model; judged by needles written apart."""
import pytest

from chipwise.check.reader import Machine, Unreadable
from chipwise.rewrite import cutting, proof, run
from chipwise.rewrite.program import read
from chipwise.tools import load_tools
from support.rewrite_rig import HEAD, deep_program, judged, make_machine, rewrite, verdict

POKE = HEAD + "M250 P0 Q0 R-40 I100 J60 K40\nT1 M6\nS8000 M3\nG0 X40.3 Y-10 Z5\nG0 Z-30\nG1 Y-2.97 F400\nY-10\nG0 Z5\nM2\n"
POKE_LINE = 7               # 0.03 mm into the stock's side, 0.85 mm wide, 30 mm deep, with 12 mm of flutes
CELL = 0.25
FINE = 0.05                 # mm from needle to needle of the verdict


@pytest.fixture(name="machine", scope="module")
def make_ini(tmp_path_factory):
    return make_machine(tmp_path_factory.mktemp("machine") / "mill")


def test_a_contact_between_needles_is_seen_and_shifted(tmp_path, machine):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(POKE)
    program, geometry = read(str(before), Machine(str(machine))), load_tools(str(machine.parent / "tools.toml"))
    ((_stock, ((_section, depth, *_),)),) = proof.simulated(program, geometry, CELL)
    assert depth == 0.0                                         # so the model of the edits meets nothing: the case is what it is for
    with pytest.raises(proof.TooDeep) as error:
        proof.between_needles(program, geometry, CELL)
    assert error.value.depth == pytest.approx(30.0, abs=0.01) and error.value.limit == 12
    assert proof.line_below(program, error.value.place) == POKE_LINE
    assert judged(program, geometry, FINE)[1][1] > 17.9
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0 and f"lines {POKE_LINE} to 8 in" in done.said, (done.said, done.errors)
    assert judged(read(str(after), Machine(str(machine))), geometry, FINE)[1][1] <= 0.006


def test_what_cannot_be_proved_is_refused(tmp_path, machine, monkeypatch):
    """After the last repeat: the line of the user's program, the depth, the flutes and the remedy; no bytes."""
    before = tmp_path / "a.ngc"
    before.write_text(POKE)
    monkeypatch.setattr(run, "REPEATS", 1)
    with pytest.raises(Unreadable, match="tool 1 would still cut 30 mm deep, its flutes are 12 mm long; take smaller steps") as error:
        run.rewritten(str(before), run.Order(), lambda share: None, Machine(str(machine)))
    assert error.value.line == POKE_LINE


def test_needles_in_other_places(tmp_path, machine):
    """Half a cell from each other, and none of them where the model of the edits has one."""
    before = tmp_path / "a.ngc"
    before.write_text(POKE)
    program, geometry = read(str(before), Machine(str(machine))), load_tools(str(machine.parent / "tools.toml"))
    found = cutting.sections(program, geometry)
    (_, one), = cutting.in_stock(program, found, CELL)
    (_, two), = cutting.in_stock(program, found, CELL * proof.BETWEEN_CELLS, phase=proof.BETWEEN_PHASE)
    assert two.height.size == pytest.approx(4 * one.height.size, rel=0.01)
    ours = {(round(float(x) + float(dx), 3), round(j * one.cell + float(dy), 3)) for j, dx in enumerate(one.shift_x[:40])
            for x, dy in zip(one._x[:40], one.shift_y[:40])}
    others = {(round(float(x) + float(dx), 3), round(j * two.cell + float(dy), 3)) for j, dx in enumerate(two.shift_x[:80])
              for x, dy in zip(two._x[:80], two.shift_y[:80])}
    assert len(ours) == 1600 and len(ours & others) <= 2


@pytest.mark.parametrize("seed, was", ((96, 0.64),))
def test_first_contacts_between_needles(tmp_path, machine, seed, was):
    """A random program whose rewritten path was deeper than the flutes by `was` mm where it first meets a side."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(deep_program(seed))
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0, done.errors
    over, more, left, _rapid = verdict(before, after, machine)
    assert over <= 0.006 < was
    assert more <= 0.25 and left <= 0.25
