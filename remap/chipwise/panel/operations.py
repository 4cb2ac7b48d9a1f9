# SPDX-License-Identifier: GPL-2.0-or-later
"""What each operation of a program did, with the figures of tool_log.py and the lines of the program.  Called by
load_log.py.

An operation ends, and the next one begins, when

 1. another tool is in the spindle,
 2. M251 or M252 changes mode or target of the volumetric feed,
 3. the motion comes to the line of a cycle (G12 to G79), or leaves it.

What cuts nothing and is stopped by no guard is not an operation.  A cycle that its own line calls again, in a loop with
nothing else in it, goes on with its operation.

Motion has the number of a line only, not its file.  In a program that runs a sub of another file a number may be that
of either: cycles are not told apart there, rules 1 and 2 are kept.
"""

import re
from collections import deque
from collections.abc import Iterable

from chipwise.host.files import read_bytes
from chipwise.panel.display import LIMITS, MODES
from chipwise.panel.log_file import Row
from chipwise.panel.tool_log import SHARES, WATTS, Moment, Use

COLUMNS = (
    "start",
    "program",
    "operation",
    "code",
    "line",
    "last_line",
    "tool",
    "diameter_mm",
    "mode",
    "reference_cm3_min",
    "mean_cm3_min",
    "peak_cm3_min",
    "seconds",
    "cutting_s",
    "removed_cm3",
    *(f"{name}_s" for name in LIMITS[1:]),
    "over_s",
    "limited_by",
    "stops",
    *SHARES,
    *WATTS,
    "complete",
)
CYCLES = (12, 13, 24, 26, 27, 75, 77, 78, 79)
MOST_PROGRAM = 1 << 20  # bytes: a longer program is not read, and its cycles are not told apart
SHOWN = 200  # operations that a page can show
_TARGET_DIGITS = 3  # of a target, mm3/min: closer ones are the same
_COMMENT = re.compile(r"\([^)]*\)|;.*|[ \t\r]")
_NAME = re.compile(r"<[^>]*>")
_CODE = re.compile(r"G0*(\d+)(?![\d.])")
_SUB = re.compile(r"(?:N\d+)?O(\d+|<[^>]*>|.*?)(SUB|CALL)")
_OTHER_CALL = re.compile(r"M0*98(?!\d)")


def cycle_lines(path: str) -> dict[int, str]:
    """{line: "G79"} of the cycles that a program calls; {} if it runs subs of other files, is longer than MOST_PROGRAM
    or cannot be read."""
    try:
        text = read_bytes(path, MOST_PROGRAM).decode("utf-8", "replace")
    except OSError:
        return {}
    return _cycles(text.split("\n"))


def _cycles(lines: Iterable[str]) -> dict[int, str]:
    """As cycle_lines(), of the lines of a program."""
    found: dict[int, str] = {}
    defined: set[str] = set()
    called: set[str] = set()
    for number, line in enumerate(lines, 1):
        text = _COMMENT.sub("", line).upper()
        sub = _SUB.match(text)
        if sub:
            name = (
                str(int(sub.group(1))) if sub.group(1).isdigit() else sub.group(1)
            )  # a computed one is not defined anywhere
            (defined if sub.group(2) == "SUB" else called).add(name)
        words = _NAME.sub("", text)
        if _OTHER_CALL.search(words):
            return {}
        code = next((int(code) for code in _CODE.findall(words) if int(code) in CYCLES), None)
        if code is not None:
            found[number] = f"G{code}"
    return found if called <= defined else {}


class Operation(Use):
    """One operation."""

    def __init__(self, number: int, moment: Moment, code: str, now: float) -> None:
        """number: from 1; code: of its cycle, "" without one; now: s since 1970."""
        super().__init__(moment.tool, moment.pins["tool_diameter"])
        mode = int(moment.pins["mode"])
        self.number, self.code, self.start = number, code, now
        self.mode = MODES[mode] if 0 <= mode < len(MODES) else MODES[0]
        self.line = self.last_line = int(moment.pins["line"])
        self.seconds = 0.0

    def add(self, moment: Moment) -> None:
        super().add(moment)
        self.seconds += moment.dt
        if moment.cutting:
            self.last_line = int(moment.pins["line"])

    def row(self) -> Row:
        limited = {f"{name}_s": round(seconds, 1) for name, seconds in zip(LIMITS[1:], self.limited_s[1:])}
        return {
            "operation": self.number,
            "code": self.code,
            "line": self.line,
            "last_line": self.last_line,
            "mode": self.mode,
            "seconds": round(self.seconds, 1),
            **self.figures(),
            **limited,
        }


class OperationLog:
    """The operations of one run of a program."""

    def __init__(self, cycles: dict[int, str]) -> None:
        """cycles: cycle_lines()."""
        self.cycles = cycles
        self.now: Operation | None = None  # the Operation under way
        self.done: deque[Operation] = deque(maxlen=SHOWN)
        self.count = 0
        self._key: tuple[int, int, float, int] | None = None

    def add(self, moment: Moment, now: float) -> Operation | None:
        """A moment that ends now (s since 1970); -> the Operation that it has ended, or None."""
        if self.now is not None:
            self.now.add_late(moment)
        pins, line = moment.pins, int(moment.pins["line"])
        key = (
            moment.tool,
            int(pins["mode"]),
            round(pins["target"], _TARGET_DIGITS),
            line if line in self.cycles else 0,
        )
        ended = self.end() if key != self._key else None
        self._key = key
        if self.now is None and moment.counts:
            self.count += 1
            self.now = Operation(self.count, moment, self.cycles.get(line, ""), now)
        if self.now is not None:
            self.now.add(moment)
        return ended

    def end(self) -> Operation | None:
        """End the operation under way; -> it, or None."""
        ended, self.now = self.now, None
        if ended is not None:
            self.done.append(ended)
        return ended

    def shown(self) -> list[Operation]:
        """The last SHOWN operations, the one under way at the end."""
        return [*self.done, *([self.now] if self.now else [])][-SHOWN:]
