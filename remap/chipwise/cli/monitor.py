# SPDX-License-Identifier: GPL-2.0-or-later
"""Keep the HAL components informed: tool in the spindle, its shape, saved stock; report faults to the operator.

Called by hal/chipwise.hal (`loadusr -Wn chipwise-monitor chipwise monitor`); runs as long as LinuxCNC does.  Start it
by hand if a message says that chipwise-monitor does not answer: it takes over the pins of the one that was killed.
"""

from chipwise.errors import CycleError, unnamed
from chipwise.host.halcmd import pins
from chipwise.monitor import takeover, worker
from chipwise.monitor.component import make_component
from chipwise.monitor.supervisor import Supervisor
from chipwise.settings import load_settings

NAME = "monitor"
HELP = "keep the HAL components informed (called by chipwise.hal)"


def add_arguments(parser):
    del parser


def run(options):
    """Runs until LinuxCNC ends it."""
    del options
    from chipwise.options.machine import CommandError
    import linuxcnc

    try:
        settings = load_settings(takeover.ini_file(linuxcnc))
        if not pins("stock-tracker.0."):
            raise CycleError("there is no stock tracker in HAL", "start LinuxCNC with chipwise.hal first")
        component, inherited = make_component()
    except CycleError as error:
        raise CommandError(unnamed(error)) from error
    component.ready()
    try:
        Supervisor(
            lambda died: worker.watch(component, settings, inherited, died), lambda: component["heartbeat"]
        ).run()
    finally:
        component.exit()
