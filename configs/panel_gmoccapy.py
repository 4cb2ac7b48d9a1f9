# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise's panel as a GladeVCP tab: texts for panel_gmoccapy.ui, whose pins chipwise_panel_gladevcp.hal connects.

Called by gladevcp (`-u panel_gmoccapy.py`), started by gmoccapy as [DISPLAY]EMBED_TAB_COMMAND.
"""

import hal
from gi.repository import GLib

FLOATS = ("rate", "rate-target", "share")
WORDS = {  # label: {bit of chipwise-display: what is shown}
    "stock": {"stock-is-none": "none (M250)", "stock-is-defined": "defined", "stock-is-assumed": "assumed"},
    "mode": {
        "mode-off": "F (M252)",
        "mode-limit": "P1 limit",
        "mode-constant": "P2 constant",
        "mode-window": "P3 window",
    },
    "by": {
        "by-nothing": "nothing",
        "by-stock": "stock here",
        "by-ahead": "stock ahead",
        "by-floor": "lowest feed",
        "by-ceiling": "ceiling",
        "by-fallback": "fault or no stock/tool: F",
    },
    "unit": {"unit-cm3": "cm3/min", "unit-in3": "in3/min"},
}
PERIOD_MS = 100


class Panel:
    """The labels, renewed ten times a second."""

    def __init__(self, component, builder):
        self.component, self.builder = component, builder
        for name in FLOATS:
            component.newpin(name, hal.HAL_FLOAT, hal.HAL_IN)
        for bits in WORDS.values():
            for name in bits:
                component.newpin(name, hal.HAL_BIT, hal.HAL_IN)
        GLib.timeout_add(PERIOD_MS, self.show)

    def show(self):
        pins, label = self.component, self.builder.get_object
        for name, bits in WORDS.items():
            label(name).set_text(next((text for bit, text in bits.items() if pins[bit]), ""))
        label("rate").set_text(f"{pins['rate']:.1f}")
        label("target").set_text(f"{pins['rate-target']:.1f}")
        label("share").set_fraction(min(max(pins["share"] / 150.0, 0.0), 1.0))
        label("share").set_text(f"{pins['share']:.0f} %")
        return True


def get_handlers(component, builder, _options):
    return [Panel(component, builder)]
