# SPDX-License-Identifier: GPL-2.0-or-later
"""program/clamp_places.py: units and coordinates of CLAMP comments from the text of a program, and where it does not
say them."""

import pytest

from chipwise.program import clamp_places
from chipwise.program.clamp_places import has_word, places_of

BOX = "(CLAMP,BOX,XMIN=40,YMIN=-12,ZMIN=-20,XMAX=60,YMAX=-2,ZMAX=8)\n"
KNOWN = {  # text, line of the cycle: (line of the comment, move, units, system) of each
    ("G90\n" + BOX + "G21 G54\nG0 X1\nG13 X0 I5 Z-1", 5): [(2, 4, "mm", 1)],
    (BOX + "G0 X1\nG13 X0 I5 Z-1", 3): [(1, 2, None, None)],
    (BOX + "G13 X0 I5 Z-1\nG21 G55\nG0 X1\n" + BOX + "G20\nG0 X2", 2): [(1, 2, None, None), (5, 7, "in", 2)],
    ("G20 G59.3\n" + BOX + "N7 G0 X1\nG10 L2 P1 X3", 3): [(2, 3, "in", 9)],
    ("G10 L2 P1 X3\nG92 X5\nG21\n(CLAMP, left side first)\n" + BOX + "M6 T1\nG91.1\nG43 H1\ng 0 x 1", 9): [
        (5, 9, "mm", None)
    ],
    ("G21 G54\no1 sub\nG0 X#1\no1 endsub\n" + BOX + "o1 call [5]\nG0 X1", 3): [(5, 6, "mm", 1)],
    (
        "G21 G54\n"
        + BOX
        + "o2 while [#1 LT 3]\n#1=[#1+1]\nG1 X#1\no2 endwhile\no3 do\nG1 X2\no3 while [0]\nG0 X1\n"
        + BOX
        + "G0 Y1",
        5,
    ): [(2, 5, "mm", 1), (11, 12, "mm", 1)],
    (
        "G21 G54\n"
        + BOX
        + "G0 X1 (G55 G10 L2 P1 X9)\n#<g_20>=1\nG10 L1 P1 Z5\nG0 Y1 ; G20\n#1=5220\n(%s)" % BOX.strip("()\n"),
        4,
    ): [(2, 3, "mm", 1)],
    ("G21 G54\n" + BOX + "O<other> call\nG0 X1", 4): [(2, 3, "mm", 1)],
    ("G21 G54\nG0 X1\n" + BOX + "M2", 2): [],
}
UNKNOWN = {  # text, line of the cycle: why
    (BOX + "G0 X1\nG10 L20 P1 X0\nG13 X0 I5 Z-1", 4): "line 3 changes the work offset",
    ("G92 X0\n" + BOX + "G0 X1\nG13 X0\nG92.1", 5): "line 5 changes the work offset",
    ("G0 X1\nG13 X0 I5 Z-1\n#5221=4\n" + BOX + "G0 X2", 2): "line 3 changes the work offset",
    (BOX + "G0 X1\nG55\nG13 X0 I5 Z-1", 4): "no word in front of line 2 says the coordinate system",
    (BOX + "G0 X1\nG13 X0\nG20", 4): "no word in front of line 2 says the units",
    ("o1 sub\nG55\nG0 X1\no1 endsub\nG21 G54\n" + BOX + "o1 call\nG0 X1", 7): "line 2 may change the coordinate system",
    ("/G20\nG21\n" + BOX + "G0 X1", 4): "line 1 may change the units",
    (
        "o1 if [#1]\n" + BOX + "o1 endif\nG0 X1",
        4,
    ): "line 2 is in a sub, a loop or a branch, or is one that may be left out",
    ("/" + BOX + "G0 X1", 2): "line 1 is in a sub, a loop or a branch, or is one that may be left out",
    (
        "G54\n" + BOX + "o1 if [#1]\nG0 X1\no1 endif\nG55\nG0 X2",
        7,
    ): "the first move behind it is perhaps in line 4, perhaps in line 7",
    ("G21 G54\n" + BOX + "o<probe> call\nG0 X1", 4): "the file of sub probe may change the work offset",
    ("G21 G54\n" + BOX + "o<deep> call\nG0 X1", 4): "the file of sub probe may change the work offset",
    ("G21 G[50+#1]\n" + BOX + "G0 X1", 3): "the words in front of line 3 have expressions",
    ("G21 G54\n" + BOX + "G0 X1\nM98 P5", 4): "line 4 changes the work offset",
    ("o1 repeat [2]\nM72\no1 endrepeat\nG21 G54\n" + BOX + "G0 X1", 6): "line 2 may change the units",
}
FILES = {
    "probe": b"o<probe> sub\nG38.2 Z-5 F100\nG10 L20 P1 Z0\no<probe> endsub\n",
    "deep": b"o<deep> sub\no<PROBE> call\no<deep> call\no<deep> endsub\n",
}


def text_of_sub(word):
    return FILES.get(word.decode().strip("<>").lower())


def found(text):
    return places_of(text.encode(), text_of_sub)


@pytest.mark.parametrize("text, line", KNOWN)
def test_what_the_text_says(text, line):
    places = found(text)
    own = [place for place in places.places if place.line]
    assert [(place.line, place.move, place.units, place.system) for place in own] == KNOWN[text, line]
    assert not any(places.unknown(place, line) for place in own)


@pytest.mark.parametrize("text, line", UNKNOWN)
def test_what_it_does_not_say(text, line):
    places = found(text)
    own = [place for place in places.places if place.line]
    assert [places.unknown(place, line) for place in own] == [UNKNOWN[text, line]]


@pytest.mark.parametrize("text, line", KNOWN)
def test_other_line_ends_and_letters(text, line):
    again = found(text.lower().replace("\n", "\r\n"))
    own = [place for place in again.places if place.line]
    assert [(place.line, place.move, place.units, place.system) for place in own] == KNOWN[text, line]


def test_the_first_move_of_a_program():
    places = found("G20\nG0 X1\nG21 G55\nG0 X2\n").places
    assert [(place.line, place.move, place.units, place.system) for place in places] == [(0, 2, "in", None)]


def test_the_word_is_found_across_parts(tmp_path, monkeypatch):
    monkeypatch.setattr(clamp_places, "PART", 16)
    path = tmp_path / "part.ngc"
    path.write_text("(" + "x" * 13 + "Clamp")
    assert has_word(str(path)) and not has_word(str(tmp_path / "none"))
    path.write_text("(clam)\np\n" * 9)
    assert not has_word(str(path))
