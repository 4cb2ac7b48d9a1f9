# SPDX-License-Identifier: GPL-2.0-or-later
"""Registers as M68 sets them: first the word, with the value of before still there, then the value."""

import math

from support.halrig import Stimulus

BOX_COMMIT, FEED_COMMIT, IDLE = 7, 17, 0
BOX_A = (-10.5, -20.25, -30.125, 10.5, 20.25, 0.0)
BOX_B = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
ODD_WORDS = (
    -1.0,
    -1e300,
    -math.inf,
    0.4,
    8.0,
    9.0,
    10.0,
    15.0,
    16.0,
    18.0,
    99.0,
    100.0,
    1e9,
    1e300,
    math.inf,
    math.nan,
)
ODD_MODES = (-1.0, 4.0, 17.0, 1e300, -1e300, math.inf, math.nan)
TURNS = (33.5, None, -120.0, math.nan, math.inf, 1e300, None)  # degrees; None: not sent
STATUS = ((0, 0), (1, 0), (0, 3), (1, 21))  # stock-defined, fault-code


def send(rows, first, values):
    """Registers from number `first` on."""
    for number, value in enumerate(values, first):
        rows.add({"word": number})
        rows.add({"value": value})


def box_and_feed(rows):
    """A box and a feed, each sent, committed and held."""
    rows.phase("before")
    rows.add({})
    rows.add({"value": 12345.0})
    rows.phase("box A, registers")
    send(rows, 1, BOX_A)
    rows.phase("box A, commit")
    for _ in range(5):
        rows.add({"word": BOX_COMMIT})
    rows.phase("box A, idle")
    rows.add({"word": IDLE})
    rows.add({"value": 777.0})
    rows.phase("feed, registers")
    send(rows, 11, (2, 6000.0, 3000.0))
    rows.phase("feed, commit")
    rows.add({"word": FEED_COMMIT})
    rows.add({"word": FEED_COMMIT})


def aborted(rows):
    """Registers without a commit, words that are not valid; then a feed and a box that are."""
    rows.phase("box B, aborted after each register")
    for count in range(1, 7):
        send(rows, 1, BOX_B[:count])
        rows.add({"word": IDLE})
    rows.phase("feed, aborted after each register")
    for count in range(1, 4):
        send(rows, 11, (1, 60.0, 30.0)[:count])
        rows.add({"word": IDLE})
    rows.phase("odd words")
    for word in ODD_WORDS:
        rows.add({"word": word})
        rows.add({"value": 4.0})
    rows.phase("feed off")
    send(rows, 11, (0,))
    rows.phase("feed off, commit")
    rows.add({"word": FEED_COMMIT})
    rows.phase("box B, registers")
    send(rows, 1, BOX_B)
    rows.phase("box B, commit")
    rows.add({"word": BOX_COMMIT})
    rows.phase("box B, idle")
    rows.add({"word": IDLE})


def modes(rows):
    """Feed modes that are not valid, and what the status says in each of the others."""
    for k, mode in enumerate(ODD_MODES):
        rows.phase(f"odd mode {k}, registers")
        send(rows, 11, (3, 100.0, 50.0))
        rows.add({"word": FEED_COMMIT})
        send(rows, 11, (mode,))
        rows.phase(f"odd mode {k}")
        rows.add({"word": FEED_COMMIT})
    rows.phase("status")
    for mode in (0, 1, 2, 3):
        send(rows, 11, (mode,))
        for defined, code in STATUS:
            rows.add({"word": FEED_COMMIT, "stock-defined": defined, "fault-code": code})


def shapes(rows):
    """Boxes with a shape, and turned."""
    for what, shape in (("cylinder", 1.0), ("no shape", 7.0), ("box after it", None)):
        rows.phase("before the shape: " + what)
        if shape is not None:
            send(rows, 8, (shape,))
        send(rows, 1, BOX_A)
        rows.phase("shape: " + what)
        rows.add({"word": BOX_COMMIT})
        rows.add({"word": BOX_COMMIT})
    for k, turn in enumerate(TURNS):
        rows.phase(f"before turn {k}")
        if turn is not None:
            send(rows, 8, (0.0, turn))
        send(rows, 1, BOX_A)
        rows.phase(f"turn {k}")
        rows.add({"word": BOX_COMMIT})
        rows.add({"word": BOX_COMMIT})


def files(rows):
    """Commands for files, which are replied to."""
    for commit, slot in ((27, 4.0), (28, 9.0), (27, -3.0), (28, math.nan)):
        rows.phase(f"file {commit} {slot}, registers")
        send(rows, 21, (slot,))
        rows.phase(f"file {commit} {slot}")
        rows.add({"word": commit, "reply": 0})
        rows.add({"word": commit, "reply": 2})
    rows.phase("files over")
    rows.add({"word": IDLE, "reply": 0})


def stimulus():
    rows = Stimulus({"word": [], "value": [], "stock-defined": [], "fault-code": [], "reply": []})
    for part in (box_and_feed, aborted, modes, shapes, files):
        part(rows)
    rows.phase("end")
    rows.add({})
    return rows
