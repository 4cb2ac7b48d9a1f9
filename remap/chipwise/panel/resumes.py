# SPDX-License-Identifier: GPL-2.0-or-later
"""Resumes for the page of `chipwise panel`: what may be asked of resume.py, and in which order.  Called by entry.py.

Only what was planned last can be written, once, within VALID_S, as for set_ups.py: what was planned without the token
does not take the place of what was planned with it, and no path of a request gets to the machine.
"""

import time

from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.panel import Ask, Json, Right

VALID_S = 600.0
HIDDEN = ("path_of_program", "digest")  # of an answer: not for the page


class Resumes:
    """Of one machine.  ask: order -> answer, as lines.process; planning, acting: functions that give a context, the
    right to do so."""

    def __init__(self, ini: str, ask: Ask, planning: Right, acting: Right) -> None:
        self.ini, self.ask, self.planning, self.acting = ini, ask, planning, acting
        self._count = 0
        # whether the token was there: (number, options, answer, s on the clock)
        self._planned: dict[bool, tuple[int, Json, Json, float]] = {}

    def plan(self, line: int | None, seconds: float, broke: bool, by_token: bool) -> Json:
        """What would go on with the loaded program, with the number of the plan; or {"error"}.  Raises CycleError."""
        options = {"line": line, "seconds": seconds, "broke": broke}
        with self.planning():
            self._planned.pop(by_token, None)
            found = self.ask({"do": "resume", "ini": self.ini, **options})
            if "error" in found:
                return found
            self._count += 1
            self._planned[by_token] = self._count, options, found, time.monotonic()
            return {"resume": self._count, **{name: value for name, value in found.items() if name not in HIDDEN}}

    def go_on(self, number: int) -> Json:
        """Write and open the program of a plan: {"file"}, or {"error"}.  Raises CycleError."""
        with self.acting():
            kind = next((kind for kind, one in list(self._planned.items()) if one[0] == number), None)
            one = None if kind is None else self._planned.pop(kind, None)
            if one is None:
                raise CycleError("nothing is written: it is not the plan that was made last", "plan it again")
            _number, options, found, then = one
            if time.monotonic() - then > patience(VALID_S):
                raise CycleError(
                    f"nothing is written: the plan was made more than {VALID_S / 60:g} min ago", "plan it again"
                )
            if not found["file"]:
                raise CycleError("a lathe needs no other program", "start this one again: G26 goes on with the part")
            return self.ask(
                {
                    "do": "go-on",
                    "ini": self.ini,
                    **options,
                    "path_of_program": found["path_of_program"],
                    "digest": found["digest"],
                }
            )
