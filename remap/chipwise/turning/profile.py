# SPDX-License-Identifier: GPL-2.0-or-later
"""Part and blank as graphs: the outside x(z), and the bore mirrored, -x(z), so that both are cut from above.

Called by read_part.py and resume.py.  A sub is read by contour_sub with Z as its first and X as its second coordinate.
It holds one chain: the outside, in either direction; or bore, face and outside in one chain, open or closed.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from chipwise.program import comments
from chipwise.program.find_sub import quoted
from chipwise.errors import Across, CycleError
from chipwise.contour_sub.read import Shape
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import Contour
from chipwise.turning.profile_function import Graph, Piece, above, closed, flat, highest, negative, segment, value
from chipwise.turning.thread_comment import Thread

VERTICAL_MM = 1e-6  # an element narrower than this in Z is a wall
BELOW_AXIS_MM = 1e-6  # rounding of X0
CLOSE_MM = 1e-5  # walls that are dropped leave gaps of this width

_Arc = tuple[float, float, float, int]  # centre (z, x), radius, side as in Piece
_Element = tuple[float, float, float, float, int, _Arc | None]  # (z, x) at both ends, line, arc


@dataclass(frozen=True)
class Profile:
    """outside, bore: graphs (bore: -x(z), [] for none); z0, z1: mm, left and right end; threads:
    (thread_comment.Thread, ..)."""

    outside: list[Piece]
    bore: list[Piece]
    z0: float
    z1: float
    threads: tuple[Thread, ...] = ()


def make_profile(shape: Shape, contour: Contour) -> Profile:
    """Profile of a contour whose first coordinate is Z and second X, mm.  Raises CycleError."""
    runs = _runs(_steps(contour))
    where = f"sub O{shape.sub} of {quoted(shape.file)}"
    if contour.closed and len(runs) == 3:
        runs = [runs[2] + runs[0], runs[1]]
    if len(runs) > 2 or not runs:
        line = runs[2][0][4] if runs else int(contour.line[0])
        raise CycleError(
            f"{where}: the profile turns back in Z" if runs else f"{where}: the profile has no extent in Z",
            "draw it so that Z runs in one direction along the outside, and along the bore (line {line})",
            line=str(line),
        )
    graphs = [_graph(run) for run in runs]
    low = min(x for run in runs for step in run for x in (step[1], step[3]))
    if low < -BELOW_AXIS_MM:
        raise CycleError(
            f"{where}: the profile goes below the axis, to X{{x}}",
            "X is a radius in G8 and a diameter in G7, from 0 on",
            x=Across(low),
        )
    outside, bore = graphs[0], []
    if len(graphs) == 2:
        graphs.sort(key=_mean, reverse=True)
        outside, bore = graphs[0], negative(graphs[1])
        crossing = above(graphs[1], outside, 1e-6)
        if crossing:
            raise CycleError(
                f"{where}: the bore is outside of the outside at Z{{z}}",
                "draw bore, face and outside as one chain",
                z=crossing[0][0],
            )
    return Profile(outside, bore, outside[0].z0, max(outside[-1].z1, bore[-1].z1 if bore else -math.inf))


def _mean(graph: Graph) -> float:
    return sum((p.z1 - p.z0) * value(p, 0.5 * (p.z0 + p.z1)) for p in graph) / (graph[-1].z1 - graph[0].z0)


def _steps(contour: Contour) -> list[_Element]:
    """[(z, x, z, x, line, arc or None)] of a contour, arcs cut where they are vertical."""
    e = contour.elements
    steps: list[_Element] = []
    for k in range(len(e)):
        line = int(contour.line[k])
        if not e.is_arc[k]:
            (z0, x0), (z1, x1) = e.start[k].tolist(), e.end[k].tolist()
            steps.append((z0, x0, z1, x1, line, None))
            continue
        start, sweep = float(e.start_angle[k]), float(e.sweep[k])
        lo, hi = sorted((start, start + sweep))
        turns = [n * math.pi for n in range(math.ceil(lo / math.pi - 1e-9), math.floor(hi / math.pi + 1e-9) + 1)]
        share = sorted({0.0, 1.0, *(min(max((t - start) / sweep, 0.0), 1.0) for t in turns)})
        points = elements.point_at(e, np.full(len(share), k), np.array(share))
        points[0], points[-1] = e.start[k], e.end[k]
        for a, b, u, v in zip(points, points[1:], share, share[1:]):
            side = 1 if math.sin(start + 0.5 * (u + v) * sweep) > 0 else -1
            (z0, x0), (z1, x1), (cz, cx) = a.tolist(), b.tolist(), e.centre[k].tolist()
            steps.append((z0, x0, z1, x1, line, (cz, cx, float(e.radius[k]), side)))
    return steps


def _runs(steps: Iterable[_Element]) -> list[list[_Element]]:
    """Parts of a chain in which Z runs in one direction; walls belong to the one before."""
    runs: list[list[_Element]] = []
    sense = 0
    for step in steps:
        dz = step[2] - step[0]
        now = 0 if abs(dz) <= VERTICAL_MM else 1 if dz > 0 else -1
        if now and now != sense:
            runs.append([])
            sense = now
        if runs and now:
            runs[-1].append(step)
    return runs


def _graph(run: list[_Element]) -> list[Piece]:
    """Graph of steps that run in one direction."""
    pieces: list[Piece] = []
    for z0, x0, z1, x1, line, arc in (
        run if run[0][2] > run[0][0] else [(s[2], s[3], s[0], s[1], *s[4:]) for s in run[::-1]]
    ):
        if arc:
            cz, cx, r, side = arc
            pieces.append(Piece(z0, z1, cz, cx, 0.0, r, side, line))
        else:
            pieces.append(segment(z0, x0, z1, x1, line))
    return _joined(pieces)


def _joined(pieces: Iterable[Piece]) -> list[Piece]:
    """Pieces whose ends in Z meet, after walls of some micrometres have been dropped."""
    out: list[Piece] = []
    for p in pieces:
        if out and 0.0 < abs(p.z0 - out[-1].z1) <= CLOSE_MM:
            p = p._replace(z0=out[-1].z1)
        if p.z1 > p.z0:
            out.append(p)
    return closed(out)


def blank_of_comment(text: str, unit_mm: float) -> Profile | None:
    """Profile of the program's (WORKPIECE,CYLINDER,..) comment; None without one.  BORE: diameter of a hole through
    it."""
    found = [
        fields
        for shape, _, fields in (inside.partition(",") for inside in comments.insides(text, "WORKPIECE"))
        if shape.strip().upper() == "CYLINDER"
    ]
    if not found:
        return None
    axis = "Z"
    numbers: dict[str, float] = {}
    for part in found[0].split(","):
        key, number = (word.strip().upper() for word in part.partition("=")[::2])
        if key == "AXIS":
            axis = number
            continue
        try:
            numbers[key] = float(number) * unit_mm
        except ValueError:
            numbers[key] = math.nan
    if axis != "Z" or any(abs(numbers.pop(k, 0.0)) > 0.0 for k in "XY"):
        raise CycleError(
            "WORKPIECE comment: the cylinder is not about the Z axis of the lathe", "use AXIS=Z, without X and Y"
        )
    bore = numbers.pop("BORE", 0.0)
    if set(numbers) != {"DIAMETER", "ZMIN", "ZMAX"} or not all(map(math.isfinite, [bore, *numbers.values()])):
        raise CycleError(
            "WORKPIECE comment: DIAMETER, ZMIN and ZMAX are not all given as numbers",
            "write (WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0.5), BORE= for a hole",
        )
    d, z0, z1 = numbers["DIAMETER"], numbers["ZMIN"], numbers["ZMAX"]
    if not (0 <= bore < d and z0 < z1):
        raise CycleError("WORKPIECE comment: the blank has no extent", "give DIAMETER above BORE, and ZMAX above ZMIN")
    return Profile([flat(z0, z1, d / 2)], [flat(z0, z1, -bore / 2)] if bore else [], z0, z1)


def widest(profile: Profile) -> float:
    """Largest radius of a profile, mm."""
    return highest(profile.outside, -math.inf, math.inf)
