# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/limits.svg: the feed that each limit allows over the width of cut, from closed forms.

    /usr/bin/python3 tools/pictures/limits.py

A flat end of 10 mm with 4 edges at 12,000 1/min, 5 mm deep in 6061: fz sin(phi) chips, Kienzle's force, edges straight
and evenly spaced, pushed off the stock with RADIAL of the force along their path.
"""

import math
from pathlib import Path

import numpy as np

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
WIDTH, HEIGHT, LEFT, TOP = 760, 380, 66, 20  # px
MOST = 4000.0  # mm/min, of the axis

RADIUS, DEPTH, EDGES, TURNS = 5.0, 5.0, 4, 200.0  # mm, mm, -, 1/s
KC11, MC, RADIAL = 800.0, 0.25, 0.3
RATE, CHIP, POWER, FORCE = 40.0, 0.0262, 1520.0, 275.0  # cm3/min, mm, W, N
CURVES = (
    ("rate", "#06c", f"rate {RATE:g} cm3/min"),
    ("chip", "#c40", f"largest chip {CHIP:.3f} mm"),
    ("power", "#182", f"power {POWER:g} W"),
    ("force", "#82a", f"side force {FORCE:g} N"),
)


def allowed(share):
    """{limit: mm/min} in a pass of this share of the diameter, from one side."""
    angle = np.radians(np.arange(0.125, 360.0, 0.25))  # from the side of the stock to the heading and beyond
    end = math.acos(1.0 - 2.0 * min(share, 1.0))
    thin = np.where(angle < end, np.clip(np.sin(angle), 0.0, None), 0.0)
    one = DEPTH * thin ** (1.0 - MC)
    vectors = (one * np.exp(1j * angle) * (1j + RADIAL)).reshape(EDGES, -1).sum(axis=0)
    edges, work = EDGES * TURNS, RADIUS * one.sum() * math.radians(0.25)
    feed = {
        "rate": RATE * 1000.0 / 60.0 / (2.0 * RADIUS * DEPTH * share),
        "chip": CHIP * edges / thin.max(),
        "power": edges * (1000.0 * POWER / (KC11 * edges * work)) ** (1.0 / (1.0 - MC)),
        "force": edges * (FORCE / (KC11 * np.abs(vectors).max())) ** (1.0 / (1.0 - MC)),
    }
    return {name: 60.0 * value for name, value in feed.items()}


def place(share, feed):
    return LEFT + share * (WIDTH - LEFT - 12), TOP + HEIGHT * (1.0 - min(feed, MOST) / MOST)


def line(shares, feeds, colour, width):
    points = " ".join("{:.1f},{:.1f}".format(*place(s, f)) for s, f in zip(shares, feeds) if f <= MOST)
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"/>'


def main():
    shares = np.arange(0.02, 1.0001, 0.005)
    feeds = [allowed(share) for share in shares]
    shapes = [
        f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - 12}" height="{HEIGHT}" fill="none" stroke="#bbb"/>',
        line(shares, [min(feed.values()) for feed in feeds], "#fd6", 9),
    ]
    for k, (name, colour, text) in enumerate(CURVES):
        shapes += [
            line(shares, [feed[name] for feed in feeds], colour, 1.8),
            f'<text x="{WIDTH - 24}" y="{TOP + 24 + 19 * k}" font-size="14" fill="{colour}" text-anchor="end">'
            f"{text}</text>",
        ]
    shapes.append(
        f'<text x="{WIDTH - 24}" y="{TOP + 24 + 19 * len(CURVES)}" font-size="14" fill="#a80" text-anchor="end">'
        "yellow: the feed in force</text>"
    )
    for feed in range(0, int(MOST) + 1, 1000):
        y = place(0.0, feed)[1]
        shapes.append(f'<text x="{LEFT - 6}" y="{y + 4:.0f}" font-size="12" text-anchor="end">{feed}</text>')
    for share in range(0, 101, 20):
        x = place(share / 100.0, 0.0)[0]
        shapes.append(f'<text x="{x:.0f}" y="{TOP + HEIGHT + 16}" font-size="12" text-anchor="middle">{share}</text>')
    shapes += [
        f'<text x="{LEFT}" y="{TOP - 6}" font-size="13">feed, mm/min</text>',
        f'<text x="{WIDTH - 12}" y="{TOP + HEIGHT + 34}" font-size="13" text-anchor="end">'
        "width of cut, % of the diameter</text>",
    ]
    body = "\n".join(shapes)
    (DOCS / "user" / "limits.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{TOP + HEIGHT + 42}" '
        f'font-family="sans-serif"><rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n'
    )


if __name__ == "__main__":
    main()
