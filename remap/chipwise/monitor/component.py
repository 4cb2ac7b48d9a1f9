# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL pins of chipwise-monitor.  Called by cli/monitor.py."""

from chipwise.host.halcmd import halcmd, signal_of
from chipwise.monitor import known, set_up_time, takeover

COMPONENT = "chipwise-monitor"
# (type, direction, names) of the pins, by the names of the module hal
PINS = (
    (
        "HAL_FLOAT",
        "HAL_OUT",
        (
            "tool-diameter",
            "tool-corner-radius",
            "tool-tip-angle",
            "tool-flute-length",
            "tool-stick-out",
            "tool-holder-diameter",
        ),
    ),
    (
        "HAL_S32",
        "HAL_OUT",
        ("tool-number", "tool-followed", "heartbeat", "program-loaded", "program-mark", "job-stock", *known.PINS),
    ),
    (
        "HAL_FLOAT",
        "HAL_OUT",
        (
            "tool-max-rate",
            "tool-flutes",
            "max-chip",
            "min-chip",
            "max-power",
            "max-force",
            "tool-stiffness",
            "specific-force",
            "force-exponent",
            "load-factor",
            "stock-doubt",
        ),
    ),
    ("HAL_BIT", "HAL_OUT", ("adaptive-off",)),
    ("HAL_FLOAT", "HAL_OUT", ("feed-override",)),
    ("HAL_BIT", "HAL_OUT", ("program-running",)),
    ("HAL_S32", "HAL_OUT", ("reply", "parts")),
    ("HAL_FLOAT", "HAL_OUT", ("job-target", "job-ceiling", *set_up_time.PINS)),
    ("HAL_BIT", "HAL_OUT", ("hold", "assumed", "tool-assumed", "job", "job-waits", "job-air")),
    (
        "HAL_BIT",
        "HAL_IN",
        (
            "ready",
            "fault",
            "load-lost",
            "override-ignored",
            "held",
            "stock-defined",
            "certain",
            "job-active",
            "feed-carried",
            "new-part",
        ),
    ),
    ("HAL_FLOAT", "HAL_IN", ("guard-distance", "guard-depth", "mrr-target", "load-cut-factor", "load-ratio")),
    (
        "HAL_S32",
        "HAL_IN",
        (
            "fault-code",
            "limited-by",
            "mode",
            "request",
            "slot",
            "guard-reason",
            "guard-line",
            "tool-in-spindle",
            "run-end",
            "path-refused",
            "guard-clamp",
            "guard-part",
            "clamps-taken",
            "load-alarm",
            "load-cuts",
        ),
    ),
)


def make_component():
    """(the component, whether it has taken over the pins of one that was killed)."""
    import hal

    name, dead = takeover.choose_name(COMPONENT)
    component = hal.component(name)
    for kind, direction, names in PINS:
        for name in names:
            component.newpin(name, getattr(hal, kind), getattr(hal, direction))
    if dead:
        takeover.take_over(component, dead, hal.get_value)
    else:
        signal = signal_of("stock-tracker.0.tool-in-spindle")
        if signal:  # the machine's own tool number, by whatever name
            halcmd("net", signal, component.getprefix() + ".tool-in-spindle")
    return component, bool(dead)
