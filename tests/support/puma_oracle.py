# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tip of the simulated robot is, from its joints: a chain of rotations and shifts, nothing of LinuxCNC's
formulas.

The arm of hal/robot.hal: J0 about Z; J1 about the arm's Y, 300 mm of upper arm; J2 about the same direction, forearm of
400 mm, 50 mm off; then the wrist's three rotations, and 70 mm to the tip.  With all joints 0 the upper arm is level
along X and the forearm hangs down.
"""

import numpy as np

A2, A3, D3, D4, D6 = 300.0, 50.0, 70.0, 400.0, 70.0


def about(axis, degrees):
    """Rotation matrix about x, y or z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    k = "xyz".index(axis)
    found = np.eye(3)
    i, j = (k + 1) % 3, (k + 2) % 3
    found[i, i] = found[j, j] = c
    found[i, j], found[j, i] = -s, s
    return found


def tip(joints):
    """(position (3,), rotation of the tool (3, 3)) from six joints in degrees."""
    q = list(joints)
    arm = about("z", q[0])
    upper = arm @ about("y", q[1])
    fore = upper @ about("y", q[2])
    wrist = arm @ (0, D3, 0) + upper @ (A2, 0, 0) + fore @ (A3, 0, -D4)
    tool = fore @ about("x", 180.0) @ about("z", q[3]) @ about("y", -q[4]) @ about("z", q[5])
    return wrist + tool @ (0, 0, D6), tool
