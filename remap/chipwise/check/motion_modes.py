# SPDX-License-Identifier: GPL-2.0-or-later
"""Where LinuxCNC's motion stops between two moves, and how it rounds corners: what the canonical calls of a preview do not tell.

Called by reader_runner.py, line by line, for a program that is judged.  Read in LinuxCNC 2.9: emctaskmain.cc, emcTaskCheckPreconditions.
"""

from chipwise.check.records import DWELL, EXACT_PATH, EXACT_STOP, PATH
from chipwise.interpreter_process import INCH

_CODES = {610: EXACT_PATH, 611: EXACT_STOP}     # by the interpreter's active G-code
_G64 = 640


class MotionModes:
    """What was in force after the line before."""

    def __init__(self):
        self._path = self._waited_for = self._moves = None

    def changes(self, state, moves, interpreter):
        """Yield (kind, value) of records.  state: of next_line(); moves: their number until now; interpreter: as Python sees it, or None."""
        waits_for = state.spindle, state.speed, state.mist, state.flood, state.tool_length_offset
        if self._waited_for not in (None, waits_for):
            yield DWELL, 0.0
        self._waited_for = waits_for
        moved, self._moves = moves != self._moves, moves
        path = _CODES.get(state.path_mode)
        if path is None and interpreter and not (moved and self._path is not None and self._path >= 0.0):       # P of G64 is slow to read
            path = interpreter.active_settings[3] * (INCH if interpreter.length_units == 1 else 1.0)
        if path not in (None, self._path):
            self._path = path
            yield PATH, path
