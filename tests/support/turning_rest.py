# SPDX-License-Identifier: GPL-2.0-or-later
"""Turned parts that are stopped at a cut, and the plans that finish them.  Called by tests/turning and
bench/bench_turning.py."""

from dataclasses import replace

from chipwise.turning import resume
from chipwise.turning.plan import make_plan, total_length


def stopped(text, number, count):
    """A written program up to move `count` of its step `number`, and back to where the tool is changed, away from the
    work first."""
    lines = text.split("\n")
    begin = next(k for k, line in enumerate(lines) if line.startswith(f"(step {number}: ") and "not needed" not in line)
    moves = next(k for k in range(begin, len(lines)) if lines[k].startswith("F")) + 1
    end = next(k for k in range(moves, len(lines)) if lines[k].startswith("("))
    if count == end - moves:
        return "\n".join(lines[:end] + ["G0 X#<change_x>", "G0 Z#<change_z>", ""])
    (x, z), (far_x, far_z) = (
        [float(lines[k].split(letter)[1].split()[0]) for letter in "XZ"] for k in (moves + count - 1, end - 1)
    )
    if " inside" in lines[begin]:
        away = 0.4 / (25.4 if "G20 " in text else 1.0)
        retreat = [f"G0 X{x - away:.6f} Z{z + away:.6f}", f"G0 Z{far_z:.6f}", f"G0 X{far_x:.6f}"]
    else:
        retreat = [f"G0 X{far_x:.6f}", f"G0 Z{far_z:.6f}"]
    return "\n".join([*lines[: moves + count], *retreat, ""])


def stop(rng, plan):
    """(Stage, number of the step, moves) of a stop anywhere in a plan."""
    found = resume.stages(plan)
    number, count, stage = rng.choice([(number, *mark) for number, marks in found.marks.items() for mark in marks])
    return found.stages[stage], number, count


def finished(plan, stage):
    """The plan for what a stage has left."""
    return make_plan(replace(plan.order, blank=resume.blank_of(stage)))


def feed_left(plan, number, count):
    """Feed length (mm) of a plan after move `count` of its step `number`."""
    now = plan.steps[number - 1]
    steps = [s for n, s in enumerate(plan.steps, 1) if n > number]
    return total_length(steps) + total_length(
        [replace(now, start=(now.moves[count - 1].z, now.moves[count - 1].x), moves=now.moves[count:])]
    )
