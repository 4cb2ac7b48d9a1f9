# SPDX-License-Identifier: GPL-2.0-or-later
"""Requests of the page of `chipwise panel` about a typed line, a guard, a new part, a tool, a clamp or an alarm: the
part of server.py's Handler that asks entry.py."""

import math
import urllib.parse
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler
from typing import TYPE_CHECKING, TypeVar

from chipwise.errors import CycleError, printable, unnamed
from chipwise.panel import Json
from chipwise.panel.alarms import StillActive
from chipwise.panel.entry_process import GUARDS
from chipwise.setup.job import FARTHEST_MM, MAX_TEXT
from chipwise.stock.reasons import SET_UPS

if TYPE_CHECKING:  # server.py imports this one
    from chipwise.panel.server import Server

T = TypeVar("T")
Routes = dict[str, tuple[Callable[..., None], dict[str, object]]]

MOST_LINE, MOST_S = 10**9, 3600.0  # of a program to resume; s of --time


class Refused(Exception):
    """An answer without content: status, words."""

    def __init__(self, status: int, words: str) -> None:
        super().__init__(words)
        self.status = status


class LineRequests(BaseHTTPRequestHandler):
    """What a Handler answers about lines; it has server.lines, server.watch, headers and send_json()."""

    server: "Server"
    query = ""  # of the request
    by_token = False  # who asks for something of HARMLESS has brought the token

    def send_json(self, status: int, found: object) -> None:
        """Answer with an object."""
        raise NotImplementedError

    def ask(self, routes: Routes, path: str, wanted: Json) -> None:
        """A request with its object, by its row of HARMLESS or CHANGES."""
        work, words = routes[path]
        work(self, *(wanted.get(word, usual) for word, usual in words.items()))

    def languages(self) -> list[str]:
        """The languages that the browser asks for, in their order."""
        return [part.split(";")[0].strip() for part in (self.headers.get("Accept-Language") or "").split(",")]

    def codes(self) -> None:
        """The codes with their data; the query is a language, or nothing."""
        self.send_json(200, self.asked(self.server.lines.codes, [self.query, *self.languages()]))

    def line(self) -> None:
        """The line of G-code of what is typed."""
        self.send_json(200, self.asked(self.server.lines.line, *self.words("code", "text", "chop")))

    def plan(self, code: object, text: object, mode: object, chop: object) -> None:
        """What a typed line does; the query is a language, or nothing."""
        if not all(isinstance(value, str) for value in (code, text, mode, chop)):
            raise Refused(400, "code, text, mode and chop are not texts")
        self.send_json(
            200,
            self.asked(self.server.lines.plan, code, text, mode, [self.query, *self.languages()], chop, self.by_token),
        )

    def run(self, number: object) -> None:
        """Run the line that was planned last; looks at the machine from `look` on are of then or later, those that the
        page has not read yet may not be."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "plan is not a whole number")
        found = self.asked(self.server.lines.run, number)
        if "error" in found:
            raise Refused(409, found["error"])
        self.send_json(200, {"done": True, "look": self.server.watch.number})

    def guard(self, name: object, on: object) -> None:
        """Switch a guard on or off."""
        if name not in GUARDS or not isinstance(on, bool):
            raise Refused(400, "guard is not rapid or flute, or on is not true or false")
        found = self.asked(self.server.lines.guard, name, on)
        if "error" in found:
            raise Refused(409, found["error"])
        print(f"chipwise-panel: guard-{name} is {'on' if on else 'off'}, by the page", flush=True)
        self.send_json(200, {"done": True})

    def part(self) -> None:
        """Begin a new part: a whole stock in place of an assumed one."""
        found = self.asked(self.server.lines.part)
        if "error" in found:
            raise Refused(409, found["error"])
        print("chipwise-panel: a new part is begun, by the page", flush=True)
        self.send_json(200, {"done": True})

    def tools(self) -> None:
        """The tools with their geometry."""
        self.send_json(200, self.asked(self.server.lines.tools))

    def tool(self, number: object, values: object, seen: object) -> None:
        """Change a tool."""
        if (
            isinstance(number, bool)
            or not isinstance(number, int)
            or not isinstance(seen, str)
            or not isinstance(values, dict)
        ):
            raise Refused(400, "tool is not a whole number, values is not an object, or checksum is not a text")
        if not all(
            value is None or isinstance(value, str) or type(value) in (int, float) and math.isfinite(value)
            for value in values.values()
        ):
            raise Refused(400, "values are not texts and numbers")
        found = self.asked(self.server.lines.tool, number, values, seen)
        if "error" in found:
            raise Refused(409, found["error"])
        print(f"chipwise-panel: tool {number} is changed in {found['file']}, by the page", flush=True)
        self.send_json(200, found)

    def measure(self, stock: object, material: object) -> None:
        """What the loaded program cuts in a stock."""
        if not (isinstance(material, str) and len(material) <= MAX_TEXT and (material.isprintable() or not material)):
            raise Refused(400, f"material is not a text of at most {MAX_TEXT} characters")
        if stock is not None and not (
            isinstance(stock, list)
            and len(stock) == 6
            and all(type(value) in (int, float) and abs(value) <= FARTHEST_MM for value in stock)
        ):
            raise Refused(400, "stock is not six lengths")
        self.send_json(200, self.asked(self.server.lines.set_ups.measure, stock, material, self.by_token))

    def corner(self, number: object, in_machine: object) -> None:
        """Where the tool is, as a corner of the stock, or of a clamp (machine coordinates)."""
        self.send_json(200, self._without_error(self.server.lines.set_ups.corner, number, in_machine is True))

    def clamps(self) -> None:
        """The set-ups of clamps of the machine, and which of them are in force."""
        self.send_json(200, self.asked(self.server.lines.clamps.listed, self.server.watch.clamps))

    def clamp(self, number: object, title: object, name: object, box: object, gone: object) -> None:
        """Add a clamp to a set-up, or take one out of it."""
        self._check_set_up(number, 1)
        if not all(text is None or isinstance(text, str) and len(text) <= MAX_TEXT for text in (title, name, gone)) or (
            name is None
        ) == (gone is None):
            raise Refused(400, "title, add or remove is not a text")
        if name is not None and not (
            isinstance(box, list)
            and len(box) == 6
            and all(type(value) in (int, float) and abs(value) <= FARTHEST_MM for value in box)
        ):
            raise Refused(400, "box is not six lengths")
        found = self._without_error(self.server.lines.clamps.change, number, title, name, box, gone)
        print(f"chipwise-panel: set-up {number} of clamps is changed in {found['file']}, by the page", flush=True)
        self.send_json(200, found)

    def put_clamps(self, number: object) -> None:
        """Put a set-up of clamps in force, 0: none."""
        self._check_set_up(number, 0)
        found = self._without_error(self.server.lines.clamps.put, number)
        print(f"chipwise-panel: M256 P{number}, by the page", flush=True)
        self.send_json(200, found)

    def _check_set_up(self, number: object, least: int) -> None:
        if type(number) is not int or not least <= number < SET_UPS:
            raise Refused(400, f"set_up is not a whole number from {least} to {SET_UPS - 1}")

    def confirm(self, number: object) -> None:
        """Write the job file of the loaded program."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "measured is not a whole number")
        found = self._without_error(self.server.lines.set_ups.confirm, number)
        print(f"chipwise-panel: {found['file']} is confirmed, by the page", flush=True)
        self.send_json(200, found)

    def resume(self, line: object, seconds: object, broke: object) -> None:
        """What would go on with the loaded program."""
        if line is not None and not (type(line) is int and 1 <= line <= MOST_LINE):
            raise Refused(400, "line is not a whole number from 1")
        if (
            isinstance(seconds, bool)
            or not isinstance(seconds, (int, float))
            or not 0 <= seconds <= MOST_S
            or not isinstance(broke, bool)
        ):
            raise Refused(400, f"seconds is not a number from 0 to {MOST_S:g}, or broke is not true or false")
        self.send_json(200, self.asked(self.server.lines.resumes.plan, line, float(seconds), broke, self.by_token))

    def go_on(self, number: object) -> None:
        """Write and open the program that goes on."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "resume is not a whole number")
        found = self._without_error(self.server.lines.resumes.go_on, number)
        print(f"chipwise-panel: {found['file']} is written and opened, by the page", flush=True)
        self.send_json(200, found)

    def _without_error(self, work: Callable[..., Json], *values: object) -> Json:
        found = self.asked(work, *values)
        if "error" in found:
            raise Refused(409, found["error"])
        return found

    def clear(self, number: object) -> None:
        """Clear an alarm, or all that have ended (None)."""
        if number is not None and (isinstance(number, bool) or not isinstance(number, int)):
            raise Refused(400, "alarm is not a whole number")
        with self.server.watch.published:
            try:
                self.server.watch.alarms.clear(number)
            except StillActive as active:
                raise Refused(409, f"the cause is still there: {active}") from active
            except KeyError as error:
                raise Refused(404, "there is no such alarm") from error
        self.send_json(200, {"done": True})

    def asked(self, work: Callable[..., T], *values: object) -> T:
        """What entry.py answers.  Raises Refused with its message."""
        try:
            return work(*values)
        except CycleError as error:
            raise Refused(409, printable(unnamed(error))) from error

    def words(self, *names: str) -> list[str]:
        """Values of names in the query, "" for one that is not in it."""
        try:
            found = urllib.parse.parse_qs(self.query, keep_blank_values=True, max_num_fields=len(names))
        except ValueError as error:
            raise Refused(400, "the request asks for too much") from error
        return [found.get(name, [""])[0] for name in names]


# Path: what answers it, the words of the request's object that it takes, in its order, and what each is if it is not
# there.
HARMLESS: Routes = {  # these change nothing
    "/plan": (LineRequests.plan, {"code": "", "text": "", "mode": "", "chop": ""}),
    "/measure": (LineRequests.measure, {"stock": None, "material": ""}),
    "/corner": (LineRequests.corner, {"measured": None, "machine": False}),
    "/resume": (LineRequests.resume, {"line": None, "seconds": 0, "broke": False}),
}
CHANGES: Routes = {  # these need the token
    "/clear": (LineRequests.clear, {"alarm": None}),
    "/run": (LineRequests.run, {"plan": None}),
    "/guard": (LineRequests.guard, {"guard": None, "on": None}),
    "/part": (LineRequests.part, {}),
    "/confirm": (LineRequests.confirm, {"measured": None}),
    "/clamp": (LineRequests.clamp, {"set_up": None, "title": None, "add": None, "box": None, "remove": None}),
    "/clamps": (LineRequests.put_clamps, {"set_up": None}),
    "/go-on": (LineRequests.go_on, {"resume": None}),
    "/tool": (LineRequests.tool, {"tool": None, "values": None, "checksum": None}),
}
