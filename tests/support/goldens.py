# SPDX-License-Identifier: GPL-2.0-or-later
"""Motion of a cycle as text, kept in tests/interpreter/golden, and elements turned and shifted.  Called by
tests/interpreter."""

import dataclasses
import math
import os

from support import ROOT

GOLDEN = ROOT / "tests" / "interpreter" / "golden"


def turned(e, angle, dx, dy, dz):
    """An element turned about the origin (degrees), then shifted."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))

    def at(p):
        return (p[0] * c - p[1] * s + dx, p[0] * s + p[1] * c + dy) + tuple(v + dz for v in p[2:])

    return dataclasses.replace(e, a=at(e.a), b=at(e.b), centre=None if e.centre is None else at(e.centre))


def motion_text(trace):
    """The motion between (begin) and (end), machine coordinates in mm to 0.01: one line each."""
    places = {t: n for t, n, _ in trace.comments}
    rows = []
    for n in range(places["begin"], places["end"]):
        e = trace.elements[n]
        numbers = list(e.b) + (list(e.centre) + [1 if e.ccw else -1] if e.kind == "arc" else [])
        feed = "" if trace.feeds[n] is None else f" F{trace.feeds[n]:.0f}"
        rows.append(e.kind + "".join(f" {v + 0.0:.2f}" for v in numbers) + feed)
    return "\n".join(rows).replace("-0.00", "0.00") + "\n"


def compare_golden(text, name):
    """Compare with golden/NAME.txt; CHIPWISE_UPDATE_GOLDEN=1 writes it instead.  One unit of the last digit is
    allowed."""
    path = GOLDEN / f"{name}.txt"
    if os.environ.get("CHIPWISE_UPDATE_GOLDEN"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    wanted, found = path.read_text().splitlines(), text.splitlines()
    assert len(found) == len(wanted), f"{name}: {len(found)} motions, golden has {len(wanted)}"
    for number, (a, b) in enumerate(zip(found, wanted), 1):
        a_kind, *a_numbers = a.split()
        b_kind, *b_numbers = b.split()
        close = len(a_numbers) == len(b_numbers) and all(
            abs(float(p.lstrip("F")) - float(q.lstrip("F"))) <= 0.0101 for p, q in zip(a_numbers, b_numbers)
        )
        assert a_kind == b_kind and close, f"{name}:{number}: {a} is not {b}"
