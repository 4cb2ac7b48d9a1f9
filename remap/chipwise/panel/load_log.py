# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of the load: tools (tool_log.py) and operations (operations.py) of the running program, and their files
(log_file.py).

Called by watch.py with each look; server.py answers with shown().

An operation is added to its file when it has ended, a tool at the end of the program.  RUNNING_S lies between two
writes of what is not in the files yet: so much is lost at most if the server is killed.
"""

import os
import time
from collections.abc import Callable

from chipwise.panel import Json, log_file, operations, tool_log
from chipwise.panel.log_file import Row
from chipwise.panel.machine import Pins
from chipwise.panel.operations import Operation

RUNNING_S = 10.0


def moment_text(seconds: float) -> str:
    """s since 1970 as a spreadsheet reads it, local time."""
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))


class LoadLog:
    """Tools and operations of one program after the other."""

    def __init__(self, path: str = "") -> None:
        """path: of the file of the tools, "" for none."""
        self.path = path
        self.program, self.start = "", 0.0
        self._begin_parts({})
        self._errors: dict[str, str] = {}  # by what was tried
        self._rows: list[Row] = []  # of operations that are not in the file yet
        self._ended_rows: list[Row] | None = None  # of the tools of a program that has ended and is not in the file yet
        self._running_operation: Operation | None = None  # the Operation that NAME.running has
        self._running, self._running_due = False, 0.0
        if path:
            self._try(self._recover)

    def _begin_parts(self, cycles: dict[int, str]) -> None:
        self.moments, self.tools, self.operations = (
            tool_log.Moments(),
            tool_log.ToolLog(),
            operations.OperationLog(cycles),
        )

    # ---- what has happened -----------------------------------------------------------------------------------------

    def begin(self, program: str, now: float) -> None:
        """A program begins; program: its path, now: s since 1970."""
        self.program, self.start = os.path.basename(program), now
        self._begin_parts(operations.cycle_lines(program))
        self._running = True

    def look(self, dt: float, pins: Pins, now: float) -> None:
        """dt s after the look before; pins: Machine.pins(); now: s since 1970."""
        moment = self.moments.look(dt, pins)
        self.tools.add(moment)
        self._has_ended(self.operations.add(moment, now), True)

    def end(self, complete: bool = True) -> None:
        """The program has ended; complete: false if the server ends before it."""
        self._has_ended(self.operations.end(), complete)
        self._running = False
        self._ended_rows = self._tool_rows(complete)

    def _has_ended(self, operation: Operation | None, complete: bool) -> None:
        if operation is not None and self.path:
            self._rows.append(self._operation_row(operation, complete))

    def shown(self) -> Json:
        """What a page shows: {"program", "file", "error", "tools": rows, "operations": rows of the last ones, "count":
        of all}."""
        return {
            "program": self.program,
            "error": self.error,
            "file": os.path.basename(self.path),
            "tools": self.tools.rows(),
            "operations": [one.row() for one in self.operations.shown()],
            "count": self.operations.count,
        }

    def _tool_rows(self, complete: bool) -> list[Row]:
        return [self._with_ends(self.start, row, complete) for row in self.tools.rows()]

    def _operation_row(self, operation: Operation, complete: bool) -> Row:
        return self._with_ends(operation.start, operation.row(), complete)

    def _with_ends(self, start: float, row: Row, complete: bool) -> Row:
        return {"start": moment_text(start), "program": self.program, **row, "complete": "yes" if complete else "no"}

    # ---- files -----------------------------------------------------------------------------------------------------

    @property
    def error(self) -> str:
        """What is wrong with the files, "" if nothing is."""
        return next(iter(self._errors.values()), "")

    def write(self) -> None:
        """Bring the files up to date; what is wrong with them is in `error`; nothing is raised."""
        if not self.path:
            return
        if self._rows:
            self._try(self._append_operations)
            self._rows = []
        if self._ended_rows is not None:
            self._try(self._append_tools)
            self._ended_rows = None
        elif self._running:
            due = time.monotonic() >= self._running_due
            if due or self._running_operation not in (None, self.operations.now):  # that one is in its file by now
                self._running_due = time.monotonic() + RUNNING_S if due else self._running_due
                self._running_operation = self.operations.now if due else None
                self._try(self._keep_running)

    def _try(self, work: Callable[[], None]) -> None:
        try:
            work()
            self._errors.pop(work.__name__, None)
        except (OSError, ValueError) as error:
            path = getattr(error, "filename", None) or self.path
            self._errors[work.__name__] = (
                f"{path}: {getattr(error, 'strerror', None) or error}; correct [CHIPWISE]PANEL_LOG"
            )

    def _append_operations(self) -> None:
        log_file.append(log_file.operations_path(self.path), operations.COLUMNS, self._rows)

    def _append_tools(self) -> None:
        self._running_due = 0.0
        log_file.append(self.path, tool_log.COLUMNS, self._ended_rows or [])
        log_file.forget_running(self.path)
        self._running_operation = None

    def _keep_running(self) -> None:
        """Tools of the program and the operation under way, as incomplete."""
        if self.tools.uses:
            log_file.keep_running(
                self.path,
                [
                    self._tool_rows(False),
                    [self._operation_row(self._running_operation, False)] if self._running_operation else [],
                ],
            )

    def _recover(self) -> None:
        """Add what a server has left that was killed."""
        tools, operation = log_file.left_running(self.path, tool_log.COLUMNS, operations.COLUMNS)
        log_file.append(log_file.operations_path(self.path), operations.COLUMNS, operation)
        log_file.append(self.path, tool_log.COLUMNS, tools)
        log_file.forget_running(self.path)
