# SPDX-License-Identifier: GPL-2.0-or-later
"""CLAMP comments of the loaded program: puts their clamps in front of the realtime guard (clamps_in_force.py).  Called
by worker.py.

1. A program whose file has the word CLAMP is read in a process of its own (monitor/comment_process.py) when it is
   loaded, and again when the file or the work offset changes.
2. All its clamps are in force from then on until another program is loaded: also before the line of the comment, and
   for MDI.
3. An answer that comes when the program runs already counts at once: the machine is stopped before a clamp that is
   still to come.
4. What M256 of the program takes away comes back when the run has ended.
"""

import contextlib

from chipwise.clamps.clamp import Clamp
from chipwise.monitor.answering import Answering
from chipwise.monitor.clamp_request import ClampRequest
from chipwise.monitor.clamps_in_force import COMMENTS
from chipwise.monitor.saying import Saying
from chipwise.monitor.shadow import is_idle
from chipwise.program import loaded
from chipwise.program.clamp_places import has_word
from chipwise.program.program_file import opened_name
from chipwise.stock import reasons


class CommentClamps:
    """Of one LinuxCNC.  follow() at each look of the monitor."""

    def __init__(self, component, stock_files, ini, inform, working=contextlib.nullcontext):
        """inform: function of a text for the operator; working: context of long work."""
        self.pins, self.files, self.ini, self.working = component, stock_files, ini, working
        self.saying, self.reading = Saying(inform), Answering("chipwise.monitor.comment_process")
        self.loaded = None  # (program, identity, work offset) that was asked for
        self.clamps = []  # [(how many M256 come before it, Clamp)]
        self.request, self.said_late = ClampRequest(component, stock_files, COMMENTS), False

    def follow(self, linuxcnc, status):
        """At each look; nothing of it waits for the process."""
        if not self.ini:
            return
        self.saying.speak(linuxcnc)
        if is_idle(linuxcnc, status):
            self.said_late = False
            if COMMENTS in self.files.clamps.dropped and not self.pins["program-running"]:
                self.request.is_due = True
            self._load(status)
        elif self.reading.child is not None and self.pins["program-running"] and not self.said_late:
            self.said_late = True
            self.saying.tell(
                f"{self._name()} has begun before the clamps of its comments were read, so they are not in force yet"
            )
        answer = self.reading.take()
        if answer:
            self._take(answer)
        self._lay()

    def has_read(self, program):
        """Whether nothing more is to come for the loaded program."""
        return not self.ini or bool(
            self.loaded and self.loaded[0] == program and self.reading.child is None and not self.request.is_open
        )

    def end(self):
        """The monitor ends."""
        self.reading.end()

    def _name(self):
        return opened_name(self.loaded[0] if self.loaded else "")

    def _load(self, status):
        """Another program, content or work offset: what was before ends."""
        scene = loaded.scene(status)
        found = (status.file, loaded.identity(status.file), loaded.place(scene)) if status.file else None
        if found == self.loaded:
            return
        self.reading.end()
        self.loaded = found
        self._offer([])
        if found and found[1] and self._has_word(status.file):
            self.reading.ask({"ini": self.ini, "program": status.file, "scene": scene})

    def _has_word(self, path):
        with self.working():  # a disk may take seconds for a large file
            return has_word(path)

    def _take(self, answer):
        if answer["why"]:
            self.saying.tell(f"{self._name()}: the clamps of its comments are not in force: {answer['why']}")
            return
        self._offer([(after, Clamp.of_row(row)) for after, *row in answer["clamps"]])

    def _offer(self, clamps):
        """Those of the loaded program, as far as is known; without any there is something to do only while others are
        in the table."""
        self.clamps = clamps
        self.request.is_due = bool(clamps) or self.files.clamps.has(COMMENTS)

    def _lay(self):
        """Put them into the table, and say what became of it."""
        reply = self.request.step(self.clamps, may_begin=not self.files.clamps.waits)
        if reply is None:
            return
        if reply != reasons.DONE:
            problem, remedy = reasons.REASONS[reply]
            self.saying.tell(f"{self._name()}: the clamps of its comments are not in force: {problem}; {remedy}")
        elif self.clamps:
            count = len(self.clamps)
            self.saying.tell(
                f"{self._name()}: {count} clamp{'s' * (count > 1)} of its comments: the machine stops before a move "
                f"comes too near"
            )
