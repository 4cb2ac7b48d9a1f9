# SPDX-License-Identifier: GPL-2.0-or-later
"""The path mode (G61, G61.1, G64) around the lines of a pattern: the sub's inside, the program's own before and after.

Called by glue/emit.py and session.py.  The interpreter keeps the mode of G64 and not its P and Q; canon has them
(emccanon.cc, 2.9 and 2.10), in program units.

Motion may have another mode than interpreter and canon, which are ahead of it: an abort drops what is queued, so that
the mode of the inside stays, and LinuxCNC up to 2.9.1 forgets mode and tolerance in motion where the machine is
switched off, E-stop included, so that it then rounds corners as G64 without P does (tpClear() of tp.c; mended in its
pull request 2742).  The codes of RS274NGC_STARTUP_CODE are lost so, too.  renew() sends the mode once more: what an
inside of ours may have left, before the first code of ours or F word of another program; what LinuxCNC may have
forgotten, only where the program has a code of ours or a set-up.  Any other program runs as without chipwise (SHADOW).
"""

from __future__ import annotations

import emccanon
from typing import TYPE_CHECKING

from chipwise.errors import MM_PER_INCH
from chipwise.gcode_lines import path_text
from chipwise.glue import program_run
from chipwise.moves import CALLERS_PATH, PATH
from chipwise.pattern import mirroring

if TYPE_CHECKING:
    from chipwise.program.interp import Interp

_CODES = {610: 61, 611: 61.1, 640: 64}  # by the interpreter's active G-code, which the preview has, too


class _Renewal:
    """inside: whether motion may have the mode of an inside; left: whether it may in another context; due: whether this
    context has not had its mode yet."""

    inside = left = due = False


def renew(interp: Interp, another: bool, ours: bool) -> None:
    """In the task: the mode that interpreter and canon have, for motion, where another context begins.  What is queued
    before the line that the run starts from is lost, so until that line is known to be behind it is sent again.
    another: whether the context begins; ours: whether it has a code of ours or a set-up."""
    if not interp.task:
        return
    _Renewal.due = _Renewal.due or another
    _Renewal.left = _Renewal.left or another and _Renewal.inside
    if (_Renewal.left or ours and _Renewal.due) and not program_run.skipped():
        again = program_run.may_be_skipped()
        _Renewal.inside = _Renewal.inside and not _Renewal.left
        _Renewal.left, _Renewal.due = again and _Renewal.left, again
        for text in _callers(interp):
            interp.execute(text)


class PathMode:
    """What the path mode is before the first line of a chunk, and whether a line has changed it."""

    def __init__(self, interp: Interp) -> None:
        self._interp, self._changed = interp, False
        self._callers: tuple[str, ...] = ()

    def execute(self, line: str) -> None:
        """Execute a line of lines.chunks()."""
        if not line.startswith(PATH):
            self._interp.execute(line)
            return
        if not self._callers:
            self._callers = _callers(self._interp)
        self._changed = line != CALLERS_PATH
        _Renewal.inside = _Renewal.inside or self._changed and bool(self._interp.task)
        if self._changed:  # the reader of a pattern around this one sees a line by its comment (pattern/runner.py)
            self._interp.execute(line if mirroring.path is None else line + " (.)")
        else:
            self._put_back()

    def end(self) -> None:
        """Put the mode back that was there before."""
        if self._changed:
            self._put_back()
            self._changed = False

    def _put_back(self) -> None:
        for text in self._callers:
            self._interp.execute(text)


def _callers(interp: Interp) -> tuple[str, ...]:
    """Lines that make the path mode what it is now."""
    unit_mm = MM_PER_INCH if interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES else 1.0
    if mirroring.path is not None:
        if not mirroring.path:
            return (f"({mirroring.CALLERS})",)
        code, tolerance, naive = mirroring.path
        return (f"{path_text(code, tolerance, naive, unit_mm)} (.)",)
    code = next((_CODES[c] for c in interp.active_g_codes if c in _CODES), 64)
    if code == 64:
        return (
            path_text(
                64,
                emccanon.GET_EXTERNAL_MOTION_CONTROL_TOLERANCE(),
                emccanon.GET_EXTERNAL_MOTION_CONTROL_NAIVECAM_TOLERANCE(),
                1.0,
            ),
        )
    # P and Q of the last G64, which the interpreter keeps and shows
    tolerance, naive = list(interp.active_settings)[3:5]
    return path_text(64, tolerance, naive, 1.0), path_text(code, None, None, 1.0)
