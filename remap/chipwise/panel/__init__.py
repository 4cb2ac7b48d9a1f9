# SPDX-License-Identifier: GPL-2.0-or-later
"""What an operator sees of chipwise: pins for a panel of the screen, and the page of `chipwise panel`.

display.py          pins with figures of the volumetric feed, and one line at the end of each program
machine.py          the same machine, read for the page
watch.py            one look after the other: state, figures of a run, alarms
tiles.py, alarms.py the stock in tiles; the alarms
look_ahead.py            the path ahead and the contours of the loaded program; look_ahead_process.py reads it,
                         path_window.py follows the tool on it
tab.py              the page as a tab of AXIS, gmoccapy and QtDragon
load_log.py         what each tool did in a program (tool_log.py), and each operation (operations.py); log_file.py keeps
                    both
entry.py            a typed line: made, planned, run; entry_process.py plans and runs it, entry_routes.py are the
                    requests about it
set_ups.py          the set-up of the loaded program, set_up.py in the process of a plan; resumes.py, resume.py the same
                    for what goes on with it
clamp_set_ups.py    the set-ups of clamps of the machine
visitors.py         how many connections and pages an address may have
server.py           the web server; page/ has its files, page_colours.py their colours
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

Json = dict[str, Any]  # an object as the json module makes it; who writes it has its keys in a docstring
Ask = Callable[[Json], Json]  # an order to a process, and its answer
Right = Callable[[], AbstractContextManager[None]]  # to plan, or to change something, as long as its context lasts
