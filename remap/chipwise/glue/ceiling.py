# SPDX-License-Identifier: GPL-2.0-or-later
"""The ceiling of M251 P2 and P3: what becomes of F while the volumetric feed may go above it.

Called by emit.set_feed (cycles), by volumetric.py (M251, M252), by session.py and by the remapped F.

LinuxCNC 2.9 clamps the adaptive feed to 1: it can slow the machine down but not speed it up.  So the canonical
feed is set to the ceiling, the feed the program asked for goes to volumetric-feed.0.programmed-vel through an analog
output that M67 sets in step with motion, and the override is below 1 from then on.  The interpreter itself keeps the
program's F: #<_feed> and every cycle see what was programmed.  It forgets it wherever it has waited for the machine
(tool change, M66, G38, abort, start of a program: Interp::synch() takes the canonical feed); restore_programmed() gives
it back before one of our codes looks.

The ceiling is set only after the machine has got to the M251 and its mode was read back (volumetric.py): without the
realtime side F is never replaced.  One interpreter per process, so the state is the module's.
"""

from __future__ import annotations

import emccanon
from typing import TYPE_CHECKING

from chipwise.errors import MM_PER_INCH

if TYPE_CHECKING:
    from chipwise.program.interp import Interp

_FEED_PER_MINUTE = 0


class Times(float):
    """A ceiling that is so many times the F of each move: that of a set-up."""


class Axes(float):
    """A ceiling that is what the axes allow in each move: that of a set-up whose feeds above the stock are free
    (mm/min; LinuxCNC clamps it)."""


AXES = Axes(1e6)


class Ceiling:
    """value: mm/min, Times or Axes, None while F is not replaced; output: the analog output that carries the programmed
    feed; programmed: F in mm/min as the program said it last, None in other feed modes than G94;
    waiting: (value, output) of an M251 that run from line has read over, for begin() at the first code behind that
    line."""

    value: float | None = None
    output: int = 0
    programmed: float | None = None
    waiting: tuple[float, int] | None = None


def forget(interp: Interp) -> bool:
    """F is the machine's feed again as far as the interpreter goes; -> whether there was a ceiling."""
    restore_programmed(interp)
    was = Ceiling.value is not None or Ceiling.waiting is not None
    Ceiling.value = Ceiling.waiting = None
    if was:
        emccanon.enqueue_SET_FEED_RATE(interp.feed_rate)
    return was


def begin(interp: Interp, value: float | None, output: int) -> None:
    """From here on the ceiling `value` (mm/min) takes the place of F; the machine stands.

    The first programmed feed goes out at once, too: what waits for the next move is lost in an abort, and without any
    the realtime side would take the ceiling for F.
    """
    Ceiling.value, Ceiling.output, Ceiling.programmed, Ceiling.waiting = value, output, None, None
    if value is not None:
        emccanon.SET_AUX_OUTPUT_VALUE(output, 0.0)
    set_canon_feed(interp, interp.feed_rate)


def end(interp: Interp) -> None:
    """F is the machine's feed again."""
    Ceiling.value = None
    set_canon_feed(interp, interp.feed_rate)
    emccanon.SET_AUX_OUTPUT_VALUE(Ceiling.output, 0.0)


def restore_programmed(interp: Interp) -> None:
    """Give the interpreter the program's F back where it has taken the ceiling for it."""
    if Ceiling.value is None or Ceiling.programmed is None or interp.feed_mode != _FEED_PER_MINUTE:
        return
    taken, replaced = interp.feed_rate * _unit_mm(interp), _replaced(Ceiling.programmed)
    if abs(taken - replaced) <= 1e-6 * replaced:
        interp.feed_rate = Ceiling.programmed / _unit_mm(interp)


def _replaced(programmed: float) -> float:
    """The ceiling for a programmed feed, mm/min."""
    value = Ceiling.value or 0.0
    return value * programmed if isinstance(value, Times) else max(programmed, value)


def _unit_mm(interp: Interp) -> float:
    """mm of a program unit."""
    return MM_PER_INCH if interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES else 1.0


def _as_output(programmed: float | None) -> float:
    """mm/min or None -> machine units/s for volumetric-feed.0.programmed-vel."""
    return (programmed or 0.0) / 60.0 * emccanon.GET_EXTERNAL_LENGTH_UNITS()


def set_canon_feed(interp: Interp, feed: float) -> None:
    """Make `feed` (program units/min, or /rev under G95) the machine's feed, or the ceiling in its place."""
    if Ceiling.value is None:
        emccanon.enqueue_SET_FEED_RATE(feed)
        return
    unit_mm = _unit_mm(interp)
    per_minute = interp.feed_mode == _FEED_PER_MINUTE
    first = not Ceiling.programmed
    Ceiling.programmed = feed * unit_mm if per_minute else None
    if first and Ceiling.programmed:  # see begin()
        emccanon.SET_AUX_OUTPUT_VALUE(Ceiling.output, _as_output(Ceiling.programmed))
    emccanon.SET_MOTION_OUTPUT_VALUE(Ceiling.output, _as_output(Ceiling.programmed))
    of_change = (
        isinstance(Ceiling.value, (Times, Axes)) and interp.remap_level > 1
    )  # an F in a tool change that is remapped stays F
    emccanon.enqueue_SET_FEED_RATE(_replaced(feed * unit_mm) / unit_mm if per_minute and not of_change else feed)
