# SPDX-License-Identifier: GPL-2.0-or-later
"""override-ignored in each phase; for the two that break away: how fast it was by then."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, always, load_module

scene = load_module(SCENES / "feed_watchdog/stimulus.py")
LATE = 8  # periods, at most


def seen(trace, phase):
    """Rows from being faster than explained to override-ignored: not before, and soon."""
    part = trace.only(phase)
    velocity = scene.stimulus().columns["current-vel"][trace.phases[phase]]
    faster = int(np.argmax(np.array(velocity) > scene.EXPLAINED))
    first = int(np.argmax(part["override-ignored"])) if part["override-ignored"].any() else len(velocity)
    assert faster < first <= faster + LATE, (
        f"override-ignored: from {(part.start + first) * PERIOD_S:.3f} s, "
        f"allowed: {PERIOD_S} to {LATE * PERIOD_S} s after {(part.start + faster) * PERIOD_S:.3f} s"
    )
    rest = part["override-ignored"][first:]
    assert rest.all(), "override-ignored: let go before the move was, allowed: kept"


def check(trace):
    always(trace.only("follows"), "override-ignored", 0)
    seen(trace, "ignores")
    always(trace.only("let go"), "override-ignored", 0)
    always(trace.only("told"), "override-ignored", 1)
    always(trace.only("switched off"), "override-ignored", 0)
    always(trace.only("not judged"), "override-ignored", 0)
    seen(trace, "judged again")


SABOTAGE = {
    "never": lambda t: t.but(override_ignored=lambda d: 0 * d),
    "always": lambda t: t.but(override_ignored=lambda d: 0 * d + 1),
    "10 ms late": lambda t: t.but(override_ignored=lambda d: np.roll(d, 10)),
    "trips on braking": lambda t: t.put("override-ignored", "follows", 1, 150),
    "let go at rest": lambda t: t.put("override-ignored", "ignores", 0, -1),
    "kept for good": lambda t: t.put("override-ignored", "let go", 1),
    "not told": lambda t: t.put("override-ignored", "told", 0),
    "trips on a thread": lambda t: t.put("override-ignored", "not judged", 1, 250),
}
