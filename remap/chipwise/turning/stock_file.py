# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of the part in the chuck, r(z), in a file that survives an abort, E-stop and the end of LinuxCNC:
[CHIPWISE]TURNING_STOCK.

Written by stages.py in the planner's process before anything moves; glue/turning.py only appends to it, when the
machine has done what the line says.  Read by stages.py before the next plan.

    {"chipwise turning stock": 1, "token": .., "program": .., "part": .., "blank": .., "zero": [z, x], "digest": ..}
    {"step": "", "outside": [[z0, z1, zr, xr, slope, r, side], ..], "bore": [..], "threads": [..]}      one line a
    stage, the first is the beginning ..
    {"token": .., "done": 7}            appended: the machine has done all up to stage 7, or "asked", "confirmed"

1. A line that is appended only ever takes stock away that the tool has cut, so one that is lost, torn or foreign leaves
   the stock fuller than it is: the plan then cuts air.
2. The whole of the stages has a digest: a file that anybody has changed is not used.
Lengths mm, work coordinates; zero: where these are, machine coordinates of the tool's tip.
"""

import dataclasses
import hashlib
import json
import os
import secrets
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes, write_durable
from chipwise.turning.profile_function import Graph, Piece, Place
from chipwise.turning.thread_comment import Thread

if TYPE_CHECKING:  # the interpreter's process loads this module, and no planning
    from chipwise.turning.profile import Profile
    from chipwise.turning.state import Order

FORMAT = 1
_HEAD = "chipwise turning stock"
MAX_BYTES = 1 << 26
UNFINISHED = ".unfinished"
ZERO_MM = 0.001  # of a work offset that is the same
ASKED, CONFIRMED = "asked", "confirmed"


class Stage(NamedTuple):
    """Stock after a part of a plan.  step: name of the step that has made it, "" at the beginning; outside, bore:
    graphs; threads: those that are there."""

    step: str
    outside: list[Piece]
    bore: list[Piece]
    threads: tuple[Thread, ...]


class Key(NamedTuple):
    """What has to be the same if the file's stock is that of a plan: program (path), digests of part and blank, zero
    (z, x) mm."""

    program: str
    part: str
    blank: str
    zero: Place


class Record(NamedTuple):
    """A file that lines are appended to."""

    path: str
    token: str


class Kept(NamedTuple):
    """What a file says.  stage: how far the machine has come; begun: whether it is farther than the beginning; asked:
    the operator has been asked whether the part is in the chuck, and has not said so; changed: time of the file, s."""

    key: Key
    stage: Stage
    begun: bool
    asked: bool
    changed: float


def key_of(order: "Order", program: str, zero: Place) -> Key:
    """Key of a plan.Order.  program: path; zero: (z, x) mm."""
    part, blank = order.part, order.blank
    return Key(
        os.path.abspath(program),
        _digest([*_shape(part), [_thread(t) for t in part.threads]]),
        _digest(_shape(blank)),
        (zero[0], zero[1]),
    )


def difference(kept: Key, wanted: Key) -> str:
    """Why the stock of a Key is not that of another one, "" if it is."""
    if kept.program != wanted.program:
        return "it is of another program, " + braceless(os.path.basename(kept.program))
    if kept.part != wanted.part:
        return "the part is drawn in another way"
    if kept.blank != wanted.blank:
        return "the blank is another one"
    if max(abs(a - b) for a, b in zip(kept.zero, wanted.zero)) > ZERO_MM:
        return "the work offset has changed"
    return ""


def _shape(profile: "Profile") -> list[list[list[float]]]:
    return [_pieces(profile.outside), _pieces(profile.bore)]


def _pieces(graph: Graph) -> list[list[float]]:
    """A graph without the lines of its sub."""
    return [list(p[:7]) for p in graph]


def _thread(thread: Thread) -> list[float]:
    """A thread without its line."""
    return list(dataclasses.astuple(dataclasses.replace(thread, line=0)))


def _digest(value: object) -> str:
    return hashlib.sha256((value if isinstance(value, str) else json.dumps(value)).encode()).hexdigest()


def write(path: str, key: Key, stages: Sequence[Stage]) -> Record:
    """Write a new file; -> its Record.  Raises OSError, and the file is then as before."""
    token = secrets.token_hex(8)
    body = "".join(
        json.dumps(
            {
                "step": s.step,
                "outside": _pieces(s.outside),
                "bore": _pieces(s.bore),
                "threads": [_thread(t) for t in s.threads],
            }
        )
        + "\n"
        for s in stages
    )
    head = {_HEAD: FORMAT, "token": token, **key._asdict(), "stages": len(stages), "digest": _digest(body)}
    write_durable(path, (json.dumps(head) + "\n" + body).encode(), UNFINISHED)
    return Record(path, token)


def note(record: Record, what: int | str) -> None:
    """Append a line: the number of the stage that is done, ASKED or CONFIRMED.  Raises OSError."""
    line: dict[str, object] = {"token": record.token}
    line.update({"done": what} if isinstance(what, int) else {what: True})
    handle = os.open(record.path, os.O_WRONLY | os.O_APPEND | os.O_CLOEXEC)  # never makes a file
    try:
        os.write(handle, (json.dumps(line) + "\n").encode())
    finally:
        os.close(handle)


def end(record: Record) -> None:
    """The part is finished: no file.  Raises OSError."""
    try:
        os.unlink(record.path)
    except FileNotFoundError:
        pass


def read(path: str) -> Kept | None:
    """Kept of a file, None without one.  Raises CycleError for a file that cannot be used."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8")
        changed = os.stat(path).st_mtime
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise _unusable(path, getattr(error, "strerror", None) or "it is not UTF-8") from error
    try:
        return _kept(text, changed)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        raise _unusable(path, "it is not what chipwise has written") from error


def _unusable(path: str, why: str) -> CycleError:
    return CycleError(f"{braceless(os.path.basename(path))}: {braceless(why)}", "remove the file")


def _kept(text: str, changed: float) -> Kept:
    """Kept of a file's text.  Raises what json and wrong types raise."""
    first, *lines = text.split("\n")
    head = json.loads(first)
    count = head["stages"]
    if head[_HEAD] != FORMAT or count < 1 or _digest("".join(line + "\n" for line in lines[:count])) != head["digest"]:
        raise ValueError
    done, asked = 0, False
    for line in lines[count:-1]:  # what follows the last line feed is torn
        said = _journal(line, head["token"])
        stage_done = said.get("done")
        if isinstance(stage_done, int) and 0 <= stage_done < count:
            done = max(done, stage_done)
        asked = said.get(ASKED) is True or asked and said.get(CONFIRMED) is not True
    stage = json.loads(lines[done])
    z, x = head["zero"]
    key = Key(str(head["program"]), str(head["part"]), str(head["blank"]), (float(z), float(x)))
    begun = done > 0 or bool(stage["step"])
    return Kept(
        key,
        Stage(
            stage["step"],
            [Piece(*p) for p in stage["outside"]],
            [Piece(*p) for p in stage["bore"]],
            tuple(Thread(*t) for t in stage["threads"]),
        ),
        begun,
        asked,
        changed,
    )


def _journal(line: str, token: str) -> dict[str, object]:
    """What an appended line says, {} where it cannot be read or is of another file."""
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) and said.get("token") == token else {}
