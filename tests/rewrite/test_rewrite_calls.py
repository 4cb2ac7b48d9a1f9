# SPDX-License-Identifier: GPL-2.0-or-later
"""Calls, loops and conditions that rewrite writes out (rewrite/calls.py): judged by what LinuxCNC's rs274 prints for
both programs."""

import random

import pytest

from chipwise.program.reader import Machine
from chipwise.rewrite import read_back
from chipwise.rewrite import calls
from chipwise.rewrite.blocks import blocks_of
from chipwise.rewrite.line_marks import watched
from chipwise.rewrite.program import Reads, read
from chipwise.rewrite.marked_reader import Followed
from chipwise.rewrite.unroll import Unroller
from support.calls_oracle import acts, difference
from support.calls_random import Maker
from support.random_cases import random_count, random_seed, write_replay
from support.rewrite_rig import HEAD, check_status, rewrite, verdict

STOCK = "M250 P0 Q0 R-40 I100 J60 K40\n"
TOOL = "T1 M6\nS8000 M3\n"


def without_blocks(path, ini, share=1.0, seed=0):
    """The Followed program with a share of its outermost blocks written out."""
    machine = Machine(str(ini))
    program = read(str(path), machine)
    rng = random.Random(seed)
    blocks = sorted(set(program.blocks.outermost.values()), key=lambda block: block.first)
    chosen = {block for block in blocks if rng.random() < share}
    return calls._without(Followed(program, machine, None), chosen, Reads(machine, None, {}))


def test_random_programs(tmp_path, machine):
    """The machine gets the same canonical calls, whichever blocks are written out."""
    for case in range(random_count(5)):
        seed = random_seed() + case
        made = Maker(seed)
        for name, text in made.files.items():
            (machine.parent / "subs" / f"{name}.ngc").write_text(text)
        before, after = tmp_path / f"{seed}.ngc", tmp_path / f"{seed}.out.ngc"
        before.write_text(made.text)
        new = without_blocks(before, machine, share=0.8, seed=seed)
        after.write_bytes(new.program.content())
        (one, _), (two, error) = acts(before, machine), acts(after, machine)
        found = error or difference(one, two)
        assert len(one) > 10
        assert not found, (seed, found, write_replay("calls", {"seed": seed, "text": made.text, "files": made.files}))


PROGRAM = (
    "G21 G90 G17 G40 G49 G80 G94\n#<_g>=1\n#31=4\nT1 M6\nS1000 M3\nG0 X1 Y1 Z5\nF150\no1 repeat [2]\n"
    "G1 X[#31*2] F[#31*50]\n"
    "G91 G2 X2 Y2 I2\nM8\n#31=[#31+1/3]\n#<_g>=#31\nG1 Y1\no1 endrepeat\nX#31\nG90 M9\nG0 Z20\nM5\nM2\n"
)
FAULTS = {  # (what the written out program has, what it is made)
    "a place": ("G1 X18.66667", "G1 X18.67667"),
    "an end of an arc": ("Y6 Z5", "Y6.002 Z5"),
    "coolant": ("M8\n", ""),
    "a parameter": ("#31=4.6666", "#31=4.6676"),
    "a named one": ("#<_g>=", "#<_h>="),
    "G91 behind it": ("G91\n", ""),
    "F behind it": ("F216.666667", "F210"),
    "the motion mode": ("G91\n", "G91\nG0\n"),
    "a move more": ("M8\n", "M8\nG0 Z6\nZ5\n"),
}


@pytest.fixture(name="written", scope="module")
def make_written(tmp_path_factory, machine):
    """(what PROGRAM does, the Followed, the text with its loop written out)."""
    path = tmp_path_factory.mktemp("program") / "a.ngc"
    path.write_text(PROGRAM)
    own = Machine(str(machine))
    followed = Followed(read(str(path), own), own, None)
    return (
        acts(path, machine)[0],
        followed,
        Unroller(followed).write(set(followed.program.blocks.outermost.values())).decode(),
    )


def test_what_is_written_out(written):
    for part in (
        "(chipwise: written out: o1 repeat [2])\n(chipwise: | G1 X[#31*2] F[#31*50])\n",
        "G1 X8 Y1 Z5 F200\nG2 X10 Y3 Z5 I2 J0\nM8\nG1 Y4\n",
        "G1 X18.66667 F216.666667\nG2 X20.66667 Y6 Z5 I1.99",
        "\n#31=4.6666666",
        "\n#<_g>=4.6666666",
        "G91\nX#31\nG90 M9\n",
    ):
        assert part in written[2], (part, written[2])


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_seen(tmp_path, machine, monkeypatch, written, name):
    """By the package's own comparison, and by rs274 where the machine does something else."""
    wanted, followed, text = written
    good, bad = FAULTS[name]
    before, inside, after = text.partition("o1 endrepeat")
    assert good in after, text
    wrong = tmp_path / "wrong.ngc"
    wrong.write_text(before + inside + after.replace(good, bad, 1))
    assert difference(wanted, acts(wrong, machine)[0]) or name == "a named one", name

    class Wrong(Unroller):
        def write(self, blocks):
            super().write(blocks)
            more = bad.count("\n") - good.count("\n")
            self.checks = {line + more: block for line, block in self.checks.items()}
            self.origin += [self.origin[-1]] * max(0, more)
            return wrong.read_bytes()

    monkeypatch.setattr(calls, "Unroller", Wrong)
    own = Machine(str(machine))
    with pytest.raises(read_back.Different):
        calls._without(followed, set(followed.program.blocks.outermost.values()), Reads(own, None, {}))


DEEP = {  # program, parts of the new one
    "a loop": (
        TOOL + "#31=0\no1 repeat [2]\n#31=[#31+1]\nG0 X-10 Y[#31*20] Z5\nG0 Z-[10+5*#31]\nG1 X110 F400\nG0 Z5 M8\n"
        "o1 endrepeat\n"
        "G0 X#31\nM2\n",
        ["#31=2\nG0 X#31\nM2\n", "(chipwise: | G0 Z-[10+5*#31])"],
    ),
    "calls": (
        "o<slot> sub\nG91 G1 Z-#2 F200\nG90 X[#1+60] F[#3*2]\nG91 G2 X10 Y10 I10 J0\nG0 Z[#2]\nG90\n#<_n>=[#<_n>+1]\n"
        "o<slot> endsub\n"
        + TOOL
        + "#<_n>=0\nG0 X10 Y10 Z1\no<slot> call [10] [30] [200]\nY40\no<slot> call [10] [5] [200] (stays)\nX0 Y0\n"
        "o<slot> call [0] [29] [100]\nG0 Z5\nM2\n",
        ["#<_n>=1\nY40\no<slot> call [10] [5] [200] (stays)\nX0 Y0\n", "#<_n>=3\nG0 Z5\nM2\n"],
    ),
    "M98": (
        TOOL
        + "F300\nG0 X10 Y10 Z1\nM98 P77\nG0 X30 Y30\nM98 P77 L2\nG0 Z5\nM2\nO77\nG91 G1 Z-14\nM8\nX20\nG0 Z14\nG90\n"
        "M99\n",
        ["(chipwise: written out: M98 P77)", "(chipwise: written out: M98 P77 L2)"],
    ),
    "a file": (
        TOOL + "F300\nG0 X10 Y10 Z1\no<deep> call [25]\nG0 Z5\nM2\n",
        ["(chipwise: written out: o<deep> call [25])", "G4 P0.25\n"],
    ),
    "compensation in it": (
        TOOL + "G0 X-20 Y30 Z5\nG0 Z-30\no1 if [1 GT 0]\nG41.1 D6 G1 X-10 F400\nX90\nG40 Y50\no1 endif\nG0 Z5\nM2\n",
        ["\nG0 Z5\nM2\n"],
    ),
    "a cycle that goes on": (
        TOOL + "G0 X10 Y10 Z5\nG81 X10 Y10 Z-2 R1 F100\no1 repeat [2]\nG91 X20\no1 endrepeat\nG90 G80\nG0 X-10 Y50 Z5\n"
        "G0 Z-20\n"
        "o2 repeat [1]\nG1 X110 F400\no2 endrepeat\nG0 Z5\nM2\n",
        ["o1 repeat [2]\nG91 X20\no1 endrepeat\nG90 G80\n"],
    ),
}
DEEP_FILE = (
    "o<deep> sub\no10 while [#1 GT 20]\nG1 Z-#1\nX90\n#1=[#1-5]\no10 endwhile\nG4 P[25/100]\no<deep> endsub\nM2\n"
)


@pytest.mark.parametrize("name", DEEP)
def test_deep_moves_in_blocks(tmp_path, machine, name):
    body, parts = DEEP[name]
    (machine.parent / "subs" / "deep.ngc").write_text(DEEP_FILE)
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + body)
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0 and "levels" in done.said, done.errors
    text = after.read_text()
    for part in parts:
        assert part in text, (part, text)
    assert check_status(after, machine)[0] == 0
    over, more, left, rapid = verdict(before, after, machine)
    assert over <= 0.006 and rapid <= 0.006 and more <= 0.02 and left <= 0.05


REFUSED = {  # lines in o1 if .. endif before a move that is too deep; what is said
    "an input": ("M66 P0 L0", "M66 there"),
    "which interpreter": ("#32=#<_task>", "on the machine only"),
    "saved modes": ("M70", "M70 there"),
    "a thread": ("G33.1 Z-2 K1", "G33.1 there"),
    "block delete": ("/M8", "block delete"),
    "a parameter of LinuxCNC's": ("#5221=3", "#5221 there"),
    "its end": ("G0 Z5\nM2", "the program ends"),
    "what a print shows": ("(PRINT, #31)", "PRINT"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(tmp_path, machine, name):
    line, said = REFUSED[name]
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(
        HEAD
        + STOCK
        + TOOL
        + f"#31=1\nG0 X-10 Y30 Z5\no1 if [#31 LT 9]\nG0 Z-30\nG1 X110 F400\n{line}\nG0 Z5\no1 endif\nM2\n"
    )
    after.write_text("precious")
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 2 and said in done.errors and "(line " in done.errors, done.errors
    assert after.read_text() == "precious" and len(done.errors.splitlines()) == 1


OUTSIDE = {  # programs whose block cannot be written out for what is before or behind it
    "compensation goes on": (
        "G0 X-20 Y30 Z5\nG0 Z-30\nG41.1 D6 G1 X-10 F400\no1 repeat [1]\nX90\no1 endrepeat\nG40 Y50\nG0 Z5\nM2\n",
        "compensation",
    ),
    "a number names the sub": (
        "o5 sub\nG1 X110\no5 endsub\nF400\nG0 X-10 Y30 Z5\nG0 Z-30\no[2+3] call\nG0 Z5\nM2\n",
        "a call of",
    ),
    "the value is read": (
        "o5 sub\nG1 X110\no5 endsub [3]\nF400\nG0 X-10 Y30 Z5\nG0 Z-30\no5 call\nG0 Z[#<_value>+5]\nM2\n",
        "#<_value",
    ),
}


@pytest.mark.parametrize("name", OUTSIDE)
def test_refused_for_what_is_outside(tmp_path, machine, name):
    body, said = OUTSIDE[name]
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + TOOL + body)
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 2 and said in done.errors and not after.exists(), done.errors


def test_blocks():
    text = (
        b"o<A> sub\no100 while [1]\nG1\no100 endwhile\no<a> endsub\no<a> call\nM98 P077\no1 do\no2 while [1]\nX1\n"
        b"o2 endwhile\n"
        b"N5 o1 while [0]\n(o3 call)\nO77\nM99\no[1+2] call\n"
    )
    found = blocks_of(text.splitlines(keepends=True))
    assert sorted({(b.first, b.last) for b in found.outermost.values()}) == [(6, 6), (7, 7), (8, 12), (16, 16)]
    assert found.subs == {1, 2, 3, 4, 5} and found.defined == {b"a", b"77"} and found.called == {b"a", b"77", None}


def test_watched_parameters():
    assert watched(["#1=2 #<_A b>=[#3 EQ 4]\n", "G1 X#7 #8 = 3", "(#9=1)", "#5221=3"]) == {
        "numbers": [1, 8],
        "names": ["_ab"],
    }
    assert len(watched(["##1=3"])["numbers"]) == len(watched(["#[2+3]=1"])["numbers"]) == 5000
