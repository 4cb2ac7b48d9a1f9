"""G12 / G13: words -> HoleRequest -> moves.  Called by codes.py through session.run_cycle."""

from chipwise import report
from chipwise.cycles.hole import HoleRequest, chop_parts, hole_moves, largest_piece

WORDS = "xyzrijkqeh"


def request_of(ccw):
    """The plan of G12 (ccw False) or G13 (ccw True) for session.run_cycle: State -> moves."""
    return lambda state: _plan(state, _request(state, ccw))


def _plan(state, request):
    """The moves; the task, not the preview, also reports what will fall out."""
    moves = hole_moves(request)
    if state.interp.task:
        parts = chop_parts(request)
        report.record("hole", chopped=parts > 1, pieces=parts, largest_piece_mm=largest_piece(request))
    return moves


def _request(state, ccw):
    """Words of the line -> HoleRequest (mm)."""
    state.check_words(WORDS)
    diameter = state.tool_diameter()
    x, y = state.place()
    clearance, bottom = state.heights()
    depth_step = state.length("j")
    return HoleRequest(
        x=x, y=y, bottom=bottom, clearance=clearance,
        radius=state.needed("i", "radius of the hole"), finished=state.length("k"), step=state.length("q"),
        ccw=ccw, tool_radius=diameter / 2, chop_size=state.chop_size(),
        depth_step=state.flute_length() if depth_step is None else depth_step,
        feed=state.feed(), plunge_feed=state.plunge_feed(), start=state.position())
