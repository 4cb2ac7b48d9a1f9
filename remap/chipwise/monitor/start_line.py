# SPDX-License-Identifier: GPL-2.0-or-later
"""What the operator reads when LinuxCNC has started: that chipwise is there, and if what the machine learns will be
forgotten.

Called by cli/load.py (the terminal), worker.py and cli/panel.py (the screen).  With [CHIPWISE]PANEL the page's process
says that chipwise runs, because it knows whether the page could be served; without it chipwise-monitor does.
"""

import os
import time

from chipwise import ROOT, version
from chipwise.host.clock import patience

SETTLED_S = 10.0  # after the task's first answer: the screen has started
QUIET_S = 3.0  # without a command and at rest: nobody is about to start a program
SAMPLES = "aux_examples"  # LinuxCNC's folder of what packages offer its configuration selector


def running(detail=""):
    """The start line."""
    return f"version {version()} is running" + (f"; {detail}" if detail else "")


def forgetful(folder):
    """What is lost, and the remedy, if nothing can be written in the folder of the INI file, "" if it can."""
    folder = os.path.realpath(folder or ".")
    if os.access(folder, os.W_OK | os.X_OK):
        return ""
    sample = folder.startswith(ROOT + os.sep) or os.path.basename(os.path.dirname(folder)) == SAMPLES
    remedy = "make a folder of your own with chipwise new-config" if sample else "start a copy in a folder of your own"
    return f"{folder} cannot be written, so work offsets, tools and stock are forgotten at the end; {remedy}"


class Quiet:
    """Whether neither a program nor MDI is under way and no command has come for some seconds, or nobody is there to
    ask.

    A message is a command to the task.  It takes the place of the one that has started a run, so that glue/task.py
    could not tell any more which line it was started from, and on a busy computer of one that the task has not read
    yet."""

    def __init__(self, linuxcnc, seconds=QUIET_S):
        self.linuxcnc, self.status, self.seconds = linuxcnc, linuxcnc.stat(), seconds
        self.commands = self.since = None

    def __call__(self, now=None):
        now = time.monotonic() if now is None else now
        try:
            self.status.poll()
        except self.linuxcnc.error:
            return True
        commands, rests = self.status.echo_serial_number, self.status.interp_state == self.linuxcnc.INTERP_IDLE
        if not rests or commands != self.commands:
            self.commands, self.since = commands, now
        return now - self.since >= patience(self.seconds)


class StartLine:
    """Said once, when it is quiet and the screen has sent its first command and so can show it."""

    def __init__(self, settings, inform, is_due):
        self.inform = inform
        self.texts = (
            [text for text in (forgetful(settings.folder), "" if settings["PANEL"] else running()) if text]
            if is_due
            else []
        )
        self.since = None

    def follow(self, commands, is_quiet=True, now=None):
        """commands: number of the last command of LinuxCNC; is_quiet: Quiet's answer."""
        now = time.monotonic() if now is None else now
        self.since = now if self.since is None else self.since
        if is_quiet and (commands > 0 or now - self.since > patience(SETTLED_S)):
            texts, self.texts = self.texts, []
            for text in texts:
                self.inform(text)
