# SPDX-License-Identifier: GPL-2.0-or-later
"""M256: the set-up of clamps that is in force.  For cycles it ends with the program, as in the preview; before the realtime guard it stays (monitor/clamps_in_force.py).

Called by codes.py through session.run_steps, by session.begin and by state.py.  What needs numpy is imported when a set-up is used: LinuxCNC's task must not
load it for every machine.
"""

from chipwise.program import preview
from chipwise.errors import CycleError
from chipwise.clib.layout import Register
from chipwise.tool_data.geometry import ToolGeometry, tool_geometry

MOST = 999
SET_UP = "_chipwise>clamps"     # no program can write it: to LinuxCNC's parser a name ends at ">"


def put_on(state):
    """M256."""
    state.check_words("p")
    number = state.number("p")
    if number is None:
        raise CycleError("word P (set-up of clamps) is missing", "add P, or P0 for none")
    if number not in range(MOST + 1):
        raise CycleError(f"set-up P{number:g} is not from 0 to {MOST}", "use P0 for none")
    if number:
        from chipwise.clamps import set_ups
        set_ups.clamps_of(state.settings.path("CLAMPS"), int(number))
    state.interp.params[SET_UP] = number
    if not state.interp.task:
        preview.clamps(state.line_number, int(number))
        return
    import emccanon
    from chipwise.glue import program_run, stock_codes
    if program_run.skipped():
        emccanon.MESSAGE("chipwise: M256: run from line skips this line, so the clamps before the machine stay as they are; give it in MDI before")
        yield
        return
    yield from stock_codes.request(state, int(number), Register.CLAMPS_COMMIT, f"the clamps of set-up P{number:g} are not in force")


def obstacles(state):
    """The Obstacles for a cycle, in work coordinates; None without any."""
    number = int(state.interp.params[SET_UP]) if SET_UP in state.interp.params.globals() else 0
    if not number:
        return None
    from chipwise.clib.height_map import Shape
    from chipwise.clamps import set_ups
    from chipwise.cycles import obstacles as planned
    from chipwise.glue import soft_limits
    origin, turn = state.machine_point((0.0, 0.0, 0.0)), state.interp.rotation_xy
    clamps = tuple(clamp.seen_from(origin, turn) for clamp in set_ups.clamps_of(state.settings.path("CLAMPS"), number))
    geometry = tool_geometry(state.settings.path("TOOL_GEOMETRY"), state.interp.tool_table[0].toolno) or ToolGeometry()
    return planned.Obstacles(clamps, state.settings["CLAMP_CLEARANCE"], Shape.of_tool(state.tool_diameter(), geometry), soft_limits.of(state))


def forget(interp):
    """No set-up is in force."""
    if SET_UP in interp.params.globals():
        del interp.sub_context[0].named_params[SET_UP]
