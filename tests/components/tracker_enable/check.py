# SPDX-License-Identifier: GPL-2.0-or-later
"""Volume cut in each phase, against closed forms; nothing where nothing may be cut."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, always, load_module, near, require, within

scene = load_module(SCENES / "tracker_enable/stimulus.py")
ROUNDING_MM3 = 1e-4  # a cell's heights are whole 65535ths of the stock's
R, H = 0.5 * scene.DIAMETER, scene.DEPTH
DISC = np.pi * R * R

CUT_MM3 = {  # what each phase removes
    "disabled": 0.0,
    "enabled in the middle": H * (DISC + 2 * R * 15.0),  # whole discs at both ends
    "disabled again": 0.0,
    "plunge": H * DISC,
    "retract": 0.0,
    "traverse above": 0.0,
    "traverse touches nothing at the top": 0.0,
    "once more": 0.0,
}
RAMP_AND_BACK_MM3 = H * (DISC + 2 * R * 20.0)
LOAD_MM2 = {"plunge": DISC, "enabled in the middle": 2 * R * H}


def cut_in(trace, phase):
    """(mm3 removed in the phase, s at which it ends)."""
    rows = trace.phases[phase]
    volume = trace["removed-volume"]
    return volume[rows.stop - 1] - volume[rows.start - 1], rows.stop * PERIOD_S


def check(trace):
    always(trace, "fault-code", 0)
    volume = trace["removed-volume"]
    require(
        trace,
        "removed-volume",
        np.append(True, np.diff(volume) >= -ROUNDING_MM3),
        "mm3",
        f"never falling by more than {ROUNDING_MM3:g}",
    )
    for phase, wanted in CUT_MM3.items():
        cut, at = cut_in(trace, phase)
        if wanted:
            near(f"removed in phase '{phase}'", cut, wanted, 0.003, "mm3", at)
        else:
            assert abs(cut) <= 0.02, f"removed in phase '{phase}': {cut:.4g} mm3 at {at:.3f} s, allowed: 0 mm3 +- 0.02"
    ramp, _ = cut_in(trace, "plunge slanted")
    back, at = cut_in(trace, "same way back")
    near("removed by a ramp and the way back", ramp + back, RAMP_AND_BACK_MM3, 0.003, "mm3", at)
    assert 0.3 < ramp / (ramp + back) < 0.7, (
        f"ramp: {ramp:.5g} mm3 at {at:.3f} s, allowed: 30..70 % of {ramp + back:.5g} mm3"
    )

    for phase, area in LOAD_MM2.items():
        part = trace.only(phase)
        inside = part["pos-z"] - scene.OFFSET[2] < scene.TOP - 0.5
        within(part, "section-area", 0.98 * area, 1.02 * area, "mm2", np.where(inside, part["section-area"], area))
    for phase in ("retract", "traverse above"):
        part = trace.only(phase)
        within(
            part, "section-area", 0.0, 1e-6, "mm2", part["section-area"] * (np.arange(len(part["section-area"])) > 0)
        )
    disabled = trace.only("disabled")
    within(disabled, "removed-volume", 0.0, 0.0, "mm3")
    across = np.arange(len(disabled["pos-z"])) > len(disabled["pos-z"]) // 2 + 50
    within(
        disabled,
        "section-area",
        23.5,
        24.5,
        "mm2",  # the position is followed all the same
        np.where(across, disabled["section-area"], 24.0),
    )


def joined(t):
    """The path made while disabled is cut as soon as enable comes."""
    start = t.phases["enabled in the middle"].start
    return t.but(removed_volume=lambda v: v + 360.0 * (np.arange(len(v)) >= start))


SABOTAGE = {
    "the path before is cut": joined,
    "disabled cuts": lambda t: t.put("removed-volume", "disabled", 3.0, 100),
    "volume 5 % too small": lambda t: t.but(removed_volume=lambda v: 0.95 * v),
    "nothing is ever cut": lambda t: t.but(removed_volume=lambda v: 0 * v),
    "offset not subtracted: nothing met": lambda t: t.but(section_area=lambda v: 0 * v),
    "volume falls once": lambda t: t.put("removed-volume", "plunge", 100.0, 90),
    "volume NaN": lambda t: t.put("removed-volume", "end", np.nan),
    "retract has load": lambda t: t.put("section-area", "retract", 28.3, 20),
    "load shifted 0.1 s": lambda t: t.but(section_area=lambda v: np.roll(v, 100)),
    "a fault": lambda t: t.put("fault-code", "traverse above", 21, 3),
    "plunge at double load": lambda t: t.put("section-area", "plunge", 56.6),
}
