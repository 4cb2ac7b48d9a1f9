# SPDX-License-Identifier: GPL-2.0-or-later
"""A job file of surfaces: a model and the cuts over it, one after the other -> the options of each cut.

Called by surface.py and filter/model.py.  TOML; the keys are the options of `chipwise surface`, with _ for -:

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

from chipwise.cli import UsageError
from chipwise.errors import CycleError, braceless, unnamed
from chipwise.files import read_bytes

ENDING = ".toml"
MAX_BYTES, MAX_CUTS, MAX_SHOWN = 1 << 18, 50, 40
OF_THE_MODEL = ("model", "at", "scale", "pixel", "depth", "cell")       # not in a [[cut]]


def is_job(path):
    """Whether a path is that of a job file."""
    return path.lower().endswith(ENDING)


def read_job(path, defaults):
    """Options (Namespace) of each cut.  defaults: {name: value, None: not given} of the options.  Raises CycleError, with the file's name."""
    name = braceless(os.path.basename(path))
    try:
        table = tomllib.loads(read_bytes(path, MAX_BYTES).decode())
        cuts = table.pop("cut", None)
        if not (isinstance(cuts, list) and 0 < len(cuts) <= MAX_CUTS and all(isinstance(cut, dict) for cut in cuts)):
            raise CycleError(f"the job file has no [[cut]], or more than {MAX_CUTS}", "add [[cut]] with tool and step")
        common = {**defaults, **_values(table, "", defaults)}
        of_a_cut = [key for key in defaults if key not in OF_THE_MODEL]
        found = [argparse.Namespace(**{**common, **_values(cut, f" of cut {number}", of_a_cut)}) for number, cut in enumerate(cuts, 1)]
        for number, cut in enumerate(found, 1):
            for key in ("model", "tool", "step"):
                if getattr(cut, key) is None and (key != "step" or cut.scallop is None):
                    raise CycleError(f"{key} of cut {number} is missing", f"add {key} = ..")
            cut.model = os.path.join(os.path.dirname(os.path.abspath(path)), os.path.expanduser(cut.model))
        return found
    except OSError as error:
        raise CycleError(f"{name}: {braceless(error.strerror or str(error))}", "correct the name of the job file") from error
    except (ValueError, RecursionError) as error:           # UTF-8, TOML, a number of 5,000 digits, tables in tables in tables
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
            raise CycleError(f"the job file has {key} = {braceless(repr(value)[:MAX_SHOWN])}{where}, which is not {rule}", "correct it")
        found[key] = value
    return found


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def message_of(error, unit):
    """CycleError or UsageError -> text without the program's name."""
    if isinstance(error, UsageError):
        return str(error).removeprefix("surface: ").partition("; see chipwise")[0]
    return unnamed(error.text(unit))
