# SPDX-License-Identifier: GPL-2.0-or-later
"""Random turned parts as programs: lines, arcs, walls, pockets, bores; drawn in either direction; G7 or G8, G20 or
G21."""

import math
import re
from dataclasses import dataclass, replace

INSERTS = {"C80": (85.0, 5.0), "D55": (87.0, 32.0), "V35": (87.0, 52.0)}


@dataclass(frozen=True)
class Case:
    """text: program; outside, bore: [(z, x)] corner points and arcs as dense chords, mm, from the right; blank (radius,
    z0, z1)."""

    text: str
    outside: list
    bore: list
    blank: tuple
    allowance: float
    insert: str
    barrier: tuple = ()  # (radius, right end) of a chuck
    tailstock: tuple = ()  # (radius, left and right end)


def _arc(rng, a, b):
    """(centre, ccw) of an arc from a to b (z, x), to the left, without a vertical tangent inside; None if the dice say
    no."""
    dz, dx = b[0] - a[0], b[1] - a[1]
    chord = math.hypot(dz, dx)
    r = chord * rng.uniform(0.55, 3.0)
    h = math.sqrt(r * r - chord * chord / 4) * rng.choice((-1, 1))
    c = (0.5 * (a[0] + b[0]) - h * dx / chord, 0.5 * (a[1] + b[1]) + h * dz / chord)
    side = [p[1] - c[1] for p in (a, b)]
    if side[0] * side[1] <= 1e-3:
        return None
    return c, side[0] > 0  # to the left over the top is counter-clockwise in (z, x)


def _chain(rng, x, low, high, length, count, snap=0.0):
    """[(z, x, arc)] from Z0 to the left: a random chain within the radii low .. high; snap: mm, of which ends of
    elements are multiples in Z."""
    z, chain = 0.0, [(0.0, x, None)]
    step = length / count
    for k in range(count):
        kind = max(
            rng.random(), 0.3 if k == 0 else 0.0
        )  # the chain does not begin with a wall: the face is drawn before it
        if kind < 0.3:
            x = rng.uniform(low, high)
            chain.append((z, x, None))
        z2 = z - step * rng.uniform(0.4, 1.0)
        z2 = snap * round(z2 / snap) if snap else z2
        x2 = x if kind < 0.55 else rng.uniform(low, high)
        arc = _arc(rng, (z, x), (z2, x2)) if kind > 0.75 else None
        if arc:
            (cz, cx), ccw = arc
            r = math.hypot(z - cz, x - cx)
            inner = [
                cx + (1 if ccw else -1) * math.sqrt(max(r * r - (u - cz) ** 2, 0))
                for u in (z + (z2 - z) * k / 16 for k in range(17))
            ]
            if not low <= min(inner) <= max(inner) <= high:
                arc = None
        chain.append((z2, x2, arc))
        z, x = z2, x2
    return chain


def dense(chain):
    """[(z, x)] of a chain, arcs as chords of about 0.01 mm."""
    points = [p[:2] for p in chain[:1]]
    for (z0, x0, _), (z1, x1, arc) in zip(chain, chain[1:]):
        if arc:
            (cz, cx), ccw = arc
            r = math.hypot(z0 - cz, x0 - cx)
            a, b = math.atan2(x0 - cx, z0 - cz), math.atan2(x1 - cx, z1 - cz)
            turn = (b - a) % (2 * math.pi) if ccw else -((a - b) % (2 * math.pi))
            n = max(int(abs(turn) * r / 0.01), 2)
            points += [(cz + r * math.cos(a + turn * k / n), cx + r * math.sin(a + turn * k / n)) for k in range(1, n)]
        points.append((z1, x1))
    return points


def words(chain, diameter, unit):
    """G-code lines of a chain."""
    f = (2 if diameter else 1) / unit
    (z, x, _), lines = chain[0], []
    lines.append(f"G0 X{x * f:.9f} Z{z / unit:.9f}")
    for z2, x2, arc in chain[1:]:
        if arc:
            (cz, cx), ccw = arc
            lines.append(
                f"G{3 if ccw else 2} X{x2 * f:.9f} Z{z2 / unit:.9f} I{(cx - x) / unit:.9f} K{(cz - z) / unit:.9f}"
            )
        else:
            lines.append(f"G1 X{x2 * f:.9f} Z{z2 / unit:.9f}")
        z, x = z2, x2
    return lines


def reversed_chain(chain):
    """The chain in the other direction."""
    points = [p[:2] for p in chain][::-1]
    arcs = [p[2] for p in chain][:0:-1]
    return [(*points[0], None), *((*p, a and (a[0], not a[1])) for p, a in zip(points[1:], arcs))]


def random_case(rng, insert=None, allowance=None, snap=0.0, wide=False):
    """Case of a random.Random; snap: mm, of which ends of elements and barriers are multiples in Z; wide: a disc, not a
    shaft."""
    unit, diameter = rng.choice((1.0, 1.0, 25.4)), rng.random() < 0.5
    high, length, count = (
        (rng.uniform(20, 40), rng.uniform(4, 14), rng.randint(2, 5))
        if wide
        else (rng.uniform(10, 18), rng.uniform(12, 40), rng.randint(3, 10))
    )
    bored = rng.random() < 0.4
    low = rng.uniform(8.5, 9.5) if bored else rng.uniform(1.0, 6.0)
    outside = _chain(rng, rng.uniform(low, high), low, high, length, count, snap)
    bore = []
    if bored:
        end = outside[-1][0] * (1.0 if rng.random() < 0.5 else rng.uniform(0.3, 0.8))
        bore = [
            (z, x, None)
            for z, x in ((0.0, rng.uniform(7.2, 8.2)), (0.5 * end, 7.1), (0.5 * end, 6.6), (end, rng.uniform(6.3, 6.6)))
        ]
    chain = reversed_chain(bore) + [(*p[:2], p[2]) for p in outside] if bored else outside
    if rng.random() < 0.5:
        chain = reversed_chain(chain)
    allowance = rng.choice((0.0, 0.3)) if allowance is None else allowance
    insert = insert or rng.choice(sorted(INSERTS))
    blank = (high + rng.uniform(0.2, 4.0), outside[-1][0] - 30.0, rng.choice((0.0, 0.5, 2.5)))
    lines = words(chain, diameter, unit)
    barrier = (rng.uniform(5.0, 40.0), outside[-1][0] - rng.uniform(0.05, 12.0)) if rng.random() < 0.5 else ()
    if barrier and snap:
        barrier = (barrier[0], snap * round(barrier[1] / snap))
    chuck = [f"G22 X{barrier[0] * (2 if diameter else 1) / unit:.9f} Z{barrier[1] / unit:.9f}"] if barrier else []
    text = "\n".join(
        [
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={2 * blank[0] / unit:.9f},ZMIN={blank[1] / unit:.9f},"
            f"ZMAX={blank[2] / unit:.9f})",
            f"G{20 if unit > 1 else 21} G18 G{7 if diameter else 8} G94 G97 S500 M3",
            *chuck,
            f"G26 Q100 I{allowance / unit:.9f} D{rng.uniform(0.5, 2.0) / unit:.9f} F{100 / unit:.6f} E{50 / unit:.6f}",
            "M2",
            "O100 sub",
            *lines,
            "O100 endsub",
            "",
        ]
    )
    return Case(text, dense(outside), dense(bore), blank, allowance, insert, barrier)


def tailstock_case(rng):
    """Case of a faced blank without a bore and with a tailstock in front of it."""
    case = random_case(rng, wide=rng.random() < 0.3)
    while case.bore:
        case = random_case(rng)
    unit, twice = (25.4 if "G20" in case.text else 1.0), (2 if "G7 " in case.text else 1)
    left = rng.uniform(0.0, 2.0)
    radius, right = rng.uniform(0.5, case.blank[0] + 3.0), left + rng.uniform(0.5, 50.0)
    text = re.sub(r"ZMAX=[\d.]+", "ZMAX=0", case.text).replace(
        "G26 ", f"G22 X{radius * twice / unit:.9f} Z{right / unit:.9f} K{left / unit:.9f}\nG26 "
    )
    return replace(case, text=text, blank=(*case.blank[:2], 0.0), tailstock=(radius, left, right))
