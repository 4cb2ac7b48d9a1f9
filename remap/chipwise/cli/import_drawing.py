# SPDX-License-Identifier: GPL-2.0-or-later
"""Make contour subs of a drawing: DXF or SVG -> a program whose subs G77, G78 and G79 take.

Chains are joined within the tolerance, arcs stay arcs, ellipses and splines become arcs within it. Closed loops are
sorted into pockets and islands, each layer has a sub, and the file ends with lines that are ready to use. All lengths
are written in mm.

Exit status: 0 done, 1 something of the drawing is open or unclear and was said, 2 the drawing cannot be used.
"""

import json
import math
import os

from chipwise.options.machine import UsageError
from chipwise.options.machine import refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.cli.picture import check_output, write_picture
from chipwise.errors import CycleError, printable, unnamed

NAME = "import"
HELP = "make contour subs of a DXF or SVG drawing"

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("drawing", metavar="DRAWING", help="FILE.dxf or FILE.svg")
    parser.add_argument("-o", "--output", required=True, metavar="SUB.ngc", help="program with the subs")
    parser.add_argument("--layer", metavar="L", help="only this layer (default: each layer that is on)")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.01,
        metavar="MM",
        help="of gaps that are joined, and of arcs for curves (default: 0.01)",
    )
    parser.add_argument("--scale", type=float, default=1.0, metavar="S", help="multiplies all lengths (default: 1)")
    parser.add_argument("--text", action="store_true", help="texts of a DXF as outlines")
    parser.add_argument("--picture", metavar="FILE", help="FILE.svg or FILE.png of what was read")
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs")
    parser.error = refuse


def run(options):
    """-> exit status."""
    for name, low, high in (("tolerance", 1e-4, 1.0), ("scale", 1e-6, 1e6)):
        value = getattr(options, name)
        if not (math.isfinite(value) and low <= value <= high):
            refuse(f"--{name} {value:g} is not from {low:g} to {high:g}")
    check_outputs(
        refuse,
        {"-o": options.output, "--picture": options.picture, "--json": options.json},
        [("the drawing", options.drawing)],
    )
    from chipwise.importing.run import imported
    from chipwise.importing.sub import program

    try:
        if options.picture:
            check_output(options.picture)
        found = imported(options.drawing, options.tolerance, options.scale, options.text, options.layer)
        text, numbers = program(found, os.path.basename(options.drawing), options.tolerance)
        write_output(NAME, options.output, text)
        if options.picture:
            from chipwise.drawing.imported import svg

            write_picture(svg(found, os.path.basename(options.drawing)), options.picture)
    except CycleError as error:
        raise UsageError(printable(f"{NAME}: " + unnamed(error.text("mm")))) from error
    if options.json:
        write_output(NAME, options.json, json.dumps(_figures(found, numbers), indent=1) + "\n")
    print("\n".join(map(printable, [*found.words, *_rows(found, numbers), f"program: {options.output}"])))
    return 1 if found.doubtful else 0


def _rows(found, numbers):
    """A line for each layer."""
    for layer in found.layers:
        own = numbers[layer.name]
        first = f"sub O{own[0][1]}" if own else "no sub"
        area = sum(layer.areas)
        yield (
            f"layer {layer.name}: {first}, {len(layer.pockets)} pockets, "
            f"{sum(len(islands) for _, islands in layer.pockets)} islands, "
            f"{area:.3f} mm2, {len(layer.open)} open chains"
        )


def _figures(found, numbers):
    """What --json holds."""
    return {
        "layers": [
            {
                "layer": layer.name,
                "subs": [{"what": what, "number": number} for what, number in numbers[layer.name]],
                "pockets": [
                    {"area_mm2": area, "islands": len(islands)}
                    for area, (_, islands) in zip(layer.areas, layer.pockets)
                ],
                "open": len(layer.open),
            }
            for layer in found.layers
        ],
        "words": found.words,
        "left_out": found.left,
        "gaps": found.gaps,
        "widest_gap_mm": found.widest,
        "doubtful": found.doubtful,
    }
