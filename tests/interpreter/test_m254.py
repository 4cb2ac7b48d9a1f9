# SPDX-License-Identifier: GPL-2.0-or-later
"""M254 with R180, the second side: the words that the preview takes and refuses.  What the machine makes of them:
tests/machine/test_turned_stock.py."""

import pytest

from support.canon import run_preview, run_rs274, write_ini

TOOL = {1: 6.0}
SUFFIX = "\nG0 X1\nM2\n"
ANY = "use R180 for a part that was turned over, or give P alone"
AXIS = "use H1 for X, H2 for Y"


def error_of(text, **words):
    return run_preview("G21\nT1 M6\n" + text + SUFFIX, tools=TOOL, **words).error


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize(
    "line",
    [
        "M254 P1",
        "M254 P1 R180 H1",
        "m254 p9 r180.0 h2 i-20 j15.5 k0",
        "G20\nM254 P0 R180 H2 K1",
        "G10 L2 P1 X5 Y6 R360\nM254 P1 R180 H1",
    ],
)
def test_taken(machine, line):
    """Nothing moves for it."""
    trace = run_preview("G21\nT1 M6\n" + line + SUFFIX, tools=TOOL, machine=machine)
    assert not trace.error and len(trace.elements) == 2  # M6, G0


def test_taken_by_rs274():
    assert run_rs274("G21\nT1 M6\nM254 P1 R180 H1 I1 J2 K3" + SUFFIX, tools=TOOL).error == ""


@pytest.mark.parametrize(
    "line, said",
    [
        ("M254 R180 H1", "word P (slot) is missing; add P0 to P9"),
        ("M254 P1 R90 H1", f"R90 is not half a turn; {ANY}"),
        ("M254 P1 R-180 H1", f"R-180 is not half a turn; {ANY}"),
        ("M254 P1 H1", f"H, I, J and K are words of a part that was turned over, and R180 is missing; {ANY}"),
        ("M254 P1 K3", f"H, I, J and K are words of a part that was turned over, and R180 is missing; {ANY}"),
        ("M254 P1 R180", f"word H (axis that the part was turned about) is missing; {AXIS}"),
        ("M254 P1 R180 H0", f"axis H0 is neither 1 nor 2; {AXIS}"),
        ("M254 P1 R180 H3", f"axis H3 is neither 1 nor 2; {AXIS}"),
        ("M254 P1 R180 H1 Q5", "word Q is not used here; words are P R H I J K F"),
        (
            "G10 L2 P1 X0 Y0 R90\nM254 P1 R180 H1",
            "the work coordinates are turned by 90 degrees, and a stock is turned over along the axes of the machine; "
            "align the part, and set the rotation to R0 with G10 L2",
        ),
        (
            "M254 P1 R180 H1 J-2000000",
            "the corner is at Y-2000000 mm of the machine, more than 1000000 mm from its zero; correct I, J, K or the "
            "work offset",
        ),
        (
            "#<_chipwise_allowance> = -1\nM254 P1 R180 H1",
            "allowance -1 mm is not a length from 0 to 100 mm; "
            "set #<_chipwise_allowance> to how much larger the stock may be",
        ),
    ],
)
def test_refused(line, said):
    assert error_of(line) == "chipwise: M254: " + said


def test_an_ini_file_that_drops_the_words(tmp_path):
    """With the argspec of before LinuxCNC drops them in silence, and the stock would be restored as it was saved."""
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace("argspec=prhijkN python=m254", "argspec=pN python=m254"))
    assert error_of("M254 P1 R180 H1", ini=ini) == (
        "chipwise: M254: word R does not reach chipwise; write argspec=prhijkN in the line REMAP = M254 of the INI file"
    )
    assert error_of("M254 P1", ini=ini) == ""
