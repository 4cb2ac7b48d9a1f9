# SPDX-License-Identifier: GPL-2.0-or-later
"""The colours of the page of `chipwise panel` as a style sheet, from the display items of colours.py.  Pure; called by
server.py.

--stock, --stock-cut, --tool, ..        an item each
--box, --ink                            background and text
--line, --faint                         between them: lines; words beside figures
--state-calm, --state-off, ..            what lies around the boxes in a state of the machine: the item of the state,
mixed into the background
"""

from chipwise.panel.colours import BACKGROUND, MODES, Item

TEXT = "text"
MIXED = {  # name: item, its share over the background
    "line": (TEXT, 0.3),
    "faint": (TEXT, 0.75),
    "state-calm": (TEXT, 0.08),
    "state-off": (TEXT, 0.16),
    "state-cutting": ("ok", 0.22),
    "state-limited": ("limited", 0.22),
    "state-over": ("over", 0.3),
    "state-alarm": ("alarm_rapid", 0.3),
}
SELECTORS = {"light": ":root", "dark": ':root[data-theme="dark"]'}


def mixed(over: str, under: str, share: float) -> str:
    """Colours "#rrggbb"; share of the first, 0 to 1."""
    pairs = ((int(over[k : k + 2], 16), int(under[k : k + 2], 16)) for k in (1, 3, 5))
    return "#" + "".join(f"{round(under_part + (part - under_part) * share):02x}" for part, under_part in pairs)


def variables(items: dict[str, Item], mode: str) -> dict[str, str]:
    """{name: "#rrggbb"} of a mode; items: colours.load()."""
    behind = items[BACKGROUND].colour(mode)
    found = {item.replace("_", "-"): entry.colour(mode) for item, entry in items.items()}
    found.update(box=behind, ink=items[TEXT].colour(mode))
    found.update((name, mixed(items[item].colour(mode), behind, share)) for name, (item, share) in MIXED.items())
    return found


def stylesheet(items: dict[str, Item]) -> str:
    """Text of the style sheet for both modes."""
    return "".join(
        SELECTORS[mode]
        + " {"
        + "".join(f" --{name}: {value};" for name, value in variables(items, mode).items())
        + " }\n"
        for mode in MODES
    )
