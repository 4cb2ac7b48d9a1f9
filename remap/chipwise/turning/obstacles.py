# SPDX-License-Identifier: GPL-2.0-or-later
"""What keeps a tool from a place: its edges, its holder, or a barrier before one of them.  Called by steps.py for what
it refuses."""

from chipwise.turning import reach
from chipwise.turning.profile_function import Graph, clip, highest
from chipwise.turning.state import State
from chipwise.turning.tool import LatheTool

EDGE, HOLDER, BARRIER = "an edge that reaches over the work", "its holder", "a barrier"


def obstacle(state: State, tool: LatheTool, work: Graph, z0: float, z1: float, edges: bool = True) -> tuple[float, str]:
    """(mm, text) of the highest position from z0 to z1 at which an outside tool touches something, and with what.
    work: graph that has to stay; edges: of the edges, too."""
    barrier = state.barrier[False]
    found = [(EDGE, reach.dilated(work, tool, 0.0, state.domain))] if edges else []
    found += [(HOLDER, clip(reach.holder_height(work, tool), *state.domain))]
    if barrier:
        found += [
            (BARRIER, reach.dilated(barrier, tool, 0.0, state.domain)),
            (BARRIER, clip(reach.holder_height(barrier, tool), *state.domain)),
        ]
    return max((highest(graph, z0, z1), text) for text, graph in found)
