# SPDX-License-Identifier: GPL-2.0-or-later
"""Where LinuxCNC's motion stops between two moves, how it rounds corners, and which axes have been named: what the canonical calls of a preview do not tell.

Called by reader_runner.py, line by line, for a program that is judged.  Read in LinuxCNC 2.9: emctaskmain.cc, emcTaskCheckPreconditions.
"""

from chipwise.check.records import DWELL, EXACT_PATH, EXACT_STOP, PATH
from chipwise.interpreter_process import INCH

_CODES = {610: EXACT_PATH, 611: EXACT_STOP}     # by the interpreter's active G-code
_G64 = 640
_G10, _G28, _G30, _G92, _HERE = 100, 280, 300, 920, 20      # by their number in a block, ten times the code; L20 of G10
_XYZ = 7
_STILL = 1e-9               # inch


def _words(block):
    """The axes, as a mask, that a block's words name; both X and Y for a polar place."""
    polar = block.radius_flag or block.theta_flag
    words = (block.x_flag or polar) + 2 * (block.y_flag or polar) + 4 * block.z_flag
    return _XYZ if not words and block.g_modes[0] in (_G28, _G30) else words


class MotionModes:
    """What was in force after the line before."""

    def __init__(self, axis_mask):
        self._path = self._waited_for = self._moves = None
        self.unnamed = axis_mask & _XYZ         # a mask: where these axes are is known on the machine only

    def named(self, interpreter, moved):
        """The axes that are still unnamed behind a move.  moved: by how much in X, Y, Z, inch; under cutter compensation the moves come when a later
        line is read, so that a place that changes names its axis too."""
        if interpreter is None:
            self.unnamed = 0
        for level in range(interpreter.remap_level + 1 if interpreter else 0):
            self.unnamed &= ~_words(interpreter.blocks[level])
        self.unnamed &= ~sum(1 << axis for axis, by in enumerate(moved) if abs(by) > _STILL)
        return self.unnamed

    def _touched_off(self, block):
        """A touch-off tells where the machine is."""
        if block.g_modes[0] == _G92 or block.g_modes[0] == _G10 and block.l_number == _HERE:
            self.unnamed &= ~_words(block)

    def changes(self, state, moves, interpreter):
        """Yield (kind, value) of records.  state: of next_line(); moves: their number until now; interpreter: as Python sees it, or None."""
        if self.unnamed and interpreter:
            self._touched_off(interpreter.blocks[interpreter.remap_level])
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
