# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages: whatever the texts in them hold, they come out, on one line, in a length that LinuxCNC carries."""

import random

import pytest

from support.random_cases import random_count, random_seed
from chipwise.errors import MESSAGE_BYTES, Area, CycleError, clip, fill
from chipwise.geometry.base.contour import ContourError
from chipwise.settings import parse_settings


def test_values_in_both_units():
    error = CycleError("step {s}, {a} stay in {f}", "use {s} of {{", s=25.4, a=Area(25.4**2), f="{s}", code="G79")
    assert error.text("mm") == "chipwise: G79: step 25.4 mm, 645.2 mm2 stay in {s}; use 25.4 mm of {"
    assert error.text("in") == "chipwise: G79: step 1 in, 1 in2 stay in {s}; use 1 in of {"


@pytest.mark.parametrize("text", ["{", "}", "{}", "{0}", "{x!r}", "{a.b}", "{a[0]}", "{:>9}", "%s", "{{", "}}{", "{x"])
def test_any_braces_come_out(text):
    """Seen failing with str.format: ValueError, KeyError, IndexError out of the path that reports errors."""
    assert CycleError("is " + text, "use " + text, x=1.0).text()
    with pytest.raises(CycleError) as caught:
        parse_settings({text.upper(): "1"})
    assert "CELL" in str(caught.value)
    assert str(ContourError("empty", (), "is " + text, x=1.0))


def test_bytes_that_are_not_utf8_and_line_breaks():
    text = CycleError("file a\udcffb\nc\td", code="M250").text()
    assert text == "chipwise: M250: file a?b c d"
    assert text.encode()


def test_long_messages_keep_their_end():
    for letter in "xü€":
        text = clip(letter * 300, " (line 12)")
        assert len(text.encode()) <= MESSAGE_BYTES and text.endswith(".. (line 12)")
    assert clip("short", " (line 12)") == "short (line 12)"


def test_random_texts():
    rng = random.Random(random_seed())
    for _ in range(random_count(2000)):
        text = "".join(rng.choice("{}ab0.!:[]%\\\n\udc80é") for _ in range(rng.randrange(20)))
        shown = CycleError(text, text, code="G12", ab=1.0, a="{ab}").text(rng.choice(("mm", "in")))
        assert clip(shown).encode() and "\n" not in shown, repr(text)


def test_a_name_without_a_value_stays():
    assert fill("{a} {b}", {"a": 1.0}, "mm") == "1 mm {b}"
