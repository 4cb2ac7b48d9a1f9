# SPDX-License-Identifier: GPL-2.0-or-later
"""How exact the stock model is: one row per kind of cut, against its target.

Called by bench/run.py (prints JSON rows) and by hand with --table (all cuts).  `rows()` gives
the rows to other programs.  The cuts and their truths are those of the tests
(tests/support/cuts.py, tests/support/stock_cases.py, tests/support/stock_profiles.py).
"""

import json
import math
import sys

import roots  # noqa: F401  sys.path
from support import cuts, stock_cases, stock_profiles

VOLUME_TARGET = {0.1: 0.1, 0.25: 0.3}  # %, by cell size in mm
MEAN_TARGET, SPREAD_TARGET = 1.0, {"side": 4.0}  # %; spread of all others 2 %
PROFILE_SPREAD = {"deeper": 2.0}  # of the others, cuts with a side: as side cuts
CELL = 0.25


def volumes():
    """Every cut of known volume: (name, cell, error in %)."""
    for name, tool, points, volume in cuts.known():
        for cell in VOLUME_TARGET:
            yield name, cell, 100.0 * (cuts.core_volume(tool, points, cell) / volume - 1.0)
    for cell in VOLUME_TARGET:
        yield "helix", cell, 100.0 * (cuts.core_volume((6, 0, 0), cuts.helix(), cell) / cuts.helix_volume() - 1.0)


def sections(through):
    """Every cut of known section area: (kind, tool, name, mean error in %, spread in %)."""
    for case in stock_cases.cases():
        mean, spread = stock_cases.measured(case, CELL, through)
        yield case.kind, case.name.split()[1], case.name, 100.0 * mean, 100.0 * spread


def shallow():
    """A ball end at a small depth, where one band of the tool is all that touches: % of the truth."""
    for depth in (0.05, 0.1, 0.2, 0.5):
        truth = stock_cases.front_area(stock_cases.BALL, depth)
        stock = stock_cases.core.Stock(stock_cases.LOW, stock_cases.HIGH, CELL)
        tool = stock_cases.core.Tool(*stock_cases.BALL)
        area, _ = stock.section(tool, (0.13, -0.07, -depth), (math.cos(0.3), math.sin(0.3), 0.0))
        yield depth, 100.0 * (area / truth - 1.0)


def profiles():
    """Every pass above or beside earlier ones: (kind, name, worst mean error in %, worst spread in %) of its
    directions."""
    for case in stock_profiles.cases():
        found = [stock_profiles.measured(case, angle, CELL) for angle in stock_profiles.DIRECTIONS]
        yield (
            case.kind,
            case.name,
            100.0 * max((mean for mean, _ in found), key=abs),
            100.0 * max(spread for _, spread in found),
        )


def _row(name, value, target):
    verdict = "meets" if abs(value) <= target else "MISSES"
    return {"name": name, "value": round(value, 4), "unit": "%", "target": target, "note": f"{verdict} {target:g} %"}


def rows():
    """List of dicts: name, value, unit, target, note; the worst cut of every kind."""
    out, worst = [], {}

    def keep(key, value, name, target):
        if key not in worst or abs(value) > abs(worst[key][0]):
            worst[key] = value, name, target

    for name, cell, error in volumes():
        kind = name.split(" deg")[0].rstrip("0123456789 ")
        keep(f"removed volume, {kind}, {cell:g} mm cells", error, name, VOLUME_TARGET[cell])
    for through in ("section", "ahead"):
        label = "section area" if through == "section" else "through look-ahead"
        for kind, tool, name, mean, spread in sections(through):
            keep(f"{label}, {kind}, {tool}: mean", mean, name, MEAN_TARGET)
            keep(f"{label}, {kind}, {tool}: deviation", spread, name, SPREAD_TARGET.get(kind, 2.0))
    for kind, name, mean, spread in profiles():
        tool = name.split(",")[0]
        keep(f"section area, {kind}, {tool}: mean", mean, name, MEAN_TARGET)
        keep(f"section area, {kind}, {tool}: deviation", spread, name, PROFILE_SPREAD.get(kind, SPREAD_TARGET["side"]))
    for key, (value, name, target) in worst.items():
        row = _row(key, value, target)
        row["note"] += f" ({name})"
        out.append(row)
    for depth, error in shallow():
        out.append(_row(f"section area, ball D6 {depth:g} mm deep", error, MEAN_TARGET))
    return out


def print_table():
    """Every single cut."""
    print(f"{'removed volume':36s} {'cell mm':>8s} {'error %':>9s} {'target':>7s}")
    for name, cell, error in volumes():
        print(
            f"{name:36s} {cell:8.2f} {error:9.3f} {VOLUME_TARGET[cell]:7.1f}"
            + ("" if abs(error) <= VOLUME_TARGET[cell] else "  MISSES")
        )
    for through in ("section", "ahead"):
        print(f"\n{'dV/ds through ' + through:36s} {'mean %':>8s} {'dev. %':>9s} {'targets':>9s}")
        for kind, _, name, mean, spread in sections(through):
            most = SPREAD_TARGET.get(kind, 2.0)
            print(
                f"{name:36s} {mean:8.2f} {spread:9.2f}   {MEAN_TARGET:g} / {most:g}"
                + ("" if abs(mean) <= MEAN_TARGET and spread <= most else "  MISSES")
            )
    print(f"\n{'above and beside earlier cuts':44s} {'mean %':>8s} {'dev. %':>9s} {'targets':>9s}")
    for kind, name, mean, spread in profiles():
        most = PROFILE_SPREAD.get(kind, SPREAD_TARGET["side"])
        print(
            f"{name:44s} {mean:8.2f} {spread:9.2f}   {MEAN_TARGET:g} / {most:g}"
            + ("" if abs(mean) <= MEAN_TARGET and spread <= most else "  MISSES")
        )
    print()
    for depth, error in shallow():
        print(f"ball D6, {depth:g} mm deep{'':16s} {error:8.2f}")


if __name__ == "__main__":
    if "--table" in sys.argv:
        print_table()
    else:
        for row in rows():
            print(json.dumps(row))
