# SPDX-License-Identifier: GPL-2.0-or-later
"""The machining steps, in their stored order: is a step needed, over which range, in which direction; its path and what
it leaves.

Called by plan.py.  Source: the abstract on determining the machining steps of a lathe: the steps are read in sequence,
each is judged on blank and part, and ranges and directions follow for those that are needed.  Here the blank of a step
is what the steps before it have left, and a step is needed when its tool can reach more than its own tolerance of it.
"""

import math
from collections.abc import Callable

from chipwise.errors import Across, CycleError
from chipwise.turning import passes, reach
from chipwise.turning.profile_function import clip, highest, upper, value
from chipwise.turning.obstacles import BARRIER, EDGE, HOLDER, obstacle
from chipwise.turning.path import Move, NoRoom
from chipwise.turning.drilling import drill
from chipwise.turning.grooves import groove
from chipwise.turning.sides import ROUGH_MM, turn
from chipwise.turning.state import CLEARANCE_MM, FACED_MM, State, Step, tools_of_role, without_tool
from chipwise.turning.thread import thread
from chipwise.turning.tool import LatheTool

FACE_REMEDIES = {
    EDGE: "use a tool whose front angle I is at most 90 degrees",
    HOLDER: "use a tool whose holder is behind its nose",
    BARRIER: "use a faced blank, or end the barrier of the tailstock with G23",
}


def face(state: State, name: str) -> Step:
    """Facing cuts from the right end of the stock to the face of the part."""
    order, stock = state.order, state.stock[False]
    end = max((p.z1 for p in stock if max(value(p, p.z0), value(p, p.z1)) > 0.0), default=-math.inf)
    target = order.part.z1 + order.allowance
    if end - target <= FACED_MM:
        return Step(name, False, f"the stock ends at Z{end:.3f} mm, the face is at Z{order.part.z1:.3f} mm")
    tools = [t for role in ("rough", "finish") for t in tools_of_role(state, role, False) if t.towards < 0]
    if not tools:
        return without_tool(name, "rough", False)
    failed = []
    for tool in tools:
        try:
            return _faced(state, name, tool, end, target)
        except NoRoom as error:
            failed.append(error)
    raise failed[0]


def _faced(state: State, name: str, tool: LatheTool, end: float, target: float) -> Step:
    """Step that faces with a tool from Z end to Z target.  Raises NoRoom."""
    keep = clip(state.stock[False], state.domain[0], target)
    work, frame = state.work(tool, 0.0, keep=keep, standing=keep)
    right = frame.domain[1]
    count = math.ceil((end - target) / min(state.order.depth, tool.depth) - 1e-9)
    levels = [end + (target - end) * k / count + tool.nose for k in range(1, count + 1)]
    hole = -highest(state.stock[True], target, end)
    x_to = max(hole - CLEARANCE_MM, 0.0)
    limit = highest(work.reach, levels[-1] + passes.ROUNDING_MM, right)
    if limit > x_to + passes.ROUNDING_MM:
        what = obstacle(state, tool, upper(keep, state.part[False]), levels[-1] + passes.ROUNDING_MM, right)[1]
        raise NoRoom(
            f"T{tool.number} faces down to X{{x}} only, for {what} is in the way",
            FACE_REMEDIES[what],
            x=Across(limit - tool.nose),
        )
    step = Step(name, True, f"{end - target:.3f} mm of stock before the face", tool, "transverse, towards the axis")
    path = passes.face(work, levels, highest(work.contact, levels[-1] - 1e-9, right), x_to)
    state.cut(step, path, frame)
    state.stock[True] = clip(state.stock[True], state.domain[0], target)
    state.faced = target
    return step


def part_off(state: State, name: str) -> Step:
    """The part from the bar, behind its left end."""
    order, stock = state.order, state.stock[False]
    tools = tools_of_role(state, "partoff", False, flat_bottom=True)
    if not tools:
        return Step(name, False, "no tool for it: none of role PARTOFF")
    tool = tools[0]
    z = order.part.z0 - tool.nose - tool.flat
    if not stock or stock[0].z0 >= order.part.z0 - ROUGH_MM:
        return Step(name, False, f"there is no bar behind the part, whose left end is at Z{order.part.z0:.3f} mm")
    hole = -highest(state.stock[True], z - tool.nose, z + tool.flat + tool.nose)
    x_to = max(hole - CLEARANCE_MM, 0.0) + (tool.nose if hole > 0 else 0.0)
    around = upper(stock, clip(state.part[False], order.part.z0, math.inf))
    limit, what = obstacle(state, tool, around, z, z, edges=False)
    if limit > x_to:
        raise CycleError(
            f"T{tool.number} parts off down to X{{x}} only, for {what} is in the way",
            "use a longer blade, or leave more bar outside of the chuck",
            x=Across(limit - tool.nose),
        )
    top = (
        max(highest(reach.dilated(stock, tool, 0.0, state.domain), z - order.beside, z + order.beside), x_to)
        + order.approach
    )
    step = Step(
        name,
        True,
        f"bar behind the part, from Z{order.part.z0:.3f} mm on",
        tool,
        "outside, transverse",
        z - tool.nose,
        order.part.z0,
    )
    step.start = (state.safe_z + tool.nose, state.safe_x + tool.nose)
    step.moves = [
        Move("rapid", z, step.start[1]),
        Move("rapid", z, top),
        Move("feed", z, x_to),
        Move("rapid", z, step.start[1]),
        Move("rapid", *step.start),
    ]
    step.removed = (tool.flat + 2 * tool.nose) * max(top - order.approach - tool.nose - max(hole, 0.0), 0.0)
    state.stock[False] = clip(stock, order.part.z0, math.inf)
    return step


REPEATED = (
    "rest outside",
    "rest inside",
    "finish outside",
    "finish inside",
    "groove",
)  # as long as a tool reaches more
STEPS: dict[str, Callable[[State, str], Step]] = {
    "face": face,
    "drill": drill,
    "groove": groove,
    "part off": part_off,
    "thread outside": lambda s, n: thread(s, n, False),
    "thread inside": lambda s, n: thread(s, n, True),
    "undercut": lambda s, n: turn(s, n, "undercut", False, False),
    "rough outside": lambda s, n: turn(s, n, "rough", False, False),
    "rough inside": lambda s, n: turn(s, n, "rough", True, False),
    "rest outside": lambda s, n: turn(s, n, "rough", False, False, True),
    "rest inside": lambda s, n: turn(s, n, "rough", True, False, True),
    "finish outside": lambda s, n: turn(s, n, "finish", False, True),
    "finish inside": lambda s, n: turn(s, n, "finish", True, True),
}
