# SPDX-License-Identifier: GPL-2.0-or-later
"""List the factors of the measured spindle load, and forget those of a tool, so that its next cut teaches them again.

A factor is measured / predicted power of a tool in a material; chipwise-monitor keeps the first cut's. Forget it after
the tool was ground, or its edges were replaced. A running LinuxCNC sees the change at once.

Exit status: 0 done, 2 the file cannot be read or changed, or there is no such factor.
"""

import json
import os

from chipwise.options.machine import UsageError, add_file_of_machine, file_of_machine, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, printable, unnamed
from chipwise.tool_data import load_factors

NAME = "load-factors"
HELP = "list and reset the factors of the measured spindle load"

refuse = refuser(NAME)


def add_arguments(parser):
    add_file_of_machine(parser, "SPINDLE_LOADS", "factors")
    parser.add_argument(
        "--reset",
        nargs="+",
        action="append",
        default=[],
        metavar=("TOOL", "MATERIAL"),
        help="forget the factors of a tool, or the one in a material; may be repeated",
    )
    parser.add_argument("--json", metavar="FILE", help="the factors, for programs")
    parser.error = refuse


def run(options):
    """-> exit status."""
    try:
        path = file_of_machine(options, "SPINDLE_LOADS", refuse)
        check_outputs(
            refuse,
            {"--json": options.json},
            [("the file of the factors", path), ("the INI file", options.ini or os.environ.get("INI_FILE_NAME"))],
        )
        found, gone = _reset(path, options) if options.reset else (load_factors.read(path), set())
    except CycleError as error:
        refuse(unnamed(error))
    except OSError as error:
        raise UsageError(
            f"{NAME}: {path} cannot be written: {error.strerror}; make room, or correct [CHIPWISE]SPINDLE_LOADS"
        ) from error
    for tool, material in sorted(gone):
        print(printable(f"tool {tool} in {material}: reset, the next cut teaches it"))
    for (tool, material), factor in sorted(found.items()):
        print(printable(f"tool {tool} in {material}: {factor:.3f} times the predicted power"))
    if not found:
        print(printable(f"{path}: no factor is kept"))
    if options.json:
        factors = [
            {"tool": tool, "material": material, "factor": factor} for (tool, material), factor in sorted(found.items())
        ]
        write_output(NAME, options.json, json.dumps({"file": printable(path), "factors": factors}, indent=1) + "\n")
    return 0


def _reset(path, options):
    """-> the factors that are left, the keys of those that have gone."""
    with load_factors.changing(path) as found:
        gone = {key for words in options.reset for key in _keys(words, found, options, path)}
        for key in gone:
            del found[key]
    return found, gone


def _keys(words, found, options, path):
    """Those of one --reset."""
    if len(words) > 2 or not words[0].isdecimal():
        refuse(
            f"--reset {printable(' '.join(words))} is not a tool number and a material; write --reset 3, or --reset 3 "
            f"6061"
        )
    tool, material = int(words[0][:9]), _material(words[1], options) if len(words) > 1 else None
    keys = [key for key in found if key[0] == tool and material in (None, key[1])]
    if not keys:
        refuse(
            printable(
                f"{path} has no factor of tool {tool}"
                + (f" in {material}" if material else "")
                + f"; it has {_listed(found)}"
            )
        )
    return keys


def _listed(found):
    return ", ".join(f"tool {tool} in {material}" for tool, material in sorted(found)) or "none"


def _material(name, options):
    """The name under which factors of a material are kept; of one that no table has any more it is its own."""
    from chipwise.settings import load_settings
    from chipwise.tool_data.materials import find_material

    try:
        return find_material(name, load_settings(options.ini).path("MATERIALS")).name
    except CycleError:
        return name
