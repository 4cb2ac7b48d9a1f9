# SPDX-License-Identifier: GPL-2.0-or-later
"""Cases of the feed law, one per period, each with the answer worked out by hand, and hostile ones.

Q = 6000 mm3/min = 100 mm3/s throughout, so an area of A mm2 allows 100/A mm/s.
"""

import math
import random

from support.halrig import Stimulus

PERIOD_S, FLOOR = 0.001, 2.0  # s; mm/s, min-vel in test.hal
SEED, HOSTILE = 2, 700
NOTHING, HERE, AHEAD, FLOOR_BY, CEILING, FALLBACK = range(6)
NAN, INF = math.nan, math.inf
SOUND = {
    "mode": 1,
    "mrr-target": 6000.0,
    "mrr-lower": 3000.0,
    "programmed-vel": 20.0,
    "requested-vel": 20.0,
    "motion-type": 2,
    "acceleration": 500.0,
    "section-area": 10.0,
    "ready": 1,
    "fault": 0,
    "distance-first": 0.0,
    "area-first": 0.0,
    "distance-last": 0.0,
    "area-last": 0.0,
}
ODD = (NAN, INF, -INF, -1.0, 0.0, 1e300, -1e300, 1e-300, 5.0, 100.0)

CASES = []  # (phase, pins that differ, factor, limited-by)


def case(phase, factor, by, **pins):
    CASES.append((phase, {name.replace("_", "-"): v for name, v in pins.items()}, factor, by))


def braking(there, distance, accel=500.0, scale=1.0, requested=20.0):
    """mm/s allowed `distance` mm before a place that allows `there`, with half the acceleration
    and two periods at the speed of the period before."""
    room = max(0.0, distance - 2 * PERIOD_S * scale * requested)
    return math.sqrt(there**2 + accel * room)


# F = Q / A at the tool, never above F
case("limit", 0.5, HERE, section_area=10.0)
case("limit", 0.25, HERE, section_area=20.0)
case("limit", 1.0, NOTHING, section_area=4.0)
case("limit", 1.0, NOTHING, section_area=0.0)
case("limit", 0.5, HERE, motion_type=3)
case("limit", 0.25, HERE, section_area=10.0, mrr_target=3000.0)
case("limit", 0.5, NOTHING, section_area=1.0, programmed_vel=10.0)  # F below the ceiling
case("limit", 0.5, HERE, section_area=10.0, programmed_vel=0.0)  # 0: as requested
case("limit", 0.5, HERE, section_area=10.0, programmed_vel=50.0)  # above: as requested
# constant: up to the ceiling, whatever F is
case("constant", 0.5, HERE, mode=2, section_area=10.0)
case("constant", 0.9, HERE, mode=2, section_area=100 / 18, programmed_vel=10.0)
case("constant", 1.0, CEILING, mode=2, section_area=1.0, programmed_vel=10.0)
case("constant", 1.0, CEILING, mode=2, section_area=0.0, programmed_vel=10.0)
# window: F while its rate lies in R..Q, here 50..100 mm3/s
case("window", 0.4, NOTHING, mode=3, section_area=10.0, programmed_vel=8.0)
case("window", 0.5, HERE, mode=3, section_area=10.0, programmed_vel=12.0)  # over: Q / A
case("window", 0.25, HERE, mode=3, section_area=10.0, programmed_vel=2.5)  # under: R / A
case("window", 1.0, CEILING, mode=3, section_area=1.0, programmed_vel=8.0)  # under, out of reach
case("window", 1.0, CEILING, mode=3, section_area=0.0, programmed_vel=8.0)
# ahead: sqrt(v^2 + a d), the nearest worst place wins; a row of the same keeps the scale
for _ in range(2):
    case("ahead", None, AHEAD, section_area=0.0, distance_first=0.1, area_first=20.0)
    case("ahead", None, AHEAD, section_area=0.0, distance_last=0.3, area_last=50.0)
    case("ahead", None, AHEAD, section_area=6.0, distance_first=2.0, area_first=8.0, distance_last=0.2, area_last=40.0)
case("ahead", 1.0, NOTHING, section_area=0.0, distance_first=20.0, area_first=50.0)
case("ahead", 0.5, HERE, section_area=10.0, distance_first=20.0, area_first=50.0)
case("ahead", 0.25, AHEAD, section_area=10.0, distance_first=0.0, area_first=20.0)
# floor: 2 mm/s, and never below a thousandth of the requested velocity
case("floor", 0.1, FLOOR_BY, section_area=100.0)
case("floor", 0.1, FLOOR_BY, section_area=1e9)
case("floor", 0.1, FLOOR_BY, section_area=0.0, distance_first=0.0, area_first=1e9)
case("floor", 0.001, FLOOR_BY, section_area=1e9, requested_vel=4000.0, programmed_vel=1e-3)
# off, and motions that are not feeds: the override stays 1
case("off", 1.0, NOTHING, mode=0)
case("off", 1.0, NOTHING, mode=4)
case("off", 1.0, NOTHING, mode=-1)
for motion in (0, 1, 4, 5, 6, -3, 99):
    for mode in (1, 2, 3):
        case("other motion", 1.0, NOTHING, motion_type=motion, mode=mode, programmed_vel=5.0)
        case("other motion", 1.0, NOTHING, motion_type=motion, mode=mode, ready=0)
# what cannot be judged leaves the programmed feed
for mode in (1, 2, 3):
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, ready=0)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, fault=1)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, section_area=NAN)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, section_area=-1.0)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, mrr_target=0.0)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, mrr_target=INF)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, acceleration=0.0)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, area_last=NAN)
    case("fallback", 0.4, FALLBACK, mode=mode, programmed_vel=8.0, distance_first=NAN)
    case("fallback", 1.0, FALLBACK, mode=mode, programmed_vel=NAN, ready=0)
    case("fallback", 1.0, FALLBACK, mode=mode, programmed_vel=-5.0, ready=0)
    case("fallback", 1.0, FALLBACK, mode=mode, programmed_vel=50.0, ready=0)
    case("fallback", 1.0, FALLBACK, mode=mode, requested_vel=0.0)
    case("fallback", 1.0, FALLBACK, mode=mode, requested_vel=NAN)
case("fallback", 0.4, FALLBACK, mode=3, programmed_vel=8.0, mrr_lower=6001.0)
case("fallback", 0.4, FALLBACK, mode=3, programmed_vel=8.0, mrr_lower=NAN)
case("fallback", 0.5, HERE, mode=1, mrr_lower=NAN)  # not asked for
case("sound again", 0.5, HERE)


def hostile_row(rng):
    row = dict(SOUND)
    for name in rng.sample(sorted(row), rng.randint(1, 5)):
        if name in ("mode", "motion-type"):
            row[name] = rng.choice((1, 2, 3, 2**31 - 1, -(2**31)))
        elif name in ("ready", "fault"):
            row[name] = rng.randint(0, 1)
        else:
            row[name] = rng.choice(ODD)
    return row


def stimulus():
    rows = Stimulus({name: [] for name in SOUND})
    for phase, pins, _factor, _by in CASES:
        if phase not in rows.phases:
            rows.phase(phase)
        rows.add(dict(SOUND, **pins))
    rng = random.Random(SEED)
    rows.phase("hostile")
    for _ in range(HOSTILE):
        rows.add(hostile_row(rng))
    return rows
