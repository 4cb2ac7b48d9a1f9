"""G79: words -> PocketRequest -> moves.  Called by codes.py through session.run_cycle."""

from chipwise import report, subs
from chipwise.cycles.pocket import PocketRequest, pocket_plan
from chipwise.errors import CycleError
from chipwise.geometry.contour import ContourError
from chipwise.glue import shape

WORDS = "qdikplzrjeh"

# D without a word, in tool diameters.
STEP_SHARE = 0.4


def plan(state):
    """The plan of G79 for session.run_cycle: State -> moves.  What the operator should know goes to the state."""
    state.check_words(WORDS)
    words = _words(state)
    found = shape.read(state)
    try:
        made = pocket_plan(PocketRequest(loops=tuple(tuple(loop) for loop in found.loops), **words))
    except ContourError as error:
        raise subs.shape_error(found, error) from error
    for text, lengths in made.notes:
        state.say(text, **lengths)
    if state.interp.task:
        report.record("pocket", regions=made.fields, plunges=len(made.plunges), unreached_mm2=[
            round(region.area, 3) for region in made.unreached])
    return made.moves


def _words(state):
    """Words of the line -> fields of a PocketRequest (mm), all but the loops."""
    diameter = state.tool_diameter()
    clearance, bottom = state.heights()
    state.chop_size()               # checks H0: a pocket leaves no slug, so there is nothing to chop
    depth_step, step = state.length("j"), state.length("d")
    return dict(
        bottom=bottom, clearance=clearance, tool_radius=diameter / 2,
        step=STEP_SHARE * diameter if step is None else step, close_gap=state.settings["CLOSE_GAP"],
        side_allowance=state.length("i") or 0.0, floor_allowance=state.length("k") or 0.0, strategy=_strategy(state),
        direction=float(state.number("l") or 0), climb=state.turns_clockwise(),
        depth_step=state.flute_length() if depth_step is None else depth_step, ramp_angle=state.ramp_angle(),
        feed=state.feed(), plunge_feed=state.plunge_feed(), start=state.position())


def _strategy(state):
    """The word P."""
    value = state.number("p") or 0
    if value not in (0, 1, 2, 3):
        raise CycleError(f"strategy P{value:g} is not known", "use P0, P1, P2 or P3")
    return int(value)
