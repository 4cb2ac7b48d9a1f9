# SPDX-License-Identifier: GPL-2.0-or-later
"""How much of the stock model's work a servo period has time for, as `chipwise load` measures it."""

import statistics

import pytest

from chipwise.clib import work_trial
from chipwise.cli import load
from chipwise.settings import parse_settings


@pytest.mark.parametrize(
    "us_of_all, period_ms, slower, chosen",
    [
        (40, 1.0, 1.0, 100),
        (40, 1.0, 4.0, 100),
        (300, 1.0, 1.0, 100),
        (301, 1.0, 1.0, 70),
        (40, 0.125, 1.0, 70),
        (160, 0.25, 1.0, 35),
        (40, 1.0, 40.0, 25),
        (9000, 1.0, 1.0, 25),
    ],
)
def test_the_largest_part_that_fits(monkeypatch, us_of_all, period_ms, slower, chosen):
    """30 % of the period for the costliest one; a quarter of the work where nothing fits."""
    monkeypatch.setattr(work_trial, "costliest_us", lambda percent: us_of_all * percent / 100)
    assert work_trial.choose(period_ms / 1000, slower) == chosen


def test_the_trial_sees_the_work(monkeypatch):
    """A quarter of the work takes less time than all of it, two thirds or so; a clock that runs fast is slowed down
    again.  By the shares of pairs, one right after the other, since a computer with other work is now faster, now
    slower."""
    pairs = [(work_trial.costliest_us(100), work_trial.costliest_us(25)) for _ in range(15)]
    assert 0 < statistics.median(quarter / all_of_it for all_of_it, quarter in pairs) < 0.9
    monkeypatch.setenv("CHIPWISE_SPEED", "1000")
    assert work_trial.costliest_us(100) < statistics.median(pair[0] for pair in pairs) / 100


class Machine:
    def servo_period_s(self):
        return 0.001


@pytest.mark.parametrize(
    "setting, measured, percent, said",
    [
        (None, 100, 100, ""),
        ("100", 25, 100, ""),
        (
            None,
            35,
            35,
            "chipwise: a servo period does 35 % of the stock model's work: this computer has no time for more",
        ),
        ("50", 100, 50, "chipwise: a servo period does 50 % of the stock model's work ([CHIPWISE]WORK)"),
    ],
)
def test_what_load_says(monkeypatch, capsys, setting, measured, percent, said):
    monkeypatch.setattr(load, "choose", lambda period_s: measured)
    assert load.work_of(Machine(), parse_settings({"WORK": setting} if setting else {})) == percent
    out = capsys.readouterr().out
    assert out.startswith(said) and bool(out) == bool(said) and out.count("\n") == bool(said)
