# SPDX-License-Identifier: GPL-2.0-or-later
"""P2: clear a machinable region by cuts to and fro, joined along the outline.

Called by strategies.py.  Same rows and outline pieces as P1 (scan.py).  From the end of a chord
the tool feeds along the outline to a chord of the next row that is still to cut, or round the end of
an island or of a bay, until no way leads on.  The next Track begins at the end of a chord that is
done, next to one that is not, so that only the first Track of a machinable region enters in solid stock.
"""

import numpy as np

from chipwise.geometry.pocket.scan import finished, rows_before


def zigzag(region, radius, step, direction, climb, walls=None):
    """Tracks of a machinable region, chords in `direction` (rad) and against it; see tracks.py."""
    rows = rows_before(region, radius, step, direction, climb, walls)
    done = np.zeros(rows.chords, bool)
    tracks = []
    while not done.all():
        tracks.append(rows.track(_chain(rows, done, tracks[-1].end if tracks else None)))
    return finished(region, rows, tracks, climb, walls)


def _routes(rows, crossing):
    """The two ways along the outline from a crossing, down the rows first: (crossing, run)."""
    after, before = int(rows.after[crossing]), int(rows.before[crossing])
    onward = (after, lambda: rows.chain_of_segment(crossing))
    back = (before, lambda: rows.chain_back(rows.chain_of_segment(before)))
    return (onward, back) if rows.is_start[crossing] else (back, onward)


def _chain(rows, done, here):
    """Pool indices of one Track; marks its chords as done."""
    crossing, chain = _entry(rows, done, here)
    while crossing is not None:
        chord = int(rows.chord[crossing])
        done[chord] = True
        forward = bool(rows.is_start[crossing])
        chain = chain + rows.chain_of_chord(chord, forward)
        end = int(rows.ends[chord] if forward else rows.starts[chord])
        crossing = None
        for there, route in _routes(rows, end):
            if not done[rows.chord[there]]:
                crossing, chain = there, chain + route()
                break
    return chain


def _entry(rows, done, here):
    """(crossing, run) where the next Track begins: the link from a chord that is done, nearest to
    `here`, or the first chord left."""
    left, best = ~done[rows.chord], None
    for origin in (rows.after, rows.before):
        open_ = np.flatnonzero(left & done[rows.chord[origin]])
        if len(open_):
            away = np.hypot(*(rows.point[origin[open_]] - here).T)
            k = int(np.argmin(away))
            if best is None or away[k] < best[0]:
                best = away[k], int(open_[k]), int(origin[open_[k]])
    if best is None:
        return int(rows.starts[np.flatnonzero(~done)[0]]), []
    _, crossing, origin = best
    if rows.after[origin] == crossing:
        return crossing, rows.chain_of_segment(origin)
    return crossing, rows.chain_back(rows.chain_of_segment(crossing))
