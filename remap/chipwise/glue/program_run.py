# SPDX-License-Identifier: GPL-2.0-or-later
"""MDI or one run of a program: where another one begins, what the one before it has left ends.

Called by session.begin() before a code or the remapped F does anything.  What ends:
    - named parameters of ours (named.py): what a run has not set itself counts as not set;
    - the volumetric feed (volumetric.begin): M251 ends with its program, and in MDI when a program starts.
LinuxCNC calls no Python where a program begins or ends, so this is done by the first code of ours in it; the F word is
one.  In the preview, whose interpreter is new each time, there is nothing to do.

skipped() is True for the lines that run from line only reads over.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from chipwise.program.find_sub import sub_folders
from chipwise.glue import named, skipped_lines, task
from chipwise import ini
from chipwise.program import loaded

if TYPE_CHECKING:
    from chipwise.program.interp import Interp, Words

MDI, PROGRAM = "MDI", "program"


class _Context:
    """kind: MDI, PROGRAM or None at first; start: task.start_line() of a program, seen: task.seen() then; line: of the
    main program."""

    kind: str | None = None
    start: int | None = 0
    line = 0
    seen: task.Seen | None = None


def enter(interp: Interp, words: Words) -> bool:
    """A code of ours begins; words: its keyword arguments, n the line number.  -> whether another context begins."""
    if not interp.task:
        return False
    _Context.line = main_line(interp, int(words.get("n", 0)))
    before = _Context.kind
    _Context.kind = PROGRAM if task.is_program() else MDI
    starts = _Context.kind == PROGRAM and task.is_new_run()
    if starts:
        _Context.start, _Context.seen = task.start_line(), task.seen()
        named.forget(interp, _assigned(interp).__contains__)
    elif _Context.kind == MDI and before == PROGRAM:
        named.forget(interp, lambda name: True)
    named.mark(interp)
    return starts or before not in (None, _Context.kind)


def is_mdi() -> bool:
    return _Context.kind == MDI


def skipped() -> bool:
    """Whether the line is before the one the run was started from."""
    start = (_Context.start if _Context.kind == PROGRAM else 0) or 0
    return start != 0 and (start < 0 or _Context.line < start)


def may_be_skipped() -> bool:
    """Whether that is not known.  Where a move of the run has been carried out, nothing is skipped any more."""
    if _Context.kind == PROGRAM and _Context.start is None and task.has_moved(_Context.seen):
        _Context.start = 0
    return _Context.kind == PROGRAM and _Context.start is None


def stock_is_defined_again(interp: Interp) -> bool:
    """Whether a later line that is skipped, too, defines or restores the stock."""
    try:
        with open(main_file(interp), encoding="utf-8", errors="replace") as program:
            return skipped_lines.stock_is_defined_again(program.read(), _Context.line, _Context.start or 0)
    except OSError:
        return False


def main_line(interp: Interp, line: int) -> int:
    """Line of the main program; during a sub, the line of the call; without a meaning in MDI."""
    return line if interp.call_level <= 1 else interp.sub_context[0].sequence_number


def _assigned(interp: Interp) -> set[str]:
    """Names of our parameters that the running program assigns up to its present line, or in a sub."""
    names: set[str] = set()
    waiting = [(main_file(interp), _Context.line)]
    seen: set[str] = set()
    folders = None
    while waiting:
        path, line = waiting.pop()
        seen.add(path)
        try:
            with open(path, encoding="utf-8", errors="replace") as program:
                found, called = named.assigned_in(program.read(), line)
        except OSError:
            continue
        names |= found
        folders = sub_folders(ini.file_name()) if folders is None else folders
        files = {os.path.abspath(os.path.join(folder, name + ".ngc")) for folder in folders for name in called}
        waiting += [(file, 0) for file in sorted(files - seen) if os.path.isfile(file)]
    return names


def loaded_program(interp: Interp) -> tuple[str, object] | None:
    """(path, state of the file) of the program that is loaded or runs; None without one."""
    path = main_file(interp)
    state = loaded.identity(path) if interp.filename else None
    return state and (path, state)


def main_file(interp: Interp) -> str:
    """Path of the program that is loaded or runs, not of one that it calls."""
    main = interp.sub_context[0].filename if interp.call_level > 1 else interp.filename
    return os.path.abspath(main or interp.filename)
