# SPDX-License-Identifier: GPL-2.0-or-later
"""What becomes of a program: what goes to the GUI, the exit status, and the messages to the operator.

Made by work.py and, if the time is up, by process.py; read by cli/filter.py.
"""

import os
import re
from dataclasses import dataclass, field
from typing import Optional

from chipwise.errors import printable

OPENED, FINDINGS, UNUSABLE = 0, 1, 2  # exit status
UNCHECKED_IS_REFUSED = ("unchecked",)  # values of [CHIPWISE]FILTER_REFUSE
FINDINGS_ARE_REFUSED = ("findings", "unchecked")

# What chipwise check advises and only its command line can do
_OPTIONS = re.compile(
    r",? (?:or )?(?:name (?:the stock|it) )?with --(?:stock|tool-diameter|tool|diameter)(?: [^;() ]+)*|: --stock(?: "
    r"[^;() ]+)*"
)


@dataclass
class Verdict:
    """notes: (text, whether it is a warning); more: lines for the log only; path: of a program to be opened in place of
    the user's; judged: os.stat_result of the user's file."""

    status: int = OPENED
    notes: list = field(default_factory=list)
    more: list = field(default_factory=list)
    path: str = ""
    judged: Optional[os.stat_result] = None

    def note(self, text, warning=False):
        self.notes.append((printable(text), warning))

    @property
    def warns(self):
        return self.status != OPENED or any(warning for _text, warning in self.notes)


def for_screen(text):
    """A message of chipwise check as it is of use in a GUI."""
    return _OPTIONS.sub("", text).replace("use a larger --cell", "use a larger [CHIPWISE]CELL")


def not_opened(text):
    """A file that cannot be used."""
    verdict = Verdict(UNUSABLE)
    verdict.note(f"it is not opened: {for_screen(text)}", True)
    return verdict


def unchecked(text, refuse):
    """A program that LinuxCNC can use and chipwise cannot judge; refuse: [CHIPWISE]FILTER_REFUSE."""
    if refuse in UNCHECKED_IS_REFUSED:
        return not_opened(text)
    verdict = Verdict()
    verdict.note(f"it is opened unchecked: {for_screen(text)}")
    return verdict


def unfinished(text, loops, refuse):
    """A program that was not read to its end; loops: it has some, so it may have no end."""
    return not_opened(text) if loops else unchecked(text, refuse)


def late_model(seconds):
    """The time is up, and there is no program yet."""
    return not_opened(
        f"it takes more than {seconds:g} s to plan; raise [CHIPWISE]FILTER_TIME, or use `chipwise surface`"
    )


def late(seconds, loops, refuse):
    """The time is up."""
    if loops:
        return not_opened(
            f"it takes more than {seconds:g} s to check, and its loops or subs may have no end; look for a loop "
            f"without "
            "an end, or raise [CHIPWISE]FILTER_TIME"
        )
    return unchecked(
        f"it takes more than {seconds:g} s to check; raise [CHIPWISE]FILTER_TIME, or use `chipwise check`", refuse
    )
