# SPDX-License-Identifier: GPL-2.0-or-later
"""What a check finds, and its text.

Called by answer.py, simulate.py, travel.py, result.py and page.py.  One Finding is a chain of segments that break one
rule one after the other; its position and value are those of the worst of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Optional

from chipwise.errors import format_length, printable
from chipwise.rates import MM3_PER_CM3

FLUTE, RAPID, HOLDER, RATE, TOOL, FLUTES_UNKNOWN = "flute", "rapid", "holder", "rate", "tool", "flute-unknown"
CLEARANCE, GOUGE, MACHINE, LIMIT, CLAMP = "clearance", "gouge", "machine", "limit", "clamp"
CHIP, POWER, BENDING = "chip", "power", "bending"
OF_LOAD, OF_MACHINE = (RATE, CHIP, POWER, BENDING), (MACHINE, LIMIT, TOOL)
NEAR = (CLEARANCE, CLAMP)  # rules of which the smallest value is the worst
OF_STOCK = (FLUTE, RAPID, HOLDER, RATE, CHIP, POWER, BENDING, CLEARANCE, GOUGE)  # rules that a stock decides

RULES = {
    FLUTE: "stock is cut by the flutes only",
    RAPID: "a traverse meets no stock",
    CLEARANCE: "a traverse keeps TRAVERSE_CLEARANCE from stock at its side",
    HOLDER: "the holder meets no stock",
    CLAMP: "tool, shank and holder keep CLAMP_CLEARANCE from clamps",
    GOUGE: "the tool does not cut into the part of --part",
    RATE: "the removal rate stays below the tool's max_rate",
    CHIP: "the largest chip stays below the tool's chip_load",
    POWER: "the power at the edges stays below SPINDLE_POWER and SPINDLE_TORQUE",
    BENDING: "the side force bends the tool by less than its deflection",
    MACHINE: "the machine has the tools and axes that the program names",
    LIMIT: "the axes stay within their limits",
    TOOL: "the tool is described in [CHIPWISE]TOOL_GEOMETRY",
    FLUTES_UNKNOWN: "the tool's flute_length is known",
}

MAX_KEPT = 1000  # findings of a program; more are only counted
ALIKE = 3  # findings of one rule and tool, from which on they are one line


def known(value: float | None) -> float:
    """A value or a limit that every finding of the rule has.  Raises ValueError for one without it."""
    if value is None:
        raise ValueError("a finding of this rule has a value and a limit")
    return value


@dataclass
class Finding:
    """rule; first and last line; tool; position: (x, y, z) mm in work coordinates; value, limit: mm, mm3/min or
    None."""

    rule: str
    line: int
    last_line: int
    tool: int
    position: Optional[tuple] = None
    value: Optional[float] = None  # of CLAMP: mm from it, negative: in it
    limit: Optional[float] = None
    segments: int = 1
    at: int = 0  # segments before it, for the order
    machine: Optional[tuple] = None  # the position, mm in machine coordinates
    axis: str = ""  # of MACHINE (not of a tool) and LIMIT
    subject: str = ""  # of CLAMP: what moves
    clamp: str = ""  # of CLAMP: its name

    def is_worse(self, other: Finding) -> bool:
        """Whether it is than another one of the same rule."""
        value, had = known(self.value), known(other.value)
        return value < had if self.rule in NEAR else value > had

    def json(self) -> dict[str, Any]:
        """As in --json."""
        x, y, z = self.position or (None, None, None)
        return {
            "rule": self.rule,
            "line": self.line,
            "last_line": self.last_line,
            "tool": self.tool,
            "x": x,
            "y": y,
            "z": z,
            "value": self.value,
            "limit": self.limit,
            "text": self.text(),
        }

    def text(self, unit: str = "mm") -> str:
        """One line for the operator."""
        lines = f"line {self.line}" + (f" to {self.last_line}" if self.last_line > self.line else "")
        where = (
            f"{lines}: "
            if self.line and self.axis and not self.tool
            else f"{lines}, tool {self.tool}: "
            if self.line
            else f"tool {self.tool}: "
            if self.tool
            else ""
        )  # 0: of the tool that is there before the program
        return printable(where + self.said(unit))

    def said(self, unit: str = "mm") -> str:
        """The same without line and tool."""

        def length(v: float | None) -> str:
            return format_length(round(known(v), 3), unit)

        at = " at X{} Y{} Z{}".format(*(length(v).split()[0] for v in self.position)) if self.position else ""
        if self.rule == FLUTE:
            said = (
                f"cuts {length(self.value)} deep{at}, the flutes are {length(self.limit)} long; "
                "take smaller steps in Z, or a tool with longer flutes"
            )
        elif self.rule == RAPID:
            said = f"a traverse meets {length(self.value)} of stock{at}; retract higher, or use G1"
        elif self.rule == CLEARANCE:
            said = (
                f"traverses beside stock: {self.segments}, the nearest {length(self.value)} from it{at}, "
                f"TRAVERSE_CLEARANCE is "
                f"{length(self.limit)}; retract higher, or use G1"
            )
        elif self.rule == CLAMP:
            said = self._said_of_clamp(length, at)
        elif self.rule == HOLDER:
            said = (
                f"the holder meets {length(self.value)} of stock{at}, the tool sticks out {length(self.limit)}; "
                f"let it stick out {length(known(self.limit) + known(self.value))}"
            )
        elif self.rule in OF_LOAD:
            said = self._said_of_load(length, at)
        elif self.rule == GOUGE:
            said = f"the part is gouged by {length(self.value)}{at}; correct the program, or the place of the part"
        elif self.rule in OF_MACHINE:
            said = self._said_of_machine(length)
        else:
            said = "its flute_length is unknown, so its depth is not checked; add it to [CHIPWISE]TOOL_GEOMETRY"
        return printable(said)

    def _said_of_load(self, length: Callable[[float | None], str], at: str) -> str:
        """said() of OF_LOAD."""
        if self.rule == RATE:
            said = (
                f"removes {known(self.value) / MM3_PER_CM3:.4g} cm3/min{at}, the tool's max_rate is "
                f"{known(self.limit) / MM3_PER_CM3:.4g}; "
                "lower F, or use M251"
            )
        elif self.rule == CHIP:
            said = (
                f"cuts chips of {length(self.value)}{at}, the tool's chip_load is {length(self.limit)}; lower F, "
                f"or use M251"
            )
        elif self.rule == POWER:
            said = (
                f"needs {self.value:.3g} W at the edges{at}, the spindle has {self.limit:.3g} W at this speed "
                f"(SPINDLE_POWER, SPINDLE_TORQUE); lower F, or use M251"
            )
        else:
            said = (
                f"is bent by {length(self.value)} at its tip{at}, its deflection is {length(self.limit)}; lower F, "
                f"take smaller cuts, or use M251"
            )
        return said

    def _said_of_machine(self, length: Callable[[float | None], str]) -> str:
        """said() of OF_MACHINE."""
        if self.rule == MACHINE and self.axis:
            said = (
                f"the machine has no axis {self.axis}, so LinuxCNC refuses the program; leave {self.axis} out, or "
                f"name the machine with --ini"
            )
        elif self.rule == MACHINE:
            said = (
                f"the tool is not in the tool table, so LinuxCNC refuses the program; add T{self.tool} to it, or "
                f"name the machine with --ini"
            )
        elif self.rule == LIMIT:
            said = (
                f"{self.axis} goes to {length(self.value)} in machine coordinates, its limit is {length(self.limit)}; "
                "move the work, and touch off again"
            )
        else:
            said = (
                "the tool is not in [CHIPWISE]TOOL_GEOMETRY and is checked as a flat end mill of its diameter; "
                "describe it there"
            )
        return said

    def _said_of_clamp(self, length: Callable[[float | None], str], at: str) -> str:
        """said() of CLAMP."""
        if known(self.value) > 0.0:
            return (
                f"{self.subject} comes within {length(self.value)} of {self.clamp}{at}, CLAMP_CLEARANCE is "
                f"{length(self.limit)}; go over it, or round it"
            )
        return f"{self.subject} meets {self.clamp}{at}; go over it, or round it"


class Group(tuple[Finding, ...]):
    """Findings of one cause: one rule, one tool."""

    @property
    def lines(self) -> tuple[int, int]:
        """First and last line."""
        return min(one.line for one in self), max(one.last_line for one in self)

    @property
    def worst(self) -> Finding:
        """The Finding whose value is the worst."""
        return (min if self[0].rule in NEAR else max)(self, key=lambda one: one.value or 0.0)

    def said(self, unit: str = "mm") -> str:
        """What is found, without lines and tool."""
        if len(self) == 1:
            return self[0].said(unit)
        return f"{len(self)} findings, the worst in line {self.worst.line}: {self.worst.said(unit)}"

    def text(self, unit: str = "mm") -> str:
        """One line for the operator."""
        if len(self) == 1:
            return self[0].text(unit)
        first, last = self.lines
        return printable(f"lines {first} to {last}, tool {self[0].tool}: {self.said(unit)}")


def grouped(findings: list[Finding]) -> list[Group]:
    """[Group] of Findings by rule and tool, in the order of the first of each; fewer than ALIKE stay alone."""
    found: dict[tuple[str, int, str, str], list[Finding]] = {}
    for one in findings:
        found.setdefault((one.rule, one.tool, one.axis, one.clamp), []).append(one)
    groups = [
        Group(part) for many in found.values() for part in ([many] if len(many) >= ALIKE else [[one] for one in many])
    ]
    return sorted(groups, key=lambda group: findings.index(group[0]))


def grouped_notes(notes: Iterable[Sequence[Any]]) -> list[str]:
    """[[line, text], ..] -> texts with their lines, each text once."""
    found: dict[str, list[int]] = {}
    for line, text in notes:
        found.setdefault(text, []).append(line)
    return [
        (
            f"lines {min(lines)} to {max(lines)}, {len(lines)} times: "
            if len(lines) > 1
            else f"line {lines[0]}: "
            if lines[0]
            else ""
        )
        + text
        for text, lines in found.items()
    ]


@dataclass
class Findings:
    """Findings of one program, in the order of the program."""

    kept: list = field(default_factory=list)
    dropped: int = 0
    _open: dict = field(default_factory=dict)  # by rule: the finding that may continue

    def add(self, finding: Finding) -> None:
        """A finding of its own."""
        if len(self.kept) < MAX_KEPT:
            self.kept.append(finding)
        else:
            self.dropped += 1

    def extend(self, finding: Finding, goes_on: bool) -> None:
        """One of a chain of segments; goes_on: the chain before, which broke the same rule, continues.  Of traverses
        that are too near to stock, those of a tool are one."""
        before = self._open.get(finding.rule)
        if not ((goes_on or finding.rule == CLEARANCE) and before is not None and before.tool == finding.tool):
            self._open[finding.rule] = finding
            self.add(finding)
            return
        before.segments += finding.segments
        before.last_line = max(before.last_line, finding.last_line)
        before.line = min(before.line, finding.line)
        if finding.is_worse(before):
            before.value, before.position, before.machine = finding.value, finding.position, finding.machine

    @property
    def count(self) -> int:
        return len(self.kept) + self.dropped
