# SPDX-License-Identifier: GPL-2.0-or-later
"""Requests of the page of `chipwise panel` about a typed line, a guard, a new part, a tool, a clamp or an alarm: the part of server.py's Handler that asks entry.py."""

import math
import urllib.parse

from chipwise.errors import CycleError, printable, unnamed
from chipwise.panel.alarms import StillActive
from chipwise.panel.entry_process import GUARDS
from chipwise.setup.job import FARTHEST_MM, MAX_TEXT
from chipwise.stock.reasons import SET_UPS

HARMLESS = "/plan", "/measure", "/corner", "/resume"        # these change nothing
MOST_LINE, MOST_S = 10 ** 9, 3600.0         # of a program to resume; s of --time


class Refused(Exception):
    """An answer without content: status, words."""

    def __init__(self, status, words):
        super().__init__(words)
        self.status = status


class LineRequests:
    """What a Handler answers about lines; it has server.lines, server.watch, headers and send_json()."""

    def harmless(self, path, wanted, query, by_token):
        """A request of HARMLESS with its object; by_token: who asks has brought the token."""
        if path == "/plan":
            self.plan(wanted, query, by_token)
        elif path == "/measure":
            self.measure(wanted.get("stock"), wanted.get("material", ""), by_token)
        elif path == "/resume":
            self.resume(wanted.get("line"), wanted.get("seconds", 0), wanted.get("broke", False), by_token)
        else:
            self.corner(wanted.get("measured"), wanted.get("machine", False))

    def change(self, path, wanted):
        """A request that changes something, with its object; the token was there."""
        if path == "/clear":
            self.clear(wanted.get("alarm"))
        elif path == "/run":
            self.run(wanted.get("plan"))
        elif path == "/guard":
            self.guard(wanted.get("guard"), wanted.get("on"))
        elif path == "/part":
            self.part()
        elif path == "/confirm":
            self.confirm(wanted.get("measured"))
        elif path == "/clamp":
            self.clamp(wanted.get("set_up"), wanted.get("title"), wanted.get("add"), wanted.get("box"), wanted.get("remove"))
        elif path == "/clamps":
            self.put_clamps(wanted.get("set_up"))
        elif path == "/go-on":
            self.go_on(wanted.get("resume"))
        elif path == "/tool":
            self.tool(wanted.get("tool"), wanted.get("values"), wanted.get("checksum"))
        else:
            raise Refused(404, "there is nothing here")

    def languages(self):
        """The languages that the browser asks for, in their order."""
        return [part.split(";")[0].strip() for part in (self.headers.get("Accept-Language") or "").split(",")]

    def codes(self, query):
        """The codes with their data; query: a language, or nothing."""
        self.send_json(200, self.asked(self.server.lines.codes, [query, *self.languages()]))

    def line(self, query):
        """The line of G-code of what is typed."""
        self.send_json(200, self.asked(self.server.lines.line, *self.words(query, "code", "text", "chop")))

    def plan(self, wanted, query, by_token):
        """What a typed line does; by_token: who asks has brought the token."""
        code, text, mode, chop = values = [wanted.get(name, "") for name in ("code", "text", "mode", "chop")]
        if not all(isinstance(value, str) for value in values):
            raise Refused(400, "code, text, mode and chop are not texts")
        self.send_json(200, self.asked(self.server.lines.plan, code, text, mode, [query, *self.languages()], chop, by_token))

    def run(self, number):
        """Run the line that was planned last."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "plan is not a whole number")
        found = self.asked(self.server.lines.run, number)
        if "error" in found:
            raise Refused(409, found["error"])
        self.send_json(200, {"done": True})

    def guard(self, name, on):
        """Switch a guard on or off."""
        if name not in GUARDS or not isinstance(on, bool):
            raise Refused(400, "guard is not rapid or flute, or on is not true or false")
        found = self.asked(self.server.lines.guard, name, on)
        if "error" in found:
            raise Refused(409, found["error"])
        print(f"chipwise-panel: guard-{name} is {'on' if on else 'off'}, by the page", flush=True)
        self.send_json(200, {"done": True})

    def part(self):
        """Begin a new part: a whole stock in place of an assumed one."""
        found = self.asked(self.server.lines.part)
        if "error" in found:
            raise Refused(409, found["error"])
        print("chipwise-panel: a new part is begun, by the page", flush=True)
        self.send_json(200, {"done": True})

    def tools(self):
        """The tools with their geometry."""
        self.send_json(200, self.asked(self.server.lines.tools))

    def tool(self, number, values, seen):
        """Change a tool."""
        if isinstance(number, bool) or not isinstance(number, int) or not isinstance(seen, str) or not isinstance(values, dict):
            raise Refused(400, "tool is not a whole number, values is not an object, or checksum is not a text")
        if not all(value is None or isinstance(value, str) or type(value) in (int, float) and math.isfinite(value) for value in values.values()):
            raise Refused(400, "values are not texts and numbers")
        found = self.asked(self.server.lines.tool, number, values, seen)
        if "error" in found:
            raise Refused(409, found["error"])
        print(f"chipwise-panel: tool {number} is changed in {found['file']}, by the page", flush=True)
        self.send_json(200, found)

    def measure(self, stock, material, by_token):
        """What the loaded program cuts in a stock; by_token: who asks has brought the token."""
        if not (isinstance(material, str) and len(material) <= MAX_TEXT and (material.isprintable() or not material)):
            raise Refused(400, f"material is not a text of at most {MAX_TEXT} characters")
        if stock is not None and not (isinstance(stock, list) and len(stock) == 6 and all(type(value) in (int, float) and abs(value) <= FARTHEST_MM for value in stock)):
            raise Refused(400, "stock is not six lengths")
        self.send_json(200, self.asked(self.server.lines.set_ups.measure, stock, material, by_token))

    def corner(self, number, in_machine):
        """Where the tool is, as a corner of the stock, or of a clamp (machine coordinates)."""
        self.send_json(200, self._without_error(self.server.lines.set_ups.corner, number, in_machine is True))

    def clamps(self):
        """The set-ups of clamps of the machine, and which of them are in force."""
        self.send_json(200, self.asked(self.server.lines.clamps.listed, self.server.watch.clamps))

    def clamp(self, number, title, name, box, gone):
        """Add a clamp to a set-up, or take one out of it."""
        self._check_set_up(number, 1)
        if not all(text is None or isinstance(text, str) and len(text) <= MAX_TEXT for text in (title, name, gone)) or (name is None) == (gone is None):
            raise Refused(400, "title, add or remove is not a text")
        if name is not None and not (isinstance(box, list) and len(box) == 6 and all(type(value) in (int, float) and abs(value) <= FARTHEST_MM for value in box)):
            raise Refused(400, "box is not six lengths")
        found = self._without_error(self.server.lines.clamps.change, number, title, name, box, gone)
        print(f"chipwise-panel: set-up {number} of clamps is changed in {found['file']}, by the page", flush=True)
        self.send_json(200, found)

    def put_clamps(self, number):
        """Put a set-up of clamps in force, 0: none."""
        self._check_set_up(number, 0)
        found = self._without_error(self.server.lines.clamps.put, number)
        print(f"chipwise-panel: M256 P{number}, by the page", flush=True)
        self.send_json(200, found)

    def _check_set_up(self, number, least):
        if type(number) is not int or not least <= number < SET_UPS:
            raise Refused(400, f"set_up is not a whole number from {least} to {SET_UPS - 1}")

    def confirm(self, number):
        """Write the job file of the loaded program."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "measured is not a whole number")
        found = self._without_error(self.server.lines.set_ups.confirm, number)
        print(f"chipwise-panel: {found['file']} is confirmed, by the page", flush=True)
        self.send_json(200, found)

    def resume(self, line, seconds, broke, by_token):
        """What would go on with the loaded program; by_token: who asks has brought the token."""
        if line is not None and not (type(line) is int and 1 <= line <= MOST_LINE):
            raise Refused(400, "line is not a whole number from 1")
        if type(seconds) not in (int, float) or not 0 <= seconds <= MOST_S or not isinstance(broke, bool):
            raise Refused(400, f"seconds is not a number from 0 to {MOST_S:g}, or broke is not true or false")
        self.send_json(200, self.asked(self.server.lines.resumes.plan, line, float(seconds), broke, by_token))

    def go_on(self, number):
        """Write and open the program that goes on."""
        if isinstance(number, bool) or not isinstance(number, int):
            raise Refused(400, "resume is not a whole number")
        found = self._without_error(self.server.lines.resumes.go_on, number)
        print(f"chipwise-panel: {found['file']} is written and opened, by the page", flush=True)
        self.send_json(200, found)

    def _without_error(self, work, *values):
        found = self.asked(work, *values)
        if "error" in found:
            raise Refused(409, found["error"])
        return found

    def clear(self, number):
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

    def asked(self, work, *values):
        """What entry.py answers.  Raises Refused with its message."""
        try:
            return work(*values)
        except CycleError as error:
            raise Refused(409, printable(unnamed(error))) from error

    def words(self, query, *names):
        """Values of names in a query, "" for one that is not in it."""
        try:
            found = urllib.parse.parse_qs(query, keep_blank_values=True, max_num_fields=len(names))
        except ValueError as error:
            raise Refused(400, "the request asks for too much") from error
        return [found.get(name, [""])[0] for name in names]
