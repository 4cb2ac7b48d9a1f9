# SPDX-License-Identifier: GPL-2.0-or-later
"""List, show, add and remove the set-ups of clamps of a machine: what M256 P.. puts in force.

Lengths are mm, machine coordinates.

Exit status: 0 done, 2 the file or an argument cannot be used.
"""

import json
import os

from chipwise.clamps import set_ups
from chipwise.options.machine import add_file_of_machine, file_of_machine, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, unnamed
from chipwise.stock.shape_comment import CYLINDER

NAME = "clamps"
HELP = "list, show, add and remove the clamps of M256"

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument(
        "action",
        nargs="?",
        choices=("list", "show", "add", "remove"),
        default="list",
        help="list: all set-ups; show P; add P CLAMP with --box or --cylinder; remove P [CLAMP]",
    )
    parser.add_argument("set_up", nargs="?", metavar="P", help="number of a set-up")
    parser.add_argument("clamp", nargs="?", metavar="CLAMP", help="name of a clamp")
    add_file_of_machine(parser, "CLAMPS", "set-ups")
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument(
        "--box", nargs=6, type=float, metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"), help="corners of the clamp"
    )
    shape.add_argument(
        "--cylinder",
        nargs=5,
        type=float,
        metavar=("X", "Y", "Z0", "Z1", "D"),
        help="axis, ends and diameter of the clamp",
    )
    parser.add_argument("--name", metavar="TEXT", help="name of the set-up")
    parser.add_argument("--json", metavar="FILE", help="the set-ups, for programs (-: standard output)")
    parser.error = refuse


def run(options):
    """-> exit status."""
    try:
        path = file_of_machine(options, "CLAMPS", refuse)
        check_outputs(
            refuse,
            {"--json": options.json},
            [("the file of the set-ups", path), ("the INI file", options.ini or os.environ.get("INI_FILE_NAME"))],
        )
        change(path, options)
        found = set_ups.load(path)
    except CycleError as error:
        refuse(unnamed(error))
    if options.action != "list" and options.action != "remove":
        number = _number(options)
        if number not in found:
            _missing(path, number, found)
        found = {number: found[number]}
    if options.json != "-":
        print(
            "\n".join(line for number, one in sorted(found.items()) for line in text_of(number, one, options.action))
            or f"{path}: there are no set-ups"
        )
    if options.json:
        write_output(
            NAME,
            options.json,
            json.dumps(
                {"file": path, "set_ups": {number: figures(one) for number, one in sorted(found.items())}}, indent=1
            )
            + "\n",
        )
    return 0


def change(path, options):
    """add, remove; nothing of the others."""
    shape = "box" if options.box else "cylinder" if options.cylinder else None
    if options.action != "add" and (shape or options.name is not None):
        refuse(f"{options.action} takes neither --box, --cylinder nor --name; use add")
    if options.action == "list" and options.set_up is not None:
        refuse("list takes no number; use show")
    if options.action in ("list", "show"):
        return
    number = _number(options)
    if options.action == "add":
        if options.clamp is None or shape is None:
            refuse("add needs the name of a clamp, and --box or --cylinder")
        if not set_ups.CLAMP_NAME.fullmatch(options.clamp):
            refuse(f"{options.clamp[:50]} is not a name of at most 40 letters, digits, - and _")
        set_ups.add(path, number, options.clamp, shape, options.box or options.cylinder, options.name)
        return
    found = set_ups.load(path)
    if number not in found:
        _missing(path, number, found)
    if options.clamp is not None and options.clamp not in found[number].clamps:
        refuse(f"set-up {number} has no clamp {options.clamp[:50]}; it has {', '.join(found[number].clamps) or 'none'}")
    set_ups.remove(path, number, options.clamp)


def _missing(path, number, found):
    refuse(f"{path}: there is no set-up {number}; there are {', '.join(map(str, sorted(found))) or 'none'}")


def _number(options):
    text = options.set_up or ""
    if not (text.isascii() and text.isdigit() and len(text) <= 4 and 1 <= int(text) <= set_ups.MAX_SET_UP):
        refuse(f"the number of a set-up, {text[:20] or 'none'}, is not from 1 to {set_ups.MAX_SET_UP}")
    return int(text)


def figures(one):
    """A set-up for --json."""
    return {
        "name": one.name,
        "clamps": {
            name: {"shape": _shape(clamp), "min": clamp.low, "max": clamp.high} for name, clamp in one.clamps.items()
        },
    }


def _shape(clamp):
    return "cylinder" if clamp.shape == CYLINDER else "box"


def text_of(number, one, action):
    """Lines for the terminal."""
    title = f"set-up {number}" + (f" ({one.name})" if one.name else "")
    count = len(one.clamps)
    yield f"{title}: {count} clamp{'s' * (count != 1)}"
    for name, clamp in one.clamps.items() if action in ("show", "add") else ():
        corners = [
            " ".join(f"{axis}{value:.4f}" for axis, value in zip("XYZ", corner)) for corner in (clamp.low, clamp.high)
        ]
        yield f"  {name}: {_shape(clamp)} from {corners[0]} to {corners[1]}"
