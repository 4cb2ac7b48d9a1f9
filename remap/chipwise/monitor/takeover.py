# SPDX-License-Identifier: GPL-2.0-or-later
"""Take over the pins of a chipwise-monitor that was killed.

Called by component.py when the monitor starts.  A component in user space that is killed leaves its pins in HAL as they
were:  its name is in use, and `hold` may stay TRUE.  The new one gets another name (chipwise-monitor-2, ..), and its
pins are connected to the signals of the killed one, which from then on carry its values.  They begin with the values of
the killed one: a pin that is linked writes what it has into the signal (LinuxCNC 2.9), and program-running FALSE for a
moment would end M251 in the middle of a cut.
"""

import os
import re

from chipwise.errors import CycleError
from chipwise.host.halcmd import components, halcmds, pins
from chipwise.host.processes import lives

OUTWARD = "==>"  # of a pin that writes its signal
KEPT = ("program-loaded", "job-stock")  # pins on no signal that are read by the next monitor


def instances(component):
    """{name: PID} in HAL of the component and of those that have taken over from it."""
    return {name: pid for name, pid in components().items() if re.fullmatch(re.escape(component) + r"(-\d+)?", name)}


def choose_name(component):
    """(name for the new one, name of the killed one or None).  Raises CycleError if one is running."""
    members = instances(component)
    for name, pid in members.items():
        if lives(pid):
            raise CycleError(f"{name} is already running (process {pid})", "use that one")
    if not members:
        return component, None
    numbers = [int(name[len(component) + 1 :] or 1) for name in members]
    last = max(numbers)
    return f"{component}-{last + 1}", component if last == 1 else f"{component}-{last}"


def links(name, found):
    """{pin without the component's name: signal} of a component; found: halcmd.pins()."""
    return {
        pin[len(name) + 1 :]: signal for pin, (_arrow, signal) in found.items() if signal and pin.startswith(name + ".")
    }


def take_over(component, dead, read):
    """Connect the pins of a component to the signals of the killed component `dead`.  read: function of a pin's name ->
    its value
    (hal.get_value)."""
    name, found = component.getprefix(), pins(dead + ".")
    for pin, (arrow, _signal) in found.items():
        short = pin[len(dead) + 1 :]
        if pin.startswith(dead + ".") and (arrow == OUTWARD or short in KEPT):
            component[short] = read(pin)
    halcmds(
        *(
            words
            for pin, signal in links(dead, found).items()
            for words in (("unlinkp", f"{dead}.{pin}"), ("net", signal, f"{name}.{pin}"))
        )
    )


def ini_file(linuxcnc):
    """INI file of the running LinuxCNC, for a monitor started by hand; "" if none runs."""
    if os.environ.get("INI_FILE_NAME"):
        return os.environ["INI_FILE_NAME"]
    try:
        status = linuxcnc.stat()
        status.poll()
        return status.ini_filename or ""
    except (linuxcnc.error, SystemError):
        return ""
