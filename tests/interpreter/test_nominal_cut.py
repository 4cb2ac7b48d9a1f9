# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 with I and J, the nominal cut, in place of Q: what it makes of them, in every unit, and what it refuses."""

import json

import pytest

from support.canon import run_preview, run_rs274, write_ini
from support.check_runs import chipwise_check

BOX = "M250 P0 Q0 R-10 I60 J40 K10\n"
BEGIN = "G21\nT1 M6\n" + BOX
TOOL = {1: 6.0}


def refused(text, **words):
    return run_preview(text + "\nM2\n", tools=TOOL, **words).error


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize(
    "line", ["F400 M251 I4 J10", "F400\nM251 I4 J10 P2 E3000", "F400\nM251 I4 J10 P3 R2 E900", "f400 m251 j10 i4 p1"]
)
def test_taken(machine, line):
    assert refused(BEGIN + line, machine=machine) == ""
    assert run_rs274(BEGIN + line + "\nM2\n", tools=TOOL, machine=machine).error == ""


@pytest.mark.parametrize(
    "line, message",
    [
        ("F400\nM251 I4 J10 Q6", "Q and the nominal cut I, J are both given; give Q, or I and J"),
        ("F400\nM251 I4", "word J (depth of cut) is missing; add J"),
        ("F400\nM251 J4", "word I (width of cut) is missing; add I"),
        ("F400\nM251 I0 J4", "width of cut I0 mm is not above 0; give I above 0"),
        ("F400\nM251 I4 J-1", "depth of cut J-1 mm is not above 0; give J above 0"),
        (
            "F9000\nM251 I400 J1000",
            "a cut of I400 mm and J1000 mm at F9000 mm/min is 3.6e+06 cm3/min, above 10000 cm3/min, which no machine "
            "removes; "
            "give width and depth of one cut",
        ),
        ("F400\nM251 I4 J10 P3 R17 E900", "lower removal rate R17 is above that of the cut I, J; give R below it"),
        ("F400\nM251 I4 J10 P2", "word E (ceiling of the feed) is missing; mode P2 replaces F; add E"),
        (
            "S600 M3\nG95 F0.5\nM251 I4 J10",
            "G95 is on, and the rate of a cut I, J needs a feed per minute; program G94 before, or give Q",
        ),
        (
            "G93\nM251 I4 J10",
            "G93 is on, and the rate of a cut I, J needs a feed per minute; program G94 before, or give Q",
        ),
        ("M251", "word Q (removal rate, cm3/min) is missing; add Q"),
    ],
)
def test_refused(line, message):
    assert refused(BEGIN + line) == "chipwise: M251: " + message


def test_no_feed():
    """By rs274: the preview of a screen begins with a feed."""
    assert run_rs274(BEGIN + "M251 I4 J10\nM2\n", tools=TOOL).error == (
        "chipwise: M251: the rate of a cut I, J needs a feed, and no F is set; give F before, or on the line"
    )


def test_an_ini_file_that_drops_the_words(tmp_path):
    """With the argspec of before LinuxCNC drops I and J in silence."""
    ini = write_ini(tmp_path)
    ini.write_text(ini.read_text().replace("argspec=qpreijN", "argspec=qpreN"))
    assert refused(BEGIN + "F400\nM251 I4 J10", ini=ini) == (
        "chipwise: M251: words I and J do not reach chipwise; write argspec=qpreijN in the line "
        "REMAP = M251 of the INI file, or give Q"
    )
    assert refused(BEGIN + "F400\nM251 Q6", ini=ini) == ""


def times(tmp_path, name, text):
    """Seconds of a program with M251, by check."""
    folder = tmp_path / name
    folder.mkdir()
    _status, _out, _err, report = chipwise_check(folder, {"a.ngc": text})
    (found,) = report["programs"]
    assert not found["error"], json.dumps(found)
    return found["tools"][0]["volumetric_planned_s"], found["tools"][0]["planned_s"]


def test_it_is_the_rate_of_that_cut_at_that_f(tmp_path):
    """4 x 2 mm at F300 is 2.4 cm3/min, whatever F follows, in mm and in inch; not that of another cut."""
    cuts = "G0 X-5 Y20 Z5\nG0 Z-8\nG1 X65 F600\nG0 Z5\nM252\nM2\n"
    by_cut = times(tmp_path, "a", BEGIN + "F300\nM251 I4 J2\n" + cuts)
    by_rate = times(tmp_path, "b", BEGIN + "F300\nM251 Q2.4\n" + cuts)
    other = times(tmp_path, "c", BEGIN + "F300\nM251 I5 J2\n" + cuts)
    inch = times(tmp_path, "d", BEGIN + f"G20\nF{300 / 25.4:.6f}\nM251 I{4 / 25.4:.6f} J{2 / 25.4:.6f}\nG21\n" + cuts)
    assert by_cut == pytest.approx(by_rate) and inch == pytest.approx(by_rate, rel=1e-4)
    assert by_cut[0] > by_cut[1] + 5 and other[0] < by_cut[0] - 1
    behind_a_ceiling = times(tmp_path, "e", BEGIN + "F300\nM251 Q1 P2 E3000\nM251 I4 J2\n" + cuts)
    assert behind_a_ceiling == pytest.approx(by_rate)
