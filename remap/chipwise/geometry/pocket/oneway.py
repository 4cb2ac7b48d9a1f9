# SPDX-License-Identifier: GPL-2.0-or-later
"""P1: clear a machinable region by cuts that all run one way, with the wall cut in the same go.

Called by strategies.py.  Source: the abstract on unidirectional area machining.  Its sequence,
with its symbols: cut along PTi from Pi to Qi; feed along the outline OLC back to Qi-1; traverse to
Pi; feed along OLC to Pi+1; cut along PTi+1; and so on.  A Track here is what lies between two
traverses: Pi to Pi+1 along the outline, PTi+1, and Qi+1 to Qi along the outline.  The direction of
progress (scan.py, 1) makes all three kinds of move climb, or all conventional.

Departures: the abstract says nothing of the first and the last path, of islands and of bays.
1. The first chord of a region goes on along the outline over the region's head, back to its start.
2. At the start of an island the tool goes on over its head to the chord on its other side.
3. What the moves of the abstract leave of the outline, the foot of a region or of an island, is cut
   from P to Q as soon as the chords on both sides are done.
4. A chord waits until every chord before it is done; of those that may be next the one below the
   last comes first, then the one whose start is nearest.
5. With Walls all this ends a little before the walls (scan.py: rows_before).  The outline is run at the end, without
   the stops of the traverses.
"""

import numpy as np

from chipwise.geometry.pocket.scan import finished, rows_before


def one_way(region, radius, step, direction, climb, walls=None):
    """Tracks of a machinable region, every chord in `direction` (rad); see tracks.py."""
    rows = rows_before(region, radius, step, direction, climb, walls)
    order = _Order(rows)
    tracks = []
    while (chord := order.following()) is not None:
        tracks += [rows.track(chain) for chain in order.cut(chord)]
    return finished(region, rows, tracks, climb, walls)


class _Order:
    """Which chord comes next, and the runs it takes."""

    def __init__(self, rows):
        self.rows = rows
        self.done = np.zeros(rows.chords, bool)
        self.waiting = np.array([len(a) for a in rows.above], int)  # chords above still to cut
        self.below = [[] for _ in range(rows.chords)]
        for chord, above in enumerate(rows.above):
            for other in above:
                self.below[other].append(chord)
        self.heads = self._heads()
        self.ready = {c for c in range(rows.chords) if self.heads[c] and not self.waiting[c]}
        self.last = None

    def _heads(self):
        """Chords at which a track may begin: their start follows another along a wall, or they are
        the first of a region that no row has entered."""
        rows = self.rows
        heads = rows.is_start[rows.before[rows.starts]]
        for chord, above in enumerate(rows.above):
            if not above and chord == rows.beside[chord][0]:
                heads[chord] = True
        return heads

    def following(self):
        """The next chord, or None."""
        ready = [c for c in self.ready if not self.done[c]]
        if not ready:
            left = np.flatnonzero(~self.done)
            return int(left[0]) if len(left) else None
        rows = self.rows
        if self.last is None:
            return min(ready)
        wall = rows.after[rows.starts[self.last]]
        if rows.is_start[wall] and int(rows.chord[wall]) in self.ready and not self.done[rows.chord[wall]]:
            return int(rows.chord[wall])
        ready.sort()
        away = rows.point[rows.starts[ready]] - rows.point[rows.ends[self.last]]
        return ready[int(np.argmin(np.hypot(away[:, 0], away[:, 1])))]

    def cut(self, chord):
        """Runs of the track that cuts a chord, and of the feet that become free with it."""
        rows, fresh = self.rows, []
        before = int(rows.before[rows.starts[chord]])
        chain = rows.chain_of_segment(before) if self._cleared(before) else []
        while True:
            self._take(chord)
            fresh.append(chord)
            chain += rows.chain_of_chord(chord) + rows.chain_of_segment(rows.ends[chord])
            here = int(rows.after[rows.ends[chord]])
            if self._closes(here):
                chain += rows.chain_of_segment(here)  # over the head and on to the next row
                here = int(rows.after[here])
            chord = int(rows.chord[here])
            if not rows.is_start[here] or self.done[chord]:
                break
        self.last = fresh[-1]
        return [chain] + self._feet(fresh)

    def _cleared(self, crossing):
        return self.rows.is_start[crossing] and self.done[self.rows.chord[crossing]]

    def _closes(self, here):
        """Whether the outline came back to the start of a chord that is done, and leads on to one
        that may be cut."""
        rows, onward = self.rows, int(self.rows.after[here])
        follower = int(rows.chord[onward])
        return bool(
            rows.is_start[here]
            and self.done[rows.chord[here]]
            and rows.is_start[onward]
            and not self.done[follower]
            and not self.waiting[follower]
        )

    def _take(self, chord):
        self.done[chord] = True
        for other in self.below[chord]:
            self.waiting[other] -= 1
            if not self.waiting[other] and self.heads[other]:
                self.ready.add(other)
        self.ready.discard(chord)

    def _feet(self, fresh):
        """Runs of outline pieces from P to Q with both chords done, one of them just now."""
        rows, chains = self.rows, []
        for chord in fresh:
            for crossing in (rows.starts[chord], rows.before[rows.ends[chord]]):
                foot = rows.is_start[crossing] and not rows.is_start[rows.after[crossing]]
                ends = rows.chord[[crossing, rows.after[crossing]]]
                chain = rows.chain_of_segment(crossing) if foot and self.done[ends].all() else []
                if chain and chain not in chains:
                    chains.append(chain)
        return chains
