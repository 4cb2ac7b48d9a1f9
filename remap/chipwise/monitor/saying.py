# SPDX-License-Identifier: GPL-2.0-or-later
"""What one part of chipwise-monitor has for the operator, shown when no command is under way.  Called by worker.py,
set_up.py and shadow.py."""

from chipwise.host.files import printable
from chipwise.monitor.start_line import Quiet


class Saying:
    """tell() at any time, speak() at each look."""

    def __init__(self, inform):
        """inform: function of a text for the operator."""
        self.inform, self.quiet, self.texts, self.said = inform, None, [], None

    def tell(self, text):
        """A text that is the same again is not said."""
        text = printable(text)
        if text != self.said:
            self.said = text
            print(f"chipwise: {text}", flush=True)
            self.texts.append(text)

    def speak(self, linuxcnc):
        """What waits to be said, when it is quiet: a message would take the place of a command."""
        if not self.texts:
            return
        self.quiet = self.quiet or Quiet(linuxcnc)
        if self.quiet():
            texts, self.texts = self.texts, []
            for text in texts:
                self.inform(text)

    def forget(self):
        """What has not been shown is not shown any more; a text may be said again."""
        self.texts, self.said = [], None
