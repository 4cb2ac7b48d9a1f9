# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages to the operator about a program, as their GUI can take them (__init__.py says how the GUIs read).

Called by cli/filter.py.

 1. Standard error has whole lines of UTF-8, at most 100 of FILTER_PROGRESS= and some of text: far less than a pipe
    holds.  AXIS and QtVCP show the text if the exit status is not 0.
 2. A GUI of gladevcp gets nothing there.
 3. What is said of a program that is opened, and everything in a GUI of gladevcp, goes through LinuxCNC's task
    (screen_runner.py), as one message of at most 250 bytes.
"""

import os
import subprocess

from chipwise import ini as ini_file
from chipwise.options.machine import Progress
from chipwise.errors import clip, printable

PYTHON = "/usr/bin/python3"
RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "screen_runner.py")
PATIENCE_S = 1.5  # for the task to take a message
LINE_BYTES = 1000


class _Lines:
    """Standard error as a stream for Progress: a write is one line or part of a bar, and never fails."""

    def __init__(self, handle):
        self.handle = handle

    def isatty(self):
        return os.isatty(self.handle)

    def write(self, text):
        try:
            os.write(self.handle, text.encode("utf-8", "replace"))
        except OSError:
            pass  # the GUI is gone

    def flush(self):
        pass


class Screen:
    """Where the filter was started: in a GUI of this INI file, or in a shell."""

    def __init__(self, ini, environment, handle=2):
        display = []
        try:
            display = ini_file.section_of(ini_file.read_lines(ini), "DISPLAY").get("DISPLAY", "").split()
        except OSError:
            pass
        axis = os.path.basename(display[0]) == "axis" if display else True
        self.in_gui = bool(environment.get("INI_FILE_NAME"))
        self.reads_errors = axis or "AXIS_PROGRESS_BAR" not in environment
        self._stream = _Lines(handle)
        self._progress = Progress(self._stream, True)

    def progress(self, share):
        if self.reads_errors:
            self._progress(share)

    def tell(self, program, verdict):
        """Say what a Verdict has to say of a program."""
        if not verdict.notes:
            self._progress.clear()
            return
        texts = [text for text, _warning in verdict.notes]
        if self.reads_errors:
            self._progress.clear()
            for text in (*texts, *verdict.more):
                self._stream.write(clipped(f"chipwise: {program}: {text}") + "\n")
        if self.in_gui and not self._stream.isatty() and (verdict.status == 0 or not self.reads_errors):
            self._through_task(
                clip(printable(f"chipwise: {os.path.basename(program)}: {'; '.join(texts)}")), verdict.warns
            )

    def _through_task(self, text, warning):
        """A message on the screen; whether it got there shows there only."""
        try:
            subprocess.run(
                [PYTHON, "-s", RUNNER, "error" if warning else "text"],
                input=text.encode(),
                timeout=PATIENCE_S,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            pass


def clipped(text):
    """A line of at most LINE_BYTES."""
    data = printable(text).encode("utf-8", "replace")
    return data[:LINE_BYTES].decode("utf-8", "ignore")
