# SPDX-License-Identifier: GPL-2.0-or-later
"""The rules of the words every cycle has: R, Z, J, F, E.  Requests that have these fields, mm and mm/min, are checked
here.

Called by hole.py, contour.py and pocket.py.
"""

from chipwise.cycles.plan import Note
from chipwise.errors import CycleError
from chipwise.geometry.base.tolerances import CONNECT_MM
from chipwise.settings import MIN_CHOP_SIZE

# Lengths closer than this are equal. mm; rounding of inch words is below 1e-5
EQUAL = 1e-6

# A step typed as the tool's diameter may be this much larger: half of the fourth decimal of an inch. mm
TYPED = 1.3e-3

# More passes in depth, or rings in a pocket, are a slip of the finger and would stall the preview.
MAX_PASSES = 1000

# Moves of one cycle where nothing else is said: [CHIPWISE]PLAN_MOVES.
MOST_MOVES = 500_000


def check_heights(r):
    """Raise CycleError where Z is not below R."""
    if r.bottom >= r.clearance - EQUAL:
        raise CycleError(
            "final depth Z{z} is not below the clearance plane R{r}",
            "use Z below R or R above Z",
            z=r.bottom,
            r=r.clearance,
        )


def check_feeds(r):
    """Raise CycleError for F or E that is not above 0."""
    if r.feed <= 0:
        raise CycleError("no feed is set", "give F on this line or before")
    if r.plunge_feed <= 0:
        raise CycleError(
            f"plunge feed E{{e}}/{r.feed_per} is not above 0", "use E above 0, or leave it out for F/2", e=r.plunge_feed
        )


def check_depth_step(r):
    """Raise CycleError for J that is not above 0, or needs too many passes."""
    if r.depth_step is None:
        return
    if r.depth_step <= 0:
        raise CycleError("depth per pass J{j} is not above 0", "use J above 0", j=r.depth_step)
    if (r.clearance - r.bottom) / r.depth_step > MAX_PASSES:
        raise CycleError(
            f"depth per pass J{{j}} needs more than {MAX_PASSES} passes from R to Z",
            "use a larger J, or correct Z; without J it is the flute length",
            j=r.depth_step,
        )


def check_step(name, letter, step, diameter, why=""):
    """Raise CycleError for a step (mm) of the word `letter` that is not above 0, or larger than the tool."""
    if step <= 0:
        raise CycleError(
            f"{name} {letter}{{s}} is not above 0", f"use {letter} above 0, up to {{d}}", s=step, d=diameter
        )
    if step > diameter + TYPED:
        raise CycleError(
            f"{name} {letter}{{s}} is larger than the tool ({{d}}){why}",
            f"use {letter} up to {{d}}",
            s=step,
            d=diameter,
        )


def gap_notes(contours) -> tuple[Note, ...]:
    """What the operator should know of gaps that were closed."""
    return tuple(
        Note(
            f"the contour has a gap of {{gap}} at the end of line {contour.gap_line}, which is closed",
            {"gap": contour.gap},
        )
        for contour in contours
        if contour.gap > CONNECT_MM
    )


def check_moves(count, r, remedy):
    """Raise CycleError for more moves than the request's .most_moves."""
    if count > r.most_moves:
        raise CycleError(
            f"this takes {count:.0f} moves, more than {r.most_moves}", remedy + ", or raise [CHIPWISE]PLAN_MOVES"
        )


def check_chop_size(r):
    """Raise CycleError for a chop size below 0, or so small that it can only be a slip of the finger."""
    if r.chop_size < 0:
        raise CycleError(
            "chop size {h} is negative", "set #<_chipwise_chop_size> to 0 (never chop) or more", h=r.chop_size
        )
    if 0 < r.chop_size < MIN_CHOP_SIZE - EQUAL:
        raise CycleError(
            "chop size {h} is below {least}",
            "set #<_chipwise_chop_size> to 0 (never chop), or to {least} or more",
            h=r.chop_size,
            least=MIN_CHOP_SIZE,
        )
