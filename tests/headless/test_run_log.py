# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise.headless.log: rates and volumes of made-up runs with known answers."""

import numpy as np
import pytest

from chipwise.headless import log as runlog
from chipwise.headless.log import COLUMNS, NAMES

PERIOD = 0.001


def made_up(count, **columns):
    log = {name: np.zeros(count) for name in NAMES}
    log["sample"] = np.arange(count)
    log.update({name: np.asarray(column) for name, column in columns.items()})
    return log


def steady(count, rate, target):
    """A feed move removing `rate` mm3/min all along."""
    return made_up(
        count,
        motion_type=np.full(count, 2),
        removed_volume=np.arange(count) * PERIOD * rate / 60,
        rate_target=np.full(count, target),
    )


def test_steady_cut():
    figures = runlog.figures(steady(2001, rate=3600, target=4000), PERIOD)
    assert figures["cycle_s"] == 2.001
    assert figures["volume_mm3"] == pytest.approx(120)
    assert figures["rate_mean"] == pytest.approx(3600)
    assert figures["rate_peak"] == pytest.approx(3600)
    assert figures["rate_target"] == 4000
    assert figures["over_target_share"] == 0


def test_share_over_target():
    """A quarter of the cut runs at twice the target."""
    count, target = 4001, 1000.0
    rate = np.where(np.arange(count) < 1000, 2 * target, 0.9 * target)
    log = steady(count, 0, target)
    log["removed_volume"] = np.concatenate([[0], np.cumsum(rate[:-1])]) * PERIOD / 60
    figures = runlog.figures(log, PERIOD)
    assert figures["over_target_share"] == pytest.approx(0.25, abs=0.005)
    assert figures["rate_peak"] == pytest.approx(2 * target)


def test_air_and_rapids_do_not_count():
    log = steady(3001, rate=600, target=0)
    log["motion_type"][1000:2000] = 1  # a rapid
    log["removed_volume"][2000:] = log["removed_volume"][2000]  # a feed move in air
    rate, _target = runlog.cutting_windows(log, PERIOD)
    assert rate == pytest.approx(600)
    assert len(rate) == pytest.approx(100, abs=2)
    figures = runlog.figures(log, PERIOD)
    assert figures["rate_target"] is None
    assert figures["over_target_share"] is None


def walls(count=8001, reading=1.0, target=1000.0):
    """A cut at 99 % of the target whose map gives a fifth of it away in lumps, now and then one for ten windows; the
    reading of the section area is off by a factor."""
    rate, vel = 0.99 * target / 60, 10.0  # mm3/s, mm/s
    log = steady(count, 0, target)
    t = np.arange(count) * PERIOD
    log["x"], log["section_area"] = vel * t, np.full(count, reading * rate / vel)
    log["removed_volume"] = 0.8 * rate * t + 0.2 * rate * 0.1 * np.floor(t / 0.1)
    return log


@pytest.mark.parametrize("units", [1.0, 1 / 25.4])
@pytest.mark.parametrize("reading", [1.0, 0.97])
def test_steps_of_the_map_are_not_the_cut_s(reading, units):
    """By the section area, neither the map's lumps nor a reading that is off in the mean count as peaks."""
    log = walls(reading=reading)
    log["x"] = log["x"] * units
    figures = runlog.figures(log, PERIOD, units)
    assert figures["over_target_share"] < 0.005  # a lump at the very end is not made up for
    assert figures["rate_peak"] == pytest.approx(990, rel=0.04) and figures["rate_mean"] == pytest.approx(990, rel=0.01)
    log["section_area"][:] = 0.0
    assert runlog.figures(log, PERIOD, units)["over_target_share"] == pytest.approx(0.1, abs=0.01)  # the map's own


def test_a_reading_that_is_too_low_hides_nothing():
    """3 % above the target for half of the time, the section area reads 3 % low: half is reported."""
    log = walls()
    t = np.arange(len(log["x"])) * PERIOD
    rate = np.where(t < 4.0, 1.04, 0.95) * 1000 / 60
    log["removed_volume"] = np.concatenate([[0], np.cumsum(rate[:-1])]) * PERIOD
    log["section_area"] = 0.97 * rate / 10.0
    assert runlog.figures(log, PERIOD)["over_target_share"] == pytest.approx(0.5, abs=0.08)


def test_lost_samples_leave_their_window_out():
    log = steady(1001, rate=600, target=600)
    kept = np.delete(np.arange(1001), slice(500, 520))
    log = {name: column[kept] for name, column in log.items()}
    assert runlog.lost_samples(log) == 20
    rate, _target = runlog.cutting_windows(log, PERIOD)
    assert rate == pytest.approx(600)
    assert runlog.figures(log, PERIOD)["cycle_s"] == 1.001


def test_new_stock_starts_a_new_sum():
    volume = np.concatenate([np.linspace(0, 5, 100), np.linspace(0, 7, 100)])
    assert runlog.volume_removed(made_up(200, removed_volume=volume)) == pytest.approx(12)


def test_empty_and_short_logs():
    for count in (0, 1, 5, 10, 11):
        figures = runlog.figures(steady(count, 100, 100), PERIOD)
        assert figures["cycle_s"] == pytest.approx(count * PERIOD)


def test_tail_is_cut_only_at_rest():
    log = made_up(1000, motion_type=np.zeros(1000), velocity=np.zeros(1000))
    log["motion_type"][:900] = 2
    assert len(runlog.without_tail(log, PERIOD, 0.05)["sample"]) == 950
    assert len(runlog.without_tail(log, PERIOD, 0.5)["sample"]) == 900


def test_text_of_halsampler(tmp_path):
    row = " ".join(["1.5"] * 4 + ["2"] + ["0.5"] * 6 + ["1", "7", "0", "1"])
    path = tmp_path / "samples"
    path.write_text("10 %s \noverrun\n14 %s \n15 %s" % (row, row, row[:9]))
    log = runlog.load_text(str(path))
    assert list(log["sample"]) == [10, 14]
    assert list(log["motion_type"]) == [2, 2]
    assert list(log["flute_excess"]) == [1, 1]
    assert runlog.lost_samples(log) == 3


def test_sampler_types_match_the_hal_file():
    import os

    hal = open(os.path.join(os.path.dirname(__file__), "../../hal/headless.hal")).read()
    cfg = hal.split("cfg=")[1].split()[0]
    assert cfg == "".join(kind for _name, _pin, kind in COLUMNS)
