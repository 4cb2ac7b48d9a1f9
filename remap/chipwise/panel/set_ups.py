# SPDX-License-Identifier: GPL-2.0-or-later
"""Set-ups for the page of `chipwise panel`: what may be asked of set_up.py, and in which order.  Called by entry.py.

1. One program is measured at a time, however many pages there are.
2. Only what was measured last can be confirmed, within VALID_S.  What was asked for without the token does not take the
   place of what was asked for with it.  No number of a request gets into a job file: "confirm" names a measurement.
"""

import time
from collections.abc import Sequence

from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.panel import Ask, Json, Right

VALID_S = 3600.0
HIDDEN = ("job", "frame", "path_of_program")  # of an answer: not for the page


class SetUps:
    """Of one machine.  ask: order -> answer, as lines.process; measuring, acting: functions that give a context, the
    right to do so."""

    def __init__(self, ini: str, ask: Ask, measuring: Right, acting: Right) -> None:
        self.ini, self.ask, self.measuring, self.acting = ini, ask, measuring, acting
        self._count = 0
        # whether the token was there: (number, answer, s on the clock)
        self._measured: dict[bool, tuple[int, Json, float]] = {}

    def measure(self, stock: Sequence[float] | None, material: str, by_token: bool) -> Json:
        """What a program cuts in a stock (six numbers, mm, or None), with the number of the measurement; or {"error"}.
        Raises CycleError."""
        with self.measuring():
            self._measured.pop(by_token, None)
            found = self.ask({"do": "measure", "ini": self.ini, "stock": stock, "material": material})
            if "error" in found:
                return found
            self._count += 1
            self._measured[by_token] = self._count, found, time.monotonic()
            return {"measured": self._count, **{name: value for name, value in found.items() if name not in HIDDEN}}

    def corner(self, number: object, in_machine: bool = False) -> Json:
        """Where the tool is, in the coordinates of a measurement, in those in force or in those of the machine; or
        {"error"}."""
        if in_machine:
            return self.ask({"do": "corner", "frame": [0.0, [0.0] * 3, [0.0] * 3]})
        frame = next((found["frame"] for count, found, _then in list(self._measured.values()) if count == number), None)
        return self.ask({"do": "corner", "frame": frame})

    def confirm(self, number: int) -> Json:
        """Write the job file of a measurement: {"file"}, or {"error"}.  Raises CycleError."""
        with self.acting():
            kind = next((kind for kind, one in list(self._measured.items()) if one[0] == number), None)
            one = None if kind is None else self._measured.pop(kind, None)
            if one is None:
                raise CycleError(
                    "the set-up is not confirmed: it is not the one that was measured last", "measure it again"
                )
            _number, found, then = one
            if time.monotonic() - then > patience(VALID_S):
                raise CycleError(
                    f"the set-up is not confirmed: it was measured more than {VALID_S / 60:g} min ago",
                    "measure it again",
                )
            return self.ask(
                {"do": "confirm", "ini": self.ini, "program": found["path_of_program"], "job": found["job"]}
            )
