# SPDX-License-Identifier: GPL-2.0-or-later
"""A machine that a test sets by hand, for Resume on the page of `chipwise panel`.  Used by tests/panel/ and
tests/resume/."""

from dataclasses import replace

from chipwise.entry import mdi
from support.scenes import SCENE

PAGE_SCENE = {**SCENE, "codes": "G17 G21 G91"}
OPTIONS = {"line": None, "seconds": 0, "broke": False}


class Mdi:
    """entry/mdi.py of a machine that the test sets by hand."""

    def __init__(self, program):
        self.state, self.offsets, self.opened = mdi.State(program=str(program)), PAGE_SCENE, []

    def read(self):
        return self.state

    def scene(self):
        return self.offsets

    def open_program(self, path):
        self.opened.append(path)
        self.state = replace(self.state, program=path)
