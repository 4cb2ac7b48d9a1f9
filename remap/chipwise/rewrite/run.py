# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewrites one program, from the file to the bytes of the new one, which are read back and compared first.

Called by cli/rewrite.py and filter/work.py.
"""

from __future__ import annotations

import functools
import math
import os
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Callable, Optional, TypeVar, cast

from chipwise.check.assume import Named
from chipwise.program.program_file import Missing
from chipwise.program.reader import Limits, Machine, Unreadable
from chipwise.errors import CycleError, format_length, unnamed
from chipwise.host.temp_folder import OwnFolder, writing
from chipwise.host.processes import return_freed_arrays, return_heap
from chipwise.rates import MM3_PER_CM3, MM3_PER_IN3
from chipwise.rewrite import depth_proof, expected_program, read_back as proof, sections
from chipwise.rewrite import assumed, calls, feed, flute
from chipwise.rewrite.fed import feed_traverses
from chipwise.rewrite.program import SYNCHRONISED, Program, Reads
from chipwise.rewrite.text import Writer
from chipwise.rewrite.trials import RESERVE_MM
from chipwise.rewrite.words import plain_move, words_of
from chipwise.settings import load_settings
from chipwise.tool_data.geometry import load_tools

if TYPE_CHECKING:
    from chipwise.check.assume import Assumption
    from chipwise.clib.arrays import Corners, Floats
    from chipwise.rewrite.edits import Edits
    from chipwise.rewrite.program import Moves
    from chipwise.tool_data.geometry import ToolGeometry

_Figures = TypeVar("_Figures")

# of rewriting, with needles where the new program has been too deep, or a traverse too near; RESERVE_MM more if too
# deep
REPEATS = 8
MOST_FED = 3  # repeats more, in which the traverses that are still too near become feed moves
# of a text of our own that is read back: a program that was taken is not refused for what is made of it
MOST_BYTES = 2_000_000_000


@dataclass(frozen=True)
class Order:
    """What is asked for.  rates: feed.Rates, None: respect the flutes; whole, diameter (mm): of flute.Order; cell: mm,
    None: as the program asks for; tool: number, tool_diameter: mm, of the one in the spindle at the beginning, or
    None."""

    rates: Optional[feed.Rates] = None
    whole: bool = False
    diameter: Optional[float] = None
    cell: Optional[float] = None
    tool: Optional[int] = None
    tool_diameter: Optional[float] = None


def rewritten(
    path: str,
    order: Order,
    progress: Callable[[float], object],
    machine: Machine,
    stock: Corners | None = None,
    **limits: float | None,
) -> tuple[bytes, str]:
    """-> (bytes of the new program, what is said).  Raises Unreadable, Different, FolderError, MemoryError.

    machine: reader.Machine; stock: (low, high) mm in work coordinates or None; limits: those of Reader.
    """
    reads = Reads(machine, stock, cast(Limits, limits))  # mypy 1.0 has no Unpack of a TypedDict
    try:
        return _rewritten(path, order, progress, reads)
    except Missing as error:
        named = Named(bool(stock), order.tool, order.tool_diameter)
        found = assumed.assumed(path, machine, error.line, named, reads.limits)
    stock = (found.low, found.high) if found.low and found.high else stock
    if found.guessed and order.rates:
        order = replace(order, rates=replace(order.rates, raises=False))
    reads = replace(reads, machine=assumed.machine_with(machine, found), stock=stock)
    data, said = _rewritten(path, order, progress, reads, found)
    return data, "; ".join([*found.notes, *([assumed.NEVER_RAISED] if found.guessed and order.rates else []), said])


def _rewritten(
    path: str, order: Order, progress: Callable[[float], object], reads: Reads, assumption: Assumption | None = None
) -> tuple[bytes, str]:
    """rewritten(), on an Assumption if there is one."""
    return_freed_arrays()
    try:
        settings = load_settings(reads.machine.ini)
        geometry = load_tools(settings.path("TOOL_GEOMETRY"))
    except CycleError as error:
        raise Unreadable(unnamed(error.text()), "") from error

    if assumption:
        geometry = assumed.geometry_with(geometry, assumption)
    program = reads.program(path)
    return_heap()
    limits = reads.limits.copy()
    limits["most_bytes"] = MOST_BYTES
    reads = replace(reads, limits=limits, most=flute.MOST_WRITTEN)
    progress(0.2)
    cell = order.cell or sections.cell_for(
        program, geometry, settings["CELL"], *([sections.CELLS_FOR_VOLUME] if order.rates else [])
    )
    job = Job(program, reads, geometry, cell, settings["TRAVERSE_CLEARANCE"])
    if assumption and assumption.guessed and not order.rates:
        return assumed.keep_flutes(job)

    def share_done(share: float) -> None:
        progress(0.2 + 0.5 * share)

    data, said = write_feeds(order.rates, job, share_done) if order.rates else respect_flutes(order, job, share_done)
    return data, "; ".join([*(str(text) for _line, text in program.notes), said])


def rate_unit(machine: Machine) -> tuple[float, str]:
    """(mm3/min of the unit that rates are said in, its name)."""
    return (MM3_PER_IN3, "in3/min") if machine.unit_mm > 10 else (MM3_PER_CM3, "cm3/min")


def written(folder: str, program: Program, edits: Edits) -> str:
    """The path of a Program with Edits that is written in an OwnFolder.  Raises Unreadable, FolderError."""
    path = os.path.join(folder, os.path.basename(program.path))
    with writing(), open(path, "wb") as file:
        Writer(program, edits, file).write()
    return path


def read_back(path: str, read_it: Callable[[str], Program]) -> Program:
    """The Program of the new text.  Raises Different where it cannot be read."""
    try:
        return read_it(path)
    except Unreadable as error:
        raise proof.Different(f"the new program cannot be read ({error})") from error


def _content(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


@dataclass
class Job:
    """What every kind of rewriting needs: program, reads: of what is made of it, geometry {number: ToolGeometry}, cell
    (mm); clearance (mm) of traverses."""

    program: Program
    reads: Reads
    geometry: dict[int, ToolGeometry]
    cell: float
    clearance: float

    def moves_of(self, path: str) -> Program:
        """The Program of a file, without its lines."""
        return self.reads.program(path, text=False)

    @functools.cached_property
    def own_traverses(self) -> list[depth_proof.Witness]:
        """[depths.Witness] of traverses of the program itself that are nearer to stock than the clearance: they stay as
        they are."""
        return depth_proof.too_deep(self.program, self.geometry, self.cell, math.inf, self.clearance)

    def broken(self, program: Moves) -> list[depth_proof.Witness]:
        """[depths.Witness] of where a program with edits cuts too deep, or where one of its new traverses is too near
        to stock."""
        found = depth_proof.too_deep(program, self.geometry, self.cell, proof.OVER_MM, self.clearance)
        return depth_proof.but_own(found, self.own_traverses) if any(witness.traverse for witness in found) else found


def in_place(
    job: Job,
    program: Program,
    rewrite: Callable[[Program, bool], tuple[Edits, _Figures]],
    check: Callable[[Program, Edits, _Figures], None],
) -> tuple[Program, Edits, _Figures]:
    """(Program, Edits, Figures): calls, loops and conditions that hold a step that has to change are written out.

    rewrite: (Program, whether steps anywhere may change) -> (Edits, Figures); check: (Program, Edits, Figures), raises
    Unreadable for what cannot be rewritten.  The Figures are those of the Program as it was, if it has such blocks: its
    lines are the user's.
    """
    if not calls.has_blocks(program):
        edits, figures = rewrite(program, False)
        return program, edits, figures
    edits, figures = rewrite(program, True)
    if not edits:
        return program, edits, figures
    followed, (edits, own) = calls.written_out(program, (edits, figures), lambda other: rewrite(other, True), job.reads)
    try:
        check(followed.program, edits, own)
    except Unreadable as error:
        error.line = followed.line_of(error.line)
        raise
    return followed.program, edits, figures


@dataclass
class FoundOut:
    """What the repeats so far have found out.  reserve: mm; needles: of flute.Order, what the map of the edits has not
    met; fed: ends of traverses that become feed moves."""

    reserve: float = 0.0
    needles: dict[int, Floats] = field(default_factory=dict)
    fed: list[tuple[float, ...]] = field(default_factory=list)


def respect_flutes(order: Order, job: Job, progress: Callable[[float], object]) -> tuple[bytes, str]:
    """CN105492980; -> (bytes, what is said)."""
    found_out = FoundOut()
    second: Moves | None
    with OwnFolder("rewrite") as folder:
        for repeat in range(1, REPEATS + MOST_FED + 1):
            path, second, figures, found = _with_reserve(order, job, progress, found_out, folder)
            if not found:
                break
            second = None  # long programs need the room
            deep = any(witness.traverse is None for witness in found)
            if repeat >= REPEATS and (deep or repeat == REPEATS + MOST_FED):
                raise still_broken(job, found)
            if repeat >= REPEATS:
                found_out.fed += [witness.traverse[3:] for witness in found if witness.traverse]
            else:
                found_out.needles = depth_proof.with_needles(found_out.needles, found)
                found_out.reserve += RESERVE_MM * deep
        if not path:
            where = "elsewhere" if job.program.lead.notes else "everywhere"
            return job.program.content(), f"the flutes are long enough {where}, the program is unchanged"
        assert isinstance(second, Program)  # what is written has been read
        proof.same_stock(job.program, second, job.geometry, job.cell)
        second = None
        data = _content(path)
    unit = job.reads.machine.unit
    parts = [
        f"line{'s' * (b > a)} {a}" + (f" to {b}" if b > a else "") + f" in {n} levels" for a, b, n in figures.lines[:5]
    ]
    more = f" and {len(figures.lines) - 5} more" if len(figures.lines) > 5 else ""
    return data, (
        f"{', '.join(parts)}{more}; {format_length(round(figures.added_feed, 1), unit)} of feed added to "
        f"{format_length(round(figures.first_feed, 1), unit)}"
    )


def _with_reserve(
    order: Order, job: Job, progress: Callable[[float], object], found_out: FoundOut, folder: str
) -> tuple[str | None, Moves, flute.Figures, list[depth_proof.Witness]]:
    """One of the repeats -> (path of the new program in the folder, None: not written; what is cut then: Program, or
    Foreseen of what is not written; Figures; [Witness] of what is too deep)."""
    reserve, needles = found_out.reserve, found_out.needles

    def rewrite(program: Program, anywhere: bool) -> tuple[Edits, flute.Figures]:
        return flute.rewrite(
            program,
            job.geometry,
            flute.Order(job.cell, order.whole, order.diameter, reserve, anywhere, needles, job.clearance),
            progress,
        )

    def check(program: Program, _edits: Edits, figures: flute.Figures) -> None:
        for first, end in figures.shifted:
            program.check_shiftable(first, end)

    program, edits, figures = in_place(job, job.program, rewrite, check)
    if not edits:
        return None, job.program, figures, depth_proof.too_deep(job.program, job.geometry, job.cell, proof.OVER_MM)
    feed_traverses(program, edits, found_out.fed)
    path, without_f = written(folder, program, edits), synchronised_lines(program)
    meant = expected_program.foreseen(program, edits)
    del program, edits  # long programs need the room
    return_heap()
    found = job.broken(meant)
    if found:
        return None, meant, figures, found
    second = read_back(path, job.moves_of)
    if not expected_program.same_moves(meant, second):
        found = job.broken(second)
    else:
        proof.same_feeds(meant, second, without_f)
    return path, second, figures, found


def still_broken(job: Job, found: list[depth_proof.Witness]) -> Unreadable:
    """The Unreadable for depths.Witness that no repeat has mended."""
    unit, deep = job.reads.machine.unit, [witness for witness in found if witness.traverse is None]
    if not deep:
        return Unreadable(
            f"a traverse of the rewritten path of tool {found[0].tool.number} would still be less than "
            f"{format_length(job.clearance, unit)} beside stock",
            "take smaller steps in Z here, or a smaller TRAVERSE_CLEARANCE",
            proof.line_below(job.program, found[0].place),
        )
    worst = max(deep, key=lambda witness: witness.depth - witness.tool.flutes)
    return Unreadable(
        f"the rewritten path of tool {worst.tool.number} would still cut {format_length(round(worst.depth, 3), unit)} "
        f"deep, its "
        f"flutes are {format_length(worst.tool.flutes, unit)} long",
        "take smaller steps in Z here, or a tool with longer flutes",
        proof.line_below(job.program, worst.place),
    )


def synchronised_lines(program: Program) -> list[int]:
    """[numbers of the lines whose moves follow the spindle]: their F means nothing."""
    return [
        n
        for n, (text, modes) in enumerate(zip(program.source, program.modes), 1)
        if modes.synchronised
        or (
            ("G" in text or "g" in text)
            and not plain_move(text)
            and any(letter == "G" and value in SYNCHRONISED for letter, value in words_of(text))
        )
    ]


def write_feeds(rates: feed.Rates, job: Job, progress: Callable[[float], object]) -> tuple[bytes, str]:
    """JP3131045; -> (bytes, what is said)."""

    def rewrite(program: Program, _anywhere: bool) -> tuple[Edits, feed.Figures]:
        order = feed.Order(job.cell, rates, job.reads.machine.speeds, synchronised_lines(program))
        return feed.rewrite(program, job.geometry, order, progress)

    def check(program: Program, edits: Edits, _figures: feed.Figures) -> None:
        for step in edits.changed():
            program.check_writable(step, "F has to change")

    program, edits, figures = in_place(job, job.program, rewrite, check)
    if not calls.has_blocks(job.program):
        check(program, edits, figures)
    data = _with_feeds(job, program, edits) if edits else job.program.content()
    scale, unit = rate_unit(job.reads.machine)
    return data, (
        f"F of {figures.changed} of {figures.moves} feed moves changed, {figures.divided} divided; "
        f"{figures.before_s:.1f} s "
        f"of feed become {figures.after_s:.1f} s, peak {figures.peak_before / scale:.4g} {unit} becomes "
        f"{figures.peak_after / scale:.4g}"
    )


def _with_feeds(job: Job, program: Program, edits: Edits) -> bytes:
    """The bytes of a Program with Edits that make no other path.  Raises Unreadable, Different, FolderError."""
    with OwnFolder("rewrite") as folder:
        path = written(folder, program, edits)
        second, meant = read_back(path, job.moves_of), expected_program.foreseen(program, edits)
        proof.same_path(job.program, second)
        if not expected_program.same_moves(meant, second):
            raise proof.Different("its moves are not those that were meant")
        proof.same_feeds(meant, second, synchronised_lines(program))
        return _content(path)
