# SPDX-License-Identifier: GPL-2.0-or-later
"""Circles in a graph of what needs what.

Called by tests/oracles/test_rooms.py and test_c_files.py.
"""

import graphlib


def circle(graph):
    """Nodes of {node: nodes it needs} that need each other in a ring, [] if there are none."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []
