# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 of MDI that goes into the next run of the loaded program (monitor/carried_feed.py): the mark of a program, and
what is said when."""

import os

import pytest

from chipwise.monitor.carried_feed import CarriedFeed, mark_of


def test_the_mark_is_that_of_a_file_and_its_content(tmp_path):
    one, other = tmp_path / "one.ngc", tmp_path / "other.ngc"
    for path in (one, other):
        path.write_text("M2\n")
        os.utime(path, ns=(10**18, 10**18))
    first = mark_of(str(one))
    assert first > 0 and first == mark_of(str(one)) < 1 << 31 and first != mark_of(str(other))
    one.write_text("M30\n")
    assert mark_of(str(one)) not in (0, first)
    assert mark_of("") == mark_of(str(tmp_path / "missing.ngc")) == 0
    assert mark_of(os.fsdecode(bytes(tmp_path / "other.ngc")) + "\udcff") == 0


def looks(remapped, *seen):
    """What is said after looks of (running, mode, carried), or of that and the line of the last move."""
    said, pins = [], {}
    feed = CarriedFeed(pins, said.append, remapped)
    for running, mode, carried, *line in seen:
        pins.update({"program-running": running, "mode": mode, "feed-carried": carried})
        feed.follow("/a/part.ngc", line[0] if line else 0)
    return said


MDI, IDLE = (False, 2, False), (False, 0, False)


@pytest.mark.parametrize(
    "remapped, seen, said",
    [
        (
            True,
            (IDLE, MDI, (True, 2, False), (True, 2, True), (True, 2, True), IDLE),
            "part.ngc: M251 of MDI is in force in this run",
        ),
        (True, (MDI, (True, 2, False), (True, 0, False), IDLE), ""),  # the program's first F says it
        (False, (MDI, (True, 2, False), (True, 0, False), IDLE), "M251 of MDI has ended"),
        (False, (MDI, (True, 0, False), (True, 0, False), IDLE), "M251 of MDI has ended"),
        (False, (IDLE, (True, 0, False), (True, 2, False), (True, 0, False), IDLE), ""),  # the program's own
        (False, (IDLE, (True, 0, False), (True, 2, False), IDLE, IDLE, (True, 0, False), (True, 0, False)), ""),
    ],
)
def test_what_is_said(remapped, seen, said):
    found = looks(remapped, *seen)
    assert len(found) == bool(said) and all(text.startswith(said) for text in found), found


CARRIED = (True, 2, True)


@pytest.mark.parametrize(
    "seen, after",
    [
        (
            (MDI, (True, 2, False, 7), (*CARRIED, 7), (*CARRIED, 7), (*CARRIED, 3)),
            5,
        ),  # a move on line 7 was the last of the run before
        ((MDI, (True, 2, False, 7), (*CARRIED, 7), (*CARRIED, 0), (*CARRIED, 0), IDLE), 6),
        ((MDI, (*CARRIED, 0), (*CARRIED, 0), IDLE), 4),
    ],
)
def test_it_is_said_after_a_move_or_at_the_end(seen, after):
    """Before, the message would take the place of the command that has started the run, so that no code could tell
    where the run starts."""
    counts = [len(looks(True, *seen[:number])) for number in range(1, len(seen) + 1)]
    assert counts == [0] * (after - 1) + [1] * (len(seen) - after + 1)
