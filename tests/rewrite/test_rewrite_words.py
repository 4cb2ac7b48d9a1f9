# SPDX-License-Identifier: GPL-2.0-or-later
"""rewrite/words.py and program.py: what is read at a glance is what reading word by word says, on random lines."""

import random

from chipwise.rewrite import program, words
from support.random_cases import random_count, random_seed

TOKENS = (
    "G0 G1 g2 G03 G81 G80 G90 G91 g20 G38.2 G1.5 G[#1] G#2 X1 Y-2.5 I1 F100 R3 n5 M2 / #1=2 T1 P2 K1 G00 G17 X[1+2] "
    "X#1 L3 G10".split()
    + [
        "G 1",
        "z .5",
        "N10 ",
        "(note g91)",
        "(MSG,g20)",
        "; g91",
        "M98 P1",
        "o100 sub",
        "o100 endsub",
        "O1 if [1]",
        "o1 endif",
    ]
)
PLAIN = {("G", 0.0), ("G", 1.0), ("G", 2.0), ("G", 3.0)}


def line(rng):
    return "".join(rng.choice(["", "", " "]) + rng.choice(TOKENS) for _ in range(rng.randint(0, 4))) + rng.choice(
        ["\n", "\r\n", ""]
    )


def test_a_plain_move_is_nothing_else():
    rng, plain = random.Random(random_seed()), 0
    for _ in range(random_count(20000)):
        text = line(rng)
        match = words.plain_move(text)
        if match:
            plain += 1
            assert bool(match[1]) == bool(words.MOTION.search(words.code(text))), text
            assert not words.active_comments(text) and "=" not in words.code(text) and "/" not in text, text
            assert all(
                word in PLAIN or word[0] in "NXYZIJKRF" and word[1] is not None for word in words.words_of(text)
            ), text
    assert plain


def test_modes_line_by_line():
    rng = random.Random(random_seed())
    for _ in range(random_count(2000)):
        source, modes = [line(rng) for _ in range(12)], program.Modes()
        for text, found in zip(source, program.modes_by_line(source, (), modes)):
            modes = program.after_line(modes, text)
            assert found == modes, source
