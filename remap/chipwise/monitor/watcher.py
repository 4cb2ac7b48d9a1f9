# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's task as the monitor knows it: its status, its commands, and what the operator reads.

Called by spindle_tool.py, on whose class the Monitor of worker.py is built.
"""

from chipwise.host.files import printable


class Watcher:
    """Watches one LinuxCNC."""

    def __init__(self, linuxcnc, component, settings):
        """linuxcnc: its module.  component: the monitor's pins."""
        self.linuxcnc = linuxcnc
        self.component = component
        self.settings = settings
        self.task: list = []  # its status and its commands; empty until it answers
        self.units = 1.0

    @property
    def status(self):
        """linuxcnc.stat, as the last look left it."""
        return self.task[0]

    @property
    def command(self):
        """linuxcnc.command."""
        return self.task[1]

    def connect(self):
        """True when LinuxCNC's task answers; it starts after HAL."""
        if not self.task:
            try:
                status = self.linuxcnc.stat()
                status.poll()
                command = self.linuxcnc.command()
            except self.linuxcnc.error:
                return False
            self.task = [status, command]
        try:
            self.status.poll()
        except self.linuxcnc.error:
            return False
        self.units = self.status.linear_units or 1.0
        return True

    def say(self, text):
        """An error message on the operator's screen and in the log."""
        text = printable(f"chipwise: {text}")
        print(text, flush=True)
        if self.task:
            self.command.error_msg(text[:250])

    def inform(self, text):
        """An information on the operator's screen."""
        self.command.text_msg(f"chipwise: {text}"[:250])
