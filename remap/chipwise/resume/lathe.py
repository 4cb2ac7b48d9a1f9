# SPDX-License-Identifier: GPL-2.0-or-later
"""What a lathe's G26 does with the part that was stopped, in sentences: the program itself goes on when it is started
again.

Called by cli/resume.py.  The plan is that of G26 (turning/resume.py), from the file that G26 keeps; the work
offset is taken to be that of then, which G26 compares.
"""

import os
import time

from chipwise.program.reader import Unreadable
from chipwise.errors import CycleError, unnamed
from chipwise.ini import Ini
from chipwise.settings import load_settings
from chipwise.turning import resume, stock_file
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_program, read_request


def sentences(path, ini):
    """[text] for a G26 program and a lathe's INI file.  Raises Unreadable where the part does not go on."""
    try:
        settings = load_settings(ini)
        machine, text, stock = Machine(Ini(ini), settings, ini), read_program(path), settings.path("TURNING_STOCK")
        request = read_request(text, machine.startup)
        order = make_order(job_of(path, request, machine), text, request, machine, machine.steps)
        found = stock_file.read(stock) if stock else None
        if found is None or not found.begun:
            raise Unreadable("no part is kept that was stopped", "start the program: G26 plans the whole blank")
        key = stock_file.key_of(order, path, found.key.zero)
        choice = resume.choose(order, stock, key)
    except (CycleError, OSError) as error:
        raise Unreadable(
            unnamed(error.text()) if isinstance(error, CycleError) else f"{path}: {error.strerror}", ""
        ) from error
    if not choice.stage:
        raise Unreadable(unnamed(choice.notes[0].text()), "")
    left = [
        f"{number} {step.name} (T{step.tool.number})" for number, step in enumerate(choice.plan.steps, 1) if step.needed
    ]
    when = time.strftime("%Y-%m-%d %H:%M", time.localtime(choice.changed))
    return [
        f"The part was stopped on {when} in the step {choice.stage.step}.",
        f"Start {os.path.basename(path)} again: G26 plans what is left, and no other program is needed.",
        "It stops the spindle and asks whether the part is in the chuck before anything moves, then does: "
        + ", ".join(left)
        + ".",
        "It refuses the kept part if the work offset is another one than then, and plans the whole blank.",
    ]
