# SPDX-License-Identifier: GPL-2.0-or-later
"""List, check and edit the stations taught with M255.

A station is usable with points 1, 2 and 3. Lengths are mm, machine coordinates of the tool's tip. The residual is the
distance of a point from the station's XY plane: with three points it is 0 and says nothing.

Exit status: 0 all stations are usable, 1 one is not, 2 the file cannot be read or changed.
"""

import json
import math
import os

from chipwise.options.machine import add_file_of_machine, file_of_machine, refuser
from chipwise.cli.output import check_outputs, write_output
from chipwise.errors import CycleError, format_length, unnamed
from chipwise.stations import frame, store

NAME = "stations"
HELP = "list, check and edit the stations of M255"

refuse = refuser(NAME)


def add_arguments(parser):
    add_file_of_machine(parser, "STATIONS", "stations")
    parser.add_argument(
        "--error", type=float, default=0.01, metavar="MM", help="how far a taught point may be off (default: 0.01)"
    )
    parser.add_argument(
        "--at", nargs=3, type=float, metavar=("X", "Y", "Z"), help="the error there too, in coordinates of the station"
    )
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs")
    change = parser.add_mutually_exclusive_group()
    change.add_argument(
        "--set",
        nargs=5,
        action="append",
        default=[],
        metavar=("P", "Q", "X", "Y", "Z"),
        help="put a point into a station; may be repeated",
    )
    change.add_argument(
        "--level",
        type=int,
        action="append",
        default=[],
        metavar="P",
        help="give all points of a station the Z of point 1; may be repeated",
    )
    change.add_argument(
        "--remove", type=int, action="append", default=[], metavar="P", help="remove a station; may be repeated"
    )
    parser.error = refuse


def run(options):
    """-> exit status."""
    if not (math.isfinite(options.error) and 0 < options.error <= 100):
        refuse(f"--error {options.error:g} is not a length above 0 mm, at most 100")
    if options.at and not all(map(math.isfinite, options.at)):
        refuse("--at needs three finite numbers")
    try:
        path = file_of_machine(options, "STATIONS", refuse)
        check_outputs(
            refuse,
            {"--json": options.json},
            [("the file of the stations", path), ("the INI file", options.ini or os.environ.get("INI_FILE_NAME"))],
        )
        change(path, options)
        found = {number: figures(points, options) for number, points in sorted(store.load(path).items())}
    except CycleError as error:
        refuse(unnamed(error))
    print(
        "\n".join(line for number, result in found.items() for line in text_of(number, result))
        or f"{path}: there are no stations"
    )
    if options.json:
        write_output(NAME, options.json, json.dumps({"file": path, "stations": found}, indent=1) + "\n")
    return 1 if any("problem" in result for result in found.values()) else 0


def change(path, options):
    """--set, --level, --remove: all of them, or none if one cannot be done."""
    taught = [_point(words) for words in options.set]
    for number in options.level:
        points = _station(path, number)
        if frame.ORIGIN not in points:
            refuse(f"station {number} has no point 1, whose Z the others would get")
        taught += [(number, point, (x, y, points[frame.ORIGIN][2])) for point, (x, y, _z) in points.items()]
    removed = list(dict.fromkeys(options.remove))
    for number in removed:
        _station(path, number)
    for point in taught:
        store.teach(path, *point)
    for number in removed:
        store.remove(path, number)


def _point(words):
    """--set -> (station, point, place)."""
    numbers = [
        _whole(text, most, what)
        for text, most, what in zip(words, (store.MAX_STATION, store.MAX_POINT), ("station P", "point Q"))
    ]
    place = [_length(text) for text in words[2:]]
    frame.check_point(numbers[1], place)
    return (*numbers, place)


def _station(path, number):
    """The points of a station that is there."""
    stations = store.load(path)
    if number not in stations:
        refuse(f"{path}: there is no station {number}; there are {', '.join(map(str, sorted(stations))) or 'none'}")
    return stations[number]


def _whole(text, most, what):
    if not (text.isascii() and text.isdigit() and len(text) <= 4 and 1 <= int(text) <= most):
        refuse(f"--set: {what}{text} is not from 1 to {most}")
    return int(text)


def _length(text):
    try:
        return float(text)
    except ValueError:
        refuse(f"--set: {text} is not a number")


def figures(points, options):
    """What is to be said of a station."""
    found = {"points": {str(number): list(place) for number, place in sorted(points.items())}}
    try:
        made = frame.frame_of(points)
    except CycleError as error:
        return {**found, "problem": unnamed(error)}
    found.update(
        origin=list(made.origin),
        matrix=[list(row) for row in made.matrix],
        tilt=made.tilt,
        turn=math.degrees(math.atan2(made.matrix[1][0], made.matrix[0][0])),
        residuals=made.residuals,
        error=options.error,
        error_at_points=max(made.predicted_error(made.local(place), options.error) for _, place in made.points),
    )
    if options.at:
        found.update(at=options.at, error_at=made.predicted_error(options.at, options.error))
    return found


def text_of(number, result):
    """Lines for the terminal."""
    points = result["points"]
    if "problem" in result:
        yield f"station {number}: not usable: {result['problem']}"
    else:
        yield (
            f"station {number}: X axis at {round(result['turn'], 4) + 0.0:.4f} degrees, tilt {result['tilt']:.4f} "
            f"degrees"
        )
    for name, place in points.items():
        residual = (
            f"   residual {result['residuals'][int(name)]:+.4f}" if len(points) > 3 and "problem" not in result else ""
        )
        yield f"  point {name:>2} " + " ".join(f"{axis}{value:.4f}" for axis, value in zip("XYZ", place)) + residual
    if "problem" not in result:
        yield (
            f"  if each point is off by {format_length(result['error'])}, the station is off by up to "
            f"{format_length(result['error_at_points'])} at the points"
            + (
                f", {format_length(result['error_at'])} at X{result['at'][0]:g} Y{result['at'][1]:g} "
                f"Z{result['at'][2]:g}"
                if "at" in result
                else ""
            )
        )
