# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines for the interpreter: executes what gcode_lines.py made of a cycle's moves, with every mode put back.

Only built-in codes are executed.  A remapped code, or a word that is remapped (the package remaps F), would make the
interpreter run the rest of the main program inside the cycle: Interp::_execute() enters its call loop, which ends only
when the call level is back at 0 (rs274ngc_pre.cc, 2.9.0~pre1).  So no F word is ever emitted; see set_feed().

The lines carry absolute XYZ, X as a radius, and incremental I J, and begin in G17, those of a turned part in G18 on
exact path; what that needs (G90, G91.1, the plane, G8, G61) is forced and put back, and so is the path mode if a line
sets it.  Units, feed mode and offsets are used as they are.

execute() is called without the line number, which is set beforehand: with it, and after a `yield`, the interpreter
would enter the waiting remap once more and crash (interpmodule.cc, wrap_interp_execute_2, 2.9.0~pre1 to 2.10: it leaves
the call state of the waiting remap in place, wrap_interp_execute_1 does not).
"""

from __future__ import annotations

import emccanon
from typing import TYPE_CHECKING

from chipwise.glue.ceiling import set_canon_feed
from chipwise.glue.path_mode import PathMode
from chipwise.gcode_lines import path_text
from chipwise.pattern import mirroring

if TYPE_CHECKING:
    from chipwise.program.interp import Interp

_ABSOLUTE = 0  # interp_internal.hh: DISTANCE_MODE
_PER_REV = 2  # interp_internal.hh: FEED_MODE


def set_feed(interp: Interp, feed: float) -> None:
    """Make `feed` (program units per minute, or per revolution under G95) the active feed.

    What Interp::convert_feed_rate does for an F word, without the word: the interpreter's value, then the canonical
    call, through ceiling.py, which knows whether the machine's feed is a ceiling above it.
    """
    interp.feed_rate = feed
    set_canon_feed(interp, feed)


def _modes(interp: Interp, lathe: bool) -> tuple[str, str]:
    """(line that forces what the lines of a cycle need, line that puts back what was in force)."""
    turned, diameter = interp.plane == emccanon.CANON_PLANE.CANON_PLANE_XZ, interp.params["_lathe_diameter_mode"]
    plane = " G18" if lathe else " G17" if turned else ""
    before = (
        f"G{18 if turned else 17} {'G90' if interp.distance_mode == _ABSOLUTE else 'G91'} "
        f"{'G90.1' if interp.ijk_distance_mode == _ABSOLUTE else 'G91.1'}{' G7' if diameter else ''}"
    )
    return f"G90 G91.1{plane}{' G8' if diameter else ''}", before


def emit(interp: Interp, line_number: int, chunk: tuple, lathe: bool = False) -> None:
    """Execute a chunk of lines.chunks(), rows with a line number of their own under that; modes, feed and line number
    are afterwards what they were, also after an error.

    lathe: the lines are those of turning/blocks.py: in G18, X a radius, on exact path.
    """
    motion_mode, feed_before, number_before = interp.motion_mode, interp.feed_rate, interp.sequence_number
    forced, modes_before = _modes(interp, lathe)
    interp.sequence_number = line_number
    mirroring.emitting = True
    path = PathMode(interp)
    try:
        interp.execute(forced)
        if lathe:
            path.execute(path_text(61, None, None, 1.0))
        for feed, lines, *numbers in chunk:
            if numbers:
                interp.sequence_number = numbers[0]
            if feed is not None and feed != interp.feed_rate:
                set_feed(interp, feed)
            for line in lines.split("\n"):
                path.execute(line)
    finally:
        mirroring.emitting = False
        path.end()
        # a G33 ends the feed per revolution until a feed is set again (emccanon.cc: STOP_SPEED_FEED_SYNCH, 2.9.0~pre1)
        if interp.feed_rate != feed_before or lathe and interp.feed_mode == _PER_REV:
            set_feed(interp, feed_before)
        # The motion mode first: executing a line is what copies the modes to where task and preview read them.
        interp.motion_mode = motion_mode
        interp.execute(modes_before)
        interp.sequence_number = number_before
