# SPDX-License-Identifier: GPL-2.0-or-later
"""The colours of the display items: seen by every eye, and a machine's own file is checked."""

import dataclasses
import itertools

import pytest
from support import colour_vision as vision

from chipwise.errors import CycleError
from chipwise.panel import colours

LEAST_CONTRAST = 3.0  # WCAG 2.1, 1.4.11: parts of a picture
LEAST_DISTANCE = 15.0  # CIE L*a*b*: six times what is just noticeable side by side, because the items lie apart
ITEMS = colours.load("")
PAIRS = sorted(
    {
        pair
        for group in ("map", "chart", "state")
        for pair in itertools.combinations([item for item, entry in ITEMS.items() if group in entry.groups], 2)
    }
)


def faults(items, mode):
    """What some eye cannot see: [text]."""
    behind = items["background"].colour(mode)
    found = [
        f"{item}: contrast {vision.contrast(entry.colour(mode), behind, eye):.2f}, {eye}"
        for item, entry in items.items()
        for eye in vision.VISIONS
        if item != "background" and vision.contrast(entry.colour(mode), behind, eye) < LEAST_CONTRAST
    ]
    return found + [
        f"{one} and {other}: distance {vision.distance(items[one].colour(mode), items[other].colour(mode), eye):.1f}, "
        f"{eye}"
        for one, other in PAIRS
        for eye in vision.VISIONS
        if vision.distance(items[one].colour(mode), items[other].colour(mode), eye) < LEAST_DISTANCE
    ]


@pytest.mark.parametrize("mode", colours.MODES)
def test_every_eye_sees_every_item(mode):
    assert len(PAIRS) > 40
    assert not faults(ITEMS, mode)


@pytest.mark.parametrize(
    "item, colour, words",
    [
        ("tool", "#e0a060", "tool: contrast"),  # too light on white
        ("ok", "#c4161c", "ok and alarm_rapid: distance"),  # the same red
        ("rapid", "#67655c", "stock and rapid: distance"),
    ],
)
def test_the_checker_sees_colours_that_are_not_safe(item, colour, words):
    found = faults({**ITEMS, item: dataclasses.replace(ITEMS[item], light=colour)}, "light")
    assert any(fault.startswith(words) for fault in found)


def test_the_checker_sees_what_only_some_eyes_confuse():
    """Ochre and vermilion: far apart to most, alike without the cones for red or green."""
    ochre, vermilion = "#9a7a00", "#c4571c"
    assert vision.distance(ochre, vermilion) > 2 * LEAST_DISTANCE
    found = faults(
        {
            **ITEMS,
            "ok": dataclasses.replace(ITEMS["ok"], light=ochre),
            "alarm_rapid": dataclasses.replace(ITEMS["alarm_rapid"], light=vermilion),
        },
        "light",
    )
    assert any(fault.startswith("ok and alarm_rapid") and "opia" in fault for fault in found)
    assert not any(fault.startswith("ok and alarm_rapid") and "normal" in fault for fault in found)


def test_known_values_of_the_simulation():
    """Closed form: black on white is 21:1; greys stay grey; red and green of equal effect on a dichromat's two cones
    are alike."""
    assert vision.contrast("#000000", "#ffffff") == pytest.approx(21.0, abs=1e-3)
    assert colours.contrast("#000000", "#ffffff") == pytest.approx(21.0, abs=1e-3)
    for eye in vision.VISIONS:
        assert vision.distance("#808080", "#808080", eye) == 0.0
        assert abs(vision.seen("#808080", eye) - vision.linear("#808080")).max() < 0.02
    for one, other in itertools.combinations(("#123456", "#c4161c", "#77aa33", "#f0f0f0"), 2):
        assert colours.contrast(one, other) == pytest.approx(vision.contrast(one, other), rel=2e-3)
    assert (
        vision.distance("#ff0000", "#00ff00") > 150
        and vision.distance("#ff0000", "#00ff00", "deuteranopia, Vienot") < 80
    )


def own(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


def test_a_file_of_ones_own(tmp_path, monkeypatch):
    path = own(tmp_path, '[tool]\nlight = "#AA0000"\n[background]\ndark = "#000000"\n')
    found = colours.load(path)
    assert (
        found["tool"].light == "#aa0000"
        and found["tool"].dark == ITEMS["tool"].dark
        and found["background"].dark == "#000000"
    )
    assert found["tool"].name == ITEMS["tool"].name
    (tmp_path / "a.ini").write_text("[CHIPWISE]\nCOLOURS = mine.toml\n")
    monkeypatch.setenv("INI_FILE_NAME", str(tmp_path / "a.ini"))
    assert colours.colour("tool") == "#aa0000" and colours.colour("tool", "dark") == ITEMS["tool"].dark


@pytest.mark.parametrize(
    "text, message",
    [
        ('[tol]\nlight = "#000000"', "mine.toml: 'tol' is not a display item; use background, text, stock, "),
        ('tool = "#000000"', "mine.toml: tool: is not a table; write [tool], light = .. and dark = .."),
        ('[tool]\nbright = "#000000"', "mine.toml: tool: 'bright' is not a mode; use light and dark"),
        ('[tool]\nlight = "red"', "mine.toml: tool: light = 'red' is not a colour; write it as \"#rrggbb\""),
        ('[tool]\nlight = "#00000"', "mine.toml: tool: light = '#00000' is not a colour"),
        ('[tool]\nlight = "#000000\\n"', "mine.toml: tool: light = '#000000\\n' is not a colour"),
        ("[tool]\nlight = 0", "mine.toml: tool: light = 0 is not a colour"),
        (
            '[tool]\nlight = "#fefefe"',
            "mine.toml: tool: light = #fefefe has a contrast of 1.01 to the background #ffffff, less than 3; use a "
            "darker colour",
        ),
        (
            '[background]\ndark = "#808080"',
            "mine.toml: stock: dark = #727f88 has a contrast of 1.04 to the background #808080, less than 3; use a "
            "darker",
        ),
        ('[background]\ndark = "{0}"', "mine.toml: background: dark = '{0}' is not a colour"),
        ("[tool", "mine.toml: is not TOML: "),
        ("a = " + "9" * 5000, "mine.toml: is not TOML: "),
    ],
)
def test_errors_name_the_item(tmp_path, text, message):
    with pytest.raises(CycleError) as caught:
        colours.load(own(tmp_path, text))
    assert str(caught.value).startswith("chipwise: " + message)


@pytest.mark.parametrize("path", ["/nowhere/x.toml", "/dev/zero", "/"])
def test_a_file_that_cannot_be_read(path):
    with pytest.raises(CycleError, match="it cannot be read: .*; correct .CHIPWISE.COLOURS"):
        colours.load(path)
