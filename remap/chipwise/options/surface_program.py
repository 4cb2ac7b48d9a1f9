# SPDX-License-Identifier: GPL-2.0-or-later
"""Options of `chipwise surface` -> requests, and plans -> the program and its figures.  Called by cli/surface.py and
filter/model.py."""

import math
import os
from dataclasses import dataclass, replace

from chipwise.options.machine import ini_of
from chipwise.errors import MM_PER_INCH, CycleError

MOST_MOVES = 20_000_000
STEP_SHARE = 0.5  # of the tool's diameter: the largest step-over if only a scallop is given
# option: (metavar, default in mm or None, smallest, may be the smallest, help)
LENGTHS = {
    "step": ("D", None, 0, False, "largest step-over"),
    "scallop": (
        "H",
        None,
        0,
        False,
        "height along the normal that the cuts may leave; the step-over adapts to the slope",
    ),
    "allowance": ("I", 0.0, 0, True, "left on the model all over (default: 0)"),
    "clearance": ("R", None, None, True, "clearance plane (default: 5 mm above model and stock)"),
    "relief": ("K", 1.0, 0, True, "tool relief at the ends of cuts (default: 1 mm)"),
    "floor": ("Z", None, None, True, "the tip goes no lower (default: the bottom of the model)"),
    "stock-top": ("Z", None, None, True, "top of the stock (default: the top of the model)"),
    "margin": ("MM", 0.0, 0, True, "how far the tool's centre goes beyond the model in X and Y (default: 0)"),
    "tolerance": ("MM", 0.01, 0, False, "how far the path may be above the exact one (default: 0.01 mm)"),
    "pixel": ("MM", None, 0, False, "size of a pixel (default: as the picture says, else 0.1 mm)"),
    "depth": ("MM", 5.0, 0, False, "from white to black (default: 5 mm)"),
    "cell": ("MM", None, 0, False, "of the map of the stock (default: [CHIPWISE]CELL)"),
    "rough": ("MM", None, 0, False, "in levels of at most this depth, only where there is stock"),
    "rest": ("MM", None, 0, False, "only where the stock is more than this above what the tool leaves"),
}


@dataclass(frozen=True)
class Planned:
    """One cut of a program: its options, its SurfaceRequest, its SurfacePlan, mm of a machine unit."""

    options: object
    request: object
    plan: object
    unit_mm: float


def planned(cuts, refuse, progress):
    """[Planned] of the options of each cut, each in the stock that those before have left.  progress(share) is
    called."""
    from chipwise.cycles.surface import surface_plan

    parts, earlier = [], ()
    for number, options in enumerate(cuts):
        request, unit_mm = request_of(options, refuse)
        request = replace(request, earlier=earlier)
        plan = surface_plan(request, lambda share, done=number: progress((done + share) / len(cuts)))
        parts.append(Planned(options, request, plan, unit_mm))
        earlier += (replace(request, earlier=()),)
    return parts


def unit_of(options):
    """ "mm" or "in": of the machine, whatever else is wrong."""
    from chipwise.ini import Ini

    try:
        return "in" if abs(1.0 / Ini(ini_of(options)).units_per_mm() - MM_PER_INCH) < 1e-6 else "mm"
    except CycleError:
        return "mm"


def _lengths(options, unit):
    """{name: mm or None} of LENGTHS as the options have them."""
    lengths = {}
    for name, (_metavar, default, *_rest) in LENGTHS.items():
        value = getattr(options, name.replace("-", "_"))
        lengths[name] = default if value is None else value * unit
    return lengths


def request_of(options, refuse):
    """(SurfaceRequest, mm of a machine unit)"""
    from chipwise.program.reader import Machine, Unreadable
    from chipwise.clib.height_map import Shape
    from chipwise.cycles.surface import SurfaceRequest
    from chipwise.settings import load_settings
    from chipwise.tool_data.table import diameter_of
    from chipwise.tool_data.geometry import ToolGeometry, tool_geometry

    try:
        machine = Machine(ini_of(options))
    except Unreadable as error:
        refuse(str(error).partition("; see")[0])
    settings, unit = load_settings(machine.ini), machine.unit_mm
    geometry = tool_geometry(settings.path("TOOL_GEOMETRY"), options.tool) or ToolGeometry()
    diameter, lengths = diameter_of(machine.table, options.tool) * unit, _lengths(options, unit)
    feed = 600.0 if options.feed is None else options.feed * unit
    return SurfaceRequest(
        file=options.model,
        stamp=(),
        placing=_placing(options, lengths, unit),
        bottom=lengths["floor"],
        clearance=lengths["clearance"],
        tool=Shape.of_tool(diameter, geometry),
        step=_step(lengths, diameter),
        feed=feed,
        plunge_feed=feed / 2 if options.plunge_feed is None else options.plunge_feed * unit,
        start=None,
        direction=float(options.direction),
        allowance=lengths["allowance"],
        relief=lengths["relief"],
        link=options.link,
        climb=not options.conventional,
        tolerance=lengths["tolerance"],
        stock_top=lengths["stock-top"],
        stock_is_model=True,
        cell=settings["CELL"] if lengths["cell"] is None else lengths["cell"],
        margin=lengths["margin"],
        most_moves=MOST_MOVES,
        scallop=lengths["scallop"],
        depth=lengths["rough"],
        least=lengths["rest"],
        ramp_angle=settings["RAMP_ANGLE"],
        traverse_clearance=settings["TRAVERSE_CLEARANCE"],
        flute_length=geometry.flute_length or 0.0,
    ), unit


def _placing(options, lengths, unit):
    """Placing of the model."""
    from chipwise.surface.model import Placing

    scale, wanted = (1.0, False) if options.scale is None else (options.scale, True)
    return Placing(tuple(value * unit for value in options.at), scale, lengths["pixel"], lengths["depth"], wanted)


def _step(lengths, diameter):
    """The largest step-over (mm): with a scallop alone STEP_SHARE of the diameter."""
    return STEP_SHARE * diameter if lengths["step"] is None else lengths["step"]


def program_text(parts):
    """The program: one tool after the other."""
    from chipwise.gcode_lines import texts

    first, unit_mm = parts[0], parts[0].unit_mm
    inch = unit_mm > 10
    size = " ".join(
        f"{axis}{low / unit_mm:.3f}..{high / unit_mm:.3f}"
        for axis, low, high in zip("XYZ", first.plan.low, first.plan.high)
    )
    name = "".join(
        c if c.isprintable() and c not in "()" else "_"
        for c in os.path.basename(first.options.model).encode("ascii", "replace").decode()
    )
    lines = [f"(chipwise surface: {name}, {size})", f"{'G20' if inch else 'G21'} G17 G40 G49 G54 G80 G90 G91.1 G94"]
    for part in parts:
        options, request, plan = part.options, part.request, part.plan
        kind = f", levels {request.depth / unit_mm:.4g}" if request.depth else ""
        kind += f", scallop {request.scallop / unit_mm:.4g}" if request.scallop else ""
        kind += f", rest {request.least / unit_mm:.4g}" if request.least else ""
        path = f"G64 P{0.2 * request.tolerance / unit_mm:.6f}"
        lines += [
            f"(tool {options.tool}, step-over {request.step / unit_mm:.4g}, direction {options.direction}, link "
            f"{options.link}{kind})",
            path,
            f"T{options.tool} M6",
            "G43",
            f"S{options.speed:g} M3",
            f"G0 Z{plan.clearance / unit_mm:.4f}",
            "G0 X{:.5f} Y{:.5f}".format(*(value / unit_mm for value in plan.first)),
        ]
        lines += texts(plan.moves, (*plan.first, plan.clearance), unit_mm, 5 if inch else 4, path)
        lines += ["G17", "M5"]
    return "\n".join([*lines, "M2", ""])


def figures_of(request, plan, seconds):
    """What was made: lengths in mm."""
    from chipwise.moves import Line, PlaneArc, Rapid

    at, feed_mm, rapid_mm = (*plan.first, plan.clearance), 0.0, 0.0
    for move in plan.moves:
        new = tuple(old if value is None else value for old, value in zip(at, (move.x, move.y, move.z)))
        length = math.dist(at, new)
        if isinstance(move, PlaneArc):
            twice = math.dist(at, move.centre) + math.dist(new, move.centre)
            length = twice * math.asin(min(1.0, length / twice))
        feed_mm, rapid_mm = (
            feed_mm + length * isinstance(move, (Line, PlaneArc)),
            rapid_mm + length * isinstance(move, Rapid),
        )
        at = new
    return {
        "cuts": plan.cuts,
        "sampled": plan.sampled,
        "moves": len(plan.moves),
        "arcs": sum(isinstance(move, PlaneArc) for move in plan.moves),
        "feed_mm": round(feed_mm, 3),
        "rapid_mm": round(rapid_mm, 3),
        "low": [round(v, 6) for v in plan.low],
        "high": [round(v, 6) for v in plan.high],
        "clearance": plan.clearance,
        "tolerance": request.tolerance,
        "seconds": round(seconds, 3),
        "notes": [CycleError(n.text, **n.lengths).text() for n in plan.notes],
    }
