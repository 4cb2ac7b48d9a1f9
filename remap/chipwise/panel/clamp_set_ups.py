# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps for the page of `chipwise panel`: the set-ups of the machine's file, one clamp more or less, and which set-up
is in force.  Called by entry.py.

A set-up is put in force by M256 in MDI, at rest, as an operator would do it; P0 takes all clamps away.  mm, machine
coordinates.
"""

import os
from collections.abc import Iterable, Sequence

from chipwise.errors import CycleError, printable
from chipwise.panel import Ask, Json, Right
from chipwise.settings import load_settings


class ClampSetUps:
    """Of one machine.  ask: order -> answer, as lines.process; acting: function that gives a context, the right to
    change something."""

    def __init__(self, ini: str, ask: Ask, acting: Right) -> None:
        self.ini, self.ask, self.acting = ini, ask, acting

    def _path(self) -> str:
        return load_settings(self.ini).path("CLAMPS")

    def listed(self, rows: Iterable[Sequence[float]] = ()) -> Json:
        """{"file", "set_ups": {number: {"name", "clamps"}}, "in_force": [number]}; rows: of clamp_table.rows(), those
        in force.  Raises CycleError."""
        from chipwise.clamps import set_ups
        from chipwise.clamps.clamp import Clamp

        path = self._path()
        found, now = set_ups.load(path), [Clamp.seen_from_above(row, "") for row in rows]

        def is_on(one: "set_ups.SetUp") -> bool:
            return bool(one.clamps) and all(
                any(clamp.is_where(other) for other in now) for clamp in one.clamps.values()
            )

        return {
            "file": printable(os.path.basename(path)),
            "set_ups": {
                number: {
                    "name": one.name,
                    "clamps": {
                        name: {"shape": set_ups.numbers_of(clamp)[0], "min": clamp.low, "max": clamp.high}
                        for name, clamp in one.clamps.items()
                    },
                }
                for number, one in found.items()
            },
            "in_force": [number for number, one in sorted(found.items()) if is_on(one)],
        }

    def change(
        self, number: int, title: str | None, name: str | None, box: list[float] | None, gone: str | None
    ) -> Json:
        """Add a box `name` to a set-up, whose name is then the title, or take the clamp `gone` out, and a set-up
        without clamps with it: {"file"}.  Raises CycleError."""
        from chipwise.clamps import set_ups

        path = self._path()
        with self.acting():
            if gone is None:
                if name is None or not set_ups.CLAMP_NAME.fullmatch(name):
                    raise CycleError(
                        "the clamp has no name of at most 40 letters, digits, - and _", "give it one, as jaw-1"
                    )
                set_ups.add(path, number, name, "box", box or [], title or None)
            else:
                known = set_ups.load(path)
                clamps = known[number].clamps if number in known else {}
                if gone not in clamps:
                    raise CycleError(f"set-up {number} has no clamp of that name", "look at the list again")
                set_ups.remove(path, number, None if len(clamps) == 1 else gone)
        return {"file": printable(os.path.basename(path))}

    def put(self, number: int) -> Json:
        """M256: {}, or {"error"} with why it is not done.  Raises CycleError."""
        with self.acting():
            return self.ask({"do": "clamps", "number": number})
