# SPDX-License-Identifier: GPL-2.0-or-later
"""List the patterns of a library with a picture.

A library is a folder of subs for G75: a file N.ngc for each, with sub O N and a first comment (name: description). The
folders are those of [CHIPWISE]PATTERNS. Each sub is run as G75 would run it, from Z10 above its origin. Any other file
is named and skipped.

Exit status: 0 all files are patterns that G75 finds, 1 one is not, 2 there is no library.
"""

import json
import os

from chipwise.cli import contour
from chipwise.options.machine import add_ini, ini_of, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.cli.picture import check_output, write_picture
from chipwise.errors import MM_PER_INCH, CycleError, format_length, printable, unnamed
from chipwise.pattern import library
from chipwise.settings import load_settings

NAME = "patterns"
HELP = "list the patterns of a library for G75, with a picture"

refuse = refuser(NAME)


def add_arguments(parser):
    add_ini(parser)
    parser.add_argument(
        "--folder", metavar="DIR", action="append", help="the library (default: [CHIPWISE]PATTERNS of the INI file)"
    )
    parser.add_argument(
        "--tool",
        default="3mm",
        metavar="D",
        help="diameter the subs are run with: 6 (machine units), 6mm, 0.25in (default: 3mm)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter the program would have set: --set _width=40 --set 100=3",
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="picture of all of them: FILE.svg or FILE.png")
    parser.add_argument("--json", metavar="FILE", help="the list, for programs")
    parser.error = refuse


def run(options):
    """-> exit status."""
    options.ini, options.output, options.json = (
        os.path.abspath(path) if path else path for path in (ini_of(options), options.output, options.json)
    )
    try:
        if options.output:
            check_output(options.output)
        unit_mm = contour.machine_unit(options.ini)
        paths = files_of(folders_of(options))
        check_outputs(
            refuse,
            {"-o": options.output, "--json": options.json},
            [*(("a pattern", path) for path in paths), ("the INI file", options.ini)],
        )
        entries, skipped = entries_of(options, paths, unit_mm)
        unit = "in" if unit_mm == MM_PER_INCH else "mm"
        hidden = {
            entry.path: other for entry in entries for other in [elsewhere(entry, options.ini)] if other != entry.path
        }
        print("\n".join(line for entry in entries for line in text_of(entry, unit, hidden)) or "there are no patterns")
        for bad in skipped:
            print(printable(f"skipped: {bad.path}: {bad.problem}"))
        if options.output:
            from chipwise.drawing.patterns import svg

            write_picture(svg(entries, unit), options.output)
            print(f"picture: {printable(options.output)}")
    except CycleError as error:
        refuse(unnamed(error))
    if options.json:
        found = {
            "patterns": [figures(entry, hidden) for entry in entries],
            "skipped": [{"file": printable(bad.path), "problem": bad.problem} for bad in skipped],
        }
        write_output(NAME, options.json, json.dumps(found, indent=1) + "\n")
    return 1 if skipped or hidden else 0


def folders_of(options):
    """Absolute paths of the library's folders that are there."""
    settings = load_settings(options.ini)
    named = [os.path.abspath(folder) for folder in options.folder or ()] or [
        os.path.join(settings.folder, os.path.expanduser(folder))
        for folder in settings["PATTERNS"].split(":")
        if folder
    ]
    there = list(dict.fromkeys(os.path.normpath(folder) for folder in named if os.path.isdir(folder)))
    if not there:
        refuse(
            printable(
                f"there is no folder {', '.join(named)}; make it, or name it in [CHIPWISE]PATTERNS or with --folder"
            )
        )
    return there


def files_of(folders):
    """Paths of the patterns in folders."""
    paths = []
    for folder in folders:
        try:
            paths += library.files_of(folder)
        except OSError as error:
            refuse(printable(f"{folder}: {error.strerror}"))
    return paths


def entries_of(options, paths, unit_mm):
    """([Entry], [Skipped]) of files."""
    tool = contour.tool_diameter(options.tool, unit_mm)
    caller = library.Caller(options.ini, unit_mm, tool, *contour.parameters(options.set))
    os.chdir(os.path.dirname(options.ini))  # as LinuxCNC: its relative paths count from there
    found = [library.read_entry(path, caller) for path in paths]
    return (
        [entry for entry in found if isinstance(entry, library.Entry)],
        [entry for entry in found if isinstance(entry, library.Skipped)],
    )


def elsewhere(entry, ini):
    """The file in which G75 finds the number of a pattern: its own, another one, or None."""
    path = library.found_by_g75(entry.number, os.path.dirname(ini), ini)
    return entry.path if path and os.path.samefile(path, entry.path) else path


def text_of(entry, unit, hidden):
    """Lines for the terminal."""
    (low, high), moves = entry.box(), len(entry.recorded.moves)
    yield printable(f"O{entry.number} {entry.name}" + (f": {entry.text}" if entry.text else ""))
    yield printable(
        f"  {', '.join(f'{axis} {_short(a, unit)} to {_length(b, unit)}' for axis, a, b in zip('XYZ', low, high))}, "
        f"{moves} "
        f"move{'s' if moves > 1 else ''}, {entry.path}"
    )
    if entry.path in hidden:
        other = hidden[entry.path]
        yield printable(
            f"  G75 Q{entry.number} "
            + (
                f"runs {other}: it comes first on the SUBROUTINE_PATH"
                if other
                else f"does not find it: put {os.path.dirname(entry.path)} on the SUBROUTINE_PATH"
            )
        )


def _short(value, unit):
    """A length without its unit."""
    return _length(value, unit).split()[0]


def _length(value, unit):
    """To a hundredth of a mm: arcs are measured by chords."""
    return format_length(round(value, 2) if unit == "mm" else MM_PER_INCH * round(value / MM_PER_INCH, 3), unit)


def figures(entry, hidden):
    """What a program gets of a pattern."""
    low, high = entry.box()
    return {
        "number": entry.number,
        "name": entry.name,
        "text": entry.text,
        "file": printable(entry.path),
        "moves": len(entry.recorded.moves),
        "low": low,
        "high": high,
        "found": entry.path not in hidden,
    }
