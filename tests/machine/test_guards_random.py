# SPDX-License-Identifier: GPL-2.0-or-later
"""The guards on random traverses round the stock, judged by its box and by whether anything was left to cut there."""

import random

import numpy as np
import pytest

from support.guard_runs import HEAD, SPEED, log_of
from support.random_cases import random_count, random_seed, write_replay
from support.operate import operate
from support.headless_rig import WITH_LOG

pytestmark = pytest.mark.machine

RADIUS = 3.0
MODES = ("G64", "G64", "G64 P1", "G64 P5", "G64 P20", "G61")
THIN_MM = 0.15  # half a cell: so thin a layer is ignored (docs/design/hal.md)
CHIP_MM = 0.36  # 1.4 cells: nor is what a step of the probe takes off an upright edge of the stock


def gap(points):
    """How far the tool (flat) is from the box of HEAD, above or beside it, mm; below 0: in it."""
    x, y, z = np.asarray(points, float).T
    beside = np.hypot(np.maximum(np.maximum(-x, x - 60), 0), np.maximum(np.maximum(-y, y - 40), 0)) - RADIUS
    return np.maximum(z, beside)


def random_traverses(generator, count):
    """A program of traverses whose corners all lie outside the box, half of them close to it; the blends may cut
    corners."""
    at, lines = np.array([-20.0, -20.0, 20.0]), [generator.choice(MODES), "G0 X-20 Y-20"]
    while len(lines) < count + 2:
        away, beside = RADIUS + generator.choice([0.05, 0.3, 1, 5]), generator.uniform(-20, 60)
        to = np.array(
            generator.choice(
                [
                    [generator.uniform(-45, 110), generator.uniform(-45, 85), generator.uniform(-8, 25)],
                    [-away, beside, -5],
                    [60 + away, beside, -5],
                    [beside, -away, -5],
                    [beside, 40 + away, -5],
                    [beside, beside, away - RADIUS],
                ]
            ),
            float,
        )
        if generator.random() < 0.3:
            to = at + (to - at) * generator.uniform(0.05, 0.3)
        if gap(at + (to - at) * np.linspace(0, 1, 200)[:, None]).min() > 0.02:
            lines.append("G0 X%.3f Y%.3f Z%.3f" % tuple(to))
            at = to
    return HEAD + "G0 Z20\n" + "\n".join(lines) + "\nG0 Z30\nM2\n"


def judge_traverses(log):
    """Raise where an alarm has no contact near it, or a contact no alarm the braking distance v2 / 2A before."""
    places = np.column_stack([log[axis] for axis in "xyz"])
    space, said = gap(places), np.asarray(log["rapid_contact"], bool)
    toolpath = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    stopped = toolpath + np.asarray(log["velocity"]) ** 2 / (2 * 500)  # where braking from here would end
    at_edge = ((places[:, 0] < 0) | (places[:, 0] > 60)) & ((places[:, 1] < 0) | (places[:, 1] > 40))
    touched, inside = np.flatnonzero(space < 0.0), space < -np.where(at_edge, CHIP_MM, THIN_MM)
    for row in np.flatnonzero(np.diff(said, prepend=False) & said):  # it may last while the tool is in the stock
        near = np.count_nonzero((touched > row - 1500) & (touched < row + 700))
        assert near > 0, f"alarm without a contact at line {log['line'][row]}, {space[row]:.3f} mm from the stock"
    for row in np.flatnonzero(inside[1:] & ~inside[:-1]):
        if np.ptp(log["removed_volume"][row : row + 300]) == 0.0:  # a contact before has taken this stock away
            continue
        before = slice(max(0, row - 1500), row)
        assert (said[before] & (stopped[before] < toolpath[row])).any(), (
            f"no alarm in time before the contact at line {log['line'][row]}"
        )
    return len(touched)


def test_random_traverses(tmp_path):
    """With the guard announced but switched off: every alarm is followed by a contact, every contact was announced in
    time."""
    seeds = range(random_seed(), random_seed() + random_count(2, least=2))
    programs = [random_traverses(random.Random(seed), 60) for seed in seeds]
    answers = operate(
        tmp_path,
        [step for text in programs for step in (["log", text], ["fresh"])],
        speed=SPEED,
        edit=WITH_LOG + "; s/^GUARD_RAPID = .*/GUARD_RAPID = no/",
        timeout=150 + 60 * len(programs),
    )
    for seed, text, (errors, log) in zip(seeds, programs, answers[::2]):
        assert errors == []
        try:
            touched = judge_traverses(log_of(log))
        except AssertionError:
            print("replay:", write_replay(f"traverses-{seed}", text))
            raise
        print(f"seed {seed}: {touched} ms in the stock")


def test_the_judge_of_traverses_sees_both_faults():
    """A traverse along X into the box at 100 mm/s: told 0.2 s before, not at all, too late; and told beside it."""
    x = np.arange(-40.0, 10.0, 0.1)
    log = {
        "x": x,
        "y": 0 * x + 20,
        "z": 0 * x - 5,
        "velocity": 0 * x + 100,
        "line": 0 * x,
        "rapid_contact": 0 * x,
        "removed_volume": np.maximum(x + 3, 0),
    }
    contact = int(np.argmax(x > -RADIUS))
    log["rapid_contact"][contact - 200 :] = 1
    judge_traverses(log)
    for first in (contact - 90, len(x)):
        log["rapid_contact"][:] = np.arange(len(x)) >= first
        with pytest.raises(AssertionError, match="no alarm"):
            judge_traverses(log)
    log["rapid_contact"][:], log["z"] = 1, 0 * x + 0.2  # above it
    with pytest.raises(AssertionError, match="without a contact"):
        judge_traverses(log)
