# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise display: the line at the end of a program, and the panel's pins."""

import math

import pytest

from chipwise import report
from chipwise.panel import display

PINS = {'mrr': 30000.0, 'target': 30000.0, 'programmed-vel': 0.0, 'requested-vel': 20.0, 'current-vel': 40.0, 'mode': 2,
        'motion-type': 2, 'limited-by': 1, 'stock-defined': True}


def run_of(seconds, override=1.0, **pins):
    run = display.Run()
    for _ in range(round(seconds / 0.02)):
        run.step(0.02, {**PINS, **pins}, override)
    return run


@pytest.mark.parametrize('pins, override, saved', [
    ({}, 1.0, 10.0),                                            # 40 mm/s where F is 20: 10 s are 20 s
    ({'current-vel': 10.0}, 1.0, -5.0),
    ({'programmed-vel': 10.0}, 1.0, 30.0),                      # F replaced by a ceiling
    ({}, 2.0, 0.0),                                             # the operator's override would have done the same
])
def test_time_saved_against_f(pins, override, saved):
    run = run_of(10.0, override, **pins)
    assert run.at_f_s - run.fed_s == pytest.approx(saved, abs=1e-6)


@pytest.mark.parametrize('pins', [{'motion-type': 1}, {'mode': 0}, {'requested-vel': 0.0}, {'current-vel': math.nan},
                                  {'current-vel': math.inf}, {'requested-vel': math.nan}])
def test_what_saves_no_time(pins):
    run = run_of(1.0, **pins)
    assert run.fed_s == run.at_f_s == 0 and run.seconds == pytest.approx(1.0)


@pytest.mark.parametrize('rate', [math.nan, math.inf, -1.0, 1e300])
def test_a_rate_that_is_none_is_no_peak(rate):
    assert run_of(0.1, mrr=rate).peak == 0


def test_the_line():
    done = [{'kind': 'hole', 'chopped': True, 'pieces': 9, 'largest_piece_mm': 11.83}, {'kind': 'hole', 'chopped': False},
            {'kind': 'contour', 'chopped': True, 'pieces': 4, 'largest_piece_mm': 7.0}]
    assert run_of(10.0).line('/a/part.ngc', done, inch=False) == (
        'part.ngc: 10.0 s, 10.0 s less than at F; peak 30, target 30 cm3/min; 13 pieces; largest piece 11.8 mm')
    assert run_of(10.0).line('/a/part.ngc', done, inch=True) == (
        'part.ngc: 10.0 s, 10.0 s less than at F; peak 1.83, target 1.83 in3/min; 13 pieces; largest piece 0.466 in')
    assert run_of(10.0, mode=0).line('', [], inch=False) == 'program: 10.0 s; peak 30 cm3/min'


@pytest.mark.parametrize('seconds, text', [(0, '0.0 s'), (59.94, '59.9 s'), (60, '1 min 0 s'), (754.4, '12 min 34 s'),
                                           (3600 * 2 + 61, '2 h 1 min')])
def test_durations(seconds, text):
    assert display.duration(seconds) == text


@pytest.mark.parametrize('number', [-5, 0, 1, 3, 4, 99])
def test_just_one_of_the_bits(number):
    pins = {}
    display.choose(pins, 'mode-', display.MODES, number)
    chosen = [name for name, on in pins.items() if on]
    assert chosen == ['mode-' + display.MODES[number if 0 <= number < 4 else 0]]


@pytest.fixture
def home(monkeypatch, tmp_path):
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.delenv(report.VARIABLE, raising=False)
    monkeypatch.delenv(report.HEADLESS, raising=False)
    return tmp_path


def test_cycles_report_to_a_display_that_runs(home):
    report.record('hole', chopped=True)
    assert report.path() is None
    report.begin()
    report.record('hole', chopped=True)
    assert len(report.read(report.path())) == 1
    report.begin()
    assert report.read(report.path()) == []
    for _ in range(30000):
        report.record('hole', chopped=True, largest_piece_mm=1.0)
    assert (home / '.chipwise-display.jsonl').stat().st_size < report.LARGEST + 200      # nobody reads: it stays small
    report.end()
    assert report.path() is None and not list(home.iterdir())
