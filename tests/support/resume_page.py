# SPDX-License-Identifier: GPL-2.0-or-later
"""A machine that a test sets by hand, for Resume on the page of `chipwise panel`.  Used by tests/panel/ and
tests/resume/."""

from dataclasses import replace

from chipwise.entry import mdi

SCENE = {
    "index": 1,
    "offset": [0.0, 0.0, 0.0],
    "g92": [0.0, 0.0, 0.0],
    "turn": 0.0,
    "tool": 1,
    "codes": "G17 G21 G91",
    "block_delete": False,
}
OPTIONS = {"line": None, "seconds": 0, "broke": False}


class Mdi:
    """entry/mdi.py of a machine that the test sets by hand."""

    def __init__(self, program):
        self.state, self.offsets, self.opened = mdi.State(program=str(program)), SCENE, []

    def read(self):
        return self.state

    def scene(self):
        return self.offsets

    def open_program(self, path):
        self.opened.append(path)
        self.state = replace(self.state, program=path)
