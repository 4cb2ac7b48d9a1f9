"""The ceiling of M251 P2 and P3: what becomes of F while the volumetric feed may go above it.

Called by emit.set_feed (cycles), by volumetric.py (M251, M252) and by the remapped F.

LinuxCNC 2.9 clamps the adaptive feed to 1: it can slow the machine down but not speed it up.  So the canonical
feed is set to the ceiling, the feed the program asked for goes to volumetric-feed.0.programmed-vel through an analog
output that M67 sets in step with motion, and the override is below 1 from then on.  The interpreter itself keeps the
program's F: #<_feed> and every cycle see what was programmed.

The ceiling is set only after the machine has got to the M251 and its mode was read back (volumetric.py): without the
realtime side F is never replaced.  One interpreter per process, so the state is the module's.
"""

import emccanon

from chipwise.errors import MM_PER_INCH

_FEED_PER_MINUTE = 0


class Ceiling:
    """mm/min, None while F is not replaced; the analog output that carries the programmed feed."""

    value = None
    output = None


def set_canon_feed(interp, feed):
    """Make `feed` (program units/min, or /rev under G95) the machine's feed, or the ceiling in its place."""
    if Ceiling.value is None:
        emccanon.enqueue_SET_FEED_RATE(feed)
        return
    unit_mm = MM_PER_INCH if interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES else 1.0
    per_minute = interp.feed_mode == _FEED_PER_MINUTE
    units = emccanon.GET_EXTERNAL_LENGTH_UNITS()
    programmed = feed * unit_mm / 60.0 * units if per_minute else 0.0
    emccanon.SET_MOTION_OUTPUT_VALUE(Ceiling.output, programmed)
    emccanon.enqueue_SET_FEED_RATE(max(feed, Ceiling.value / unit_mm) if per_minute else feed)
