# SPDX-License-Identifier: GPL-2.0-or-later
"""Inputs of the feed law, sound ones and hostile ones, and its answer.  Called by tests/core/test_feed*.py."""

import math

from chipwise.clib import core, layout

OFF, LIMIT, CONSTANT, WINDOW = layout.FeedMode
NOTHING, HERE, AHEAD, FLOOR, CEILING, FALLBACK, CHIP, POWER, TORQUE, FORCE = layout.LimitedBy
# Short names of the cases -> members of FeedIn.
MEMBERS = {
    "kind": "feed_mode",
    "target": "mrr_target_mm3_s",
    "lower": "mrr_lower_mm3_s",
    "programmed": "programmed_vel_mm_s",
    "requested": "requested_vel_mm_s",
    "accel": "acceleration_mm_s2",
    "floor": "min_vel_mm_s",
    "dt": "period_s",
    "trusted": "is_trusted",
    "area": "section_area_mm2",
    "tool_target": "tool_max_rate_mm3_s",
    "most": "max_vel_mm_s",
    "floor_share": "min_scale_of_f",
    "most_share": "max_scale_of_f",
    "air": "air_vel_mm_s",
    "plunge": "plunge_vel_mm_s",
    "upward": "dir_z",
    "chip": "max_chip_thickness_mm",
    "teeth": "flutes",
    "turns": "spindle_speed_rps",
    "tool_width": "tool_diameter_mm",
    "stock_height": "depth_mm",
    "knob": "feed_override_share",
    "jerk": "max_jerk_mm_s3",
    "speed": "current_vel_mm_s",
    "gain": "current_accel_mm_s2",
    "air_free": "is_air_free",
    "ceiling": "ceiling_of_f",
    "pace": "pace_mm",
    "pace_vel": "pace_vel_mm_s",
    "pace_accel": "pace_accel_mm_s2",
    "keeps": "keeps_f_down",
    "descent": "descent_mm",
    "descent_accel": "descent_accel_mm_s2",
}
ODD = [math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1e-9, 5e-324, 1.0, 60.0, 1e308, -1e308]


def given(**values):
    """A sound input: target 60 mm3/s, F and requested 10 mm/s, 500 mm/s2, 1 ms; changed by
    `values`; ahead=[(distance, area), ..]."""
    into = core.FeedIn()
    into.feed_mode, into.mrr_target_mm3_s, into.mrr_lower_mm3_s = LIMIT, 60.0, 0.0
    into.programmed_vel_mm_s = into.requested_vel_mm_s = 10.0
    into.motion, into.acceleration_mm_s2, into.period_s, into.is_trusted = layout.MOTION_FEED, 500.0, 0.001, 1
    for i, (distance, area) in enumerate(values.pop("ahead", [])):
        into.load_distance_mm[i], into.load_area_mm2[i] = distance, area
    for name, value in values.items():
        setattr(into, MEMBERS.get(name, name), value)
    return into


def law(last=1.0, **values):
    out = core.feed(given(**values), last)
    return out.scale, out.limit


def hostile(random):
    names = [
        "target",
        "lower",
        "programmed",
        "requested",
        "accel",
        "floor",
        "dt",
        "area",
        "tool_target",
        "most",
        "floor_share",
        "most_share",
        "air",
        "plunge",
        "upward",
        "chip",
        "teeth",
        "turns",
        "tool_width",
        "stock_height",
        "descent",
        "descent_accel",
        "ceiling",
        "pace",
        "pace_vel",
        "pace_accel",
    ]
    case = {
        "kind": int(random.integers(-1, 6)),
        "motion": int(random.integers(0, 5)),
        "trusted": int(random.integers(0, 4) != 0),
        "keeps": int(random.integers(2)),
        "air_free": int(random.integers(2)),
        "last": 1.0,
        "ahead": [],
    }
    for name in random.choice(names, random.integers(1, 10), replace=False):
        case[str(name)] = ODD[random.integers(len(ODD))]
    if random.integers(2):
        case["ahead"] = [
            (ODD[random.integers(len(ODD))], ODD[random.integers(len(ODD))]) for _ in range(random.integers(1, 9))
        ]
    if random.integers(4) == 0:
        case["last"] = ODD[random.integers(len(ODD))]
    return case


def limited(limits, loads=(), **more):
    """Inputs of the law with tooth loads [(distance mm, 1/mm, chip_tooth_limit)].  limits: a tooth_oracle.Limits."""
    values = limits.into(given(kind=2, requested=60.0, programmed=60.0, target=1e9, area=10.0, **more))
    for i, (distance, load, limit) in enumerate(loads):
        values.tooth_distance_mm[i], values.tooth_load_per_mm[i], values.tooth_limit[i] = distance, load, limit
    return values
