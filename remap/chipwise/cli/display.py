# SPDX-License-Identifier: GPL-2.0-or-later
"""Show on the screen what chipwise does: pins for a panel, and one line at the end of each program.

Called by hal/chipwise_display.hal (`loadusr -Wn chipwise-display chipwise display`), which a screen runs as its
POSTGUI_HALFILE; a HAL component of its own that commands nothing.
"""

import signal
import time

from chipwise import report
from chipwise.errors import CycleError, unnamed
from chipwise.host.halcmd import pins
from chipwise.panel.display import COMPONENT, POLL_S, Display, make_component

NAME = "display"
HELP = "pins for a panel and a line at the end of each program (called by chipwise_display.hal)"


def add_arguments(parser):
    del parser


def leave(_number, _frame):
    raise SystemExit(0)


def run(options):
    """Runs until LinuxCNC ends it."""
    del options
    from chipwise.options.machine import CommandError

    signal.signal(signal.SIGTERM, leave)
    try:
        if not pins("stock-tracker.0."):
            raise CommandError(
                "there is no stock tracker in HAL; run chipwise_display.hal after chipwise.hal, as the screen's "
                "POSTGUI_HALFILE"
            )
        if pins(COMPONENT + "."):
            raise CommandError(f"{COMPONENT} is already running; use that one")
    except CycleError as error:
        raise CommandError(unnamed(error)) from error
    component = make_component()
    display = Display(component)
    display.show()
    report.begin()
    component.ready()
    try:
        while True:
            display.step()
            time.sleep(POLL_S)
    finally:
        report.end()
        component.exit()
