"""disobeyed in each phase; for the two that break away: how fast it was by then."""
import numpy as np

from halrig import HERE, PERIOD_S, always, load_module

scene = load_module(HERE / "feed_obey/stimulus.py")
LATE = 8                            # periods, at most


def seen(trace, phase):
    """Rows from being faster than explained to disobeyed: not before, and soon."""
    part = trace.only(phase)
    velocity = scene.stimulus().columns["current-vel"][trace.phases[phase]]
    faster = int(np.argmax(np.array(velocity) > scene.EXPLAINED))
    first = int(np.argmax(part["disobeyed"])) if part["disobeyed"].any() else len(velocity)
    assert faster < first <= faster + LATE, \
        f"disobeyed: from {(part.start + first) * PERIOD_S:.3f} s, " \
        f"allowed: {PERIOD_S} to {LATE * PERIOD_S} s after {(part.start + faster) * PERIOD_S:.3f} s"
    rest = part["disobeyed"][first:]
    assert rest.all(), "disobeyed: let go before the move was, allowed: kept"


def check(trace):
    always(trace.only("obedient"), "disobeyed", 0)
    seen(trace, "disobedient")
    always(trace.only("let go"), "disobeyed", 0)
    always(trace.only("told"), "disobeyed", 1)
    always(trace.only("switched off"), "disobeyed", 0)
    always(trace.only("not judged"), "disobeyed", 0)
    seen(trace, "judged again")


SABOTAGE = {
    "never": lambda t: t.but(disobeyed=lambda d: 0 * d),
    "always": lambda t: t.but(disobeyed=lambda d: 0 * d + 1),
    "10 ms late": lambda t: t.but(disobeyed=lambda d: np.roll(d, 10)),
    "trips on braking": lambda t: t.put("disobeyed", "obedient", 1, 150),
    "let go at rest": lambda t: t.put("disobeyed", "disobedient", 0, -1),
    "kept for good": lambda t: t.put("disobeyed", "let go", 1),
    "not told": lambda t: t.put("disobeyed", "told", 0),
    "trips on a thread": lambda t: t.put("disobeyed", "not judged", 1, 250),
}
