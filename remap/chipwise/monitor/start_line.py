# SPDX-License-Identifier: GPL-2.0-or-later
"""What the operator reads when LinuxCNC has started: that chipwise is there, and if what the machine learns will be forgotten.

Called by cli/load.py (the terminal), worker.py and cli/panel.py (the screen).  With [CHIPWISE]PANEL the page's process says that
chipwise runs, because it knows whether the page could be served; without it chipwise-monitor does.
"""

import os
import time

from chipwise import ROOT, version
from chipwise.clock import patience

SETTLED_S = 10.0        # after the task's first answer: the screen has started
SAMPLES = 'aux_examples'        # LinuxCNC's folder of what packages offer its configuration selector


def running(detail=''):
    """The start line."""
    return f'version {version()} is running' + (f'; {detail}' if detail else '')


def forgetful(folder):
    """What is lost, and the remedy, if nothing can be written in the folder of the INI file, "" if it can."""
    folder = os.path.realpath(folder or '.')
    if os.access(folder, os.W_OK | os.X_OK):
        return ''
    sample = folder.startswith(ROOT + os.sep) or os.path.basename(os.path.dirname(folder)) == SAMPLES
    remedy = 'make a folder of your own with chipwise new-config' if sample else 'start a copy in a folder of your own'
    return f'{folder} cannot be written, so work offsets, tools and stock are forgotten at the end; {remedy}'


def at_rest(status, linuxcnc):
    """Whether neither a program nor MDI is under way, or nobody is there to ask.  A message is a command to the task, and takes the place of the
    one that has started a run: glue/task.py could not tell any more which line it was started from."""
    try:
        status.poll()
        return status.interp_state == linuxcnc.INTERP_IDLE
    except linuxcnc.error:
        return True


class StartLine:
    """Said once, at rest, when the screen has sent its first command and so can show it."""

    def __init__(self, settings, inform, is_due):
        self.inform = inform
        self.texts = [text for text in (forgetful(settings.folder), '' if settings['PANEL'] else running()) if text] if is_due else []
        self.since = None

    def follow(self, commands, rests=True, now=None):
        """commands: number of the last command of LinuxCNC; rests: no program and no MDI is under way."""
        now = time.monotonic() if now is None else now
        self.since = now if self.since is None else self.since
        if rests and (commands > 0 or now - self.since > patience(SETTLED_S)):
            texts, self.texts = self.texts, []
            for text in texts:
                self.inform(text)
