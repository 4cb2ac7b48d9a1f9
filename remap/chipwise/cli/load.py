"""Load the realtime components with the settings of the INI file.

Called by hal/chipwise.hal while LinuxCNC starts (`loadusr -w chipwise load`), which sets
INI_FILE_NAME.  A setting that cannot be used ends it with a message and exit status 1, and
LinuxCNC does not start: better than to start with a map that is not what was asked for.
"""

import os
import subprocess

from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.settings import load_settings, read_section

NAME = 'load'
HELP = 'load the HAL components (called by chipwise.hal)'

BYTES_PER_CELL = 8
SHARE_OF_MEMORY = 0.25      # of the machine's memory, at most, for the map


def add_arguments(parser):
    del parser


def ini_section(name):
    """{KEY: text} of a section of the INI file LinuxCNC runs with."""
    with open(os.environ['INI_FILE_NAME'], encoding='utf-8', errors='replace') as ini:
        return read_section(ini, name)


def units_per_mm():
    """[TRAJ]LINEAR_UNITS as machine units per mm."""
    text = ini_section('TRAJ').get('LINEAR_UNITS', 'mm').lower()
    known = {'mm': 1.0, 'metric': 1.0, 'in': 1 / MM_PER_INCH, 'inch': 1 / MM_PER_INCH,
             'imperial': 1 / MM_PER_INCH}
    return known[text] if text in known else float(text)


def planner_acceleration():
    """Smallest acceleration the planner may use in a straight move, machine units/s2."""
    found = [ini_section('TRAJ').get('MAX_LINEAR_ACCELERATION')]
    found += [ini_section('AXIS_' + letter).get('MAX_ACCELERATION') for letter in 'XYZ']
    numbers = [float(text) for text in found if text]
    if not numbers:
        raise CycleError('no acceleration in the INI file',
                         'set [TRAJ]MAX_LINEAR_ACCELERATION or [AXIS_X]MAX_ACCELERATION')
    return min(numbers)


def axis_accelerations():
    """{axis: machine units/s2}, of those the INI file has; what a traverse brakes with."""
    texts = {axis: ini_section('AXIS_' + axis.upper()).get('MAX_ACCELERATION') for axis in 'xyz'}
    return {axis: float(text) for axis, text in texts.items() if text}


def check_memory(settings):
    """Raise CycleError for a map that would take more than its share of the memory."""
    size_x, size_y = settings['MAP_SIZE']
    cell = settings['CELL']
    wanted = (size_x / cell + 2) * (size_y / cell + 2) * BYTES_PER_CELL
    memory = os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES')
    if wanted > SHARE_OF_MEMORY * memory:
        raise CycleError(
            f'the map needs {wanted / 2**20:.0f} MiB ([CHIPWISE]MAP_SIZE = {size_x:g} {size_y:g} mm, '
            f'CELL = {cell:g} mm), more than a quarter of the {memory / 2**20:.0f} MiB of this machine',
            'use larger cells or a smaller map')


def halcmd(*words):
    """One halcmd command; raises CycleError with what it said."""
    done = subprocess.run(['halcmd', *words], text=True, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        said = done.stdout.strip().replace('{', '{{').replace('}', '}}')
        raise CycleError(f'halcmd {" ".join(words)}: {said}', 'see the lines above')


def run(options):
    """-> exit status; everything the components need that depends on a setting."""
    del options
    from chipwise.cli import CommandError
    try:
        load(load_settings())
    except (CycleError, ValueError) as error:
        raise CommandError(str(error).removeprefix('chipwise: ')) from error


def load(settings):
    check_memory(settings)
    size_x, size_y = settings['MAP_SIZE']
    units = units_per_mm()
    acceleration = planner_acceleration()
    first, status = settings['ANALOG_OUT'], settings['ANALOG_IN']
    for words in (
            ('loadrt', 'chipwise_command'),
            ('loadrt', 'stock_tracker', f"cell={settings['CELL']:.9g}", f'size_x={size_x:.9g}',
             f'size_y={size_y:.9g}'),
            ('loadrt', 'volumetric_feed'),
            ('loadrt', 'chipwise_guard'),
            ('setp', 'chipwise-guard.0.guard-rapid', f"{settings['GUARD_RAPID']:d}"),
            ('setp', 'chipwise-guard.0.guard-flute', f"{settings['GUARD_FLUTE']:d}"),
            ('setp', 'stock-tracker.0.units-per-mm', f'{units:.17g}'),
            ('setp', 'stock-tracker.0.acceleration', f'{acceleration:.9g}'),
            *(('setp', f'stock-tracker.0.acceleration-{axis}', f'{value:.9g}')
              for axis, value in axis_accelerations().items()),
            ('setp', 'volumetric-feed.0.units-per-mm', f'{units:.17g}'),
            ('setp', 'volumetric-feed.0.acceleration', f'{acceleration:.9g}'),
            ('net', 'chipwise-word', f'motion.analog-out-{first:02d}', 'chipwise-command.0.word'),
            ('net', 'chipwise-value', f'motion.analog-out-{first + 1:02d}',
             'chipwise-command.0.value'),
            ('net', 'chipwise-programmed', f'motion.analog-out-{first + 2:02d}',
             'volumetric-feed.0.programmed-vel'),
            ('net', 'chipwise-status', 'chipwise-command.0.status', f'motion.analog-in-{status:02d}')):
        halcmd(*words)
    if settings['GUARD_RAPID'] or settings['GUARD_FLUTE']:
        connect_stop()


def connect_stop():
    """The guards' stop to both pins that hold the machine (man chipwise_guard says why both)."""
    try:
        halcmd('net', 'chipwise-stop', 'chipwise-guard.0.stop', 'motion.feed-inhibit', 'motion.feed-hold')
    except CycleError as error:
        raise CycleError(error.problem, 'where your own HAL files use motion.feed-inhibit or motion.feed-hold, let an or2 '
                         'join them and chipwise-guard.0.stop there, and set [CHIPWISE]GUARD_RAPID = no and '
                         'GUARD_FLUTE = no') from error
