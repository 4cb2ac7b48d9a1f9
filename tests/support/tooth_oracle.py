# SPDX-License-Identifier: GPL-2.0-or-later
"""What the edges of an end mill meet, tooth by tooth, in a stock that is known exactly.

Called by tests/core/test_tooth*.py.  It knows no cells, no bands, no samples and no tooth load: the stock is a box with
slots, each the place of a disc along a path, and an edge is a point of the tool's circle at one angle of many.  Helix
and run-out are 0.  h = fz cos(angle from the heading), F = kc11 b h^(1 - mc) along the edge's path, and RADIAL of it
away from the stock.
"""

import math

import numpy as np

from chipwise.clib import core, layout

PERIOD, ACCEL = 0.001, 500.0  # s, mm/s2
ANGLES = np.radians(np.arange(-90.0, 90.01, 0.5))
RADIAL = 0.3  # Tlusty and MacNeil 1975
Z = -3.0  # mm, of every pass beside()


class Plane:
    """The stock: a box -60..60 whose top is 0; cuts [(points (n, 2) mm of a path, radius mm, z mm)]."""

    def __init__(self, right=60.0):
        self.cuts, self.right = [], right

    def cut(self, points, radius, z):
        self.cuts.append((np.asarray(points, float), radius, z))

    def height(self, points, z):
        """Stock above z at points (n, 2), mm."""
        top = np.where(
            (np.abs(points[:, 1]) <= 60.0) & (points[:, 0] >= -60.0) & (points[:, 0] <= self.right), 0.0, -1e9
        )
        for path, radius, depth in self.cuts:
            a, ab = path[:-1, :, None], np.diff(path, axis=0)[:, :, None]  # (segments, 2, 1)
            off = points.T[None] - a
            t = np.clip(np.sum(off * ab, axis=1) / np.maximum(np.sum(ab * ab, axis=1), 1e-12), 0.0, 1.0)
            near = np.min(np.hypot(*np.moveaxis(off - t[:, None] * ab, 1, 0)), axis=0)
            top = np.where(near < radius, np.minimum(top, depth), top)
        return np.clip(top - z, 0.0, None)

    def met(self, at, heading, radius, z):
        """Depth at each of ANGLES from the heading, mm."""
        angle = heading + ANGLES
        return self.height(np.column_stack([at[0] + radius * np.cos(angle), at[1] + radius * np.sin(angle)]), z)


def chip_and_torque(depth, radius, per_tooth, flutes, kc11, mc):
    """Largest chip, mm, and the mean torque of a revolution, Nm, of depths at ANGLES and a feed per tooth."""
    chip = per_tooth * np.cos(ANGLES)
    touched = depth > 1e-6
    force = kc11 * depth * np.clip(chip, 0.0, None) ** (1.0 - mc)  # N of an edge at that angle
    mean = flutes * float(np.sum(force)) * (ANGLES[1] - ANGLES[0]) / (2.0 * math.pi)  # of all edges, at any moment
    return float(chip[touched].max()) if touched.any() else 0.0, mean * radius / 1000.0


def side_force(depth, per_tooth, flutes, kc11, mc):
    """The largest force of a revolution on the tool, N, and the length of its mean vector, of depths at ANGLES: edge by
    edge, each along its path and away from the stock, summed up at every angle of the first one."""
    one = kc11 * depth * (per_tooth * np.clip(np.cos(ANGLES), 0.0, None)) ** (1.0 - mc)
    vectors = np.concatenate((one * np.exp(1j * ANGLES) * (1j + RADIAL), np.zeros(359)))  # all round, 0.5 degrees
    edges = vectors.reshape(flutes, -1).sum(axis=0)  # at the same moment
    return float(np.abs(edges).max()), float(np.abs(edges.mean()))


def beside(diameter, share, angle, length=25.0):
    """A pass that leaves `share` of the diameter beside a slot of the same tool."""
    plane, along = Plane(), np.array([math.cos(angle), math.sin(angle)])
    plane.cut([-80.0 * along, 80.0 * along], 0.5 * diameter, Z)
    begin = np.array([-along[1], along[0]]) * diameter * share - 0.5 * length * along
    return plane, [core.line((*begin, Z), (*(begin + length * along), Z))]


def anywhere(rng, cell, inner, depth):
    """(stock, place, direction): stock that begins `inner` mm beside a path through a random place, and is cut away to
    below `depth` on the other side; the tool is near the middle of a cell or not, and goes in any direction."""
    angle, place = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(-3.0, 3.0, 2) * cell
    along, aside = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), cell)
    begin = place + aside * (inner - 50.0)
    core.Cutter(stock, core.Tool(100.0), (*(begin - 60.0 * along), -depth - 1.0)).to(
        (*(begin + 60.0 * along), -depth - 1.0)
    )
    return stock, place, along


class Limits:
    """Chip mm, power W, torque Nm, side force N, 0: none; the spindle 1/s, edges; the material."""

    def __init__(self, chip=0.0, power=0.0, torque=0.0, rps=200.0, flutes=3, kc11=800.0, mc=0.25, force=0.0):
        self.force = force
        self.chip, self.power, self.torque, self.rps, self.flutes, self.kc11, self.mc = (
            chip,
            power,
            torque,
            rps,
            flutes,
            kc11,
            mc,
        )

    def into(self, values):
        values.max_chip_mm, values.max_power_w, values.max_torque_nm = self.chip, self.power, self.torque
        values.max_force_n, values.tool_stiffness_n_mm = self.force, 1000.0
        values.spindle_speed_rps, values.flutes = self.rps, self.flutes
        values.specific_force_n_mm2, values.force_exponent_mc = self.kc11, self.mc
        return values


class Drive:
    """A tool that cuts along a path while the core commands its feed; the planner brakes with ACCEL and follows an
    override a period late."""

    def __init__(self, plane, diameter, z, limits, cell=0.25, ceiling=60.0, target=1e9, override=1.0, limited=True):
        self.plane, self.z, self.limits, self.ceiling, self.target = plane, z, limits, ceiling, target
        self.override, self.limited = override, limited
        self.tool = core.Tool(diameter)
        self.stock = core.Stock((-60.0, -60.0, -12.0), (plane.right, 60.0, 0.0), cell)
        for path, radius, depth in plane.cuts:
            cutter = core.Cutter(self.stock, core.Tool(2.0 * radius), (*path[0], depth))
            for point in path[1:]:
                cutter.to((*point, depth))
        # (chip mm, torque Nm, velocity mm/s, limited-by, chip and power as told, largest and mean side force N, both
        # as told)
        self.seen = []

    def feed(self, profile, velocity, last_velocity, scale):
        values = self.limits.into(layout.FeedIn())
        values.feed_mode, values.mrr_target_mm3_s, values.motion = (
            layout.FeedMode.CONSTANT,
            self.target,
            layout.MOTION_FEED,
        )
        values.programmed_vel_mm_s = values.requested_vel_mm_s = self.ceiling
        values.acceleration_mm_s2, values.period_s, values.is_trusted = ACCEL, PERIOD, 1
        values.feed_override_share = self.override
        values.section_area_mm2, values.current_vel_mm_s = profile.area, velocity
        values.current_accel_mm_s2 = (velocity - last_velocity) / PERIOD
        for i in range(profile.steps):
            step = profile.step[i]
            values.load_distance_mm[i], values.load_area_mm2[i], values.load_accel_mm_s2[i] = (
                step.distance,
                step.area,
                step.accel,
            )
        for i in range(profile.tooth_steps):
            step = profile.tooth_step[i]
            values.tooth_distance_mm[i], values.tooth_load_per_mm[i] = step.distance, step.area
            values.tooth_accel_mm_s2[i], values.tooth_limit[i] = step.accel, step.limit
        values.chip_share_now, values.power_root_now = profile.chip, profile.power
        values.force_root_now, values.force_mean_share_now = profile.force, profile.force_mean
        return core.feed(values, scale), core.tooth_law(values)

    def go(self, segments):
        """Cut along segments of core.line and core.arc that join smoothly; notes each period."""
        look = core.Lookahead(self.stock, self.tool)
        lengths = [segment.length for segment in segments]
        ends = np.cumsum(lengths)
        for segment in segments:
            segment.accel = ACCEL
        start = tuple(segments[0].origin)
        cutter = core.Cutter(self.stock, self.tool, start)
        at, s, velocity, last, scale, weights = start, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
        track, path = [start[:2]], look.path
        while s < ends[-1] - 1e-3:
            change = ACCEL * PERIOD
            stop = math.sqrt(max(0.0, 2.0 * ACCEL * (ends[-1] - s)))
            wanted = max(min(self.ceiling * scale * self.override, stop), 0.02)
            velocity, last = min(max(wanted, velocity - change), velocity + change), velocity
            s = min(s + velocity * PERIOD, ends[-1])
            k = min(int(np.searchsorted(ends, s, "right")), len(segments) - 1)
            begin = ends[k] - lengths[k]
            path.follow(k + 1, lengths[k], s - begin)
            for i in range(k + path.c.count, len(segments)):
                path.append(i + 1, segments[i])
            tip, heading, _curvature = path.at(path.c.s)
            look.limit(*weights[:2], self.limits.mc, weights[2], self.limits.flutes)
            look.step(at, tip, PERIOD, 20.0)
            cutter.to(tip)
            out, law = self.feed(look.profile(20.0), velocity, last, scale)
            weights = (
                (law.chip_weight_per_mm, law.power_weight_per_mm, law.force_weight_per_mm)
                if self.limited
                else (0.0, 0.0, 0.0)
            )
            scale, at = out.scale, tip
            self._note(tip, heading, velocity, out, law)
            track.append(tip[:2])
        self.plane.cut(track[::5] + [track[-1]], self.tool.radius, self.z)
        return np.array(self.seen)

    def _note(self, tip, heading, velocity, out, law):
        """A row of `seen`."""
        depth = self.plane.met(tip, math.atan2(heading[1], heading[0]), self.tool.radius, self.z)
        per_tooth = velocity / (self.limits.rps * self.limits.flutes)
        self.seen.append(
            (
                *chip_and_torque(
                    depth, self.tool.radius, per_tooth, self.limits.flutes, self.limits.kc11, self.limits.mc
                ),
                velocity,
                out.limit,
                law.chip_mm,
                law.power_w,
                *side_force(depth, per_tooth, self.limits.flutes, self.limits.kc11, self.limits.mc),
                law.side_force_n,
                law.mean_force_n,
            )
        )


def means(values, count=10):
    """Means over so many periods."""
    return np.convolve(values, np.ones(count) / count, "valid")
