# SPDX-License-Identifier: GPL-2.0-or-later
"""The limits of edges and spindle as the page of `chipwise panel` shows them: the share of each bound that is used, and
the power of the spindle.

Called by watch.py (the page) and tool_log.py (the log), with Machine.pins().
"""

from typing import TypedDict

from chipwise.panel.display import LARGEST, shown
from chipwise.panel.machine import Pins

TOOTH = ("chip", "power", "torque", "force")  # by the names of panel/machine.py; the bound is max_NAME


class Power(TypedDict):
    """W at the edges, and measured; ratio and factor of the tool, 0: none."""

    predicted: float
    measured: float | None
    ratio: float
    factor: float


def loads(pins: Pins) -> dict[str, float]:
    """{name: share of its bound} of the rate and the limits of edges and spindle that are known; {} where nothing but a
    rate is: that is shown as it is."""
    found = {
        name: max(0.0, shown(pins[name])) / pins["max_" + name] for name in TOOTH if 0 < pins["max_" + name] < LARGEST
    }
    if found and 0 < pins["target"] < LARGEST:
        found["rate"] = max(0.0, shown(pins["mrr"])) / pins["target"]
    return {name: round(share, 3) for name, share in found.items()}


def measured_w(pins: Pins) -> float | None:
    """Power of the cut by the load that the spindle's inverter measures, W above what the spindle takes without a cut;
    None: no sensor, or no such power yet."""
    load = shown(pins["spindle_load"]) * shown(pins["spindle_load_scale"])
    return round(max(0.0, load - pins["load_idle"]), 1) if load > 0 and pins["load_idle"] > 0 else None


def power(pins: Pins) -> Power | None:
    """{"predicted": W at the edges, "measured": measured_w(), "ratio", "factor": that of the tool, 0: none}; None where
    there is nothing of it."""
    predicted, measured = round(max(0.0, shown(pins["power"])), 1), measured_w(pins)
    if measured is None and predicted == 0 and not 0 < pins["max_power"] < LARGEST:
        return None
    return {
        "predicted": predicted,
        "measured": measured,
        "ratio": round(shown(pins["load_ratio"]), 3),
        "factor": round(shown(pins["load_factor"]), 3),
    }
