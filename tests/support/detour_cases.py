# SPDX-License-Identifier: GPL-2.0-or-later
"""Random cycles among random clamps.  Called by tests/cycles/test_detour.py.  mm."""

import math

import numpy as np

from chipwise.clamps.clamp import Clamp
from chipwise.clib.height_map import Shape
from chipwise.cycles.hole import HoleRequest, hole_plan
from chipwise.cycles.obstacles import Obstacles
from chipwise.cycles.pocket import PocketRequest, pocket_plan
from chipwise.moves import Copy, Line, Rapid
from chipwise.stock.shape_comment import BOX, CYLINDER
from support import clamp_oracle
from support.pocket_random import rectangle

TOOLS = {
    "flat": {"shape": "flat", "diameter": 6.0, "stick_out": 18.0, "holder_diameter": 24.0},
    "ball": {"shape": "ball", "diameter": 8.0},
    "bull": {"shape": "bull", "diameter": 10.0, "corner_radius": 2.0, "stick_out": 15.0, "holder_diameter": 30.0},
    "vee": {"shape": "vee", "diameter": 6.0, "tip_angle": 60.0},
}
REACH = 70.0  # mm, of the axes from the middle


class DetourCase:
    """A plan and clamps: moves, start, plane, keep for Obstacles.clear(); clamps: dicts of support/clamp_oracle.py;
    limit: of the tip's Z."""

    def __init__(self, rng, tool=None):
        self.random, self.tool = rng, TOOLS[tool or rng.choice(list(TOOLS))]
        self.clearance = rng.choice([0.5, 1.0, 2.0])
        self.plane = rng.uniform(2, 8)
        angle, far = rng.uniform(0, 2 * math.pi), rng.uniform(58, 66)
        self.start = (
            far * math.cos(angle),
            far * math.sin(angle),
            self.plane + rng.choice([0.0, 0.0, rng.uniform(0, 20)]),
        )
        self.kind = rng.choice(["hole", "hole", "pocket", "pattern"])
        self.keep = self.kind == "pattern"
        self.moves = getattr(self, "_" + self.kind)()
        self.plane = None if self.keep else self.plane
        self.limit = rng.choice([1000.0, self.start[2] + rng.uniform(0, 10)])
        self.clamps = [self._clamp(angle)] + [self._clamp() for _ in range(rng.randint(1, 7))]
        if rng.random() < 0.5:
            self.clamps += self._fence()
        self._drop_those_at_the_start()

    def words(self):
        """What a replay keeps."""
        return {
            "tool": self.tool,
            "clearance": self.clearance,
            "start": self.start,
            "plane": self.plane,
            "kind": self.kind,
            "limit": self.limit,
            "clamps": self.clamps,
            "moves": [repr(move) for move in self.moves],
        }

    def obstacles(self):
        own = []
        for k, clamp in enumerate(self.clamps):
            half, middle = clamp["half"], clamp["middle"]
            own.append(
                Clamp(
                    CYLINDER if "diameter" in clamp else BOX,
                    clamp["turn"],
                    (middle[0] - half[0], middle[1] - half[1], -20.0),
                    (middle[0] + half[0], middle[1] + half[1], clamp["top"]),
                    f"clamp {k}",
                )
            )
        t = self.tool
        corner = t["diameter"] / 2 if t["shape"] == "ball" else t.get("corner_radius", 0.0)
        shape = Shape(
            t["diameter"], corner, t.get("tip_angle", 0.0), t.get("holder_diameter", 0.0), t.get("stick_out", 0.0)
        )
        limits = {
            "matrix": tuple(map(tuple, np.eye(3).tolist())),
            "shift": (0.0, 0.0, 0.0),
            "limits": (("axis X", -REACH, REACH), ("axis Y", -REACH, REACH), ("axis Z", -200.0, self.limit)),
        }
        return Obstacles(tuple(own), self.clearance, shape, limits)

    def _drop_those_at_the_start(self):
        """So that the tool stands free, as a rule."""
        if self.random.random() < 0.95:

            def hinders(clamp):
                return any(
                    clamp_oracle.grown(self.tool, part, clamp, np.array([self.start]))[0] < self.clearance + 0.1
                    for part in ["tool"] + ["holder"] * ("holder_diameter" in self.tool)
                )

            self.clamps = [clamp for clamp in self.clamps if not hinders(clamp)] or [
                self._box((0.0, 65.0), (1.0, 1.0), 0.0, -10.0)
            ]

    def _clamp(self, angle=None):
        """Beside the cuts, as a rule; angle: where it stands, seen from the middle."""
        rng = self.random
        angle, far = (
            rng.uniform(0, 2 * math.pi) if angle is None else angle,
            rng.uniform(5, 60) if rng.random() < 0.04 else rng.uniform(36, 52),
        )
        middle = far * math.cos(angle), far * math.sin(angle)
        top = rng.choice([rng.uniform(0, 10), rng.uniform(5, 60), rng.uniform(5, 60)])
        if rng.random() < 0.4:
            radius = rng.uniform(2, 10)
            return {"middle": middle, "diameter": 2 * radius, "half": (radius, radius), "turn": 0.0, "top": top}
        return self._box(
            middle, (rng.uniform(1, 25), rng.uniform(1, 6)), rng.choice([0.0, 90.0, rng.uniform(-90, 90)]), top
        )

    def _fence(self):
        """Four walls round the cuts, with a gap or none."""
        rng = self.random
        top, gap, far = rng.uniform(5, 60), rng.choice([0, 0, 10, 20]), rng.uniform(44, 50)
        sides = [
            ((far, 0.0), (1.0, far - gap)),
            ((-far, 0.0), (1.0, far)),
            ((0.0, far), (far, 1.0)),
            ((0.0, -far), (far, 1.0)),
        ]
        return [self._box(middle, half, 0.0, top) for middle, half in sides]

    @staticmethod
    def _box(middle, half, turn, top):
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        corners = [
            (middle[0] + x * c - y * s, middle[1] + x * s + y * c)
            for x, y in ((-half[0], -half[1]), (half[0], -half[1]), half, (-half[0], half[1]))
        ]
        return {"corners": corners, "middle": middle, "half": half, "turn": turn, "top": top}

    def _hole(self):
        rng, tool = self.random, self.tool["diameter"] / 2
        return hole_plan(
            HoleRequest(
                x=rng.uniform(-5, 5),
                y=rng.uniform(-5, 5),
                bottom=rng.uniform(-6, -1),
                clearance=self.plane,
                radius=tool + rng.uniform(1, 8),
                ccw=rng.random() < 0.5,
                tool_radius=tool,
                feed=600.0,
                plunge_feed=300.0,
                start=self.start,
                chop_size=rng.choice([0.0, 5.0]),
            )
        ).moves

    def _pocket(self):
        """Of two outlines: with a link between them."""
        rng = self.random
        loops = [rectangle(x - 8, -8, x + 8, 8) for x in (-12 - rng.uniform(0, 3), 12 + rng.uniform(0, 3))]
        return pocket_plan(
            PocketRequest(
                loops=tuple(loops),
                bottom=-2.0,
                clearance=self.plane,
                tool_radius=self.tool["diameter"] / 2,
                step=self.tool["diameter"] * 0.6,
                feed=600.0,
                plunge_feed=300.0,
                start=self.start,
            )
        ).moves

    def _pattern(self):
        """A sub of its own and two copies; traverses may go in all three axes at once."""
        rng, found, first = self.random, [], None
        for turn in range(3):
            angle = 2 * math.pi * turn / 3
            if first is None:
                first = [
                    (Rapid, rng.uniform(0, 20), rng.uniform(-10, 10), self.plane),
                    (Rapid, rng.uniform(5, 25), 0.0, self.plane),
                ]
                first += [(Line, *first[-1][1:3], -2.0), (Line, rng.uniform(5, 25), rng.uniform(-10, 10), -2.0)]
                first.append((Rapid, *first[-1][1:3], self.plane))
            c, s = math.cos(angle), math.sin(angle)
            places = [(x * c - y * s, x * s + y * c, z) for _kind, x, y, z in first]
            own = tuple(
                kind(*place, **({"feed": 600.0} if kind is Line else {})) for (kind, *_), place in zip(first, places)
            )
            found += own if not found else [Copy(own, np.array([(*place, 0.0, 0.0, 0.0) for place in places]))]
        return tuple(found)
