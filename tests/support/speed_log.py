# SPDX-License-Identifier: GPL-2.0-or-later
"""The servo-rate log of a run as path, speed and kind of motion.  Called by bench/bench_time.py, bench/bench_claims.py
and test_fine_model.py."""

import numpy as np

KEEP_MM = 0.05  # the path is judged in steps of this
TURN = 0.03  # rad, and wherever it turns by more
FEEDS = (2, 3)


class Log:
    """A run: tips (n, 3) mm, path (n,) mm travelled, speed (n,) mm/s of the step that ends there."""

    def __init__(self, path):
        with np.load(path) as stored:
            data = {key: stored[key] for key in stored.files}
        self.period, unit = float(data["period"]), float(data["units_per_mm"])
        tips = np.column_stack([data["x"], data["y"], data["z"] - data["tool_offset_z"]]) / unit
        ticks = np.diff(data["sample"], prepend=data["sample"][0] - 1)
        self.tips, self.line, self.motion = tips, data["line"], data["motion_type"]
        step = np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1)
        self.toolpath, self.took = np.cumsum(step), ticks * self.period
        self.speed = step / self.took
        self.feeding = np.isin(self.motion, FEEDS)
        self.held = self.feeding & (data["rate_target"] > 0)
        self.scale = data["adaptive_feed"]
        self.limited = data["limited_by"]
        self.area = data["section_area"]
        self.removed = float(data["removed_volume"][-1])

    def places(self):
        """Rows in steps of KEEP_MM, and where the path turns, turns back or the kind of motion changes."""
        keep, heading, before = [0], np.zeros(3), 0  # `before`: the last row that moved
        for i in range(1, len(self.toolpath)):
            own = self.tips[i] - self.tips[before]
            if not own.any():
                continue
            if before != keep[-1] and heading @ own < np.cos(TURN) * np.sqrt(own @ own):
                keep.append(before)
            step = self.tips[i] - self.tips[keep[-1]]
            length = float(np.sqrt(step @ step))
            if keep[-1] == before:
                heading = step / length
            if length >= KEEP_MM or self.motion[i] != self.motion[i - 1]:
                keep.append(i)
            before = i
        if keep[-1] != len(self.toolpath) - 1:
            keep.append(len(self.toolpath) - 1)
        return np.array(keep)
