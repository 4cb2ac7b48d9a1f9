# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/design/tracer.svg: head, stylus and surface in the trace plane, and the deflection held on a slope.

    /usr/bin/python3 tools/pictures/tracer.py

The curve comes from the core in a loop with the model of its stylus (tests/support/tracer_rig.py); `make build` first.
"""

import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "remap"), str(ROOT / "tests")]

from support.tracer_rig import STATE, Rig, error, tracing  # noqa: E402

WIDTH, HEIGHT, SPLIT = 900, 300, 400


def arrow(x, y, dx, dy, colour, text, width=2.5):
    """An arrow from x, y; the text beyond its point."""
    size = math.hypot(dx, dy)
    u, v = dx / size, dy / size
    tip = f"{x + dx:.1f},{y + dy:.1f}"
    left = f"{x + dx - 10 * u - 4 * v:.1f},{y + dy - 10 * v + 4 * u:.1f}"
    right = f"{x + dx - 10 * u + 4 * v:.1f},{y + dy - 10 * v - 4 * u:.1f}"
    return [
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x + dx - 6 * u:.1f}" y2="{y + dy - 6 * v:.1f}" stroke="{colour}" '
        f'stroke-width="{width}"/>',
        f'<polygon points="{tip} {left} {right}" fill="{colour}"/>',
        f'<text x="{x + dx + 14 * u - 4:.1f}" y="{y + dy + 14 * v + 5:.1f}" font-size="15" '
        f'fill="{colour}">{text}</text>',
    ]


def scheme():
    """The plane: a slope, the ball on it, p below c, and the vectors."""
    rise, cx, cy, radius = math.radians(30), 190.0, 150.0, 34.0
    n, t = (-math.sin(rise), -math.cos(rise)), (math.cos(rise), -math.sin(rise))
    foot = (cx - radius * n[0], cy - radius * n[1])
    ends = [(foot[0] + s * t[0], foot[1] + s * t[1]) for s in (-190, 190)]
    phi = math.atan(0.3)
    e = (70 * (n[0] * math.cos(phi) - t[0] * math.sin(phi)), 70 * (n[1] * math.cos(phi) - t[1] * math.sin(phi)))
    px, py = cx - e[0], cy - e[1]
    shapes = [
        f'<polygon points="{ends[0][0]:.0f},{ends[0][1]:.0f} {ends[1][0]:.0f},{ends[1][1]:.0f} {ends[1][0]:.0f},290 '
        f'{ends[0][0]:.0f},290" fill="#e6e0d4"/>',
        f'<line x1="{ends[0][0]:.0f}" y1="{ends[0][1]:.0f}" x2="{ends[1][0]:.0f}" y2="{ends[1][1]:.0f}" stroke="#765" '
        f'stroke-width="2"/>',
        f'<circle cx="{cx}" cy="{cy}" r="{radius}" fill="#fff" fill-opacity="0.8" stroke="#333" stroke-width="1.5"/>',
        f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{radius}" fill="none" stroke="#999" stroke-dasharray="5 4"/>',
    ]
    shapes += arrow(cx, cy, 95 * n[0], 95 * n[1], "#060", "n")
    shapes += arrow(cx, cy, 110 * t[0], 110 * t[1], "#06c", "t: feed")
    shapes += arrow(px, py, *e, "#c40", "")
    shapes += [
        f'<text x="{cx - 2:.0f}" y="{cy + 60:.0f}" font-size="15" fill="#c40">e</text>',
        f'<circle cx="{cx}" cy="{cy}" r="3"/><text x="{cx + 7:.0f}" y="{cy + 5:.0f}" font-size="15">c</text>',
        f'<circle cx="{px:.1f}" cy="{py:.1f}" r="3"/><text x="{px + 7:.0f}" y="{py + 14:.0f}" font-size="15">p</text>',
        '<text x="14" y="24" font-size="14">p head without deflection, c ball, e deflection, n normal</text>',
    ]
    return shapes


def curve():
    """|eps - eps0| over time on 45 degrees at gain 100: friction is learned."""
    slope = math.sqrt(0.5)
    rows = tracing(
        Rig((-15, 0, -12), {"normal": (-slope, 0, slope), "noise_mm": 0.0005}, gain_hz=100.0).until(STATE.DONE)
    )
    off, left, top, wide, high, most = 1000 * error(rows)[:600], SPLIT + 60, 44, WIDTH - SPLIT - 80, 210, 30
    points = " ".join(
        f"{left + wide * k / 600:.1f},{top + high * (1 - min(v, most) / most):.1f}" for k, v in enumerate(off)
    )
    y = top + high * (1 - 25 / most)
    return [
        f'<text x="{left}" y="24" font-size="14">deflection error, um: 45 degrees, 1000 mm/min, gain 100</text>',
        f'<rect x="{left}" y="{top}" width="{wide}" height="{high}" fill="none" stroke="#bbb"/>',
        f'<line x1="{left}" y1="{y:.1f}" x2="{left + wide}" y2="{y:.1f}" stroke="#333" stroke-dasharray="6 5"/>',
        f'<text x="{left + wide - 6}" y="{y + 16:.1f}" font-size="12" text-anchor="end">friction left in the normal: '
        f"25</text>",
        f'<polyline points="{points}" fill="none" stroke="#c40" stroke-width="1.5"/>',
        *(
            f'<text x="{left - 6}" y="{top + high * (1 - v / most) + 4:.1f}" font-size="12" '
            f'text-anchor="end">{v}</text>'
            for v in (0, 10, 20, 30)
        ),
        *(
            f'<text x="{left + wide * v / 0.6:.1f}" y="{top + high + 16}" font-size="12" text-anchor="middle">{v:g} '
            f"s</text>"
            for v in (0, 0.2, 0.4, 0.6)
        ),
    ]


def main():
    body = "\n".join(scheme() + curve())
    (ROOT / "docs" / "design" / "tracer.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif">'
        f'<rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n',
        encoding="utf-8",
    )


if __name__ == "__main__":
    sys.exit(main())
