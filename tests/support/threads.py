# SPDX-License-Identifier: GPL-2.0-or-later
"""Parts with a thread, as programs of G26, and a judge of the passes.  Called by
tests/turning/test_turning_threads.py."""

import re

from support.turning_oracle import Insert, judge, moves
from support.turning_random import Case

TOOLS = {
    1: Insert(0.8, 85, 5, 2, (0, 25, 8)),
    3: Insert(0.4, 90, 90, 2, (-1, 22, 12), flat=2.6),
    4: Insert(0.4, 87, 52, 2, (0, 25, 12)),
    5: Insert(12, 0, 0, 7, point=118),
    7: Insert(0.4, 275, 328, 3, (0.3, 60, 2)),
    8: Insert(0.2, 120, 60, 6, (-1.2, 25, 2), edge=2.3),
    9: Insert(0.4, 107.5, 72.5, 6, (-2, 25, 10)),
    10: Insert(0.2, 240, 300, 8, (-1.2, 60, 2), edge=2.3),
}

# M20 x 1.5 with a chamfer and an undercut before a shoulder: (z, x), radii
M20 = [(0.0, 8.2), (-1.8, 10.0), (-14.0, 10.0), (-16.0, 8.85), (-19.2, 8.85), (-19.2, 14.0), (-30.0, 14.0)]
# a bore of 18.376 mm for M20 x 1.5 with an undercut at its end
NUT = [
    (-24.0, 8.0),
    (-20.0, 8.0),
    (-20.0, 10.4),
    (-16.2, 10.4),
    (-14.0, 9.188),
    (-1.0, 9.188),
    (0.0, 10.2),
    (0.0, 15.0),
    (-24.0, 15.0),
]


def sub(chain, note, at, unit=1.0, twice=1):
    """Lines of a sub; note: comment on the line that ends at point `at`."""
    yield "O100 sub"
    for k, (z, x) in enumerate(chain):
        yield f"G{1 if k else 0} X{twice * x / unit:.8f} Z{z / unit:.8f}" + (f" {note}" if k == at else "")
    yield "O100 endsub"


def program(
    chain=M20,
    note="(THREAD,PITCH=1.5)",
    at=2,
    bar=(32, -60, 0),
    tools="ROUGH=1,FINISH=4,THREAD=8",
    spindle="G94 G97 S800 M3",
    unit=1.0,
    twice=1,
    words="I0.3 D1.5 F200 E100",
    more="",
):
    words = re.sub(r"([IDFE])([\d.]+)", lambda m: f"{m[1]}{float(m[2]) / unit:.8f}", words)
    return "\n".join(
        [
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={bar[0] / unit:.8f},ZMIN={bar[1] / unit:.8f},"
            f"ZMAX={bar[2] / unit:.8f})",
            f"(LATHE,{tools})",
            f"G{20 if unit > 1 else 21} G18 G{7 if twice > 1 else 8} {spindle}",
            "G0 X60 Z60" if unit == 1 else "G0 X2.4 Z2.4",
            more,
            "(begin)",
            f"G26 Q100 {words}",
            "(end)",
            "M2",
            *sub(chain, note, at, unit, twice),
            "",
        ]
    )


def passes(text, unit=1.0):
    """[(z start, z end, x, pitch)] mm of the G33 lines of a program, the controlled point."""
    pitches = [float(k) * unit for k in re.findall(r"^G33 .*K([\d.]+)", text, flags=re.M)]
    found = [(p[0][0], p[-1][0], p[0][1]) for _, kind, p in moves(text, unit) if kind == "thread"]
    assert len(found) == len(pitches)
    return [(*a, k) for a, k in zip(found, pitches)]


def judged(text, chain, roots, bar, unit=1.0, bore=False):
    """What the oracle finds; roots: the chain with the thread cut down to its root."""
    split = (
        next(k for k in range(len(chain)) if chain[k][0] == 0.0 and k and chain[k][1] > chain[k - 1][1]) if bore else 0
    )
    outside, inside = (chain[split:], chain[:split][::-1]) if bore else (chain, [])
    deep = (outside, roots[:split][::-1]) if bore else (roots, [])
    case = Case(text, outside, inside, (bar[0] / 2, bar[1], bar[2]), 0.3, "V35")
    return judge(text, unit, case, TOOLS, deep)[0]


def clean(found):
    return found["gouge"] <= 0.001 and found["rapid"] <= 0.002 and found["holder"] <= 0.001


def at_root(chain, root):
    """A chain with nothing above a radius, between points that are kept: exact where elements cross the radius."""
    out = []
    for (z0, x0), (z1, x1) in zip(chain, chain[1:]):
        out.append((z0, min(x0, root)))
        if (x0 - root) * (x1 - root) < 0:
            out.append((z0 + (z1 - z0) * (root - x0) / (x1 - x0), root))
    return [*out, (chain[-1][0], min(chain[-1][1], root))]


def lowered(chain, root, shoulder):
    """M20 and the like: down to the root in front of the shoulder at index `shoulder`."""
    return at_root(chain[:shoulder], root) + chain[shoulder:]
