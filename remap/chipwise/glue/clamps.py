# SPDX-License-Identifier: GPL-2.0-or-later
"""M256: the set-up of clamps that is in force, as far as a run and its preview both know it.  It ends with the program.

Called by codes.py through session.run_steps, and by session.begin.
"""

from chipwise import preview
from chipwise.clamps import set_ups
from chipwise.errors import CycleError

SET_UP = "_chipwise>clamps"     # no program can write it: to LinuxCNC's parser a name ends at ">"


def put_on(state):
    """M256."""
    state.check_words("p")
    number = state.number("p")
    if number is None:
        raise CycleError("word P (set-up of clamps) is missing", "add P, or P0 for none")
    if number not in range(set_ups.MAX_SET_UP + 1):
        raise CycleError(f"set-up P{number:g} is not from 0 to {set_ups.MAX_SET_UP}", "use P0 for none")
    if number:
        set_ups.clamps_of(state.settings.path("CLAMPS"), int(number))
    state.interp.params[SET_UP] = number
    if not state.interp.task:
        preview.clamps(state.line_number, int(number))
    yield from ()


def forget(interp):
    """No set-up is in force."""
    if SET_UP in interp.params.globals():
        del interp.sub_context[0].named_params[SET_UP]
