# SPDX-License-Identifier: GPL-2.0-or-later
"""What reader_runner.py writes and check/simulate.py reads: one record of WIDTH doubles is kind, line and its values.

mm, mm/min, machine coordinates of the tool's tip:
    RAPID, FEED, ARC    x y z feed first unnamed      ARC: a chord of one, first: 1 on the first chord; unnamed: mask of
                        the axes, X 1, Y 2, Z 4, that the program has not named yet: their places are known on the
                        machine only
    TOOL                number, diameter (mm; 0: none)
    STOCK               shape (-1: of a file that only the machine has; turn is its slot then, or -1), turn, low x y z,
                        high x y z      of M250, M254
    VOLUME              mode, target, lower (mm3/min), ceiling (mm/min; 0: none)      of M251, M252
    DWELL               seconds      0 where motion stops for the spindle, the coolant or the tool's length, of a
                        program that is judged and not rewritten
    FRAME               turn (rad), offset of the coordinate system x y z, G92 offset x y z (before the turn)
    CIRCLE              plane (1 XY, 2 YZ, 3 XZ), centre x y z, turns (negative: clockwise)     of the ARC chords that
                        follow; asked for
    TARGET              x y z first         a point of a loop of a contour sub, first: 1 on a loop's first; asked for
    PATH                tolerance (mm, 0: any; EXACT_PATH, EXACT_STOP) of G64, G61, G61.1 for the moves that follow; of
                        a program that is judged and not rewritten
    LENGTH              x y z (mm) of the tool length offset for the moves that follow; of a program that is judged and
                        not rewritten
    CLAMP_SET_UP        number of a set-up of clamps, 0: none, which takes the place of all clamps before; asked for
    CLAMP               shape, turn (degrees), low x y z, high x y z      of a clamp that counts from here on; asked for
    SPINDLE             S (1/min) for the moves that follow; of a program that is judged and not rewritten
    MARK                file, what, item, modes, side of compensation, motion mode, feed      of a marked program
                        (executed_words.py)
"""

import math
from dataclasses import dataclass

(
    RAPID,
    FEED,
    ARC,
    TOOL,
    STOCK,
    VOLUME,
    DWELL,
    FRAME,
    CIRCLE,
    MARK,
    TARGET,
    PATH,
    LENGTH,
    CLAMP,
    SPINDLE,
    CLAMP_SET_UP,
) = range(16)
WIDTH = 10
UNNAMED = 7  # of a move: the value of its mask
EXACT_PATH, EXACT_STOP = -1.0, -2.0


@dataclass(frozen=True)
class Frame:
    """Work coordinates: turn (rad), offset of the coordinate system and G92 offset, mm."""

    turn: float = 0.0
    offset: tuple = (0.0, 0.0, 0.0)
    g92: tuple = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, values):
        """From the values of a FRAME record."""
        return cls(values[0], tuple(values[1:4]), tuple(values[4:7]))

    def to_machine(self, p):
        """(3,), or (3, n), work -> machine coordinates."""
        x, y, z = (a + b for a, b in zip(p, self.g92))
        c, s = math.cos(self.turn), math.sin(self.turn)
        return x * c - y * s + self.offset[0], x * s + y * c + self.offset[1], z + self.offset[2]

    def to_work(self, p):
        """(3,), or (3, n), machine -> work coordinates."""
        x, y = p[0] - self.offset[0], p[1] - self.offset[1]
        if not self.turn:
            return x - self.g92[0], y - self.g92[1], p[2] - self.offset[2] - self.g92[2]
        c, s = math.cos(self.turn), math.sin(self.turn)
        return x * c + y * s - self.g92[0], y * c - x * s - self.g92[1], p[2] - self.offset[2] - self.g92[2]
