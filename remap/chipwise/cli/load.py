"""Load the realtime components with the settings of the INI file.

Called by hal/chipwise.hal while LinuxCNC starts (`loadusr -w chipwise load`), which sets
INI_FILE_NAME.  A setting that cannot be used ends it with a message and exit status 1, and
LinuxCNC does not start: better than to start with a map that is not what was asked for.
"""

import math
import os
import subprocess

from chipwise import ROOT
from chipwise.cli.python_section import check_codes
from chipwise.clock import patience
from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.settings import braceless, ini_file_name, ini_lines, load_settings, read_section

NAME = 'load'
HELP = 'load the HAL components (called by chipwise.hal)'

BYTES_PER_CELL = 8
MONITOR_TIMEOUT_S = 5.0     # without a heartbeat of chipwise-monitor until fault 16
TOOL_NUMBER = 'iocontrol.0.tool-number'
ARROWS = ('==>', '<==', '<=>')
SHARE_OF_MEMORY = 0.25      # of the machine's memory, at most, for the map


def add_arguments(parser):
    del parser


def ini_section(name, path=None):
    """{KEY: text} of a section of an INI file; without a path: the one LinuxCNC runs with.  Raises CycleError."""
    path = path or ini_file_name()
    if not path:
        raise CycleError('no INI file: this is called by chipwise.hal while LinuxCNC starts',
                         'put HALFILE = chipwise.hal into the [HAL] section of your INI file')
    try:
        return read_section(ini_lines(path), name)
    except OSError as error:
        raise CycleError(f'INI file {braceless(path)}: {error.strerror}', 'correct INI_FILE_NAME') from error


def ini_number(section, key, default=None, path=None):
    """A number above 0 of the INI file, `default` where it is missing.  Raises CycleError."""
    text = ini_section(section, path).get(key)
    if not text:
        return default
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise CycleError(f'[{section}]{key} = {braceless(text)} is not a number above 0', 'correct the INI file')
    return number


def units_per_mm(path=None):
    """[TRAJ]LINEAR_UNITS as machine units per mm."""
    text = ini_section('TRAJ', path).get('LINEAR_UNITS', 'mm').lower()
    known = {'mm': 1.0, 'metric': 1.0, 'in': 1 / MM_PER_INCH, 'inch': 1 / MM_PER_INCH,
             'imperial': 1 / MM_PER_INCH}
    return known[text] if text in known else ini_number('TRAJ', 'LINEAR_UNITS', path=path)


def planner_acceleration():
    """Smallest acceleration the planner may use in a straight move, machine units/s2."""
    found = [ini_number('TRAJ', 'MAX_LINEAR_ACCELERATION'), *axis_accelerations().values()]
    numbers = [number for number in found if number]
    if not numbers:
        raise CycleError('no acceleration in the INI file',
                         'set [TRAJ]MAX_LINEAR_ACCELERATION or [AXIS_X]MAX_ACCELERATION')
    return min(numbers)


def planner_jerk():
    """Jerk the planner keeps to, machine units/s3: [TRAJ]MAX_LINEAR_JERK with PLANNER_TYPE = 1 (LinuxCNC 2.10), and no axis
    above its own; 0: it does not bound the jerk."""
    if ini_section('TRAJ').get('PLANNER_TYPE', '').strip() != '1':
        return 0.0
    found = [ini_number('TRAJ', 'MAX_LINEAR_JERK'), *(ini_number('AXIS_' + axis, 'MAX_JERK') for axis in 'XYZ')]
    return min((number for number in found if number), default=0.0)


def axis_accelerations():
    """{axis: machine units/s2}, of those the INI file has; what a traverse brakes with."""
    found = {axis: ini_number('AXIS_' + axis.upper(), 'MAX_ACCELERATION') for axis in 'xyz'}
    return {axis: number for axis, number in found.items() if number}


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
        said = braceless(done.stdout.strip())
        raise CycleError(f'halcmd {" ".join(words)}: {said}', 'see the lines above')
    return done.stdout


def pins(start=''):
    """{pin: (arrow, signal)} of the pins in HAL whose names begin with `start`; ('', '') where one is on no signal."""
    found = {}
    for line in halcmd('-s', 'show', 'pin', *([start] if start else [])).splitlines():
        words = line.split()
        if len(words) >= 5:
            found[words[4]] = (words[5], words[6]) if len(words) >= 7 and words[5] in ARROWS else ('', '')
    return found


def signal_of(pin):
    """-> name of the signal a pin is on, "" where it is on none."""
    return pins(pin).get(pin, ('', ''))[1]


def user_of(signal):
    """-> "signal NAME of PIN": who writes it, else who reads it."""
    members = sorted((arrow != '==>', pin) for pin, (arrow, name) in pins().items()
                     if name == signal and not pin.startswith('motion.'))
    return f'signal {signal}' + (f' of {members[0][1]}' if members else '')


def max_feed_override():
    """[DISPLAY]MAX_FEED_OVERRIDE, 1 where it is missing, as LinuxCNC has it."""
    return ini_number('DISPLAY', 'MAX_FEED_OVERRIDE', 1.0)


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
        'max-jerk': planner_jerk(),
        'max-override': max_feed_override()}


def tap(source, signal, copy, target):
    """Connect `target` to the signal `source` is on; where it is on none, to `copy`, which leaves `source` free."""
    found = signal_of(source)
    halcmd(*(('net', found, target) if found else ('net', signal, copy, target)))


def check_machine():
    """Raise CycleError for a machine chipwise cannot work on, or not yet."""
    if 'plasmac' in ini_section('DISPLAY').get('DISPLAY', '') or ini_section('PLASMAC') or pins('plasmac.'):
        raise CycleError('this is a plasma machine: plasmac sets motion.adaptive-feed, and so would chipwise',
                         "take chipwise's lines out of this INI file again")
    coordinates = ini_section('TRAJ').get('COORDINATES', 'X Y Z').upper()     # motion has pins of every axis
    for axis in 'XYZ':
        if axis not in coordinates:
            raise CycleError(f'this machine has no {axis} axis ([TRAJ]COORDINATES = {braceless(coordinates)}), '
                             'and chipwise is for mills with X, Y and Z',
                             "take chipwise's lines out of this INI file again")
    if not any(line.split()[1:] == ['motion-controller'] for line in halcmd('show', 'thread').splitlines()):
        if ini_section('HAL').get('TWOPASS'):
            raise CycleError('[HAL]TWOPASS is set, and chipwise.hal cannot be run in two passes',
                             f'let the screen run it: POSTGUI_HALFILE = {braceless(ROOT)}/hal/chipwise.hal in place of '
                             'HALFILE = chipwise.hal')
        raise CycleError('motion-controller is not in a thread yet',
                         "put HALFILE = chipwise.hal after your machine's own HAL files")


def check_free(settings):
    """Raise CycleError where a pin of motion that must be chipwise's alone is in use, or there is no such pin."""
    signal = signal_of('motion.adaptive-feed')
    if signal:
        raise CycleError(f'motion.adaptive-feed is in use ({user_of(signal)}), and chipwise sets the feed with it',
                         'give it up in your HAL files; a plasma machine needs it for itself: take '
                         "chipwise's lines out of this INI file again")
    for key, kind, number, count in (('ANALOG_OUT', 'motion.analog-out-', settings['ANALOG_OUT'], 3),
                                     ('ANALOG_IN', 'motion.analog-in-', settings['ANALOG_IN'], 1)):
        check_analog(key, kind, number, count)


def check_analog(key, kind, number, count):
    """`count` analog pins from `number` on are there and free, else CycleError says which ones are."""
    present = pins(kind)
    free = {int(pin.removeprefix(kind)) for pin, (_arrow, signal) in present.items() if not signal}
    wanted = range(number, number + count)
    if free.issuperset(wanted):
        return
    first = [n for n in sorted(free) if free.issuperset(range(n, n + count))]
    remedy = (f'set [CHIPWISE]{key} = {first[0]}' if first else
              f'load motmod with num_aio={len(present) + count} and set [CHIPWISE]{key} = {len(present)}')
    for n in wanted:
        pin = f'{kind}{n:02d}'
        if pin not in present:
            raise CycleError(f'[CHIPWISE]{key} = {number}: there is no {pin}, motion has {len(present)} of them', remedy)
        if n not in free:
            raise CycleError(f'{pin} is in use ({user_of(present[pin][1])})', remedy)


def watch_the_tool():
    """The machine's own number of the tool, which it changes in the moment of the change."""
    if pins(TOOL_NUMBER):
        tap(TOOL_NUMBER, 'chipwise-tool-in-spindle', 'chipwise-inputs.0.tool-number', 'stock-tracker.0.tool-in-spindle')
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
    check_codes()
    check_machine()
    check_free(settings)
    first, status = settings['ANALOG_OUT'], settings['ANALOG_IN']
    for words in (
            ('loadrt', 'chipwise_inputs'),
            ('loadrt', 'chipwise_command'),
            ('loadrt', 'stock_tracker', f"cell={settings['CELL']:.9g}", f'size_x={size_x:.9g}',
             f'size_y={size_y:.9g}'),
            ('loadrt', 'volumetric_feed'),
            ('loadrt', 'chipwise_guard'),
            ('setp', 'chipwise-guard.0.guard-rapid', f"{settings['GUARD_RAPID']:d}"),
            ('setp', 'chipwise-guard.0.guard-flute', f"{settings['GUARD_FLUTE']:d}"),
            ('setp', 'stock-tracker.0.units-per-mm', f'{units:.17g}'),
            ('setp', 'stock-tracker.0.monitor-timeout', f'{patience(MONITOR_TIMEOUT_S):g}'),
            ('setp', 'stock-tracker.0.read-path', f"{settings['READ_PATH']:d}"),
            ('setp', 'stock-tracker.0.acceleration', f'{acceleration:.9g}'),
            ('setp', 'stock-tracker.0.max-jerk', f'{planner_jerk():.9g}'),
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
    watch_the_tool()
    join('motion.feed-inhibit', 'chipwise-guard.0.inhibit', 'chipwise-feed-inhibit')
    join('motion.feed-hold', 'chipwise-guard.0.hold', 'chipwise-feed-hold')


def join(pin, ours, signal):
    """Put one of motion's input pins under `ours`; what it was connected to before goes through `ours`-in.

    pin, ours: bit pins; ours passes its -in on.
    """
    theirs = signal_of(pin)
    if theirs:
        halcmd('unlinkp', pin)
        halcmd('net', theirs, ours + '-in')
    halcmd('net', signal, ours, pin)
