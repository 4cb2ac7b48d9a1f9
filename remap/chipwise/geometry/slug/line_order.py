# SPDX-License-Identifier: GPL-2.0-or-later
"""The order of chop lines: the shortest travel that frees no large piece on the way.

Called by cycles/hole.py and slug.py.  Pure; mm.  Departs from JP H05-7134, which takes its lines in a fixed order.
"""

import math


def _group_stages(group, downwards):
    """One group as stages: per scan line the ways to cut it, each a tuple of directed segments."""
    stages = []
    for scan_line in reversed(group) if downwards else group:
        forward = tuple(scan_line)
        backward = tuple((b, a) for a, b in reversed(scan_line))
        stages.append((forward, backward))
    return stages


def _best_chain(stages, start, end, entry_of, exit_of):
    """Cheapest path through stages, by dynamic programming over the direction of each scan line: (length, path)."""
    best = [(0.0, (), start)]
    for options in stages:
        reached = []
        for option in options:
            first = entry_of(option[0])
            inner = sum(math.dist(exit_of(a), entry_of(b)) for a, b in zip(option, option[1:]))
            length, path, _ = min(
                ((cost + math.dist(here, first) + inner, path, here) for cost, path, here in best),
                key=lambda item: item[0],
            )
            reached.append((length, path + (option,), exit_of(option[-1])))
        best = reached
    length, path, _ = min(
        ((cost + math.dist(here, end), path, here) for cost, path, here in best), key=lambda item: item[0]
    )
    return length, [segment for option in path for segment in option]


def order_lines(groups, start, end, entry_of=lambda s: s[0], exit_of=lambda s: s[1]):
    """Directed segments in the order of shortest travel that frees no large piece on the way.

    groups    (parallel to X, parallel to Y), each a list of scan lines in rising order
    start     where the tool comes from, end: where it goes afterwards, (x, y) mm
    entry_of, exit_of   where a directed segment is entered from above and left (mm)

    While the first group is cut, all strips stay joined to the stock at their ends.  The second group frees a column of
    cells with each scan line; taken in rising or falling order, a column is one cell wide, never two.  So the second
    group must be monotone; the first is too, because no other order of parallel lines is shorter.  What is left open
    is which group comes first, each group's sense and each line's sense: at most 8 chains, each solved exactly.
    """
    groups = [group for group in groups if group]
    if not groups:
        return []
    sequences = [groups] if len(groups) == 1 else [groups, groups[::-1]]
    candidates = []
    for sequence in sequences:
        for senses in range(2 ** len(sequence)):
            stages = [stage for i, group in enumerate(sequence) for stage in _group_stages(group, senses >> i & 1)]
            candidates.append(_best_chain(stages, start, end, entry_of, exit_of))
    return min(candidates, key=lambda item: round(item[0], 6))[1]
