# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite of programs whose first moves leave an axis unnamed: these moves stay, and no axis gets a word
that it did not have."""

import pytest

from support.rewrite_rig import HEAD, check_status, rewrite

START = HEAD + "M250 P0 Q0 R-20 I100 J60 K20\nT1 M6\nS8000 M3\nF400\n"  # 5 lines; D6, flutes 12 mm; 14 mm are too deep
CASES = {  # the lines that stay, the rest, what is said of the axes
    "X first, Y named in a feed": ("G0 Z-14\nG1 X50\n", "G1 X0 Y30\nG1 X110\nG0 Z5\n", "Y is named first in line 8"),
    "Y and Z named in a feed": (
        "G1 X50\nG1 X20\n",
        "G1 X110 Y30 Z-14\nG1 X-10\nG0 Z5\n",
        "Y and Z are named first in line 8",
    ),
    "named as 0": ("G0 Z-14\nG1 X50\n", "G1 X0 Y0\nG1 X110\nG0 Z5\n", "Y is named first in line 8"),
    "Z last": ("G0 X-10 Y30\nG1 X110\n", "G1 Z-14\nG1 X-10\nG0 Z5\n", "Z is named first in line 8"),
    "relative words": (
        "G91 G1 X20 Y5\nG1 Y-3\nG90\n",
        "G0 X-10 Y30 Z5\nG0 Z-14\nG1 X110\nG0 Z5\n",
        "X, Y and Z are named first in line 9",
    ),
}


@pytest.mark.parametrize("kind", (["--flute"], ["--feed", "10"]))
@pytest.mark.parametrize("name", CASES)
def test_unnamed_axes_stay_unnamed(name, kind, tmp_path, machine):
    lead, rest, said = CASES[name]
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(START + lead + rest + "M2\n")
    done = rewrite(before, after, machine, *kind)
    assert done.status == 0 and said in done.said, (done.said, done.errors)
    text = after.read_text()
    assert text.startswith(START + lead) and text != before.read_text()
    assert (
        said.split(" in line")[0] in check_status(after, machine)[1]
    )  # by the same move, which may have its old text above as a comment
    if kind == ["--flute"]:
        assert (
            "2 levels" in done.said and check_status(before, machine)[0] == 1 and check_status(after, machine)[0] == 0
        )


def test_an_axis_that_is_never_named(tmp_path, machine):
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(START + "G0 Z-14\nG1 X50\nG1 X110\nG0 Z5\nM2\n")
    done = rewrite(before, after, machine, "--flute")
    assert (
        done.status == 0
        and "Y is never named" in done.said
        and "long enough elsewhere" in done.said
        and after.read_text() == before.read_text()
    )
    done = rewrite(before, after, machine, "--feed", "10")
    assert done.status == 0 and "Y is never named" in done.said and after.read_text() == before.read_text()


REFUSED = {
    "an arc": ("G0 Z-14\nG1 X0\nG3 X20 Y0 R10\nG1 X110\nG0 Z5\n", "where an arc from an unknown place ends", 8),
    "a sub": (
        "o100 sub\nG1 X30\nG1 Y30\nG1 X110\no100 endsub\nG0 Z-14\no100 call\nG0 Z5\n",
        "X, Y and Z are not all named before",
        12,
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_need_their_places_is_refused(name, tmp_path, machine):
    text, why, line = REFUSED[name]
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(START + text + "M2\n")
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 2 and why in done.errors and f"(line {line})" in done.errors and not after.exists(), (
        done.errors
    )
