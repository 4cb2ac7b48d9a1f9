# SPDX-License-Identifier: GPL-2.0-or-later
"""The top of the stock, as far as a run and its preview both know it.

M250 (glue/stock_codes.py) sets it, M254 and the beginning of another context (session.begin) end it, and the cycles
without J ask for it (state.depth_step).  Only the program's own M250 counts: the preview knows neither a stock of MDI
nor the map as it has been cut, and a run does what its preview shows.  Cutting only lowers the stock, so the box's top
is never too low.

It is kept in the interpreter, because each preview has a new one while this module stays loaded.  No program can write
the parameter: to LinuxCNC's parser a name ends at ">".
"""

NAME = "_chipwise>stock_top"  # mm, machine coordinates of the tool's tip
caller_top = None  # the same, of the caller of a pattern: pattern/runner.py sets it in its own process


def _parameters(interp):
    return interp.sub_context[0].named_params


def define(interp, top):
    """M250: the top of its stock, mm, machine coordinates."""
    interp.params[NAME] = top


def forget(interp):
    """The stock is not known, or no longer."""
    if NAME in interp.params.globals():
        del _parameters(interp)[NAME]


def top(interp):
    """mm, machine coordinates; None if it is not known."""
    return interp.params[NAME] if NAME in interp.params.globals() else caller_top
