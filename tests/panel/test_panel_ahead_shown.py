# SPDX-License-Identifier: GPL-2.0-or-later
"""When the path ahead and the contours are on the page: before, while and after a run, and after changes; a reading
that a test lets end."""

import math
import struct

import numpy as np
import pytest

from chipwise.panel import look_ahead
from chipwise.check.drawn_path import Thinner
from support.panel_rig import scene


def straight(length=100.0, step=10.0, line=10):
    """A path along X at Z0, a line for each move; from (0, 0, 0)."""
    thinner, count = Thinner(), round(length / step) + 1
    thinner.add(
        np.array([[k * step, 0, 0] for k in range(count)]), np.zeros(count, bool), np.arange(line, line + count)
    )
    return thinner.path()


class Reading:
    """One that a test lets end."""

    all: list = []

    def __init__(self, order):
        self.order, self.found, self.ended = order, None, False
        Reading.all.append(self)

    def end(self):
        self.ended = True

    def answer(self, path, **head):
        self.found = {"note": "", "line": 0, "relative": False, "loops": [], **head}, path


class Shop:
    """A machine with a loaded program."""

    def __init__(self, tmp_path):
        Reading.all = []
        self.program = tmp_path / "part.ngc"
        self.program.write_text("G0 X1\n")
        self.ahead = look_ahead.Ahead("mill.ini", Reading)
        self.scene = scene(self.program)
        self.pins = {"tip": (0.0, 0.0, 0.0), "line": 0.0, "current_vel": 10.0}

    def look(self, running=False, wanted=True, dt=0.1, **pins):
        self.pins.update(pins)
        self.ahead.look(dt, self.scene, running, self.pins, wanted)
        return self.ahead.state()["from"]

    def run_to(self, x, **pins):
        """To X, in looks of a millimetre, a line each 10."""
        found, at = None, self.pins["tip"][0]
        while at < x:
            at += 1
            found = self.look(True, tip=(at, 0.0, 0.0), line=float(math.ceil(at / 10) + 10), **pins)
        return found


@pytest.fixture
def shop(tmp_path):
    found = Shop(tmp_path)
    found.look()
    Reading.all[-1].answer(straight(), loops=[[[1, 2, 3], [4, 5, 6]]])
    return found


def test_before_while_and_after_a_run(shop):
    assert shop.look() == 0 and shop.ahead.state()["joined"] is False
    assert shop.run_to(5) == 1 and shop.ahead.state()["joined"] and shop.run_to(35) == 4 and shop.run_to(99) == 10
    assert shop.look(False) is None and shop.look(False) is None  # ended or aborted: nothing is ahead
    shop.pins["tip"] = (0.0, 0.0, 0.0)
    assert shop.look(True, line=11.0) == 1 and shop.run_to(25) == 3 and len(Reading.all) == 1


def test_only_for_a_page(tmp_path):
    shop = Shop(tmp_path)
    assert shop.look(wanted=False) is None and not Reading.all
    shop.look()
    assert (
        len(Reading.all) == 1
        and Reading.all[0].order["program"] == str(shop.program)
        and Reading.all[0].order["tip"] == [0, 0, 0]
    )


def test_a_page_that_is_opened_while_a_program_runs(tmp_path):
    """The program is read as it was loaded, whatever offsets it has chosen since; the tool is found on it."""
    shop = Shop(tmp_path)
    shop.look(wanted=False)
    before = dict(shop.scene)
    shop.scene = {**shop.scene, "index": 2, "offset": [9.0, 9.0, 9.0]}
    shop.look(True, wanted=False)
    shop.look(True, tip=(42.0, 0.0, 0.0), line=15.0)
    assert Reading.all[0].order["scene"] == before
    Reading.all[0].answer(straight())
    states = [shop.look(True, tip=(42.0 + 0.3 * k, 0.0, 0.0), line=15.0) for k in range(20)]
    assert set(states) == {5}


@pytest.mark.parametrize("same", [True, False])
def test_a_program_that_is_opened_and_begun_between_two_looks(shop, tmp_path, same):
    shop.run_to(15)
    shop.look()
    other = shop.program if same else tmp_path / "other.ngc"
    other.write_text("G0 X7 Y8\n")
    shop.scene = scene(other)
    assert (
        shop.look(True, tip=(0.0, 0.0, 0.0), line=0.0) is None
        and Reading.all[-1].order["program"] == str(other)
        and len(Reading.all) == 2
    )
    Reading.all[-1].answer(straight())
    assert shop.look(True, line=11.0) == 1 and shop.run_to(25) == 3 and len(Reading.all) == 2


@pytest.mark.parametrize("change", ["file", "offset", "tool", "gone", "other"])
def test_what_has_changed_is_read_again(shop, tmp_path, change):
    """What was known of it goes at once."""
    shop.look()
    if change == "file":
        shop.program.write_text("G0 X2 Y3\n")
    elif change == "gone":
        shop.scene = None
    elif change == "other":
        shop.scene = scene(tmp_path / "nothing.ngc")
    else:
        shop.scene = {**shop.scene, **({"offset": [1.0, 0.0, 0.0]} if change == "offset" else {"tool": 2})}
    assert shop.look() is None and len(Reading.all) == (1 if change in ("gone", "other") else 2)
    messages, _seen = shop.ahead.messages((1, 0))
    assert messages[0] == (b"C", b"[]") and len(messages[1][1]) == 8


def test_a_file_that_changes_while_it_is_read(tmp_path):
    shop = Shop(tmp_path)
    shop.look()
    shop.program.write_text("G0 X2 Y3 Z4\n")
    Reading.all[0].answer(straight())
    assert shop.look() is None and Reading.all[0].ended and len(Reading.all) == 2
    shop.program.write_text("G0 X2 Y3 Z4 F5\n")
    Reading.all[1].answer(straight())
    assert shop.look(True) is None


def test_no_process_for_it(tmp_path):
    """The panel goes on looking at the machine, and the page says why there is no path."""
    shop = Shop(tmp_path)

    def refuse(_order):
        raise OSError(11, "Resource temporarily unavailable")

    shop.ahead = look_ahead.Ahead("mill.ini", refuse)
    assert shop.look() is None and shop.look(True) is None
    assert (
        shop.ahead.state()["note"] == "it could not be read: Resource temporarily unavailable; open the program again"
    )


def test_a_running_program_is_not_read_again(shop):
    shop.run_to(15)
    shop.scene = {**shop.scene, "offset": [1.0, 0.0, 0.0], "tool": 4, "codes": "G20 G91"}
    assert shop.run_to(25) == 3 and len(Reading.all) == 1


def test_a_tool_that_leaves_the_path(shop):
    """A second later nothing is drawn; it is there again with the tool."""
    shop.run_to(15)
    away = [shop.look(True, tip=(15.0, 30.0, 0.0), line=12.0) for _ in range(14)]
    assert away[0] == 2 and away[-1] is None
    back = [shop.look(True, tip=(67.0, 0.0, 0.0), line=17.0) for _ in range(14)]
    assert back[-1] == 7


def test_mdi_does_not_move_along_the_program(shop):
    assert shop.look(False, tip=(50.0, 0.0, 0.0), line=15.0) == 0


def test_a_relative_program_is_read_again_from_its_start(tmp_path):
    shop = Shop(tmp_path)
    shop.look()
    Reading.all[0].answer(straight(), relative=True)
    shop.look()
    shop.look(True, tip=(0.0, 0.0, 0.0))
    assert len(Reading.all) == 1
    shop.look(False)
    shop.look(True, tip=(3.0, 0.0, 0.0))
    assert len(Reading.all) == 2 and Reading.all[1].order["tip"] == [3, 0, 0] and shop.ahead.state()["from"] is None


def test_windows(tmp_path):
    """A page has the points from its window on, wherever the tool is; points and kinds as they are on the path."""
    shop = Shop(tmp_path)
    shop.look()
    path = straight(30_000.0, 1.0)
    Reading.all[0].answer(path)
    shop.look()
    assert shop.ahead.messages((-1, 0))[1] == (2, 0)
    found, seen = shop.ahead.messages((2, 7))
    ((kind, data),) = found
    assert (
        kind == b"A"
        and struct.unpack_from("<II", data) == (2, 0)
        and len(data) == 8 + 16 * 2 * look_ahead.WINDOW
        and seen == (2, 0)
    )
    assert shop.ahead.messages(seen) == ([], seen)
    shop.ahead.look(0.1, shop.scene, True, {**shop.pins, "tip": (0.0, 0.0, 0.0)}, True)
    for k in range(30):
        shop.ahead.look(0.1, shop.scene, True, {**shop.pins, "tip": (12_345.5, 0.0, 0.0), "line": 12_356.0}, True)
    assert shop.ahead.state()["from"] == 12_346
    ((kind, data),) = shop.ahead.messages(seen)[0]
    rows = np.frombuffer(data[8:], "<f4").reshape(-1, 4)
    assert (
        struct.unpack_from("<II", data) == (2, 10_000)
        and rows[0].tolist() == [10_000, 0, 0, 0]
        and len(rows) == 2 * look_ahead.WINDOW
    )
