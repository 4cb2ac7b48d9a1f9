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
MONITOR_TIMEOUT_S = 5.0     # without a heartbeat of chipwise-monitor until fault 16
TOOL_NUMBER = 'iocontrol.0.tool-number'
SHARE_OF_MEMORY = 0.25      # of the machine's memory, at most, for the map


def add_arguments(parser):
    del parser


def ini_section(name, path=None):
    """{KEY: text} of a section of an INI file; without a path: the one LinuxCNC runs with."""
    with open(path or os.environ['INI_FILE_NAME'], encoding='utf-8', errors='replace') as ini:
        return read_section(ini, name)


def units_per_mm(path=None):
    """[TRAJ]LINEAR_UNITS as machine units per mm."""
    text = ini_section('TRAJ', path).get('LINEAR_UNITS', 'mm').lower()
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
    """One halcmd command; -> what it printed.  Raises CycleError with what it said."""
    done = subprocess.run(['halcmd', *words], text=True, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        said = done.stdout.strip().replace('{', '{{').replace('}', '}}')
        raise CycleError(f'halcmd {" ".join(words)}: {said}', 'see the lines above')
    return done.stdout


def signal_of(pin):
    """-> name of the signal a pin is on, "" where it is on none."""
    for line in halcmd('-s', 'show', 'pin', pin).splitlines():
        words = line.split()
        if len(words) >= 7 and words[4] == pin:
            return words[6]
    return ''


def tap(source, signal, target):
    """Connect one of LinuxCNC's output pins to `target`, by the signal it is on already, else by `signal`."""
    found = signal_of(source)
    halcmd(*(('net', found, target) if found else ('net', signal, source, target)))


def max_feed_override():
    """[DISPLAY]MAX_FEED_OVERRIDE, 1 where it is missing, as LinuxCNC has it."""
    return float(ini_section('DISPLAY').get('MAX_FEED_OVERRIDE', '1'))


def feed_parameters(settings, units, acceleration):
    """{parameter of volumetric_feed: value}; feeds mm/min -> machine units/s."""
    return {
        'units-per-mm': units,
        'acceleration': acceleration,
        'min-vel': settings['MIN_FEED'] / 60 * units,
        'max-vel': settings['MAX_FEED'] / 60 * units,
        'min-scale': settings['MIN_FEED_SHARE'],
        'max-scale': settings['MAX_FEED_SHARE'],
        'air-vel': settings['AIR_FEED'] / 60 * units,
        'plunge-vel': settings['PLUNGE_FEED'] / 60 * units,
        'max-chip-thickness': settings['MAX_CHIP'],
        'recover-accel': settings['RECOVERY'] * units,
        'deadband': settings['DEADBAND'],
        'max-override': max_feed_override()}


def watch_the_machine(settings):
    """What volumetric_feed has to know of motion and spindle."""
    tap('motion.current-vel', 'chipwise-velocity', 'volumetric-feed.0.current-vel')
    if signal_of('spindle.0.index-enable'):     # without an encoder nothing follows the spindle
        tap('spindle.0.index-enable', '', 'volumetric-feed.0.index-enable')
    if settings['MAX_CHIP']:
        tap('spindle.0.speed-out-rps', 'chipwise-spindle-speed', 'volumetric-feed.0.spindle-speed')


def watch_the_tool():
    """The machine's own number of the tool, which it changes in the moment of the change."""
    if halcmd('-s', 'show', 'pin', TOOL_NUMBER).split():
        tap(TOOL_NUMBER, 'chipwise-tool-in-spindle', 'stock-tracker.0.tool-in-spindle')
    else:
        print(f'chipwise: there is no {TOOL_NUMBER}: a tool change that chipwise-monitor does not see is noticed after '
              f'{MONITOR_TIMEOUT_S:g} s only', flush=True)


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
            ('setp', 'stock-tracker.0.monitor-timeout', f'{MONITOR_TIMEOUT_S:g}'),
            ('setp', 'stock-tracker.0.read-path', f"{settings['READ_PATH']:d}"),
            ('setp', 'stock-tracker.0.acceleration', f'{acceleration:.9g}'),
            *(('setp', f'volumetric-feed.0.{name}', f'{value:.17g}')
              for name, value in feed_parameters(settings, units, acceleration).items()),
            *(('setp', f'stock-tracker.0.acceleration-{axis}', f'{value:.9g}')
              for axis, value in axis_accelerations().items()),
            ('net', 'chipwise-word', f'motion.analog-out-{first:02d}', 'chipwise-command.0.word'),
            ('net', 'chipwise-value', f'motion.analog-out-{first + 1:02d}',
             'chipwise-command.0.value'),
            ('net', 'chipwise-programmed', f'motion.analog-out-{first + 2:02d}',
             'volumetric-feed.0.programmed-vel'),
            ('net', 'chipwise-status', 'chipwise-command.0.status', f'motion.analog-in-{status:02d}')):
        halcmd(*words)
    watch_the_machine(settings)
    watch_the_tool()
    connect_stop(settings['GUARD_RAPID'] or settings['GUARD_FLUTE'])


def connect_stop(needed):
    """The guards' stop to both pins that hold the machine (man chipwise_guard says why both).

    needed: a guard is on; without them only a machine that does not obey would be stopped, and it is aborted too.
    """
    taken = [pin for pin in ('motion.feed-inhibit', 'motion.feed-hold') if signal_of(pin)]
    if taken and needed:
        raise CycleError(f'{" and ".join(taken)} is in use and the guards could not stop the machine',
                         'let an or2 join your signal and chipwise-guard.0.stop there in your own HAL files after '
                         'chipwise.hal, and set [CHIPWISE]GUARD_RAPID = no and GUARD_FLUTE = no')
    if not taken:
        halcmd('net', 'chipwise-stop', 'chipwise-guard.0.stop', 'motion.feed-inhibit', 'motion.feed-hold')
