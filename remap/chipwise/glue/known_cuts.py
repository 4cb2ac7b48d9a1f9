# SPDX-License-Identifier: GPL-2.0-or-later
"""The G24 lines before this one, as far as a run and its preview both know them: their cuts are taken out of the stock.

Called by surface.py.  M250 and M254 (stock_codes.py) and the beginning of another context (session.begin) end them.  A
line that run from line reads over is not among them, so the stock is taken to be fuller than it may be, never emptier.

The requests are kept here under a number that is kept in the interpreter, because each preview has a new one while this
module stays loaded.  No program can write the parameter: to LinuxCNC's parser a name ends at ">".
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Mapping

if TYPE_CHECKING:
    from chipwise.program.interp import Interp

NAME = "_chipwise>surface_cuts"
MOST_RUNS, MOST_LINES = 8, 50  # that are kept; of more lines the first ones are forgotten

_numbers = itertools.count(1)
Place = tuple[tuple[float, float, float], float]  # of zero in machine coordinates, and their rotation
_kept: dict[int, list[tuple[Place, dict[str, object]]]] = {}  # number of a run: [(frame, fields)]


def forget(interp: Interp) -> None:
    """The stock is another one."""
    if NAME in interp.params.globals():
        _kept.pop(int(interp.params[NAME]), None)
        del interp.sub_context[0].named_params[NAME]


def before(interp: Interp, frame: Place, fields: Mapping[str, object]) -> tuple[tuple, ...]:
    """The requests before, each as a tuple of pairs: those with the same model at the same place of the machine.

    frame   where the work coordinates are: anything that can be compared
    fields  of this request
    """
    same = [
        (where, known)
        for where, known in _lines(interp)
        if where == frame and all(known[key] == fields[key] for key in ("file", "stamp", "placing"))
    ]
    return tuple(tuple(known.items()) for _where, known in same)


def add(interp: Interp, frame: Place, fields: Mapping[str, object]) -> None:
    """A request whose cuts the lines after it will find done."""
    lines = _lines(interp)
    lines.append((frame, dict(fields)))
    del lines[:-MOST_LINES]
    if NAME not in interp.params.globals():
        number = next(_numbers)
        _kept[number] = lines
        interp.params[NAME] = float(number)
        for old in list(_kept)[:-MOST_RUNS]:
            del _kept[old]


def _lines(interp: Interp) -> list[tuple[Place, dict[str, object]]]:
    return _kept.get(int(interp.params[NAME]), []) if NAME in interp.params.globals() else []
