# SPDX-License-Identifier: GPL-2.0-or-later
"""What chipwise-monitor says of the realtime side of a machine (monitor/hints.py)."""

import sys
from types import SimpleNamespace

import pytest

from chipwise.monitor import hints
from chipwise.monitor.messages import PATH_REFUSALS
from chipwise.clib.layout import PathRefusal


@pytest.fixture
def looks(monkeypatch):
    """(pins, the texts said, a list that is empty while commands are under way, a function that looks once)."""
    pins, said, quiet = {"path-refused": 0, "mode": 0}, [], []
    monkeypatch.setattr(hints, "Quiet", lambda _linuxcnc: lambda _now: bool(quiet))
    hint = hints.Hints(pins, said.append, said.append, None)
    return pins, said, quiet, lambda: hint.follow(1.0)


def test_a_path_that_is_not_read(looks):
    """What was refused at the start is said when no command is under way; what fails later under M251 only; each
    once."""
    pins, said, quiet, look = looks
    look()
    pins["path-refused"] = PathRefusal.NOT_OURS
    look()
    assert said == []
    quiet.append(True)
    for _ in range(3):
        look()
    pins["path-refused"] = PathRefusal.CHAIN
    look()
    assert len(said) == 1 and "another user" in said[0]
    pins["mode"] = 1
    for code in (PathRefusal.CHAIN, 0, PathRefusal.CHAIN, PathRefusal.POSITION, 77):
        pins["path-refused"] = code
        look()
    assert len(said) == 4 and "do not join" in said[1] and "external offsets" in said[2] and "check 77" in said[3]


def test_every_refusal_has_its_sentence():
    """Which the screen shows whole: 250 characters."""
    assert set(PATH_REFUSALS) == set(PathRefusal) - {PathRefusal.NONE}
    assert max(len(f"chipwise: {text}") for text in PATH_REFUSALS.values()) <= 250


@pytest.mark.parametrize("clocks", [1, 3000])  # a us: ns / 1000 of LinuxCNC 2.10, clocks of a processor of 3 GHz
@pytest.mark.parametrize(
    "took, tmax, realtime, said",
    [
        (612, 612, True, ["stock-tracker took 612 of 1000 us; raise [CHIPWISE]FINEST_CELL or [EMCMOT]SERVO_PERIOD"]),
        (612, 700, False, ["stock-tracker took 612 of 1000 us; raise [CHIPWISE]FINEST_CELL or [EMCMOT]SERVO_PERIOD"]),
        (490, 499, True, []),
        (490, 499, False, []),
        (490, 900, False, []),
    ],
)  # interrupted once: without a realtime kernel that says nothing of the tracker
def test_a_slow_machine(monkeypatch, clocks, took, tmax, realtime, said):
    """Once, whatever the unit; a period that begins late or early does not count."""
    values = {
        "motion.servo.last-period": 1000 * clocks,
        "stock-tracker.0.time": took * clocks,
        "stock-tracker.0.tmax": tmax * clocks,
    }
    monkeypatch.delenv("INI_FILE_NAME", raising=False)
    monkeypatch.setattr(hints, "make_pace", lambda: hints.Pace(values.__getitem__, realtime))
    heard = []
    hint = hints.Hints({"path-refused": 0, "mode": 0}, heard.append, heard.append, None)
    for k in range(200):
        values["motion.servo.last-period"] = (1000, 400, 1000, 1600)[k % 4] * clocks
        values["stock-tracker.0.time"] = took * clocks + k % 2 * 1e-3
        hint.follow(0.02 * k)
    assert heard == said


def test_a_few_interrupted_runs(monkeypatch):
    values = {"motion.servo.last-period": 1000, "stock-tracker.0.time": 100, "stock-tracker.0.tmax": 900}
    pace = hints.Pace(values.__getitem__, False)
    for k in range(2000):
        values["stock-tracker.0.time"] = (
            55900 if k % 150 < 20 else 100 + k % 2
        )  # one run that the computer held up for long is looked at again and again
        assert pace.look() == 0.0
    monkeypatch.setenv("CHIPWISE_SPEED", "10")  # the real period is a tenth of that of the clock here
    for k in range(600):
        values["stock-tracker.0.time"] = 900 + k % 2
        assert pace.look() == 0.0


def test_no_such_pins():
    """A LinuxCNC that does not measure: nothing is said, nothing fails."""
    assert hints.make_pace() is None


@pytest.mark.parametrize("answer", [True, False])
@pytest.mark.parametrize("version", ["2.9", "2.10"])
def test_a_realtime_kernel(monkeypatch, version, answer):
    """2.10 has a module for it, and hal.is_rt is a warning there."""

    class Hal:
        @property
        def is_rt(self):
            assert version == "2.9"
            return answer

    monkeypatch.setitem(sys.modules, "hal", Hal())
    monkeypatch.setitem(
        sys.modules, "lcnc_realtime", SimpleNamespace(verify=lambda: answer) if version == "2.10" else None
    )
    assert hints.is_realtime() is answer
