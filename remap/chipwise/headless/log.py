# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of a run: one row per servo period, and the figures drawn from it.

hal/headless.hal samples in realtime, bin/chipwise-headless collects, the tests
check the figures against their own model of the stock.  Pure apart from
load_text() and save(): no HAL, no LinuxCNC.

Lengths are machine units as HAL has them, volumes and areas mm; a removal rate
is mm3/min.
"""

import numpy as np

from chipwise.clib.layout import MOTION_ARC, MOTION_FEED

# (name in the log, HAL pin, type); the types in this order are the sampler's
# cfg string in hal/headless.hal.
COLUMNS = (
    ("x", "axis.x.pos-cmd", "f"),
    ("y", "axis.y.pos-cmd", "f"),
    ("z", "axis.z.pos-cmd", "f"),
    ("tool_offset_z", "motion.tooloffset.z", "f"),
    ("motion_type", "motion.motion-type", "s"),
    ("velocity", "motion.current-vel", "f"),
    ("requested_velocity", "motion.requested-vel", "f"),
    ("adaptive_feed", "motion.adaptive-feed", "f"),
    ("removed_volume", "stock-tracker.0.removed-volume", "f"),
    ("section_area", "stock-tracker.0.section-area", "f"),
    ("rate_target", "volumetric-feed.0.mrr-effective", "f"),
    ("limited_by", "volumetric-feed.0.limited-by", "s"),
    ("line", "motion.program-line", "s"),
    ("rapid_contact", "stock-tracker.0.rapid-contact", "b"),
    ("flute_excess", "stock-tracker.0.flute-excess", "b"),
)
NAMES = tuple(name for name, _pin, _type in COLUMNS)

FEED_MOTION = (MOTION_FEED, MOTION_ARC)
SETTLE_PERIODS = 20  # after the end of a move in which its last cells may still be cut
RATE_WINDOW_S = 0.010  # a rate is the volume removed in a window this long
CALIBRATE_S = 1.0  # over so long the map's volume is right
CALIBRATION = (0.8, 1.25)  # bounds of what it may correct the section area by
MIN_SWEPT = 0.5  # mm3 in that time, below which nothing is corrected
OVER_TARGET = 1.02  # a window counts as over the target from this ratio on


def load_text(path):
    """The output of `halsampler -t` -> {name: (n,) array}; `sample` counts periods.

    Lines without a number are left out.  LinuxCNC 2.9 does not count samples that a full buffer lost: sampling.py does.
    """
    with open(path) as handle:
        lines = [line for line in handle if line[:1].isdigit()]
    width = len(COLUMNS) + 1
    if lines and len(lines[-1].split()) != width:
        lines.pop()
    rows = np.loadtxt(lines, ndmin=2) if lines else np.zeros((0, width))
    log = {name: rows[:, 1 + i] for i, name in enumerate(NAMES)}
    log["sample"] = rows[:, 0].astype(np.int64)
    for name, _pin, kind in COLUMNS:
        if kind != "f":
            log[name] = log[name].astype(np.int32)
    return log


def save(path, log, **facts):
    """Write a log as .csv or, with every other ending, as .npz with the facts."""
    if path.endswith(".csv"):
        names = ("sample",) + NAMES
        np.savetxt(
            path,
            np.column_stack([log[name] for name in names]),
            fmt="%.9g",
            delimiter=",",
            header=",".join(names),
            comments="",
        )
        return
    with open(path, "wb") as handle:
        np.savez_compressed(handle, **log, **facts)


def without_tail(log, period, idle_s):
    """The log less the time at its end in which the program had already ended.

    Only rows at rest are cut, so that no motion is ever lost.
    """
    count = len(log["sample"])
    moving = np.flatnonzero((log["motion_type"] != 0) | (log["velocity"] > 0))
    last = moving[-1] + 1 if len(moving) else 0
    keep = max(last, count - int(round(idle_s / period)))
    return {name: column[:keep] for name, column in log.items()}


def lost_samples(log):
    """How many servo periods the log misses between its first and last row."""
    sample = log["sample"]
    return int(sample[-1] - sample[0] + 1 - len(sample)) if len(sample) else 0


def _windows(log, period, window):
    """-> (start, end) rows of the windows spent cutting.

    Cutting is: a feed move or an arc all through the window, and volume
    removed in it.  Windows with lost samples are left out.
    """
    step = max(1, int(round(window / period)))
    start = np.arange(0, max(0, len(log["sample"]) - step), step)
    end = start + step
    feeding = np.isin(log["motion_type"], FEED_MOTION)
    before = np.concatenate([[0], np.cumsum(feeding)])
    volume = log["removed_volume"][end] - log["removed_volume"][start]
    whole = log["sample"][end] - log["sample"][start] == step
    cutting = whole & (before[end + 1] - before[start] == step + 1) & (volume > 0)
    return start[cutting], end[cutting]


def _swept(log, period, units_per_mm):
    """(n,) mm3 removed up to each row, by the section area times the distance, scaled to the map's volume over
    CALIBRATE_S.

    The map gives a wall's cells away in steps when they are cut a second time, deeper, but is right over some time; the
    section area has no steps, but its reading may be off by some percent.  None if the log has no section area.
    """
    tip = [log["x"], log["y"], log["z"] - log["tool_offset_z"]]
    step = np.sqrt(sum(np.diff(axis, prepend=axis[:1]) ** 2 for axis in tip)) / units_per_mm
    area = np.asarray(log["section_area"], float)
    met = 0.5 * (area + np.concatenate([area[:1], area[:-1]])) * step * np.isin(log["motion_type"], FEED_MOTION)
    if not met.any():
        return None
    swept = np.concatenate([[0.0], np.cumsum(met[1:])])
    volume = np.concatenate([[0.0], np.cumsum(np.clip(np.diff(log["removed_volume"]), 0.0, None))])
    half, last = int(round(0.5 * CALIBRATE_S / period)), len(swept) - 1
    row = np.arange(len(swept))
    low, high = np.clip(row - half, 0, last), np.clip(row + half, 0, last)
    by_area, by_map = swept[high] - swept[low], volume[high] - volume[low]
    known = by_area > MIN_SWEPT
    factor = np.where(known, np.clip(by_map / np.where(known, by_area, 1.0), *CALIBRATION), 1.0)
    return np.concatenate([[0.0], np.cumsum((met * factor)[1:])])


def cutting_windows(log, period, window=RATE_WINDOW_S, units_per_mm=1.0):
    """-> (rate, target): mm3/min in each window spent cutting."""
    start, end = _windows(log, period, window)
    swept = _swept(log, period, units_per_mm) if len(log["sample"]) else None
    removed = log["removed_volume"] if swept is None else swept
    return (removed[end] - removed[start]) / window * 60.0, log["rate_target"][start]


def largest_section(log, period, units_per_mm=1.0):
    """Largest section area met (mm2): volume removed per mm of travel, over windows of cutting."""
    start, end = _windows(log, period, RATE_WINDOW_S)
    volume = log["removed_volume"][end] - log["removed_volume"][start]
    step = np.sqrt(sum(np.diff(log[axis], prepend=log[axis][:1]) ** 2 for axis in "xyz"))
    distance = np.cumsum(step) / units_per_mm
    length = distance[end] - distance[start]
    met = volume[length > 0] / length[length > 0]
    return float(met.max()) if len(met) else 0.0


def volume_removed(log):
    """mm3 over the run; a new stock (volume back at 0) starts a new sum, a restored one brings its own and adds
    nothing."""
    steps = np.diff(log["removed_volume"])
    moving = np.asarray(log["motion_type"]) != 0
    if not moving.any():
        return float(steps[steps > 0].sum())
    row = np.arange(len(moving))
    since = row - np.maximum.accumulate(np.where(moving, row, -SETTLE_PERIODS))  # periods since it moved
    steps = np.where(since[1:] < SETTLE_PERIODS, steps, 0.0)
    return float(steps[steps > 0].sum())


def figures(log, period, units_per_mm=1.0):
    """-> the summary's figures that come from the log; None where unknown."""
    count = len(log["sample"])
    span = log["sample"][-1] - log["sample"][0] + 1 if count else 0
    result = {
        "cycle_s": round(float(span) * period, 3),
        "volume_mm3": round(volume_removed(log), 3),
        "rate_target": None,
        "rate_mean": None,
        "rate_peak": None,
        "over_target_share": None,
    }
    rate, target = cutting_windows(log, period, units_per_mm=units_per_mm)
    if len(rate):
        start, end = _windows(log, period, RATE_WINDOW_S)
        removed = log["removed_volume"][end] - log["removed_volume"][start]
        result["rate_mean"] = round(float(removed.mean()) / RATE_WINDOW_S * 60.0, 3)
        result["rate_peak"] = round(float(rate.max()), 3)
    aimed = target > 0
    if aimed.any():
        result["rate_target"] = round(float(np.median(target[aimed])), 3)
        over = rate[aimed] > OVER_TARGET * target[aimed]
        result["over_target_share"] = round(float(over.mean()), 5)
    return result
