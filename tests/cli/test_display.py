# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise display: the line at the end of a program, and the panel's pins."""

import math

import pytest

from chipwise import report
from chipwise.panel import display

PINS = {
    "target": 30000.0,
    "mode": 2,
    "motion-type": 2,
    "run-time": 10.0,
    "fed-time": 8.0,
    "saved-time": 10.0,
    "mean-rate": 27000.0,
    "peak-rate": 30000.0,
    "cut-time": 6.0,
    "air-time": 2.0,
    "rub-time": 0.0,
    "stock-defined": True,
    "certain": True,
}
TIMES = {"at-f-time": 0.0, "set-up-time": 0.0}


def run_of(**pins):
    run = display.Run()
    run.look({**PINS, **pins})
    run.look_at_set_up({**TIMES, **pins})
    return run


def test_the_sums_are_those_of_the_servo_thread():
    """However often the pins are looked at."""
    run = run_of()
    for _ in range(5):
        run.look(PINS)
    assert (run.seconds, run.fed_s, run.saved_s, run.mean, run.peak) == (10.0, 8.0, 10.0, 27000.0, 30000.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_sum_that_cannot_be_shown(value):
    run = run_of(**{name: value for name in display.SUMS})
    assert run.seconds == run.saved_s == run.peak == 0 and not run.worth_a_line


def test_the_line():
    done = [
        {"kind": "hole", "chopped": True, "pieces": 9, "largest_piece_mm": 11.83},
        {"kind": "hole", "chopped": False},
        {"kind": "contour", "chopped": True, "pieces": 4, "largest_piece_mm": 7.0},
    ]
    assert run_of().line("/a/part.ngc", done, inch=False) == (
        "part.ngc: 10.0 s, 10.0 s less than at F; peak 30, target 30 cm3/min; 13 pieces; largest piece 11.8 mm"
    )
    assert run_of().line("/a/part.ngc", done, inch=True) == (
        "part.ngc: 10.0 s, 10.0 s less than at F; peak 1.83, target 1.83 in3/min; 13 pieces; largest piece 0.466 in"
    )
    assert (
        run_of(mode=0, **{"fed-time": 0.0}).line("", [], inch=False)
        == "program: 10.0 s; in air 25 % of the feed time; largest 30, mean 27 cm3/min"
    )


def test_the_line_of_an_assumed_stock():
    """At F, marked; also of a run that was in air all along, but not without a stock."""
    run = run_of(
        mode=0,
        certain=False,
        **{
            "fed-time": 0.0,
            "run-time": 455.0,
            "peak-rate": 41000.0,
            "mean-rate": 9000.0,
            "cut-time": 69.0,
            "air-time": 31.0,
        },
    )
    assert (
        run.line("/a/part.ngc", [], inch=False)
        == "part.ngc: 7 min 35 s on an assumed stock; in air 31 % of the feed time; largest 41, mean 9 cm3/min"
    )
    air = {"fed-time": 0.0, "peak-rate": 0.0, "cut-time": 0.0, "air-time": 9.0}
    run = run_of(mode=0, certain=False, **air)
    assert (
        run.worth_a_line
        and run.line("a.ngc", [], inch=False) == "a.ngc: 10.0 s on an assumed stock; in air 100 % of the feed time"
    )
    assert (
        not run_of(mode=0, **air).worth_a_line
        and not run_of(mode=0, certain=False, **{**air, "stock-defined": False}).worth_a_line
    )
    assert not run_of(mode=0, certain=False, **{**air, "air-time": 0.0}).worth_a_line
    for name, times, said in (
        ("faster", (455.2, 324.7), "; set up it would take 5:25, not 7:35"),
        ("short", (50.0, 40.04), "; set up it would take 40.0 s, not 50.0 s"),
        ("as fast", (455.0, 452.0), ""),
        ("not known", (0.0, 0.0), ""),
    ):
        some = dict(zip(display.TIMES, times))
        line = run_of(mode=0, certain=False, **{"fed-time": 0.0}, **some).line("a.ngc", [], inch=False)
        assert (
            line
            == "a.ngc: 10.0 s on an assumed stock; in air 25 % of the feed time; largest 30, mean 27 cm3/min" + said
        ), name
        assert "set up" not in run_of(mode=0, **{"fed-time": 0.0}, **some).line(
            "a.ngc", [], inch=False
        )  # M250: a person's own feeds
    fed = run_of(certain=False)  # M251 does not act on it, but the pins may say anything
    assert fed.line("a.ngc", [], inch=False).startswith(
        "a.ngc: 10.0 s, 10.0 s less than at F on an assumed stock; peak 30"
    )


@pytest.mark.parametrize(
    "seconds, text",
    [(0, "0.0 s"), (59.94, "59.9 s"), (60, "1 min 0 s"), (754.4, "12 min 34 s"), (3600 * 2 + 61, "2 h 1 min")],
)
def test_durations(seconds, text):
    assert display.duration(seconds) == text


@pytest.mark.parametrize("number", [-5, 0, 1, 3, 4, 99])
def test_just_one_of_the_bits(number):
    pins = {}
    display.choose(pins, "mode-", display.MODES, number)
    chosen = [name for name, on in pins.items() if on]
    assert chosen == ["mode-" + display.MODES[number if 0 <= number < 4 else 0]]


@pytest.fixture
def home(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv(report.VARIABLE, raising=False)
    monkeypatch.delenv(report.HEADLESS, raising=False)
    return tmp_path


def test_cycles_report_to_a_display_that_runs(home):
    report.record("hole", chopped=True)
    assert report.path() is None
    report.begin()
    report.record("hole", chopped=True)
    assert len(report.read(report.path())) == 1
    report.begin()
    assert report.read(report.path()) == []
    for _ in range(30000):
        report.record("hole", chopped=True, largest_piece_mm=1.0)
    assert (home / ".chipwise-display.jsonl").stat().st_size < report.LARGEST + 200  # nobody reads: it stays small
    report.end()
    assert report.path() is None and not list(home.iterdir())


def test_a_tool_that_rubs_is_said():
    assert "; rubs for 3.1 s: take wider cuts" in run_of(**{"rub-time": 3.1}).line("a.ngc", [], False)
    assert "rubs" not in run_of(**{"rub-time": 0.4}).line("a.ngc", [], False)
