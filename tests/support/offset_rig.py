# SPDX-License-Identifier: GPL-2.0-or-later
"""axis_offset.c in a loop with offset_planner.py.  mm, s."""

import ctypes as C

import numpy as np

from chipwise.clib import core, layout
from support.offset_planner import PERIOD_S, Planner
from support.tracer_rig import filled

STATE, FAULT = layout.AxisOffsetState, layout.AxisOffsetFault
SETTINGS = dict(
    acceleration_mm_s2=(450, 450, 450),
    max_vel_mm_s=(90, 90, 90),
    count_mm=1e-6,
    clear_vel_mm_s=20.0,
    max_astray_mm=5e-4,
    max_behind_mm=1.0,
    contact_mm=0.3,
)


class Rig:
    """Axes at offset 0; `planner` is the one of LinuxCNC, whose settings may differ."""

    def __init__(self, planner=None, **settings):
        self.settings = filled(layout.AxisOffsetSettings, {**SETTINGS, **settings})
        self.planner = planner or Planner(
            SETTINGS["acceleration_mm_s2"], SETTINGS["max_vel_mm_s"], SETTINGS["count_mm"]
        )
        self.axes, self.out, self.given = layout.AxisOffset(), layout.AxisOffsetOut(), layout.AxisOffsetIn()
        core.library().chip_axis_offset_init(C.byref(self.axes))
        self.given.has_request, self.given.has_permit, self.given.has_machine, self.given.period_s = 0, 1, 1, PERIOD_S
        self.offsets, self.velocities, self.states, self.leads = [], [], [], []
        self.run(3)

    def signals(self, **values):
        """request, permit, machine, clear; underscores as in the structure."""
        for name, value in values.items():
            setattr(self.given, {"clear": "wants_clear"}.get(name, "has_" + name), value)
        if "machine" in values:
            self.planner.switch(bool(values["machine"]))

    def step(self, position=None, deflection=0.0):
        """One servo period: LinuxCNC, then the core."""
        self.planner.step(list(self.out.counts))
        if position is not None:
            self.given.position_mm[:] = [float(x) for x in position]
        self.given.deflection_mm = deflection
        self.given.offset_mm[:], self.given.requested_mm[:] = list(self.planner.offset), list(self.planner.request)
        core.library().chip_axis_offset_step(
            C.byref(self.axes), C.byref(self.settings), C.byref(self.given), C.byref(self.out)
        )
        self.offsets.append(self.planner.offset.copy())
        self.velocities.append(self.planner.velocity.copy())
        self.states.append((self.out.state_number, self.out.fault_number))
        self.leads.append(self.out.lead_mm)

    def run(self, periods, position=None, deflection=0.0):
        for _ in range(periods):
            self.step(position, deflection)

    def follow(self, positions):
        """A rising edge of request, then positions (n, 3), a row a period; -> offsets (n, 3)."""
        self.signals(request=1)
        self.step(positions[0])
        begin = len(self.offsets)
        for position in positions:
            self.step(position)
        return np.array(self.offsets[begin:])

    def changes(self):
        """Largest change of velocity, mm/s2, that LinuxCNC has made."""
        return float(np.abs(np.diff(np.array(self.velocities), axis=0)).max() / PERIOD_S)
