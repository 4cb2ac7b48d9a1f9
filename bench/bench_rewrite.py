# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise rewrite --flute on seeded random deep programs: depth, length, what is left; and a long program's time.

Called by bench/run.py (prints JSON rows); by hand: `/usr/bin/python3 bench/bench_rewrite.py --count 200 --seed 1
--table`.  The verdict on depth and stock is tests/support/check_oracle.py's needles.  *least*: for each body the levels
that its deepest cut needs, less one, times the length that is too deep in the first path.  *least of a round edge*: the
same with the levels that such a tool needs: the round of its edge is left at the wall, so all levels but the first are
less high by it.  *least with arcs*: the length over which each of these levels is raised, where its ends are arcs of
the tool's diameter (CN105492980 [0105] to [0111]): what an arc raises has to be travelled again, too.
"""

import argparse
import json
import math
import resource
import sys
import tempfile
from pathlib import Path

import numpy as np

import roots  # noqa: F401
from chipwise.program.reader import Machine
from chipwise.rewrite import sections
from chipwise.rewrite import shift
from chipwise.rewrite.program import read
from chipwise.tool_data.geometry import load_tools
from rows import row
from support.rewrite_rig import HEAD, check_status, deep_program, judged, make_machine, neighbours, rewrite

CELL = 0.25
SKIN = 0.004  # mm of contact at the tool's side that does not count


def left_at_the_wall(shape):
    """mm: how high above the tip a tool leaves stock that the next level meets with its side."""
    corner = min(shape.corner_radius, shape.diameter / 2)
    return corner - math.sqrt(corner**2 - max(corner - SKIN, 0.0) ** 2)


def least(program, geometry):
    """mm of feed that has to be added at least: (flutes' length a level, less the round of the edge after the first,
    with arcs at their ends)."""
    total = np.zeros(3)
    for section, stock in sections.in_stock(program, sections.sections(program, geometry), CELL):
        first, end = section.first, section.end
        points, owner = sections.pieces(np.concatenate((program.start(first)[None], program.end[first:end])), 1.0)
        met = stock.cut(section.tool.shape, points[0], points[1:])
        length = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
        deep = (program.kind[first:end][owner] != 0) & (met["depth"] > section.tool.flutes + 0.005)
        if deep.any():
            flute = section.tool.flute_length
            more = met["depth"][deep] - 0.005 - flute
            steps = np.array([flute, flute - left_at_the_wall(section.tool.shape)])
            total[:2] += (np.ceil(more / steps[:, None]) * length[deep]).sum(axis=1)
            total[2] += with_arcs(
                points,
                met["depth"] - 0.005,
                program.kind[first:end][owner] != 0,
                steps,
                section.tool.shape.diameter / 2,
            )
    return total


def with_arcs(points, depth, feeds, steps, radius):
    """mm: what the levels of a section raise whose corners are arcs.  points (n + 1, 3); depth, feeds (n,) of each
    piece; steps: mm of the first level, of the others."""
    across, result = feeds & (np.hypot(*np.diff(points[:, :2], axis=0).T) > 1e-6), 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], across.astype(int), [0]))))
    for a, b in zip(edges[::2], edges[1::2]):  # feed moves one after the other
        s = shift.along(points[a : b + 1])
        fine = np.arange(0.0, s[-1], 0.1)
        own = depth[a:b][np.clip(np.searchsorted(s, fine, side="right") - 1, 0, b - a - 1)]
        level = own - steps[0]
        while (level > 0.0).any():
            result += 0.1 * np.count_nonzero(
                (shift.rounded(fine, np.maximum(level, 0.0), radius) > 0.002) & (own > 0.0)
            )  # not through air
            level = level - steps[1]
    return result


def one(seed, ini, folder):
    """Figures of one random program; None where nothing had to change."""
    before, after = folder / f"{seed}.ngc", folder / f"{seed}.out.ngc"
    before.write_text(deep_program(seed))
    done = rewrite(before, after, ini, "--flute")
    if done.status:
        return {"seed": seed, "error": done.errors}
    if "unchanged" in done.said:
        return None
    machine, geometry = Machine(str(ini)), load_tools(str(ini.parent / "tools.toml"))
    first, second = read(str(before), machine), read(str(after), machine)
    a, _, _ = judged(first, geometry)
    b, excess, _ = judged(second, geometry)
    near = neighbours(a.z)
    return {
        "seed": seed,
        "checked": check_status(after, ini)[0],
        "over": max(excess.values()),
        "more": float((near.min(axis=0) - b.z).max()),
        "left": float((b.z - near.max(axis=0)).max()),
        **added(first, second, geometry),
    }


def added(first, second, geometry):
    """Feed (mm) that a rewritten program has more than the first, and what it has to have at least."""
    plain, round_edge, arcs = least(first, geometry).tolist()
    return {
        "least": plain,
        "least_round": round_edge,
        "least_arcs": arcs,
        "added": feed_length(second) - feed_length(first),
    }


def feed_length(program):
    """mm of feed."""
    steps = np.diff(program.end, axis=0)
    return float(np.sqrt((steps * steps).sum(axis=1))[program.kind[1:] != 0].sum())


def long_program(path, moves):
    """A zigzag over 100 x 100 mm in moves of 0.1 mm that is 1 to 3 flutes deep."""
    with open(path, "w", encoding="utf-8") as file:
        file.write(HEAD + "M250 P0 Q0 R-40 I100 J100 K40\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-14 F300\n")
        rows = max(1, moves // 1000)
        for n in range(moves):
            line, k = divmod(n, 1000)
            x = 0.1 * (k + 1) if line % 2 == 0 else 100 - 0.1 * (k + 1)
            file.write(f"X{x:.3f} Y{100 * line / rows:.3f} Z{-24 + 10 * math.sin(x / 9) * math.cos(line / 40):.4f}\n")
        file.write("G0 Z5\nM2\n")


def timed(ini, folder, moves):
    """(seconds of computing of the whole command: read, shifted, written, read back, compared; MB of the largest
    process so far; what it said)."""
    path = folder / "long.ngc"
    long_program(path, moves)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = rewrite(path, folder / "long.out.ngc", ini, "--flute", timeout=600 + moves / 200)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        after.ru_maxrss / 1024,
        done.said.partition(": ")[2] or done.errors,
    )


def show(*row_of):
    print(json.dumps(row(*row_of)), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--moves", type=int, default=20000)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        ini = make_machine(folder / "mill")
        found = [f for f in (one(options.seed + k, ini, folder) for k in range(options.count)) if f]
        bad = [f for f in found if "error" in f]
        good = [f for f in found if "error" not in f]
        if options.table:
            for f in found:
                print(f, file=sys.stderr)
        if good:
            note = f"{len(good)} programs of {options.count} that had to change"
            show("rewrite: refused or not proved", len(bad), "programs", note)
            show(
                "rewrite: chipwise check has findings afterwards",
                sum(f["checked"] != 0 for f in good),
                "programs",
                note,
            )
            show("rewrite: deeper than the flutes, by the needles", max(f["over"] for f in good), "mm", note)
            show("rewrite: cut more than the first path", max(f["more"] for f in good), "mm", note)
            show("rewrite: left more than the first path", max(f["left"] for f in good), "mm", note)
            for key, name in (
                ("least", "least"),
                ("least_round", "least of a round edge"),
                ("least_arcs", "least with arcs"),
            ):
                ratio = [f["added"] / f[key] for f in good if f["least"] > 20]
                show(f"rewrite: added feed / {name}, median", float(np.median(ratio)), "", f"worst {max(ratio):.2f}")
        seconds, memory, said = timed(ini, folder, options.moves)
        show(f"rewrite: {options.moves} moves of 0.1 mm", seconds, "s", said)
        show(f"rewrite: {options.moves} moves of 0.1 mm, memory", memory, "MB", said)


if __name__ == "__main__":
    main()
