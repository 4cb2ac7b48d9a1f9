# SPDX-License-Identifier: GPL-2.0-or-later
"""G79, P0 to P3: the millimetres at full width that the plan names, against the engagement judge."""

import math

import numpy as np
import pytest

from support import engagement_judge
from support.engagement_shapes import SHAPES
from support.pocket_random import circle, rectangle
from support.pocket_requests import request, walked
from chipwise.cycles import pocket as cycle
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket import full_width
from chipwise.geometry.pocket.engage_proof import FULL

SPACING_MM = full_width.SPACING * 3.0


def told(asked):
    """(mm, places, longest, x, y) of the note; None."""
    found = [
        note
        for note in cycle.pocket_plan(asked).notes
        if note.text.startswith("the tool cuts its full width over {mm} in ")
    ]
    if not found:
        return None
    ((text, lengths),) = found
    return (lengths["mm"], int(text.split()[9]), lengths["most"], lengths["x"], lengths["y"])


@pytest.mark.parametrize(
    "strategy, name",
    [
        (0, "rectangle"),
        (0, "island"),
        (0, "comb of 9 mm slots"),
        (0, "letter"),
        (1, "rectangle"),
        (1, "neck"),
        (2, "rectangle"),
        (2, "island"),
        (3, "rectangle"),
        (3, "letter"),
    ],
)
def test_the_millimetres_at_full_width(strategy, name):
    """As the judge reads them, within its spacing and the plan's for each place."""
    asked = request(SHAPES[name], strategy=strategy)
    length, count, longest, x, y = told(asked)
    rows = engagement_judge.engagement(walked(asked), asked.bottom, 3.0).rows
    full = rows[rows[:, 4] > FULL]
    assert length == pytest.approx(full[:, 5].sum(), abs=count * (SPACING_MM + 0.1)) and 0.0 < longest <= length
    assert np.hypot(full[:, 1] - x, full[:, 2] - y).min() < SPACING_MM


@pytest.mark.parametrize("strategy", [0, 3])
def test_nothing_is_said_of_a_circle(strategy):
    """The helix is as wide as its first ring needs."""
    assert told(request((circle(25.0, (0.0, 0.0)),), strategy=strategy)) is None


def test_a_region_that_is_a_line():
    length, count, longest, _, _ = told(request((rectangle(0, 0, 6, 30),)))
    assert (length, count, longest) == (pytest.approx(24.0), 1, pytest.approx(24.0))


def test_levels_are_not_added_up():
    one, two = (told(request(SHAPES["L"], depth_step=step)) for step in (None, 2.0))
    assert one == two


def test_short_elements_count_as_chords():
    """A circle of 3,000 lines and the same circle in arcs: as many places are asked for, the length is the same."""
    angle = np.linspace(0.0, 2.0 * math.pi, 3001)
    point = 20.0 * np.column_stack((np.cos(angle), np.sin(angle)))
    lines = elements.make_lines(point[:-1], point[1:])
    coarse = full_width._coarse(lines, SPACING_MM)
    assert len(coarse) < 450 and elements.lengths(coarse).sum() == pytest.approx(40.0 * math.pi, rel=1e-3)
    assert np.hypot(*(coarse.start[1:] - coarse.end[:-1]).T).max() < 1e-12
    long = make_contour(rectangle(0, 0, 60, 40)).elements
    assert np.array_equal(full_width._coarse(long, SPACING_MM).end, long.end)
