# SPDX-License-Identifier: GPL-2.0-or-later
"""In place of monitor/answering.py: a process that reads the loaded program, and answers what a test gives it."""


class Reading:
    """order: the last one; answer: set by the test, taken once."""

    child = answer = order = None

    def ask(self, order):
        self.child = self.order = order

    def take(self):
        found, self.answer = self.answer, None
        self.child = None if found else self.child
        return found

    def end(self):
        self.child = None
