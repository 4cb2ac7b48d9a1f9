# SPDX-License-Identifier: GPL-2.0-or-later
"""The machining steps, in their stored order: is a step needed, over which range, in which direction; its path and what it leaves.

Called by plan.py.  Source: the abstract on determining the machining steps of a lathe: the steps are read in sequence, each is
judged on blank and part, and ranges and directions follow for those that are needed.  Here the blank of a step is what the steps
before it have left, and a step is needed when its tool can reach more than its own tolerance of it.
"""

import math
from dataclasses import replace

from chipwise.errors import CycleError
from chipwise.turning import passes, reach
from chipwise.turning.graph import above, clip, flat, highest, lower, negative, segment, upper, value
from chipwise.turning.passes import Move
from chipwise.turning.state import CLEARANCE_MM, FACED_MM, OVERRUN_MM, Step, roof
from chipwise.turning.thread import thread

ROUGH_MM = 0.05         # a roughing step leaves what is thinner
FINISH_MM = 0.003       # a finishing step, too
THICK, THIN_MM = 1.5, 0.3       # a finishing cut is thinner than so many allowances, and than so much at least
TOOTH, TOOTH_MM = THICK - 1.0, 0.15     # of the allowance, and mm, less than a rapid keeps: may stay at a wall after each level, for the finish
FINISHES = 3            # of a finishing tool, one after the other: each finds the stock lower that its holder has to be clear of
PECK_MM = 0.25          # of feed before the bottom that a drill has made itself
GROOVE_MM = 0.3         # a grooving tool does not come for less


def _tools(state, role, inside, flat_bottom=False):
    return [t for t in state.order.tools.get(role, ()) if t.inside == inside and not t.point_angle and bool(t.flat) == flat_bottom]


def _without(name, role, inside):
    side = "inside" if inside else "outside"
    return Step(name, False, f"no tool for it: none of role {role.upper()} works {side}")


def face(state, name):
    """Facing cuts from the right end of the stock to the face of the part."""
    order, stock = state.order, state.stock[False]
    end = max((p.z1 for p in stock if max(value(p, p.z0), value(p, p.z1)) > 0.0), default=-math.inf)
    target = order.part.z1 + order.allowance
    if end - target <= FACED_MM:
        return Step(name, False, f"the stock ends at Z{end:.3f} mm, the face is at Z{order.part.z1:.3f} mm")
    tools = [t for t in _tools(state, "rough", False) if t.towards < 0]
    if not tools:
        return _without(name, "rough", False)
    tool = tools[0]
    keep = clip(stock, state.domain[0], target)
    work, view, tool, domain = state.work(tool, 0.0, keep=keep, standing=keep)
    count = math.ceil((end - target) / min(order.depth, tool.depth) - 1e-9)
    levels = [end + (target - end) * k / count + tool.nose for k in range(1, count + 1)]
    hole = -highest(state.stock[True], target, end)
    x_to = max(hole - CLEARANCE_MM, 0.0)
    limit = highest(work.reach, levels[-1] + passes.ROUNDING_MM, domain[1])
    if limit > x_to + passes.ROUNDING_MM:
        raise CycleError("holder, barrier or part let the tool come to X{x} only in front of the face", "use a tool whose holder is behind its nose, or a faced blank with a tailstock",
                         x=limit - tool.nose)
    step = Step(name, True, f"{end - target:.3f} mm of stock before the face", tool, "transverse, towards the axis")
    path = passes.face(work, levels, highest(work.contact, levels[-1] - 1e-9, domain[1]), x_to)
    state.cut(step, path, tool, view, domain)
    state.stock[True] = clip(state.stock[True], state.domain[0], target)
    state.faced = target
    return step


def drill(state, name):
    """The hole that the boring bar needs."""
    order, part = state.order, state.part[True]
    if not part:
        return Step(name, False, "the part has no bore")
    z0, z1, room = order.part.bore[0].z0, order.part.z1, -highest(order.part.bore, *state.domain)
    drills = sorted((t for t in order.tools.get("drill", ()) if t.point_angle), key=lambda t: -t.diameter)
    now = -highest(clip(state.stock[True], z0 + ROUGH_MM, z1), *state.domain)
    fitting = [t for t in drills if t.diameter / 2 <= room - order.allowance or not state.through and _deepest(state, t) <= z0 + order.allowance + _point(t)]
    if not drills or not fitting:
        return Step(name, False, "no tool for it: none of role DRILL" if not drills else f"no drill is smaller than the bore, diameter {2 * room:.3f} mm"
                    if room > ROUGH_MM else "the point of no drill fits into the end of the bore")
    tool = fitting[0]
    if now >= tool.diameter / 2 - ROUGH_MM:
        return Step(name, False, f"the bore is {2 * now:.3f} mm wide already")
    end = max(p.z1 for p in state.stock[True])
    radius = tool.diameter / 2
    point = _point(tool)
    tip = z0 - point - 2 * OVERRUN_MM if state.through and not highest(state.barrier[True], z0 - point - 4 * OVERRUN_MM, z0) > -math.inf \
        else max(z0 + order.allowance, _deepest(state, tool))
    if tip < z0:
        part = clip(part, z0, math.inf)
    shape = [segment(tip, 0.0, tip + point, -radius)] if point else []
    shape = [*shape, flat(tip + point, state.domain[1], -radius)]
    if end - tip > tool.edge:
        raise CycleError("the hole is {deep} deep, more than the drill's flutes of {edge}", "use a longer drill", deep=end - tip, edge=tool.edge)
    if tip + point >= end:
        return Step(name, False, f"the hole is {end - tip:.3f} mm deep, too shallow for the drill's point of {point:.3f} mm")
    before = state.stock[True]
    drilled = upper(lower(before, shape), clip(before, state.domain[0], tip))
    if not passes.worth(above(before, drilled), ROUGH_MM):
        return Step(name, False, f"the hole of {tool.diameter:g} mm is there already")
    inside = above(clip(state.barrier[True], tip, math.inf), shape, passes.ROUNDING_MM)
    if inside:
        raise CycleError("a drill of {d} would enter a barrier at Z{z}", "end the barrier of the tailstock with G23", d=tool.diameter, z=inside[-1][0])
    if above(part, shape, passes.ROUNDING_MM):
        raise CycleError("a drill of {d} does not stay inside the bore", "use a smaller drill", d=tool.diameter)
    step = Step(name, True, "solid stock where the bore is", tool, "inside, along the axis", tip, end)
    step.start, step.moves = (state.safe_z, 0.0), _pecks(end, tip, tool.depth, state.safe_z, PECK_MM if end >= state.faced else CLEARANCE_MM)
    state.stock[True] = state.given[True] = drilled
    step.removed = sum(a[2] for a in above(before, state.stock[True]))
    return step


def _point(tool):
    """Length of a drill's point, mm."""
    return tool.diameter / 2 / math.tan(math.radians(tool.point_angle) / 2) if tool.point_angle < 180 else 0.0


def _deepest(state, tool):
    """The lowest place of a drill's tip at which its point stays inside of a bore that narrows towards its end, mm."""
    part, rise = reach.disc(state.part[True], state.order.allowance), math.tan(math.radians(tool.point_angle) / 2)
    tips = [-math.inf]
    for z0, z1, _, _ in above(part, [flat(*state.domain, -tool.diameter / 2)], passes.ROUNDING_MM):
        for p in clip(part, z0, z1):
            touch = reach.tangent(p, -rise)
            tips += [z + value(p, z) / rise for z in (p.z0, p.z1, touch) if z is not None and p.z0 <= z <= p.z1]
    return max(tips)


def _pecks(end, tip, depth, far, first):
    """Moves of a drill: by `depth`, out after each.  first: mm of feed before the stock."""
    count, moves = math.ceil((end - tip) / depth - 1e-9), []
    for k in range(1, count + 1):
        top = end + (tip - end) * (k - 1) / count
        moves += [Move("rapid", top + (first if k == 1 else PECK_MM), 0.0), Move("feed", end + (tip - end) * k / count, 0.0), Move("rapid", end + CLEARANCE_MM, 0.0)]
    return [*moves, Move("rapid", far, 0.0)]


def _out_of_reach(state, tool, contact):
    """Stock in the bore (graph) that the tool cannot cut because its bar would touch the far side: what lies behind it, too."""
    far = reach.window(state.stock[True], tool.holder_left, state.domain[1] - state.domain[0])
    roof = [p._replace(xr=p.xr + tool.nose - tool.bar - 2 * CLEARANCE_MM) for p in negative(far)]
    beyond = above(contact, roof)
    return clip(state.stock[True], -math.inf, beyond[-1][1]) if beyond else []


def turn(state, name, role, inside, finishing, rest=False):
    """Roughing or finishing, outside or inside, with the first tool of the role that has something to do; rest: the others."""
    if inside and not state.part[True]:
        return Step(name, False, "the part has no bore")
    tools = _tools(state, role, inside)
    if rest:
        tools = _tools(state, "rough", inside)[1:] + [t for t in _tools(state, "finish", inside)]
    if not tools:
        return _without(name, role, inside)
    allowance, least = (0.0, FINISH_MM) if finishing else (0.0 if role == "undercut" else state.order.allowance, ROUGH_MM)
    for tool in tools:
        step = _turned(state, name, tool, inside, finishing, allowance, least)
        if step:
            return step
    return Step(name, False, f"nothing thicker than {least:g} mm is left within reach of " + " or ".join(f"T{t.number}" for t in tools))


def _turned(state, name, tool, inside, finishing, allowance, least):
    """Step of a tool, None if it has nothing to do.  A finish is made again where the holder could not go before the stock beside it was cut: the
    allowance of a face keeps it from the axis."""
    step = None
    for _ in range(FINISHES if finishing else 1):
        found = _path(state, name, tool, inside, finishing, allowance, least, again=step is not None)
        if found is None:
            break
        path, area, framed, view, domain = found
        step = step or Step(name, True, f"{area:.2f} mm2 within its reach", tool,
                            f"{'inside' if inside else 'outside'}, {_direction(path, tool)}" + (", along the profile" if finishing else ""))
        state.cut(step, path, framed, view, domain)
    return step


def _path(state, name, tool, inside, finishing, allowance, least, again=False):
    """(Path, mm2 within the tool's reach, tool, view and domain as of State.work()), None if it has nothing to do.

    again: of a finish, which has lowered the stock beside the holder: what is too thick in the holder's new reach stays."""
    keep = _out_of_reach(state, tool, reach.dilated(state.stock[True], tool, 0.0, state.domain)) if inside else []
    work, view, framed, domain = state.work(tool, allowance, not finishing, keep)
    regions = passes.worth(above(clip(work.contact, *domain), work.reach, passes.ROUNDING_MM), least)
    if not regions:
        return None
    if tool.inside:
        work = replace(work, roof=roof(state, framed, min(r[0] for r in regions)))
    depth = min(state.order.depth, tool.depth, max(tool.holder_up, 0.0))
    if _finished_later(state, name, inside):
        work = replace(work, tooth=min(TOOTH * allowance, TOOTH_MM))
    if finishing and inside:
        keep = _thick(state, tool, work.contact, keep)
        work, view, framed, domain = state.work(tool, allowance, False, keep)
        regions = passes.worth(above(clip(work.contact, *domain), work.reach, passes.ROUNDING_MM), least)
        if not regions:
            return None
    elif finishing and again and _thickness(state, tool, work.contact, keep)[1]:
        return None
    elif finishing:
        _refuse_thick(state, tool, work.contact, keep)
    path = passes.finish(work, domain, least) if finishing else passes.rough(work, domain, depth, least)
    return (path, sum(r[2] for r in regions), framed, view, domain) if path and path.cut else None


def _direction(path, tool):
    """Text: levels along Z, columns, or both."""
    found = [f"longitudinal, towards {'-Z' if tool.towards < 0 else '+Z'}"] if len(path.cut) > path.columns else []
    return " and ".join(found + [f"transverse, {'away from' if tool.inside else 'towards'} the axis"] * bool(path.columns))


def _finished_later(state, name, inside):
    """Whether a step after this one finishes the side."""
    later = state.order.order[state.order.order.index(name) + 1:]
    return f"finish {'inside' if inside else 'outside'}" in later and bool(_tools(state, "finish", inside))


def _thickness(state, tool, contact, keep):
    """(mm, regions) that are too thick for a finishing cut."""
    most = max(THICK * state.order.allowance, THIN_MM)
    reserve = state.lowest(tool, most, keep=keep)[0]
    return most, passes.worth(above(contact, reserve, passes.ROUNDING_MM), ROUGH_MM)


def _thick(state, tool, contact, keep):
    """The end of a bore that roughing could not reach, added to what is kept."""
    _, thick = _thickness(state, tool, contact, keep)
    return upper(keep, clip(state.stock[True], -math.inf, thick[-1][1])) if thick else keep


def _refuse_thick(state, tool, contact, keep):
    """Refuse stock that is too thick for a finishing cut."""
    most, thick = _thickness(state, tool, contact, keep)
    if thick:
        raise CycleError("more than {most} of stock is left at Z{z} where the finishing tool goes",
                         "give a roughing tool that reaches it, or plan the step rest outside or inside before", most=most,
                         z=-thick[-1][1] if tool.towards > 0 else thick[-1][1])


def groove(state, name):
    """Plunges of a grooving tool where the other tools could not go."""
    tools = _tools(state, "groove", False, flat_bottom=True)
    if not tools:
        return Step(name, False, "no tool for it: none of role GROOVE")
    work, view, tool, domain = state.work(tools[0], 0.0)
    path = passes.plunge(work, domain, 0.8 * (tool.flat + 2 * tool.nose), GROOVE_MM)
    if path is None:
        return Step(name, False, f"nothing thicker than {GROOVE_MM:g} mm is left within reach of T{tool.number}")
    step = Step(name, True, "stock is left that the other tools do not reach", tool, "outside, transverse")
    state.cut(step, path, tool, view, domain)
    return step


def part_off(state, name):
    """The part from the bar, behind its left end."""
    order, stock = state.order, state.stock[False]
    tools = _tools(state, "partoff", False, flat_bottom=True)
    if not tools:
        return Step(name, False, "no tool for it: none of role PARTOFF")
    tool = tools[0]
    z = order.part.z0 - tool.nose - tool.flat
    if not stock or stock[0].z0 >= order.part.z0 - ROUGH_MM:
        return Step(name, False, f"there is no bar behind the part, whose left end is at Z{order.part.z0:.3f} mm")
    hole = -highest(state.stock[True], z - tool.nose, z + tool.flat + tool.nose)
    x_to = max(hole - CLEARANCE_MM, 0.0) + (tool.nose if hole > 0 else 0.0)
    around = upper(stock, clip(state.part[False], order.part.z0, math.inf))
    limit = max(highest(reach.holder_height(around, tool), z, z), highest(reach.dilated(state.barrier[False], tool, 0.0, state.domain), z, z),
                highest(reach.holder_height(state.barrier[False], tool), z, z) if state.barrier[False] else -math.inf)
    if limit > x_to:
        raise CycleError("holder or barrier let the tool come to X{x} only behind the part", "use a longer blade, or leave more bar outside of the chuck",
                         x=limit)
    top = max(highest(reach.dilated(stock, tool, 0.0, state.domain), z, z), x_to) + CLEARANCE_MM
    step = Step(name, True, f"bar behind the part, from Z{order.part.z0:.3f} mm on", tool, "outside, transverse", z - tool.nose, order.part.z0)
    step.start = (state.safe_z + tool.nose, state.safe_x + tool.nose)
    step.moves = [Move("rapid", z, step.start[1]), Move("rapid", z, top), Move("feed", z, x_to), Move("rapid", z, step.start[1]),
                  Move("rapid", *step.start)]
    step.removed = (tool.flat + 2 * tool.nose) * max(top - CLEARANCE_MM - tool.nose - max(hole, 0.0), 0.0)
    state.stock[False] = clip(stock, order.part.z0, math.inf)
    return step


STEPS = {
    "face": face, "drill": drill, "groove": groove, "part off": part_off,
    "thread outside": lambda s, n: thread(s, n, False), "thread inside": lambda s, n: thread(s, n, True),
    "undercut": lambda s, n: turn(s, n, "undercut", False, False),
    "rough outside": lambda s, n: turn(s, n, "rough", False, False), "rough inside": lambda s, n: turn(s, n, "rough", True, False),
    "rest outside": lambda s, n: turn(s, n, "rough", False, False, True), "rest inside": lambda s, n: turn(s, n, "rough", True, False, True),
    "finish outside": lambda s, n: turn(s, n, "finish", False, True), "finish inside": lambda s, n: turn(s, n, "finish", True, True)}
