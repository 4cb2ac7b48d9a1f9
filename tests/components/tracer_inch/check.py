# SPDX-License-Identifier: GPL-2.0-or-later
"""tracer_slope's check on lengths turned into mm."""

from support.halrig import SCENES, load_module

slope = load_module(SCENES / "tracer_slope/check.py")
LENGTHS = ("pos_x", "pos_z", "ball_x", "ball_z", "slave_x", "slave_z", "true_deflection")


def check(trace):
    slope.check(trace.but(**{name: lambda d: 25.4 * d for name in LENGTHS}))


SABOTAGE = {
    "deflection in mm": lambda t: t.but(true_deflection=lambda d: 25.4 * d),
    "position in mm": lambda t: t.but(pos_x=lambda d: 25.4 * d),
    "slave in mm": lambda t: t.but(slave_z=lambda d: 25.4 * d),
}
