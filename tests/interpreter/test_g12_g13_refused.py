# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines of G12 and G13 that are refused, through LinuxCNC's interpreter: the exact message, and no motion."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from support.hole_program import MM, program
from support.canon import run_preview, run_rs274

REFUSED = [
    # (before, line, message after "chipwise: G13: "), metric
    ("", "G13 X1 I10 R2 F100", "word Z (final depth) is missing; add Z"),
    ("", "G13 X1 Z-1 R2 F100", "word I (radius of the hole) is missing; add I"),
    ("", "G13 I10 Z-6 R2", "no feed is set; give F on this line or before"),
    ("", "G13 I0 Z-6 R2 F100", "radius I0 mm is not above 0; use the radius of the hole"),
    ("", "G13 I-4 Z-6 R2 F100", "radius I-4 mm is not above 0; use the radius of the hole"),
    (
        "",
        "G13 I1 Z-6 R2 F100",
        "radius I1 mm is not larger than the tool radius 1 mm; use I above 1 mm or a smaller tool",
    ),
    ("", "G13 I10 Z6 R2 F100", "final depth Z6 mm is not below the clearance plane R2 mm; use Z below R or R above Z"),
    (
        "G91",
        "G13 I10 Z1 R-2 F100",
        "final depth Z19 mm is not below the clearance plane R18 mm; use Z below R or R above Z",
    ),
    (
        "#<_chipwise_chop_size> = -3",
        "G13 I10 Z-6 R2 F100",
        "chop size -3 mm is negative; set #<_chipwise_chop_size> to 0 (never chop) or more",
    ),
    ("", "G13 I10 Z-6 R2 F100 H1", "word H1 is not H0; H0 means do not chop; the chop size is #<_chipwise_chop_size>"),
    ("", "G13 I10 Z-6 R2 F100 J-1", "depth per pass J-1 mm is not above 0; use J above 0"),
    ("", "G13 I10 Z-6 R2 F100 E0", "plunge feed E0 mm/min is not above 0; use E above 0, or leave it out for F/2"),
    (
        "S500 M3\nG95",
        "G13 I10 Z-6 R2 F1 E-.5",
        "plunge feed E-0.5 mm/rev is not above 0; use E above 0, or leave it out for F/2",
    ),
    (
        "",
        "G13 I10 Z-6 R2 F100 K5 Q1",
        "finished radius K5 mm is smaller than the first radius I10 mm; use K of 10 mm or more",
    ),
    ("", "G13 I5 Z-6 R2 F100 K9", "finished radius K9 mm without a radial step Q; add Q of at most 2 mm"),
    (
        "",
        "G13 I5 Z-6 R2 F100 K9 Q3",
        "radial step Q3 mm is larger than the tool (2 mm) and would leave rings; use Q up to 2 mm",
    ),
    ("", "G13 I5 Z-6 R2 F100 Q1", "step Q1 mm without a finished radius K; add K, or leave Q out"),
    ("", "G13 I10 Z-6 R2 F100 D3", "word D is not used here; words are X Y Z R I J K Q E H F"),
    ("", "G13 I10 Z-6 R2 F100 L2", "word L is not used here; words are X Y Z R I J K Q E H F"),
    ("", "G13 I10 Z-6 R2 F100 P1", "word P is not used here; words are X Y Z R I J K Q E H F"),
    ("", "G13 I10 Z-6 R2 F100 A1", "word A is not used here; words are X Y Z R I J K Q E H F"),
    ("G18", "G13 I10 Z-6 R2 F100", "the plane is not G17; program G17 before"),
    ("G41 D1 F100", "G13 I10 Z-6 R2 F100", "cutter compensation is on; program G40 before"),
    ("G93", "G13 I10 Z-6 R2 F100", "inverse time feed (G93) is on; program G94 before"),
    ("G95", "G13 I10 Z-6 R2 F1", "feed per revolution (G95) without a spindle speed; program S above 0 before, or G94"),
    ("G7", "G13 I10 Z-6 R2 F100", "lathe diameter mode (G7) is on; program G8 before"),
    ("", "G53 G13 I10 Z-6 R2 F100", None),
    ("T0 M6", "G13 I10 Z-6 R2 F100", "no tool is in the spindle; load one with T.. M6"),
    (
        "T2 M6",
        "G13 I10 Z-6 R2 F100",
        "tool 2 has a diameter of 0 mm, which is not above 0; give it a D in the tool table",
    ),
]


def refused(before, line, code="G13"):
    # rs274 keeps the last tool's data on T0 M6, so there no tool may have been loaded before
    first = "" if before.startswith("T0") else "T1 M6\n"
    text = f"{first}G21 G90 G40 G94 G17\nG0 X0 Y0 Z20\n{before}\n(begin)\n{line.replace('G13', code)}\n(end)\nM2\n"
    return run_rs274(text, tools={1: 2.0, 2: 0.0})


@pytest.mark.parametrize("code", ["G12", "G13"])
def test_refused(code):
    """Exact message, no motion, and the program stops there."""
    with ThreadPoolExecutor(3) as pool:
        traces = list(pool.map(lambda case: refused(case[0], case[1], code), REFUSED))
    for (before, line, message), trace in zip(REFUSED, traces):
        # None: LinuxCNC refuses the line before the cycle is asked
        wanted = f"chipwise: {code}: {message}" if message else "Must use g0 or g1 with g53"
        assert trace.error == wanted, (before, line)
        assert trace.after("begin") == [], (before, line)
        assert "end" not in [t for t, _, _ in trace.comments]
        assert "Traceback" not in trace.output


@pytest.mark.parametrize(
    "line, message",
    [
        (
            "G13 I.02 Z-.2 R.1 F5",
            "radius I0.02 in is not larger than the tool radius 0.03937 in; use I above 0.03937 in or a smaller tool",
        ),
        (
            "G13 I.5 Z.2 R.1 F5",
            "final depth Z0.2 in is not below the clearance plane R0.1 in; use Z below R or R above Z",
        ),
    ],
)
def test_refused_in_inches(line, message):
    trace = run_rs274(f"T1 M6\nG20 G0 X0 Y0 Z1\n(begin)\n{line}\n(end)\nM2\n")
    assert trace.error == f"chipwise: G13: {message}"
    assert trace.after("begin") == []


@pytest.mark.parametrize(
    "settings, message",
    [
        (
            dict(CHOP_SIZE="-1"),
            "[CHIPWISE]CHOP_SIZE = -1 is not 0 (never chop) or a length of 0.1 mm or more; correct the INI file",
        ),
        (
            dict(CHOP_SIZE="8 mm"),
            "[CHIPWISE]CHOP_SIZE = 8 mm is not 0 (never chop) or a length of 0.1 mm or more; correct the INI file",
        ),
        (dict(RAMP_ANGLE="0"), "[CHIPWISE]RAMP_ANGLE = 0 is not an angle from 0.1 to 90 degrees; correct the INI file"),
        (
            dict(TOOL_GEOMETRY="/nonexistent/t.toml"),
            "t.toml: cannot be read: No such file or directory; correct [CHIPWISE]TOOL_GEOMETRY",
        ),
    ],
)
def test_broken_settings(settings, message):
    trace = run_rs274(program("G13 I10 Z-6 R2 F100"), **settings)
    assert trace.error == f"chipwise: G13: {message}"
    assert trace.after("begin") == []


def test_a_program_continues_after_a_refusal():
    """A refusal leaves every mode alone: in MDI the next line works as if nothing had been."""
    good = run_preview(program(f"G91\nG0 X0\n(a)\nG90\nG13 {MM}"))
    trace = run_preview("T1 M6\nG21 G91 G90.1 F50\n(begin)\nG13 I-1 Z-6 R2\nM2\n")
    assert trace.error.startswith("chipwise: G13: radius I-1 mm")
    assert good.error == ""
