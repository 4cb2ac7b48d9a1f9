# SPDX-License-Identifier: GPL-2.0-or-later
"""A machine before clamps: paths as LinuxCNC's planner travels them, and the core's guard that may stop it.  Called by
tests/core/test_clamp_guard.py.

mm, s.  A path is a list of pieces, dict of kind line (start, end) or arc (centre, start, angle, rise), join (how its
end is left).  The planner accelerates and brakes with `accel`, in a parabola both pieces at once; it brakes LATE
periods after the guard says so.
"""

import copy
import ctypes as C
import math

import numpy as np

from chipwise.clib import layout
from chipwise.clib.library import library

STOP, TANGENT, PARABOLIC = 0, 1, 2
PERIOD = 0.001
LATE = 2  # periods from the stop to the first step that is shorter


def point(piece, s):
    """Place (x, y, z) on a piece, s mm from its start."""
    (x, y, z), share = piece["start"], s / piece["length"]
    if piece["kind"] == "line":
        to = piece["end"]
        return x + (to[0] - x) * share, y + (to[1] - y) * share, z + (to[2] - z) * share
    c, sine, (mx, my) = math.cos(piece["angle"] * share), math.sin(piece["angle"] * share), piece["centre"]
    x, y = x - mx, y - my
    return mx + x * c - y * sine, my + x * sine + y * c, z + piece["rise"] * share


def measured(piece):
    """The piece with its length."""
    if piece["kind"] == "line":
        return {**piece, "length": math.dist(piece["start"], piece["end"])}
    radius = math.hypot(piece["start"][0] - piece["centre"][0], piece["start"][1] - piece["centre"][1])
    return {**piece, "length": math.hypot(radius * piece["angle"], piece["rise"])}


class Planner:
    """Travels the pieces; at: (number of the piece, mm on it, mm on the next one in a blend)."""

    def __init__(self, pieces, velocity, accel):
        self.pieces, self.velocity, self.accel = pieces, velocity, accel
        self.number, self.s, self.next_s, self.v, self.next_v = 0, 0.0, 0.0, 0.0, 0.0

    def to_stop(self):
        """mm to the next place where it stops, or has to begin a blend."""
        left = -self.s
        for piece in self.pieces[self.number :]:
            left += piece["length"]
            if piece["join"] != TANGENT:
                break
        return left

    def blends(self):
        piece = self.pieces[self.number]
        return (
            piece["join"] == PARABOLIC
            and self.number + 1 < len(self.pieces)
            and self.to_stop() <= self.v * self.v / (2 * self.accel) + 1e-9
        )

    def step(self, stops):
        """A period; -> whether it still moves."""
        a = self.accel * PERIOD
        if self.next_v or self.blends():
            self.v = max(self.v - a, 0.0)
            self.next_v = max(self.next_v - a, 0.0) if stops else min(self.next_v + a, self.velocity)
            self.next_s += self.next_v * PERIOD
            self.s += self.v * PERIOD
            if self.v == 0.0 and not stops:
                self.number, self.s, self.v, self.next_s, self.next_v = (
                    self.number + 1,
                    self.next_s,
                    self.next_v,
                    0.0,
                    0.0,
                )
            return self.v > 0 or self.next_v > 0
        left = self.to_stop()
        may = (
            math.sqrt(2 * self.accel * max(left - self.v * PERIOD, 0.0))
            if self.pieces[self.number]["join"] != PARABOLIC
            else self.velocity
        )
        self.v = max(self.v - a, 0.0) if stops else max(min(self.v + a, self.velocity, max(may, a)), 0.0)
        self.s += min(self.v * PERIOD, left)
        while self.s >= self.pieces[self.number]["length"] - 1e-12:
            over = self.s - self.pieces[self.number]["length"]
            if self.pieces[self.number]["join"] == STOP:
                self.v, over = 0.0, 0.0
            if self.number + 1 == len(self.pieces):
                self.s = self.pieces[self.number]["length"]
                return False
            self.number, self.s = self.number + 1, over
        return self.v > 0 or not stops

    @property
    def tip(self):
        here = self.pieces[self.number]
        tip = point(here, min(self.s, here["length"]))
        if self.next_s:
            following = self.pieces[self.number + 1]
            tip = tuple(
                at + (there - begun) for at, there, begun in zip(tip, point(following, self.next_s), following["start"])
            )
        return tip


class Guard:
    """The core: table of clamps, tool, path."""

    def __init__(self, clamps, clearance, tool, pieces, accel, knows_path=True):
        self.lib, self.clamps, self.path, self.into = library(), layout.Clamps(), layout.Path(), layout.ClampIn()
        table = layout.ClampTable(generation=2, count=len(clamps), clearance=clearance)
        for put, clamp in zip(table.clamp, clamps):
            put.x, put.y, put.half_x, put.half_y, put.top, put.is_round = (
                *clamp["middle"],
                *clamp["half"],
                clamp["top"],
                int("diameter" in clamp),
            )
            put.cosine, put.sine = math.cos(clamp["turn"]), math.sin(clamp["turn"])
        self.taken = self.lib.chip_clamps_take(self.clamps, C.byref(table))
        shape, self.cutter = tool["shape"], layout.Tool()
        corner = {
            "ball": tool["diameter"] / 2,
            "bull": tool["corner_radius"],
            "tapered-ball": tool["corner_radius"],
        }.get(shape, 0.0)
        assert (
            self.lib.chip_tool_init(
                self.cutter,
                tool["diameter"],
                corner,
                tool["tip_angle"] if shape in ("vee", "tapered-ball") else 0.0,
                0.0,
            )
            == 0
        )
        self.lib.chip_clamps_build(self.clamps, self.cutter, tool["stick_out"], tool["holder_diameter"])
        self.into.period_s, self.into.acceleration_mm_s2 = PERIOD, accel
        self.pieces, self.knows_path, self.most_work = pieces, knows_path, 0
        self.lib.chip_path_reset(self.path)
        self.lib.chip_path_follow(self.path, 1, pieces[0]["length"], 0.0)
        for key, piece in enumerate(pieces, 1):
            segment, vec = layout.Segment(), C.c_double * 3
            if piece["kind"] == "line":
                made = self.lib.chip_segment_line(segment, vec(*piece["start"]), vec(*piece["end"]))
            else:
                made = self.lib.chip_segment_arc(
                    segment, (C.c_double * 2)(*piece["centre"]), vec(*piece["start"]), piece["angle"], piece["rise"]
                )
            assert made
            segment.accel, segment.join = accel, piece["join"]
            self.lib.chip_path_append(self.path, key, segment)

    def look(self, planner, before, tip):
        """A period of the machine, from a place of the tip to the next one; -> whether it has to stop."""
        self.into.to[:], self.into.__getattribute__("from")[:] = tip, before
        if self.knows_path:
            piece = self.pieces[planner.number]
            self.lib.chip_path_follow(self.path, planner.number + 1, piece["length"], min(planner.s, piece["length"]))
            self.into.path = C.addressof(self.path)
        else:
            self.into.distance_to_go_mm = self.pieces[planner.number]["length"] - planner.s
        self.into.current_vel_mm_s = planner.v + planner.next_v
        hit = self.lib.chip_clamps_check(self.clamps, self.into)
        self.most_work = max(self.most_work, self.clamps.work)
        return hit


def run(pieces, velocity, accel, guard=None, most=20000):
    """-> (places (n, 3) of the tip in each period, number of the place at which it had to stop or None)."""
    _free, places, stop_at = both(pieces, velocity, accel, guard, most)
    return places, stop_at


def both(pieces, velocity, accel, guard=None, most=20000):
    """-> (places (n, 3) of the tip in each period if nothing stops it, those with the guard, number of the place at
    which it had to stop or None).  They are the same up to the first period that is braked."""
    planner, stop_at, braked = Planner(pieces, velocity, accel), None, None
    free, goes = [planner.tip], True
    while goes and len(free) < most:
        if stop_at is not None and braked is None and len(free) >= stop_at + LATE:
            braked = [*free, *stopped(copy.copy(planner), most - len(free))]
        goes = planner.step(False)
        free.append(planner.tip)
        if stop_at is None and guard and guard.look(planner, *free[-2:]):
            stop_at = len(free) - 1
    return np.array(free), np.array(free if braked is None else braked), stop_at


def stopped(planner, most):
    """Places of a planner that brakes from now on."""
    places, goes = [], True
    while goes and len(places) < most:
        goes = planner.step(True)
        places.append(planner.tip)
    return places
