# SPDX-License-Identifier: GPL-2.0-or-later
"""The tracer's core in a loop with the model of its stylus, through the shared library.

All lengths mm, times s; rows are periods of PERIOD_S.
"""

import ctypes as C

import numpy as np

from chipwise.clib import core, layout

PERIOD_S = 0.001
ROW = np.dtype(layout.TracerRow)
FAR = 1000.0
STATE, FAULT, LIMIT, SURFACE = layout.TracerState, layout.TracerFault, layout.TracerLimit, layout.StylusSurface
MODE = layout.TracerMode

SETTINGS = dict(
    mode_number=MODE.BOTH_WAYS,
    scan_axis_number=0,
    direction_sign=1,
    feed_mm_s=1000 / 60,
    approach_vel_mm_s=10.0,
    return_vel_mm_s=50.0,
    max_vel_mm_s=200.0,
    acceleration_mm_s2=2000.0,
    gain_hz=1000.0,
    deflection_mm=0.3,
    range_mm=1.5,
    dead_time_s=0.0,
    drive_time_s=0.0,
    max_jump_mm=0.5,
    friction_share=0.0,
    pick_mm=0.0,
    retract_mm=2.0,
    search_mm=100.0,
    lost_mm=20.0,
    approach_dir=(0, 0, -1),
    window_min_mm=(-20, -20, -FAR),
    window_max_mm=(20, 20, FAR),
    soft_min_mm=(-FAR,) * 3,
    soft_max_mm=(FAR,) * 3,
)
MODEL = dict(
    surface_number=SURFACE.PLANE,
    at_mm=(0, 0, 0),
    normal=(0, 0, 1),
    size_mm=10.0,
    angle_deg=90.0,
    ball_mm=1.0,
    friction_share=0.15,
    noise_mm=0.0,
    delay_periods=0,
)


def filled(structure, values):
    """A ctypes structure with the named members; sequences go into arrays."""
    made = structure()
    for name, value in values.items():
        if name == "height_mm":
            continue
        if isinstance(value, (tuple, list, np.ndarray)):
            getattr(made, name)[:] = [float(one) for one in value]
        else:
            setattr(made, name, value)
    return made


class Rig:
    """A head at `at` (mm) above a model; settings and model as in SETTINGS and MODEL, changed by name."""

    def __init__(self, at, model=None, **settings):
        self.settings = filled(layout.TracerSettings, {**SETTINGS, **settings})
        self.model = filled(layout.StylusSettings, {**MODEL, **(model or {})})
        self.heights = np.ascontiguousarray((model or {}).get("height_mm", np.zeros((2, 2))), np.float32)
        self.model.height_mm = self.heights.ctypes.data
        self.model.ny, self.model.nx = self.heights.shape
        self.tracer, self.stylus, self.p = layout.Tracer(), layout.Stylus(), (C.c_double * 3)(*at)
        core.library().chip_tracer_init(C.byref(self.tracer))
        self.rows, self.feed_share = np.zeros(0, ROW), 1.0

    def run(self, seconds, enabled=1):
        """-> rows of these periods, ROW."""
        count = round(seconds / PERIOD_S)
        rows = np.zeros(count, ROW)
        core.library().chip_tracer_loop(
            C.byref(self.tracer),
            C.byref(self.settings),
            C.byref(self.stylus),
            C.byref(self.model),
            self.p,
            C.c_double(PERIOD_S),
            enabled,
            C.c_double(self.feed_share),
            C.c_long(count),
            rows.ctypes.data_as(C.c_void_p),
        )
        self.rows = np.concatenate([self.rows, rows])
        return rows

    def until(self, *states, seconds=60.0):
        """Run until one of the states; -> all rows up to there."""
        for _ in range(round(seconds / 0.1)):
            rows = self.run(0.1)
            if np.isin(rows["state"], states).any():
                break
        end = np.flatnonzero(np.isin(self.rows["state"], states))
        return self.rows[: end[0] + 1] if len(end) else self.rows


def error(rows, settings=SETTINGS):
    """| eps - eps0 | of rows, mm, as it was."""
    return np.abs(np.linalg.norm(rows["deflection_mm"], axis=1) - settings["deflection_mm"])


def tracing(rows, settle_s=0.0):
    """The rows in TRACE, without the first `settle_s` of the first one."""
    at = np.flatnonzero(rows["state"] == STATE.TRACE)
    return rows[at[round(settle_s / PERIOD_S) :]]
