# SPDX-License-Identifier: GPL-2.0-or-later
"""Numbers to and from chipwise_command, in step with motion.  Called by stock_codes.py and volumetric.py.

Numbers go through two of motion's analog outputs, set as M68 does in its turn of the queue; chipwise_command's man page
has the registers.  Its answer comes back through an analog input.

What is queued are canonical calls, not lines: execute(line, number) after a `yield` takes the task down in 2.9.0~pre1
(interpmodule.cc, wrap_interp_execute_2, leaves the call state of the waiting remap in place).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

import emccanon

from chipwise.clib import layout

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.settings import Settings


# low and high (3,) mm, shape, turn (degrees)
Box = tuple[Sequence[float], Sequence[float], int, float]


class InForce:
    """What M250 and M251 have left in force, as far as the interpreter knows.

    feed        M251 is on; feed_of_mdi: it was given in MDI; loaded: the program that was loaded then; ceiling: its
                ceiling (mm/min), None: F
    feed_carried    M251 of MDI goes on in the program that runs, if the realtime side says so, too; it is to be asked
    feed_left   it has ended, and the realtime side does not know yet
    box         (low, high, shape, turn) of the last M250, None where the stock came from a file
    job_asked   the main program's first F of this run has asked for a set-up
    stock_here  the stock was defined in this run of the program, or in this MDI
    """

    feed = feed_left = feed_of_mdi = feed_carried = stock_here = job_asked = False
    box: Box | None = None
    loaded: tuple[str, object] | None = None
    ceiling: float | None = None


def send(state: State, first: layout.Register, values: Sequence[float], commit: int) -> None:
    """As queue()."""
    queue(state.settings, first, values, commit)


def queue(settings: Settings, first: layout.Register, values: Sequence[float], commit: int) -> None:
    """Queue the registers first, first + 1, .. and the commit, in step with motion."""
    word = settings["ANALOG_OUT"]
    for number, value in enumerate(values, int(first)):
        emccanon.SET_AUX_OUTPUT_VALUE(word, number)
        emccanon.SET_AUX_OUTPUT_VALUE(word + 1, value)
    emccanon.SET_AUX_OUTPUT_VALUE(word, commit)


def status_value(settings: Settings) -> int:
    """What the realtime side says of itself, now, as a number of layout.STATUS_..; 0 where it is not there."""
    return round(emccanon.GET_EXTERNAL_ANALOG_INPUT(settings["ANALOG_IN"], 0.0))


def mode_now(settings: Settings) -> int:
    """The mode of the realtime side, now; 0 where it is not there."""
    return status_value(settings) % layout.STATUS_STOCK


def job_now(settings: Settings) -> tuple[float, bool, bool, bool]:
    """(ceiling in times F, 0 without a set-up; whether it waits for adaptive feed; whether it is in force; whether its
    feeds above the stock are free) of the loaded program, now."""
    value = status_value(settings)
    waits, active, air = (_has(value, bit) for bit in (layout.STATUS_WAITS, layout.STATUS_ACTIVE, layout.STATUS_AIR))
    return value % round(layout.STATUS_WAITS) // layout.STATUS_JOB / 100, waits, active, air


def feed_is_carried(settings: Settings) -> bool:
    """Whether M251 of MDI is in force in the program that runs, now."""
    return _has(status_value(settings), layout.STATUS_CARRIED)


def _has(status: int, bit: float) -> bool:
    """Whether a status has one of the two-valued parts, layout.STATUS_WAITS and above."""
    return status // round(bit) % 2 == 1


def status_now(state: State) -> tuple[int, bool, int]:
    """(mode, stock is defined, fault code) of the realtime side, now; (0, False, 0) where it is not there."""
    value = status_value(state.settings)
    return (
        value % layout.STATUS_STOCK,
        value // layout.STATUS_STOCK % 10 == 1,
        value % layout.STATUS_REPLY // layout.STATUS_FAULT,
    )
