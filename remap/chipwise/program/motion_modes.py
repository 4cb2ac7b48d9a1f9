# SPDX-License-Identifier: GPL-2.0-or-later
"""Where LinuxCNC's motion stops between two moves, how it rounds corners, and which axes have been named: what the
canonical calls of a preview do not tell.

Called by reader_runner.py, line by line, for a program that is judged.  Read in LinuxCNC 2.9: emctaskmain.cc,
emcTaskCheckPreconditions.
"""

from chipwise.program.records import DWELL, EXACT_PATH, EXACT_STOP, PATH, SPINDLE
from chipwise.program.canon import INCH

_CODES = {610: EXACT_PATH, 611: EXACT_STOP}  # by the interpreter's active G-code
_G64 = 640
_G10, _G28, _G30, _G53, _G92, _HERE = (
    100,
    280,
    300,
    530,
    920,
    20,
)  # by their number in a block, ten times the code; L20 of G10
_AT_CURRENT = (120, 130)  # cycles of chipwise that go round the current place
_MOTION, _DISTANCE, _G91 = 1, 3, 910  # groups of a block's G-codes
_XYZ = 7
_STILL = 1e-9  # inch


def _words(block):
    """The axes, as a mask, that a block's words name; both X and Y for a polar place."""
    polar = block.radius_flag or block.theta_flag
    words = (block.x_flag or polar) + 2 * (block.y_flag or polar) + 4 * block.z_flag
    return _XYZ if not words and block.g_modes[0] in (_G28, _G30) else words


class MotionModes:
    """What was in force after the line before."""

    def __init__(self, axis_mask):
        self._path = self._waited_for = self._moves = self._turns = None
        self._relative = False  # G91 is in force in the program itself, not in a cycle
        self.unnamed = axis_mask & _XYZ  # a mask: where these axes are is known on the machine only

    def named(self, interpreter, moved):
        """The axes that are still unnamed behind a move.  moved: by how much in X, Y, Z, inch; under cutter
        compensation the moves come when a later line is read, so that a place that changes names its axis too."""
        if interpreter is None:
            self.unnamed = 0
            return 0
        self._see_distance(interpreter)
        blocks = [
            interpreter.blocks[level] for level in range(interpreter.remap_level + 1)
        ]  # the one that is executed, then those that are remapped
        only_words = (
            len(blocks) > 1 and blocks[1].g_modes[_MOTION] in _AT_CURRENT
        )  # its moves are round a place that may be unknown
        for block in blocks[only_words:]:
            if not self._relative or block.g_modes[0] in (_G28, _G30, _G53):
                self.unnamed &= ~_words(block)
        if not (self._relative or only_words):
            self.unnamed &= ~sum(1 << axis for axis, by in enumerate(moved) if abs(by) > _STILL)
        return self.unnamed

    def _see_distance(self, interpreter):
        own = interpreter.blocks[1].g_modes[_DISTANCE] if interpreter.remap_level else -1
        if interpreter.remap_level == 0 or own >= 0:
            self._relative = own == _G91 if own >= 0 else int(interpreter.distance_mode) != 0

    def touched_off(self, interpreter):
        """On each line: a touch-off tells where the machine is."""
        if self.unnamed and interpreter:
            self._see_distance(interpreter)
            block = interpreter.blocks[0]
            if block.g_modes[0] == _G92 or block.g_modes[0] == _G10 and block.l_number == _HERE:
                self.unnamed &= ~_words(block)

    def changes(self, state, moves, interpreter):
        """Yield (kind, value) of records.  state: of next_line(); moves: their number until now; interpreter: as Python
        sees it, or None."""
        waits_for = state.spindle, state.speed, state.mist, state.flood, state.tool_length_offset
        if self._waited_for not in (None, waits_for):
            yield DWELL, 0.0
        self._waited_for = waits_for
        turns = (
            interpreter.speed[0] if interpreter else state.speed
        )  # next_line() is left as it was by a line with an F that is remapped
        if turns != self._turns:
            self._turns = turns
            yield SPINDLE, turns
        moved, self._moves = moves != self._moves, moves
        path = _CODES.get(state.path_mode)
        if (
            path is None and interpreter and not (moved and self._path is not None and self._path >= 0.0)
        ):  # P of G64 is slow to read
            path = interpreter.active_settings[3] * (INCH if interpreter.length_units == 1 else 1.0)
        if path not in (None, self._path):
            self._path = path
            yield PATH, path
