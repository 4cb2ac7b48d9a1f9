# SPDX-License-Identifier: GPL-2.0-or-later
"""A job file of surfaces: a model and the cuts over it, one after the other -> the options of each cut.

Called by cli/surface.py and filter/model.py.  TOML; the keys are the options of `chipwise surface`, with _ for -:

    model = "part.stl"          # in the folder of the job file
    at = [20, 20, 0]
    link = 1                    # of all cuts that do not say it
    [[cut]]
    tool = 3
    step = 2.4
    rough = 1.5
    allowance = 0.3
    [[cut]]
    tool = 4
    step = 0.5
"""

import argparse
import math
import os
import tomllib

from chipwise.errors import CycleError, braceless, unnamed
from chipwise.host.files import read_bytes
from chipwise.options.machine import UsageError, add_ini, refuser
from chipwise.options.surface_program import LENGTHS

NAME = "surface"

refuse = refuser(NAME)

LARGEST = 1e5  # of any length option, machine units
MOST = 1e6  # of feeds, speed and scale

ENDING = ".toml"
MAX_BYTES, MAX_CUTS, MAX_SHOWN = 1 << 18, 50, 40
OF_THE_MODEL = ("model", "at", "scale", "pixel", "depth", "cell")  # not in a [[cut]]


def is_job(path):
    """Whether a path is that of a job file."""
    return path.lower().endswith(ENDING)


def read_job(path, defaults):
    """Options (Namespace) of each cut.  defaults: {name: value, None: not given} of the options.  Raises CycleError,
    with the file's name."""
    name = braceless(os.path.basename(path))
    try:
        table = tomllib.loads(read_bytes(path, MAX_BYTES).decode())
        cuts = table.pop("cut", None)
        if not (isinstance(cuts, list) and 0 < len(cuts) <= MAX_CUTS and all(isinstance(cut, dict) for cut in cuts)):
            raise CycleError(f"the job file has no [[cut]], or more than {MAX_CUTS}", "add [[cut]] with tool and step")
        common = {**defaults, **_values(table, "", defaults)}
        of_a_cut = [key for key in defaults if key not in OF_THE_MODEL]
        found = [
            argparse.Namespace(**{**common, **_values(cut, f" of cut {number}", of_a_cut)})
            for number, cut in enumerate(cuts, 1)
        ]
        for number, cut in enumerate(found, 1):
            for key in ("model", "tool", "step"):
                if getattr(cut, key) is None and (key != "step" or cut.scallop is None):
                    raise CycleError(f"{key} of cut {number} is missing", f"add {key} = ..")
            cut.model = os.path.join(os.path.dirname(os.path.abspath(path)), os.path.expanduser(cut.model))
        return found
    except OSError as error:
        raise CycleError(
            f"{name}: {braceless(error.strerror or str(error))}", "correct the name of the job file"
        ) from error
    except (ValueError, RecursionError) as error:  # UTF-8, TOML, a number of 5,000 digits, tables in tables in tables
        raise CycleError(f"{name}: {braceless(str(error))}", "correct the job file") from error
    except CycleError as error:
        raise CycleError(f"{name}: {error.problem}", error.remedy) from None


def _values(table, where, known):
    """The entries of a table, each of the type its option has."""
    found = {}
    for key, value in table.items():
        if key not in known:
            raise CycleError(f"{braceless(key)}{where} is not a key of a job file", "use " + ", ".join(sorted(known)))
        whole = isinstance(value, int) and not isinstance(value, bool)
        if key == "model":
            good, rule = isinstance(value, str) and value, "the name of a file"
        elif key == "at":
            good, rule = isinstance(value, list) and len(value) == 3 and all(map(_is_number, value)), "three lengths"
        elif key == "conventional":
            good, rule = isinstance(value, bool), "true or false"
        elif key in ("tool", "direction", "link"):
            good, rule = whole, "a whole number"
        else:
            good, rule = _is_number(value), "a number"
        if not good:
            raise CycleError(
                f"the job file has {key} = {braceless(repr(value)[:MAX_SHOWN])}{where}, which is not {rule}",
                "correct it",
            )
        found[key] = value
    return found


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def message_of(error, unit):
    """CycleError or UsageError -> text without the program's name."""
    if isinstance(error, UsageError):
        return str(error).removeprefix("surface: ").partition("; see chipwise")[0]
    return unnamed(error.text(unit))


def add_arguments(parser):
    parser.add_argument("model", metavar="MODEL", help="STL file, PNG picture with 8 or 16 bit, or job file .toml")
    parser.add_argument("-o", "--output", metavar="OUT.ngc", required=True, help="the program")
    parser.add_argument("--tool", type=int, metavar="N", help="number of the tool in the tool table")
    for name, (metavar, _default, _least, _closed, text) in LENGTHS.items():
        parser.add_argument(f"--{name}", type=float, metavar=metavar, help=text)
    parser.add_argument(
        "--direction", type=int, metavar="DEG", default=0, help="of the cuts, whole degrees to X (default: 0)"
    )
    parser.add_argument(
        "--link",
        type=int,
        metavar="0|1|2",
        default=0,
        help="0 over the clearance plane (default), 1 the lowest safe link, 2 zigzag",
    )
    parser.add_argument("--conventional", action="store_true", help="one-way cuts are conventional, not climb, with M3")
    parser.add_argument(
        "--at",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        default=(0.0, 0.0, 0.0),
        help="where the file's origin goes",
    )
    parser.add_argument("--scale", type=float, metavar="S", help="factor of the file's lengths (default: 1)")
    parser.add_argument("--feed", type=float, metavar="F", help="cutting feed, machine units/min (default: 600 mm/min)")
    parser.add_argument("--plunge-feed", type=float, metavar="E", help="plunge feed (default: half of --feed)")
    parser.add_argument("--speed", type=float, metavar="S", default=10000.0, help="spindle speed (default: 10000)")
    parser.add_argument("--json", metavar="FILE", help="the figures, for programs")
    add_ini(parser)
    parser.error = refuse


def cuts_of(options):
    """The options of each cut: those of the command, or of the job file it names."""
    if not is_job(options.model):
        for name in ("tool", "step"):
            if getattr(options, name) is None and (name == "tool" or options.scallop is None):
                refuse(f"--{name} is missing")
        return [options]
    given = [
        f"--{name.replace('_', '-')}"
        for name, value in job_defaults().items()
        if name != "model" and getattr(options, name) != value
    ]
    if given:
        refuse(f"{given[0]} is given beside a job file: write it into the file")
    cuts = read_job(options.model, job_defaults())
    for cut in cuts:
        cut.output, cut.json, cut.ini, cut.job = options.output, options.json, options.ini, options.model
    return cuts


def job_defaults():
    """{option: default} of what a job file may give."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    known = {action.dest: action.default for action in parser._actions if action.dest != "help"}
    return {name: value for name, value in known.items() if name not in ("output", "json", "ini")}


def check_options(options):
    """UsageError for what cannot be meant."""
    for name, (_metavar, _default, least, closed, _text) in LENGTHS.items():
        value = getattr(options, name.replace("-", "_"))
        if value is None:
            continue
        low = -LARGEST if least is None else least
        if not (low < value <= LARGEST or closed and value == low):
            kind = (
                f"a length from {-LARGEST:.0f}"
                if least is None
                else "a length of 0 or more"
                if closed
                else "a length above 0"
            )
            refuse(f"--{name} {value:g} is not {kind}, up to {LARGEST:.0f}")
    for name in ("feed", "plunge_feed", "speed", "scale"):
        value = getattr(options, name)
        if value is not None and not 0 < value <= MOST:
            refuse(f"--{name.replace('_', '-')} {value:g} is not a number above 0, up to {MOST:.0f}")
    if not all(abs(value) <= LARGEST for value in options.at):
        refuse("--at needs three lengths")
    if options.tool < 1:
        refuse(f"--tool {options.tool} is not the number of a tool")
