# SPDX-License-Identifier: GPL-2.0-or-later
"""Random subs in several copies, through LinuxCNC's interpreter, against what each sub does by itself from where that
copy begins."""

import json
import random

import numpy as np
import pytest

from support import canon
from support.pattern_oracle import calls_to_moves, compare, random_sub, transformed
from support.random_cases import random_count, random_seed

HEAD = "G21 G90 G64 G94 G17 G40\nT1 M6\nS5000 M3\nF600\n"
MODES = "G21 G90 G91.1 G94 G17 G40 G98 F600"  # a plain call leaves the modes of the sub to the next one
START, COPIES = (3.0, -4.0, 7.0), 4


def at(point):
    return "G0 " + " ".join(f"{letter}{value:.9f}" for letter, value in zip("XYZ", point))


def back(point, mirror, degrees, shift):
    """The point that becomes this one."""
    turned = transformed(np.array(point) - np.array(shift), 0, -degrees, (0, 0, 0))
    return transformed(turned, mirror, 0, (0, 0, 0))[0]


def parts(lines):
    """[moves] of the parts of a program between (begin) and (end)."""
    trace = canon.run_preview("\n".join([*lines, "M2", ""]), timeout=300)
    assert not trace.error, trace.error
    calls = json.loads(trace.output.splitlines()[-1])["calls"]
    ends = [0, *(n + 1 for n, (kind, _line, *more) in enumerate(calls) if kind == "comment" and more[0] == "end")]
    return [calls_to_moves(calls[a:b]) for a, b in zip(ends, ends[1:])]


def random_case(seed):
    """(sub, words of G75, (mirror, degrees, shift) of each copy)."""
    r = random.Random(f"g75 copies {seed}")
    sub = [line if line != "G90 G17 G0 Z6" else "G90 G17 G0 Z60" for line in random_sub(seed, cycles=False)]
    odd = not any("G18" in line or "G19" in line for line in sub)
    first, turn = (round(r.uniform(-200, 200), 3) if odd else 90.0 * r.randrange(4) for _ in range(2))
    x, y, z, i, j = (round(r.uniform(-40, 40), 3) for _ in range(5))
    mirror = r.randrange(4)
    return (
        sub,
        f"X{x} Y{y} Z{z} H{mirror} R{first} L{COPIES} I{i} J{j} K{turn}",
        [(mirror, first + c * turn, (x + c * i, y + c * j, z)) for c in range(COPIES)],
    )


def judged(seed, places=None):
    """Raises AssertionError where a copy differs; places: others than the words', to see the judge fail."""
    sub, words, own = random_case(seed)
    places = places or own
    end = parts([*sub, HEAD, at(START), "(begin)", "o100 call", "(end)"])[0][-1].points[-1]
    lines, here = [*sub, HEAD, at(START), "(begin)", f"G75 Q100 {words}", "(end)"], START
    for place in places:
        lines += [MODES, at(back(here, *place)), "(begin)", "o100 call", "(end)"]
        here = transformed(end, *place)[0]
    found, *singles = parts(lines)
    expected = []
    for place, moves in zip(places, singles):
        for move in moves:
            move.points = transformed(move.points, *place)
        expected += moves
    compare(found, expected, lambda points: points)


@pytest.mark.parametrize("case", range(random_count(4)))
def test_random_subs_in_copies(case, tmp_path):
    seed = random_seed() + case
    try:
        judged(seed)
    except AssertionError as error:
        sub, words, _places = random_case(seed)
        (tmp_path / "replay.ngc").write_text("\n".join([*sub, HEAD, at(START), f"G75 Q100 {words}", "M2", ""]))
        raise AssertionError(f"CHIPWISE_SEED={seed} {words}, {tmp_path / 'replay.ngc'}: {error}") from error


def test_the_judge_can_fail():
    """The last copy turned by a thousandth of a degree."""
    places = random_case(1)[2]
    mirror, degrees, shift = places[-1]
    with pytest.raises(AssertionError, match="move"):
        judged(1, [*places[:-1], (mirror, degrees + 1e-3, shift)])
