# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether a robot follows a pattern: its joints along every chord, by the machine's own kinematics, before anything
moves.

Called by cycles/pattern.py.  mm, degrees, mm/min; joints as the kinematics have them.

 1. The path is sampled every STEP_MM and STEP_DEGREES: traverses, lines and arcs, and the turn to the station's
    orientation.
 2. The joints of a sample follow from those before it, as motion computes them (machine/kinematics.py).
 3. Refused is the first sample that the joints do not reach, where one is beyond its limit, or where one would have to
    turn faster than it can at the programmed feed: a singularity is where that happens at any feed.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.errors import CycleError
from chipwise.machine.kinematics import Kinematics
from chipwise.pattern.isometry import arc_points
from chipwise.pattern.recorded import ARC, RAPID

STEP_MM, STEP_DEGREES, CHORD = 1.0, 0.5, 0.05
SLACK = 1e-6  # degrees or mm beyond a limit: rounding
FASTER = 1.02  # of a joint's speed: what sampling may overestimate
PART = 200_000  # samples at a time: 25 MB of joints


@dataclass(frozen=True)
class Reach:
    """The robot.

    module    of kinematics, pins: ((name, value), ..) of its HAL pins
    joints    now: which of the solutions the arm is in
    limits    (lowest, highest, speed per s) of each joint
    per_mm    machine units of a mm
    speeds    of a traverse: (mm/s, degrees/s)
    abc       (A, B, C) now
    """

    module: str
    pins: tuple
    joints: tuple
    limits: tuple
    per_mm: float
    speeds: tuple
    abc: tuple

    def check(self, runs, pose):
        """Raise CycleError for the first sample out of reach.

        runs: of each copy (copy from 1, Recorded, its points, its start, Isometry to positions of the axes); pose: (A,
        B, C) in the station.
        """
        robot, joints, rows, before = Kinematics(self.module, self.pins), self.joints, [], None
        for piece in self._pieces(runs, pose):
            rows.append(piece)
            if sum(len(row[2]) for row in rows) > PART:
                joints, before = self._check(robot, joints, rows, before)
                rows = []
        if rows:
            self._check(robot, joints, rows, before)

    def _pieces(self, runs, pose):
        """(copy, step, poses (n, 6), s to each) of every move."""
        abc = np.array(self.abc, float)
        for copy, recorded, points, start, onto in runs:
            here = np.array(start, float)
            for step, at in zip(recorded.moves, recorded.ends):
                path = (
                    arc_points(here, points[at], points[at + 1], step.axis, step.turns, CHORD)
                    if step.kind == ARC
                    else points[at][None]
                )
                yield (
                    copy,
                    step,
                    *self._sampled(step, onto.points(np.vstack([here[None], path])), abc, np.array(pose, float)),
                )
                here, abc = points[at], np.array(pose, float)

    def _sampled(self, step, corners, abc, to):
        """(poses (n, 6), s to each (n,)) of a move, without its start; abc, to: its orientation at the start and at the
        end."""
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        turn = float(np.abs(to - abc).max())
        counts = np.maximum(1, np.ceil(lengths / STEP_MM)).astype(int)
        if turn > 0:
            counts = np.maximum(counts, math.ceil(turn / STEP_DEGREES / len(counts)))
        share = np.concatenate([np.arange(1, count + 1) / count for count in counts])
        part = np.repeat(np.arange(len(counts)), counts)
        places = corners[part] + (corners[part + 1] - corners[part]) * share[:, None]
        travelled = (np.concatenate([[0.0], np.cumsum(lengths)])[part] + lengths[part] * share) / max(
            float(lengths.sum()), 1e-12
        )
        whole = np.linspace(0, 1, len(part) + 1)[1:] if lengths.sum() < 1e-9 else travelled
        speed = self.speeds[0] if step.kind == RAPID or not step.feed else step.feed / 60.0
        lasts = np.maximum(lengths / speed / counts, turn / self.speeds[1] / counts.sum())[part]
        return np.column_stack([places * self.per_mm, abc + (to - abc) * whole[:, None]]), np.maximum(lasts, 1e-9)

    def _check(self, robot, joints, rows, before):
        """(joints, joints as a row) after pieces; raises CycleError."""
        count = len(self.limits)
        poses = np.concatenate([row[2] for row in rows])
        found = robot.follow(np.column_stack([poses, np.zeros((len(poses), 3))]), joints)[:, :count]
        found = np.vstack([found, np.full((len(poses) - len(found), count), np.nan)])
        seconds = np.concatenate([row[3] for row in rows])
        low, high, fastest = (np.array([limit[k] for limit in self.limits]) for k in range(3))
        first = found[:1] if before is None else before
        with np.errstate(invalid="ignore"):
            speed = np.abs(np.diff(np.vstack([first, found]), axis=0)) / seconds[:, None]
            lost, beyond, fast = (
                ~np.isfinite(found),
                (found < low - SLACK) | (found > high + SLACK),
                speed > FASTER * fastest,
            )
        bad = (lost | beyond | fast).any(axis=1)
        if bad.any():
            k = int(np.argmax(bad))
            row = rows[int(np.searchsorted(np.cumsum([len(row[2]) for row in rows]), k, side="right"))]
            self._refuse(row, poses[k, :3] / self.per_mm, found[k], (lost[k], beyond[k]), speed[k])
        return found[-1], found[-1:]

    def _refuse(self, row, place, joints, wrong, speed):
        """Raise the error of a sample."""
        copy, step, *_ = row
        where = f"line {step.source} of the sub, copy {copy}" if step.source else f"the sub, copy {copy}"
        lost, beyond = wrong
        if lost.any():
            raise CycleError(
                f"{where}: the robot does not reach X{{x}} Y{{y}} Z{{z}} of the machine",
                "move the station nearer, or turn it",
                x=float(place[0]),
                y=float(place[1]),
                z=float(place[2]),
            )
        if beyond.any():
            k = int(np.argmax(beyond))
            low, high, _speed = self.limits[k]
            raise CycleError(
                f"{where}: joint {k} would be at {joints[k]:.2f}, beyond its limit of "
                f"{low if joints[k] < low else high:g}",
                "shift or turn the station, or come from another position",
            )
        k = int(np.argmax(speed / np.array([limit[2] for limit in self.limits])))
        raise CycleError(
            f"{where}: joint {k} would turn at {speed[k]:.4g} per s, more than its {self.limits[k][2]:g}: too fast, or "
            f"near a singularity",
            "shift or turn the station, or use a lower feed",
        )
