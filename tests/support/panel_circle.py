# SPDX-License-Identifier: GPL-2.0-or-later
"""A circle that a machine traces while a page looks seldom, and how far what is drawn is from it."""

import numpy as np

PERIOD_S = 0.001


def circle(radius, velocity, centre=(30.0, 20.0, 1.0)):
    """Where the tip is in each period of a full turn from +X, (n, 3) mm."""
    count = round(2 * np.pi * radius / velocity / PERIOD_S)
    turn = np.linspace(0.0, 2 * np.pi, count + 1)
    return np.column_stack(
        [centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn), np.full(count + 1, centre[2])]
    )


def off_circle(points, radius, centre=(30.0, 20.0)):
    """Largest distance of a polyline, between its points too, from the circle, mm."""
    points = np.asarray(points, float)[:, :2] - centre[:2]
    share = np.linspace(0.0, 1.0, 201)[:, None, None]
    along = points[:-1] + share * (points[1:] - points[:-1])
    return float(np.abs(np.hypot(along[..., 0], along[..., 1]) - radius).max())
