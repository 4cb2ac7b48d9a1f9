# SPDX-License-Identifier: GPL-2.0-or-later
"""Grooves: plunges side by side, one in a groove as wide as the insert; and what other tools leave to the grooving
tool.

Called by steps.py and sides.py."""

from dataclasses import replace

from chipwise.turning import passes, reach
from chipwise.turning.profile_function import Graph, Piece, above, clip, envelope, lower, negative
from chipwise.turning.state import State, Step, tools_of_role, without_tool
from chipwise.turning.tool import LatheTool

GROOVE_MM = 0.3  # a grooving tool does not come for less
FIT_MM = (
    0.001  # an insert may be so much wider than its groove: half of it on each side is within the rounding of a drawing
)
TIGHT_MM = 0.02  # a groove narrower than its insert by no more is named: it would be gouged
SLOT = 1.5  # of the insert's width: narrower grooves are left to it whole, so that no other insert scratches into them


def groove(state: State, name: str) -> Step:
    """Plunges of a grooving tool where the other tools could not go."""
    tools = tools_of_role(state, "groove", False, flat_bottom=True)
    if not tools:
        return without_tool(name, "groove", False)
    for tool in tools:
        if (name, tool.number) in state.made:
            continue
        step = Step(name, False, "stock is left that the other tools do not reach", tool, "outside, transverse")
        for fit in (0.0, FIT_MM):
            _plunge(state, step, tool, fit)
        if step.needed:
            state.made.add((name, tool.number))
            return step
    tight = [t for t in tools if _is_too_wide(state, t)]
    if tight:
        return Step(
            name,
            False,
            "a groove is narrower than the insert of "
            + " or ".join(f"T{t.number}" for t in tight)
            + f" by {FIT_MM:g} to {TIGHT_MM:g} mm and would be gouged: use a narrower insert, or draw the groove as "
            f"wide as it",
        )
    return Step(
        name,
        False,
        f"nothing thicker than {GROOVE_MM:g} mm is left within reach of " + " or ".join(f"T{t.number}" for t in tools),
    )


def _is_too_wide(state: State, tool: LatheTool) -> bool:
    """Whether a groove is left for which the insert is a little too wide."""
    work, frame = state.work(_narrower(tool, TIGHT_MM), 0.0)
    return passes.plunge(work, frame.domain, tool.flat + 2 * tool.nose, GROOVE_MM, slots_only=True) is not None


def _plunge(state: State, step: Step, tool: LatheTool, fit: float) -> None:
    """Add plunges to a step; fit: mm that the insert is treated as narrower, then for grooves as wide as it only."""
    work, frame = state.work(_narrower(tool, fit), 0.0)
    path = passes.plunge(work, frame.domain, 0.8 * (tool.flat + 2 * tool.nose), GROOVE_MM, slots_only=fit > 0.0)
    if path is None:
        return
    done = len(step.moves)
    state.cut(step, path, frame)
    step.moves[done:] = [
        replace(m, z=m.z - fit / 2, centre=(m.centre[0] - fit / 2, m.centre[1]) if m.centre else ())
        for m in step.moves[done:]
    ]


def _narrower(tool: LatheTool, fit: float) -> LatheTool:
    """The tool with a narrower insert, whose positions are those of its own left corner: half of `fit` farther to the
    right."""
    return replace(tool, flat=max(tool.flat - fit, 0.0)) if fit else tool


def left_to_groove(state: State, name: str, tool: LatheTool) -> list[Piece]:
    """Graph of the grooves that a tool leaves to a later grooving tool: narrow ones that it does not clear, filled to
    the lower of their edges."""
    order = state.order.order
    tools = (
        tools_of_role(state, "groove", False, flat_bottom=True) if "groove" in order[order.index(name) + 1 :] else []
    )
    if not tools:
        return []
    if tool.number not in state.lids:
        lids: list[Piece] = []
        for other in tools:
            width = SLOT * (other.flat + 2 * other.nose)
            part = state.part[False]
            filled = negative(reach.window(negative(reach.window(part, 0.0, width)), -width, 0.0))
            cleared = lower(_standing(state, other), _standing(state, _narrower(other, FIT_MM)))
            left = above(_standing(state, tool), cleared, passes.ROUNDING_MM)
            lids += [
                p
                for z0, z1, _, height in above(filled, cleared, passes.ROUNDING_MM)
                if height > GROOVE_MM and any(r[3] > GROOVE_MM and r[0] < z1 and r[1] > z0 for r in left)
                for p in clip(filled, z0, z1)
            ]
        state.lids[tool.number] = lids
    return _joined(state.lids[tool.number])


def _joined(pieces: Graph) -> list[Piece]:
    """Upper graph of pieces, which may overlap."""
    return envelope([[p] for p in pieces]) if pieces else []


def _standing(state: State, tool: LatheTool) -> list[Piece]:
    """What a tool leaves of a solid block around the part and the barriers."""
    positions, frame = state.lowest(tool, 0.0, standing=state.part[False])
    return frame.view(reach.eroded(positions, frame.tool, frame.domain))
