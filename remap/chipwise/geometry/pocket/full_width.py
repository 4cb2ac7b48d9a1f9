# SPDX-License-Identifier: GPL-2.0-or-later
"""How far the tool cuts its full width along the Tracks of a machinable region: the first cut of an area, slots, necks.

Called by cycles/pocket.py for P0 to P3; P4 has it from its certificate (engage_proof.py).  The engagement is read
exactly, from the lines and arcs of the path so far (engage_ground.py).  Lengths mm.
"""

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements, make_lines
from chipwise.geometry.pocket.engage_ground import Ground
from chipwise.geometry.pocket.engage_proof import FULL

# Spacing of the places that are asked for, in tool radii.
SPACING = 0.1

# A region below this area (mm2) is a line or a place: all along it, and the tool has stock ahead only.
NO_AREA_MM2 = 1e-6


def full_width(region, tracks, entered, radius):
    """[(x, y, mm, engagement)] of the places of a level with full width.  entered: {number of a Track: Elements that
    its entry has cut}."""
    if region.area <= NO_AREA_MM2:
        return _line(tracks)
    ground, found = Ground(region.contours, radius), []
    for k, track in enumerate(tracks):
        if k in entered:
            ground.clear(entered[k])
        chain = _coarse(track.elements, SPACING * radius)
        found += _places(chain, ground.along(chain, SPACING * radius), SPACING * radius)
    return found


def _coarse(chain, spacing):
    """A chain with chords for rows of elements that are shorter together than the spacing: thousands of short ones are
    asked for as quickly as a few long ones."""
    length = elements.lengths(chain)
    cell, short = np.floor((np.cumsum(length) - length) / spacing), length < spacing
    first = np.flatnonzero(np.concatenate(([True], (np.diff(cell) > 0.0) | ~short[1:] | ~short[:-1])))
    last = np.append(first[1:], len(chain)) - 1
    chord = make_lines(chain.start[first], chain.end[last])
    return Elements(
        *(
            np.where((first == last).reshape(-1, *[1] * (one.ndim - 1)), one[first], other)
            for one, other in zip(_columns(chain), _columns(chord))
        )
    )


def _columns(e):
    return e.start, e.end, e.centre, e.radius, e.start_angle, e.sweep


def _places(chain, rows, spacing):
    """Of one chain; rows: x, y, heading, engagement at even places of each element."""
    length = elements.lengths(chain)
    count = np.ceil(length / spacing).astype(int)
    each = np.repeat(length / np.maximum(count, 1), count)
    each = each if len(each) == len(rows) else np.full(len(rows), spacing)
    found, full = [], np.flatnonzero(rows[:, 3] > FULL)
    for group in np.split(full, np.flatnonzero(np.diff(full) > 1) + 1):
        if len(group):
            found.append((*rows[group[0], :2].tolist(), float(each[group].sum()), float(rows[group, 3].max())))
    return found


def _line(tracks):
    """Of a region that is a line: there; back the tool runs in its own slot."""
    length = 0.5 * sum(track.length for track in tracks)
    return [(*tracks[0].start.tolist(), length, np.pi)] if length > 0.0 else []
