# SPDX-License-Identifier: GPL-2.0-or-later
"""Draw a contour sub with a tool: finish shape, centre path, rough shape, inaccessible regions.

The contours of a sub with several are boundaries of pockets and their islands, sorted by nesting
(as for G79); a single one has the tool on its left (41) or right (42), as for G77 and G78.
Lengths without a suffix: --tool in the unit of the INI file's machine (mm without one); --at and the
list in the unit of the program (its first G20 or G21, else the machine's).
"""

import math
import os
import re

import numpy as np

from chipwise.contour_sub import read
from chipwise.program.find_sub import MAX_BYTES, program_unit
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.parameters import OWN, check, hint_set
from chipwise.options.machine import UsageError
from chipwise.cli.output import check_outputs
from chipwise.cli.picture import check_output, write_picture
from chipwise.errors import MM_PER_INCH, CycleError, format_length, printable, unnamed
from chipwise.host.files import read_bytes
from chipwise.drawing.data import Drawing, middle, offset, wrong
from chipwise.geometry.base import elements
from chipwise.geometry.offset.inaccessible import InaccessibleRegion
from chipwise.geometry.pocket import nesting
from chipwise.ini import Ini
from chipwise.settings import load_settings

NAME = "contour"
HELP = "draw a contour sub, the centre path of a tool along it and what it cannot reach"

LARGEST_TOOL_MM = 2000.0  # radii to 1 km are tested


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="G-code file; the sub is looked for as LinuxCNC does")
    parser.add_argument("--sub", required=True, metavar="Q", help="number of the O-sub with the contour")
    parser.add_argument("--tool", required=True, metavar="D", help="diameter: 6 (machine units), 6mm, 0.25in")
    parser.add_argument("--side", choices=("41", "42"), help="tool left (41, default) or right (42) of the contour")
    parser.add_argument("-o", "--output", metavar="FILE", help="picture: FILE.svg or FILE.png")
    parser.add_argument("--ini", metavar="FILE", help="INI file of the machine (default: INI_FILE_NAME, else none)")
    parser.add_argument(
        "--at",
        nargs=2,
        type=float,
        metavar=("X", "Y"),
        help="position of the tool when the sub is called, for a sub that does not begin with G0 X Y",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter the program would have set: --set _width=40 --set 100=3",
    )
    parser.error = refuse


def refuse(text):
    """argparse's own messages in our form."""
    raise UsageError(f"{NAME}: {text}; see chipwise {NAME} --help")


def run(options):
    """-> exit status."""
    from chipwise.drawing.contour import svg

    try:
        if options.output:
            check_output(options.output)
            check_outputs(
                refuse, {"-o": options.output}, [("the program", options.program), ("the INI file", ini_of(options))]
            )
        drawing = make_drawing(options)
        if options.output:
            write_picture(svg(drawing), options.output)
        print("\n".join([*report(drawing), *([f"picture: {options.output}"] if options.output else [])]))
    except CycleError as error:
        raise UsageError(f"{NAME}: " + unnamed(error.text(error_unit(options)))) from error
    return 0


# ---- options ---------------------------------------------------------------------------------------------


def machine_unit(ini):
    """mm of a machine unit."""
    if not ini:
        return 1.0
    return 1.0 / Ini(ini).units_per_mm()


def read_program(path):
    """Text of the program."""
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise wrong(f"{path}: {error.strerror}", "name a G-code file that can be read") from error


def error_unit(options):
    """Unit of a message, whatever else is wrong."""
    try:
        return program_unit(read_program(options.program), machine_unit(ini_of(options)))
    except CycleError:
        return "mm"


def ini_of(options):
    return options.ini or os.environ.get("INI_FILE_NAME", "")


def tool_diameter(text, unit_mm):
    """--tool -> mm."""
    match = re.fullmatch(r"\s*([^a-z]+|nan|inf)\s*(mm|in|inch)?\s*", text.lower())
    try:
        value = float(match.group(1)) if match else math.nan
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise wrong(f"--tool {text} is not a diameter", "use a number, with mm or in behind it: 6, 6mm, 0.25in")
    value *= {"mm": 1.0, None: unit_mm}.get(match.group(2), MM_PER_INCH)
    if not 0.0 < value <= LARGEST_TOOL_MM:
        raise wrong(
            f"--tool {text}: the diameter is not above 0 and up to {LARGEST_TOOL_MM:g} mm",
            "give the diameter of the tool",
        )
    return value


def sub_number(text):
    match = re.fullmatch(r"[oO]?(\d{1,9})", text.strip())
    if not match:
        raise wrong(f"--sub {text} is not the number of an O-sub", "use --sub 100 for O100 sub")
    return int(match.group(1))


def parameters(given):
    """--set -> (numbered, named) as Job takes them."""
    numbered, named = [], []
    for text in given:
        name, equals, value = text.partition("=")
        name = name.strip().lstrip("#").strip("<>").lower()
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not equals or not math.isfinite(number) or not re.fullmatch(r"[1-9]\d*|_[a-z0-9_-]+", name):
            raise wrong(
                f"--set {text} is not a parameter and its value",
                "use --set _name=value (a global name) or --set 100=value",
            )
        (numbered if name.isdigit() else named).append((int(name) if name.isdigit() else name, number))
    return tuple(sorted(numbered)), tuple(sorted(named))


def make_drawing(options):
    """Drawing of what the options name."""
    text, ini = read_program(options.program), ini_of(options)
    unit_mm = machine_unit(ini)
    tool, unit = tool_diameter(options.tool, unit_mm), program_unit(text, unit_mm)
    numbered, named = parameters(options.set)
    scale = MM_PER_INCH if unit == "in" else 1.0
    if options.at and not all(map(math.isfinite, options.at)):
        raise wrong("--at is not a position", "give two numbers")
    job = Job(
        program=options.program,
        sub=sub_number(options.sub),
        ini=ini,
        unit=unit,
        machine_unit=unit_mm,
        position=(scale * options.at[0], scale * options.at[1], 0.0) if options.at else None,
        tool=(1, tool / unit_mm),
        numbered=numbered,
        named=named,
        close_gap=load_settings(ini)["CLOSE_GAP"],
    )
    check(job, OWN)
    try:
        shape = read.read_shape(job)
    except CycleError as error:
        hint_set(error)
        raise
    contours = read.contours(shape)
    result, where = offset(shape, contours, options.side, tool)
    title = printable(f"O{shape.sub} in {os.path.basename(shape.file)}")
    middles = tuple(middle(u) for u in result.inaccessible if isinstance(u, InaccessibleRegion))
    return Drawing(title, unit, tool, where, contours, result, middles, shape.close_gap)


# ---- the list -----------------------------------------------------------------------------------------------


def report(drawing):
    """Lines of text."""
    scale = 1.0 / (MM_PER_INCH if drawing.unit == "in" else 1.0)
    yield f"{drawing.title}, tool {tool_text(drawing)} {drawing.where}"
    unit = drawing.unit
    yield f"{'':22}{'elements':>9}{'lines':>7}{'arcs':>7}{'length ' + unit:>14}{'area ' + unit + '2':>16}"
    runs = [(name, c.elements, c.closed) for name, c in zip(names(drawing), drawing.contours)]
    for kind, found in (("centre path", drawing.result.paths), ("rough shape", drawing.result.rough)):
        runs += [
            (f"{kind} {k}" + ("" if run.closed else ", open"), run.elements, run.closed)
            for k, run in enumerate(found, 1)
        ]
    for name, e, closed in runs:
        yield row(name, e, closed, scale)
    if drawing.result.paths and not drawing.result.rough:
        yield "contours meet: no rough shape; the boundaries of the regions are chords"
    if not drawing.result.paths:
        yield "the tool fits nowhere along it"
    yield from inaccessible(drawing, scale)


def names(drawing):
    """What each contour of a Drawing is."""
    count = len(drawing.contours)
    if count == 1:
        return ["finish shape"]
    pockets = nesting.sort(drawing.contours, drawing.close_gap).pockets
    found = {id(island): f"island {k}" for k, island in enumerate((i for _, islands in pockets for i in islands), 1)}
    found.update(
        {
            id(boundary): "boundary" if len(pockets) == 1 else f"boundary {k}"
            for k, (boundary, _) in enumerate(pockets, 1)
        }
    )
    return [found.get(id(contour), "drawn twice") for contour in drawing.contours]


def tool_text(drawing):
    return format_length(drawing.tool, drawing.unit)


def row(name, e, closed, scale):
    arcs = int(np.count_nonzero(e.is_arc))
    surface = f"{abs(elements.area(e)) * scale**2:16.4f}" if closed and len(e) else f"{'-':>16}"
    return f"{name:22}{len(e):9}{len(e) - arcs:7}{arcs:7}{elements.lengths(e).sum() * scale:14.4f}{surface}"


def inaccessible(drawing, scale):
    """Lines of text about what the tool cannot reach."""
    regions = drawing.regions
    total = sum(region.area for region in regions) * scale**2
    yield f"inaccessible regions: {len(regions)}" + (f", {total:.4f} {drawing.unit}2 together" if regions else "")
    for number, (region, (x, y)) in enumerate(zip(regions, drawing.middles), 1):
        size = region.area * scale**2
        size = f"{size:.4f}" if size >= 0.01 else f"{size:.3g}"
        yield (f"{number:5}  X{x * scale:.4f} Y{y * scale:.4f}  {size} {drawing.unit}2  {lines_text(region.lines)}")
    if drawing.segments:
        yield f"contour segments without a centre path: {len(drawing.segments)}"
    for segment in drawing.segments:
        x, y = segment.elements.start[0] * scale
        length = elements.lengths(segment.elements).sum() * scale
        yield (f"{'':5}  from X{x:.4f} Y{y:.4f}  {length:.4f} {drawing.unit}  {lines_text(segment.lines)}")


def lines_text(numbers):
    """Source lines as "line 12" or "lines 3, 4, 5, .. 90"."""
    numbers = [str(n) for n in numbers]
    if len(numbers) > 12:
        numbers = [*numbers[:11], ".. " + numbers[-1]]
    return ("line " if len(numbers) == 1 else "lines ") + ", ".join(numbers)
