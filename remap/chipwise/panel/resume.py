# SPDX-License-Identifier: GPL-2.0-or-later
"""Resume for the page of `chipwise panel`: what the program that goes on would do, and that program, written and
opened.  Called by entry_process.py, in a process of its own.

    {"do": "resume", "ini", "line", "seconds", "broke"}         line: number or null; seconds: number; the options of
        chipwise resume
        -> {"program", "path_of_program", "said": [sentence, ..], "file", "digest"}
    {"do": "go-on", "ini", "line", "seconds", "broke", "path_of_program", "digest"}
        -> {"file"}                                             digest: of the plan; what would be written is made
                                                                again, and has to be the same

It is what `chipwise resume` does: resume/running.py, resume/run.py.  Nothing is started.
"""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from chipwise.program.program_file import Unreadable
from chipwise.program.reader import Machine
from chipwise.errors import CycleError, printable, with_line
from chipwise.host.temp_folder import OwnFolder
from chipwise.resume import running
from chipwise.resume.lathe import sentences
from chipwise.panel import Json
from chipwise.resume.run import Order, Resumed
from chipwise.rewrite.read_back import Different

if TYPE_CHECKING:  # entry_process.py imports this one
    from chipwise.entry import mdi
    from chipwise.panel.entry_process import Mdi

T = TypeVar("T")

CPU_S = 100


def _asked(work: Callable[..., T], *values: object) -> T:
    """What a function gives; its Unreadable and Different as CycleError."""
    try:
        return work(*values)
    except Unreadable as error:
        fact, _semicolon, remedy = str(error).partition("; ")
        raise CycleError(with_line(fact, error.line), remedy or "see chipwise resume") from error
    except Different as error:
        raise CycleError(f"nothing is written: {error}", "please report it with the program") from error


def _at_rest(machine: "Mdi") -> "mdi.State":
    """The State of a machine at rest.  Raises CycleError."""
    state = machine.read()
    if not (state.idle and state.at_rest):
        raise CycleError(
            "nothing is resumed: a program or a command is under way, or the machine moves",
            "wait for its end, or press Stop",
        )
    return state


def _made(order: Json, machine: "Mdi", program: str) -> tuple[Resumed, str]:
    with OwnFolder("resume") as folder:
        return _asked(
            running.made,
            program,
            Order(order["line"], order["seconds"], order["broke"]),
            order["ini"],
            machine.scene(),
            folder,
            CPU_S,
        )


def plan(order: Json, machine: "Mdi") -> Json:
    """The answer to "resume"; machine: entry/mdi.py, or what a test has in its place."""
    program = running.first_program(_at_rest(machine).program)
    found = {"program": printable(os.path.basename(program)), "path_of_program": program, "file": "", "digest": ""}
    if not _asked(Machine, order["ini"]).has_y:
        return {**found, "said": list(map(printable, _asked(sentences, program, order["ini"])))}
    path = running.output_of(program)
    made, digest = _made(order, machine, program)
    return {
        **found,
        "said": list(map(printable, made.said)),
        "file": printable(os.path.basename(path)),
        "digest": digest,
    }


def go_on(order: Json, machine: "Mdi") -> Json:
    """The answer to "go-on"; only at rest."""
    program = running.first_program(_at_rest(machine).program)
    if program != order["path_of_program"]:
        raise CycleError("nothing is written: another program is loaded", "look at the plan of that one")
    path = running.output_of(program)
    found, digest = _made(order, machine, program)
    if digest != order["digest"]:
        raise CycleError(
            "nothing is written: the stock, the program or the machine has changed since the plan",
            "look at the plan again",
        )
    _at_rest(machine)
    _asked(running.write, found, path)
    machine.open_program(path)
    return {"file": printable(os.path.basename(path))}
