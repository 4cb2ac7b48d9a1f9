# SPDX-License-Identifier: GPL-2.0-or-later
"""Entry by fields for the page of `chipwise panel`: the codes with their data, a line of G-code, its plan with a
drawing, its run by MDI.

Called by server.py.  A line is made here, at once; it is planned and run in a process of its own (entry_process.py).

 1. One line is planned at a time, and one thing is run, switched or changed at a time, whatever how many pages there
    are.  A plan that takes long keeps nobody from a run, a guard or a tool.
 2. Only the line that was planned last can be run, once, within VALID_S, and only if tool, position and program are
    what they were.  A plan that was asked for without the token does not take the place of one that was asked for with
    it.
 3. A process that takes longer than PLAN_S is ended.
 4. A chop size is part of the line: #<_chipwise_chop_size>=5 G13 ..  It stays in force for MDI, so once one was sent, a
    line without gets that of the INI file.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence

from chipwise import entry
from chipwise.host import language
from chipwise.tool_data import editor
from chipwise.host.clock import patience
from chipwise.host.processes import environment
from chipwise.entry import typed
from chipwise.entry.planned import CHOPPED
from chipwise.errors import MM_PER_INCH, CycleError, printable, unnamed
from chipwise.ini import expanded, values_of
from chipwise.panel import Ask, Json
from chipwise.panel.clamp_set_ups import ClampSetUps
from chipwise.panel.resumes import Resumes
from chipwise.panel.set_ups import SetUps
from chipwise.settings import load_settings

PLAN_S = 120.0
VALID_S = 600.0
MODES = ("light", "dark")
CHOP_SIZE = entry.EntryField("", "chop size", "length", least=0.0)
CHOP_PARAMETER = "#<_chipwise_chop_size>"


def process(order: Json) -> Json:
    """Answer of entry_process.py to an order.  Raises CycleError if there is none."""
    child = subprocess.Popen(
        [sys.executable, "-m", "chipwise.panel.entry_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        start_new_session=True,
    )
    try:
        out, words = child.communicate(json.dumps(order), patience(PLAN_S))
    except subprocess.TimeoutExpired:
        raise CycleError(
            f"the plan took more than {PLAN_S:g} s, and was ended", "plan it in a terminal with chipwise enter"
        ) from None
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
    try:
        return json.loads(out.splitlines()[-1])
    except (ValueError, IndexError) as error:
        last = (words.strip().splitlines() or ["it said nothing"])[-1]
        raise CycleError(
            "{what} has failed ({why})", "plan it in a terminal with chipwise enter", what=order["do"], why=last[:200]
        ) from error


class Lines:
    """The lines of one machine."""

    def __init__(self, ini: str, ask: Ask = process) -> None:
        """ini: path of the INI file, "" without one; ask: order -> answer."""
        self.ini, self.ask = ini, ask
        self._planning, self._acting = threading.Lock(), threading.Lock()
        # whether the token was there: (number, answer of the plan, code, s on the clock)
        self._plans: dict[bool, tuple[int, Json, str, float]] = {}
        self._count = 0
        self._sent_chop = False  # whether a chop size was sent
        rights = lambda: self._one(self._planning), lambda: self._one(self._acting)
        self.set_ups, self.resumes = SetUps(ini, self._asked, *rights), Resumes(ini, self._asked, *rights)
        self.clamps = ClampSetUps(ini, self._asked, rights[1])

    def _table(self) -> str:
        return load_settings(self.ini).path("ENTRY")

    def codes(self, wanted: Sequence[str]) -> list[Json]:
        """The codes that this machine has, with their data in the order of entry, in the first of the wanted languages.
        Raises CycleError."""
        table, translate, known, sizes = (
            self._table(),
            language.translator(wanted),
            self._known(),
            [self._chop_size(unit) for unit in ("mm", "in")],
        )
        return [
            {
                "code": code,
                "title": translate(entry.title(code, table)),
                "chop": sizes if code in CHOPPED else None,
                "fields": [
                    {
                        "letter": field.letter,
                        "name": translate(field.name),
                        "units": [field.unit("mm"), field.unit("in")],
                        "required": field.required,
                        "default": translate(field.default),
                        "choices": [[number, translate(meaning)] for number, meaning in field.choices],
                    }
                    for field in entry.fields(code, table)
                ],
            }
            for code in entry.codes(table)
            if code in known
        ]

    def _known(self) -> set[str]:
        """Codes of the machine's INI file."""
        try:
            remaps = values_of(expanded(self.ini).splitlines(), "RS274NGC", "REMAP")
        except OSError as error:
            raise CycleError("{path}: {why}", "start LinuxCNC again", path=self.ini, why=error.strerror) from error
        return {text.split()[0].upper() for text in remaps if text}

    def _chop_size(self, unit: str) -> str:
        """[CHIPWISE]CHOP_SIZE in "mm" or "in", as text."""
        return f"{load_settings(self.ini)['CHOP_SIZE'] / (MM_PER_INCH if unit == 'in' else 1.0):.9g}"

    def line(self, code: str, text: str, chop: str = "") -> Json:
        """{"line"}, or {"error", "number"} of the field; chop: size that no piece may reach, as it was typed, "" for
        that of the INI file."""
        try:
            size = typed.number(CHOP_SIZE, chop) if code in CHOPPED else ""
            return {"line": (f"{CHOP_PARAMETER}={size} " if size else "") + entry.line(code, text, self._table())}
        except CycleError as error:
            return {"error": printable(unnamed(error)), "number": getattr(error, "number", 0)}

    def plan(
        self, code: str, text: str, mode: str, wanted: Sequence[str], chop: str = "", by_token: bool = False
    ) -> Json:
        """What a line does, as a page shows it, with the number of the plan; or {"error", "number"}.  by_token: who
        asks has the token.  Raises CycleError."""
        made = self.line(code, text, chop)
        if "error" in made:
            return made
        with self._one(self._planning):
            self._plans.pop(by_token, None)
            found = self._asked(
                {
                    "do": "plan",
                    "ini": self.ini,
                    "code": code,
                    "text": text,
                    "chop": typed.number(CHOP_SIZE, chop) if code in CHOPPED else "",
                    "mode": mode if mode in MODES else MODES[0],
                    "language": language.catalogue(wanted)[0],
                }
            )
            if "error" in found:
                return found
            self._count += 1
            found["line"] = made["line"]
            self._plans[by_token] = self._count, found, code, time.monotonic()
            return {"plan": self._count, **{name: value for name, value in found.items() if name != "state"}}

    def run(self, number: int) -> Json:
        """Run the line that was planned last: {}, or {"error"} with why it is not run.  Raises CycleError."""
        with self._one(self._acting):
            kind = next((kind for kind, plan in list(self._plans.items()) if plan[0] == number), None)
            plan = None if kind is None else self._plans.pop(kind, None)
            if plan is None or plan[0] != number:
                raise CycleError("the line is not run: it is not the one that was planned last", "plan it again")
            _number, found, code, then = plan
            if time.monotonic() - then > patience(VALID_S):
                raise CycleError(
                    f"the line is not run: it was planned more than {VALID_S / 60:g} min ago", "plan it again"
                )
            line = found["line"]
            if line.startswith(CHOP_PARAMETER):
                self._sent_chop = True
            elif self._sent_chop and code in CHOPPED:
                line = f"{CHOP_PARAMETER}={self._chop_size(found['unit'])} {line}"
            return self._asked(
                {"do": "run", "code": code, "line": line, "unit": found["unit"], "state": found["state"]}
            )

    def guard(self, name: str, on: bool) -> Json:
        """Switch a guard of line_process.GUARDS: {}, or {"error"} with why it is not switched.  Raises CycleError."""
        with self._one(self._acting):
            return self._asked({"do": "guard", "name": name, "on": on})

    def part(self) -> Json:
        """Begin a new part: {}, or {"error"}.  Raises CycleError."""
        with self._one(self._acting):
            return self._asked({"do": "part"})

    def tools(self) -> Json:
        """The file of tool geometry, as tool_editor.listed().  Raises CycleError."""
        return editor.listed(load_settings(self.ini).path("TOOL_GEOMETRY"))

    def tool(self, number: int, values: Json, seen: str) -> Json:
        """Change a tool (tool_editor.change()): the file as it is then, or {"error"} with why it is not changed.
        Raises CycleError."""
        with self._one(self._acting):
            return self._asked({"do": "tool", "ini": self.ini, "number": number, "values": values, "seen": seen})

    @contextlib.contextmanager
    def _one(self, lock: threading.Lock) -> Iterator[None]:
        """The right to plan, or to run and change.  Raises CycleError if another page has it."""
        if not lock.acquire(blocking=False):
            if lock is self._planning:
                raise CycleError(
                    "another line or resume is being planned, or a program measured", "wait until it is done"
                )
            raise CycleError("another line is being run, or a guard or tool changed", "wait until it is done")
        try:
            yield
        finally:
            lock.release()

    def _asked(self, order: Json) -> Json:
        try:
            return self.ask(order)
        except CycleError as error:
            return {"error": printable(unnamed(error)), "number": 0}
