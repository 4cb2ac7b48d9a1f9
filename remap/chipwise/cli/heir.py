"""Take the place of a chipwise-monitor that has died.

Called by monitor.py when it starts.  A component in user space that is killed leaves its pins in HAL as they were: its name is
taken, and `hold` may be TRUE for ever.  The new one gets another name (chipwise-monitor-2, ..), its pins are put on the
signals of the dead one's, and from then on it says what stands there.
"""

import os
import re

from chipwise.cli.load import halcmd, pins
from chipwise.errors import CycleError


def lives(pid):
    """Whether a process runs; a zombie does not."""
    try:
        with open(f'/proc/{pid}/stat') as handle:
            return handle.read().rsplit(')', 1)[1].split()[0] not in 'ZX'
    except OSError:
        return False


def family(component):
    """{name: PID} of the component and its heirs in HAL."""
    found = {}
    for line in halcmd('-s', 'show', 'comp').splitlines():
        words = line.split()
        if len(words) >= 4 and re.fullmatch(re.escape(component) + r'(-\d+)?', words[2]):
            found[words[2]] = int(words[3])
    return found


def choose_name(component):
    """(name for the new one, name of the dead one or None).  Raises CycleError where one lives."""
    members = family(component)
    for name, pid in members.items():
        if lives(pid):
            raise CycleError(f'{name} runs already (process {pid})', 'one is enough')
    if not members:
        return component, None
    numbers = [int(name[len(component) + 1:] or 1) for name in members]
    last = max(numbers)
    return f'{component}-{last + 1}', component if last == 1 else f'{component}-{last}'


def links(name):
    """{pin without the component's name: signal} of a component."""
    return {pin[len(name) + 1:]: signal for pin, (_arrow, signal) in pins(name + '.').items()
            if signal and pin.startswith(name + '.')}


def take_over(name, dead):
    """Put the pins of `name` on the signals of the dead one's."""
    for pin, signal in links(dead).items():
        halcmd('unlinkp', f'{dead}.{pin}')
        halcmd('net', signal, f'{name}.{pin}')


def ini_file(linuxcnc):
    """INI file of the LinuxCNC that runs, for a monitor started by hand; "" where there is none."""
    if os.environ.get('INI_FILE_NAME'):
        return os.environ['INI_FILE_NAME']
    try:
        status = linuxcnc.stat()
        status.poll()
        return status.ini_filename or ''
    except linuxcnc.error:
        return ''
