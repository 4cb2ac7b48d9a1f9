"""Moves (mm) -> plain G0 G1 G2 G3 lines for the interpreter, in program units, with every mode put back.

Only built-in codes are executed.  A remapped code, or a word that is remapped (the package remaps F), would make the
interpreter run the rest of the main program inside the cycle: Interp::_execute() enters its call loop, which ends only
when the call level is back at 0 (rs274ngc_pre.cc, 2.9.0~pre1).  So no F word is ever emitted; see set_feed().

The lines carry absolute XYZ and incremental I J; what that needs (G90, G91.1) is forced and put back.  Units, plane,
path mode, feed mode and offsets are used as they are.
"""

from chipwise.glue.ceiling import set_canon_feed
from chipwise.moves import Arc, Line, Rapid

DECIMALS = 6  # of a mm or an inch: arcs then close far inside LinuxCNC's 0.0283 mm and 0.1 %

_ABSOLUTE = 0  # interp_internal.hh: DISTANCE_MODE


def set_feed(interp, feed):
    """Make `feed` (program units per minute, or per revolution under G95) the active feed.

    What Interp::convert_feed_rate does for an F word, without the word: the interpreter's value, then the canonical
    call, through ceiling.py, which knows whether the machine's feed is a ceiling above it.
    """
    interp.feed_rate = feed
    set_canon_feed(interp, feed)


def _lines(state, moves):
    """(text, feed in program units or None) of each move that moves."""
    scale = 1.0 / state.unit_mm
    x, y, z = (round(value * scale, DECIMALS) for value in state.position())
    for move in moves:
        was = (x, y, z)
        x, y, z = (old if new is None else round(new * scale, DECIMALS)
                   for old, new in zip(was, (move.x, move.y, move.z)))
        target = f"X{x:.{DECIMALS}f} Y{y:.{DECIMALS}f} Z{z:.{DECIMALS}f}"
        if isinstance(move, Arc):
            i, j = move.cx * scale - was[0], move.cy * scale - was[1]
            turns = f" P{move.turns}" if move.turns != 1 else ""
            yield (f"G{3 if move.ccw else 2} {target} I{i:.{DECIMALS}f} J{j:.{DECIMALS}f}{turns}", move.feed * scale)
        elif (x, y, z) == was:
            continue
        elif isinstance(move, Line):
            yield f"G1 {target}", move.feed * scale
        elif isinstance(move, Rapid):
            yield f"G0 {target}", None
        else:
            raise TypeError(f"unknown move {move!r}")


def emit(interp, state, moves):
    """Execute all moves; distance modes, motion mode and feed are afterwards what they were, also after an error."""
    lines = list(_lines(state, moves))
    motion_mode, feed_before = interp.motion_mode, interp.feed_rate
    modes_before = (f"{'G90' if interp.distance_mode == _ABSOLUTE else 'G91'} "
                    f"{'G90.1' if interp.ijk_distance_mode == _ABSOLUTE else 'G91.1'}")
    try:
        interp.execute("G90 G91.1", state.line_number)
        for text, feed in lines:
            if feed is not None and feed != interp.feed_rate:
                set_feed(interp, feed)
            interp.execute(text, state.line_number)
    finally:
        if interp.feed_rate != feed_before:
            set_feed(interp, feed_before)
        # The motion mode first: executing a line is what copies the modes to where task and preview read them.
        interp.motion_mode = motion_mode
        interp.execute(modes_before, state.line_number)
