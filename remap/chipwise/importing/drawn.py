# SPDX-License-Identifier: GPL-2.0-or-later
"""What is read of a drawing: curves by layer, and what was left out.  Made by dxf.py and svg.py, read by join.py and
run.py.  mm."""

import math
from collections import Counter
from dataclasses import dataclass, field

from chipwise.errors import CycleError, braceless
from chipwise.geometry.base.contour import ArcElement, LineElement

MAX_PARTS = 100_000  # as many moves as a contour sub may make
FAR_MM = 1e5  # no drawing has larger coordinates


class Unreadable(CycleError):
    """A drawing that cannot be used."""


@dataclass
class Drawn:
    """curves: {layer: [[part, ..], ..]}, each a connected chain of LineElement and ArcElement, mm; left: what was left
    out, counted by name; words: sentences about unit and place; deviation: mm by which fitted arcs differ at most."""

    curves: dict = field(default_factory=dict)
    left: Counter = field(default_factory=Counter)
    words: list = field(default_factory=list)
    deviation: float = 0.0
    count: int = 0

    def add(self, layer, parts):
        """A connected chain of parts."""
        parts = [part for part in parts if _long(part)]
        if not parts:
            return
        check_near(layer, (point for part in parts for point in (part.start, part.end)))
        self.count += len(parts)
        if self.count > MAX_PARTS:
            raise Unreadable(
                f"the drawing has more than {MAX_PARTS} lines and arcs",
                "export the layer that is to be cut, or use --layer",
            )
        self.curves.setdefault(layer, []).append(parts)

    def refuse_other_layers(self, layer, others):
        """Raise Unreadable if nothing is drawn on the layer that was asked for; others: layers on which something
        is."""
        if others and not self.curves:
            raise Unreadable(
                f"nothing is drawn on layer {braceless(layer)}",
                f"use --layer with one of {braceless(', '.join(sorted(others)[:8]))}",
            )


def check_near(layer, points):
    """Raise Unreadable for a point (x, y) mm that no drawing has: curves out there would need points without end."""
    if not all(abs(v) < FAR_MM for point in points for v in point):  # NaN, too
        raise Unreadable(
            f"a coordinate on layer {braceless(layer)} is not within 100 m of the origin",
            "correct the drawing, or use --scale",
        )


def _long(part):
    return hasattr(part, "centre") or math.dist(part.start, part.end) > 1e-6


def line(start, end):
    """A line between two points."""
    return LineElement(_point(start), _point(end), 0)


def arc(start, end, centre, ccw):
    """An arc; equal ends are a full circle."""
    return ArcElement(_point(start), _point(end), _point(centre), bool(ccw), 0)


def _point(place):
    return float(place[0]), float(place[1])
