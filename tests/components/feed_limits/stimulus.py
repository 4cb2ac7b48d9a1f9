# SPDX-License-Identifier: GPL-2.0-or-later
"""Cases with the answer worked out by hand; requested velocity 40 mm/s, the limits of test.hal, Q = 100 mm3/s."""

import math
import random

from support.halrig import Stimulus

REQUESTED, SEED, HOSTILE = 40.0, 3, 500
NOTHING, HERE, AHEAD, FLOOR_BY, CEILING, FALLBACK = range(6)
NAN, INF = math.nan, math.inf
SOUND = {
    "mode": 2,
    "mrr-target": 6000.0,
    "tool-max-rate": 0.0,
    "programmed-vel": 20.0,
    "motion-type": 2,
    "section-area": 10.0,
    "depth": 0.0,
    "direction-z": 0.0,
    "tool-flutes": 0.0,
    "spindle-speed": 0.0,
    "tool-diameter": 6.0,
    "distance": 0.0,
    "area": 0.0,
}
ODD = (NAN, INF, -INF, -1.0, 0.0, 1e300, -1e300, 1e-300, 5.0, 100.0)
CASES = []  # (phase, pins that differ, velocity mm/s, limited-by, rate that counts mm3/min)


def case(phase, velocity, by, rate=6000.0, **pins):
    CASES.append((phase, {name.replace("_", "-"): v for name, v in pins.items()}, velocity, by, rate))


# the smaller rate counts
case("tool rate", 10.0, HERE)
case("tool rate", 4.0, HERE, rate=2400.0, tool_max_rate=2400.0)
case("tool rate", 10.0, HERE, tool_max_rate=9000.0)
case("tool rate", 5.0, AHEAD, rate=2400.0, tool_max_rate=2400.0, section_area=1.0, area=8.0)
case("tool rate", 20.0, FALLBACK, tool_max_rate=NAN)
case("tool rate", 1.0, NOTHING, rate=0.0, mode=0, tool_max_rate=2400.0)  # off: the override is 1, see check
case("tool rate", 12.0, HERE, rate=240.0, mode=3, tool_max_rate=240.0, programmed_vel=8.0, section_area=1 / 3)
# highest: 32 mm/s, 2 x F
case("highest", 32.0, CEILING, section_area=1.0)
case("highest", 20.0, CEILING, section_area=1.0, programmed_vel=10.0)
case("highest", 32.0, AHEAD, section_area=0.0, area=1.0)
case("highest", 10.0, NOTHING, section_area=1.0, programmed_vel=10.0, mode=1)
# lowest: 1 mm/s, 0.1 x F, at most F
case("lowest", 2.0, FLOOR_BY, section_area=1000.0)
case("lowest", 1.0, FLOOR_BY, section_area=1000.0, programmed_vel=5.0)
case("lowest", 0.5, FLOOR_BY, section_area=1000.0, programmed_vel=0.5)
# air: 36 mm/s, modes 2 and 3
case("air", 36.0, CEILING, section_area=0.0)
case("air", 36.0, CEILING, section_area=0.0, programmed_vel=2.0, mode=3)
case("air", 20.0, NOTHING, section_area=0.0, mode=1)
case("air", 5.0, AHEAD, section_area=0.0, area=20.0)
# plunge: 5 mm/s downwards
case("plunge", 5.0, CEILING, section_area=1.0, direction_z=-1.0)
case("plunge", 10.0, CEILING, section_area=1.0, direction_z=-0.5, motion_type=3)
case("plunge", 32.0, CEILING, section_area=1.0, direction_z=1.0)
case("plunge", 36.0, CEILING, section_area=0.0, direction_z=-1.0)
case("plunge", 5.0, AHEAD, section_area=0.0, direction_z=-1.0, area=1.0)
case("plunge", 32.0, CEILING, section_area=1.0, direction_z=NAN)
# mean chip 0.05 mm: full slot v = h n z pi / 2, half v = h n z (pi / 2) as well, a tenth by its arc
TENTH = math.acos(0.8) / 0.2
for sign in (1, -1):
    case("chip", 0.05 * 100 * math.pi / 2, HERE, section_area=6.0, depth=1.0, tool_flutes=2, spindle_speed=sign * 50)
case("chip", 0.05 * 100 * math.pi / 2, HERE, section_area=3.0, depth=1.0, tool_flutes=2, spindle_speed=50)
case("chip", 0.05 * 100 * TENTH, HERE, section_area=0.6, depth=1.0, tool_flutes=2, spindle_speed=50)
case("chip", 10.0, HERE, section_area=10.0, depth=5.0, tool_flutes=2, spindle_speed=500)  # the rate is lower
case("chip", 32.0, CEILING, section_area=1.0, depth=1.0, tool_flutes=0, spindle_speed=50)
case("chip", 32.0, CEILING, section_area=1.0, depth=1.0, tool_flutes=2, spindle_speed=0)
# mode 3 without a ceiling of its own: F is the requested velocity, whatever the rate would allow
case("window without E", 32.0, CEILING, mode=3, section_area=0.1, programmed_vel=0.0)
case("window without E", 10.0, HERE, mode=3, section_area=10.0, programmed_vel=0.0)
# probing: adaptive-feed stays 1; override see check.py
for changes in (
    dict(),
    dict(programmed_vel=10.0),
    dict(programmed_vel=0.0),
    dict(programmed_vel=90.0),
    dict(mode=0, rate=0.0),
):
    case("probing", REQUESTED, NOTHING, motion_type=5, section_area=1000.0, **changes)
# easing, instance 1: 0.5 mm/s a period, in steps of 10 %
EASING = [10.0, 20.0, 4.0, 100.0, 10.0, 10.0, 10.0, 10.0, 10.0, 20.0]
for area in EASING:
    case("easing", None, None, section_area=area)


def eased():
    """Velocity of instance 1 over the phase `easing`, mm/s: worked out step by step."""
    ramp = held = None
    for area in EASING:
        goal = min(100.0 / area, REQUESTED)
        ramp = goal if ramp is None else min(goal, ramp + 0.5)
        held = ramp if held is None or ramp < held or ramp > 1.1 * held else held
        yield held


def hostile_row(rng):
    row = dict(SOUND)
    for name in rng.sample(sorted(row), rng.randint(1, 6)):
        row[name] = rng.choice((1, 2, 3, 2**31 - 1)) if name in ("mode", "motion-type") else rng.choice(ODD)
    return row


def stimulus():
    rows = Stimulus({name: [] for name in SOUND})
    for phase, pins, _velocity, _by, _rate in CASES:
        if phase not in rows.phases:
            rows.phase(phase)
            if phase == "easing":
                rows.add(dict(SOUND, **{"motion-type": 1}))  # a traverse: the easing begins anew
        rows.add(dict(SOUND, **pins))
    rng = random.Random(SEED)
    rows.phase("hostile")
    for _ in range(HOSTILE):
        rows.add(hostile_row(rng))
    return rows
