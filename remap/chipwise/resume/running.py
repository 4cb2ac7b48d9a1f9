# SPDX-License-Identifier: GPL-2.0-or-later
"""Resume where LinuxCNC runs: the work offsets in force, the program that is loaded, and the new program beside it.
Called by cli/resume.py and panel/resume.py.

LinuxCNC writes its parameter file when it ends, so work offsets that were touched off since the start are not in it.
The new program starts nothing: it is written and opened, as a person would.
"""

import hashlib
import os

from chipwise.check.in_force import with_offsets
from chipwise.program.program_file import Unreadable
from chipwise.program.reader import Machine
from chipwise.errors import CycleError, printable
from chipwise.host.files import read_only, write_durable
from chipwise.entry import mdi
from chipwise.resume.run import goes_on_with, resumed
from chipwise.stock import store

ENDING = ".resume.ngc"  # of the new program's name


def machine_here(ini, folder):
    """The Machine of an INI file, with the work offsets in force if its LinuxCNC runs here.  Raises Unreadable,
    FolderError."""
    machine = Machine(ini)
    try:
        mdi.read()
        runs = os.path.samefile(mdi.ini(), machine.ini)
        scene = mdi.scene() if runs else None
    except (CycleError, OSError, ImportError, RuntimeError):
        return machine
    except Exception as error:  # linuxcnc.error: it has just ended
        if type(error).__module__ != "linuxcnc":
            raise
        return machine
    return with_offsets(machine, scene, folder) if scene else machine


def first_program(loaded):
    """The program to name: the loaded one, or the one that it goes on with, beside it.  Raises CycleError."""
    if not loaded:
        raise CycleError("no program is loaded", "open one on LinuxCNC's screen")
    name = goes_on_with(loaded)
    if not name:
        return loaded
    first = os.path.join(os.path.dirname(loaded), name)
    if not os.path.isfile(first):
        raise CycleError("the loaded program goes on with {name}, which is not beside it", "open that one", name=name)
    return first


def output_of(program):
    """Where the new program is written.  Raises CycleError if another file has that name."""
    path = os.path.splitext(program)[0] + ENDING
    if os.path.lexists(path) and not (os.path.isfile(path) and goes_on_with(path)):
        raise CycleError(
            "{path} is there, and is not of chipwise resume", "move it away, or use chipwise resume -o", path=path
        )
    return path


def made(program, order, ini, scene, folder, cpu_s):
    """(Resumed, digest of all that it writes and says).  Raises Unreadable, Different, FolderError."""
    found = resumed(program, order, with_offsets(Machine(ini), scene, folder), cpu_s=cpu_s)
    parts = hashlib.blake2b(digest_size=16)
    for part in (
        found.data,
        "\n".join(found.said).encode("utf-8", "surrogateescape"),
        found.stock.cells_and_ring.tobytes(),
    ):
        parts.update(b"%d " % len(part) + part)
    return found, parts.hexdigest()


def write(found, path):
    """The stock to its slot, and the new program.  Raises Unreadable."""
    folder = os.path.dirname(os.path.abspath(path))
    if read_only(folder):
        raise Unreadable(
            printable(f"the new program {path} cannot be written: {folder} {read_only(folder)}"),
            "make that folder writable, or use chipwise resume -o with a folder of yours",
        )
    found.save()
    try:
        write_durable(path, found.data, store.UNFINISHED)
    except OSError as error:
        raise Unreadable(
            printable(f"the new program {path} cannot be written: {error.strerror}"),
            "make room, or use chipwise resume -o with a folder of yours",
        ) from error
