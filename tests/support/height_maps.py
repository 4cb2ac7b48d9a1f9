# SPDX-License-Identifier: GPL-2.0-or-later
"""One probed height map, 4 rows of 6 points, in the form of each program that writes such."""

import random

import numpy as np

X, Y = np.linspace(-3.5, 46.5, 6), np.linspace(2.0, 32.0, 4)
Z = np.random.default_rng(5113).normal(0, 0.4, (len(Y), len(X))).round(4)


def candle(comma=False):
    lines = [
        f"{X[0]};{Y[0]};{X[-1] - X[0]};{Y[-1] - Y[0]}",
        f"{len(X)};{len(Y)};-1;1",
        "1;100;100",
        *(";".join(map(str, row)) for row in Z),
    ]
    return "\r\n".join(line.replace(".", ",") if comma and k < 3 else line for k, line in enumerate(lines)) + "\r\n"


def pilot():
    points = "".join(f'<point X="{i}" Y="{j}">{Z[j, i]}</point>\n' for i in range(len(X)) for j in range(len(Y)))
    return (
        f'<?xml version="1.0" encoding="utf-8"?>\n'
        f'<heightmap MinX="{X[0]}" MinY="{Y[0]}" MaxX="{X[-1]}" MaxY="{Y[-1]}" SizeX="{len(X)}" '
        f'SizeY="{len(Y)}">\n{points}</heightmap>\n'
    )


def rows(form, order=None):
    lines = [form.format(x, y, Z[j, i]) for j, y in enumerate(Y) for i, x in enumerate(X)]
    if order is not None:
        random.Random(order).shuffle(lines)
    return "\n".join(lines) + "\n"


def bcnc():
    return f"{X[0]} {X[-1]} {len(X)}\n{Y[0]} {Y[-1]} {len(Y)}\n-10 3 100\n\n\n{rows('{} {} {}')}"


FORMS = {
    "candle": candle(),
    "candle with commas": candle(True),
    "opencncpilot": pilot(),
    "bcnc": bcnc(),
    "xyz": rows("{} {} {}"),
    "csv": "x,y,z\n" + rows("{},{},{}", 1),
    "semicolons": rows("{};{};{}", 2),
    "tabs and a mark": "\ufeff" + rows("{}\t{}\t{}", 3),
    "blanks and commas": rows("{}, {}, {}", 4),
}
