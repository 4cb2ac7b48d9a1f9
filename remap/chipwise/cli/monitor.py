"""Tell the realtime components the tool, and the operator what they found.

Called by hal/chipwise.hal (`loadusr -Wn chipwise-monitor chipwise monitor`); a HAL component of
its own that runs as long as LinuxCNC does.  The tool in the spindle comes from LinuxCNC's status,
its shape from the file [CHIPWISE]TOOL_GEOMETRY; a change of either is seen within POLL_S.  What a guard stopped is
told here, and cli/keeper.py, which runs here too, saves and restores the stock.

It is two processes (cli/supervise.py): one owns the pins, the other does the work and is replaced where it dies.  Trouble in
one part of the work is told and leaves the others going.  `heartbeat` counts with every look and `tool-followed` is the machine's
own tool number as of the last look: by them the stock tracker notices that it is late, stopped or dead (core/tool_watch.h).
Where both processes have died `chipwise monitor` starts others (cli/heir.py).
"""

import os
import signal
import threading
import time
from contextlib import contextmanager

from chipwise.cli import heir, load
from chipwise.cli.keeper import Keeper
from chipwise.cli.loaded import LoadedProgram
from chipwise.cli.supervise import Supervisor
from chipwise.clock import patience
from chipwise.errors import CycleError
from chipwise.files import printable
from chipwise.settings import feed_is_remapped, load_settings
from chipwise.tools import tool_geometry

NAME = 'monitor'
HELP = 'keep the HAL components informed (called by chipwise.hal)'

COMPONENT = 'chipwise-monitor'
POLL_S = 0.02
FALLBACK = 5            # volumetric-feed.0.limited-by
SETTLE_S = 0.1          # a fallback shorter than this is not worth a message
DIFFER_S = 1.0          # HAL and status name different tools for longer than they take to agree: it stays so
REPEAT_S = 30.0         # trouble of the same part is told this often at most
LONGEST_FILE_S = 300.0  # work on a file may take this long without being taken for a monitor that hangs
MOST_BEATS = 1 << 30

FAULTS = {              # stock-tracker.0.fault-code (man stock_tracker)
    1: 'the stock box has a corner that is not a number; define it again with M250',
    2: 'the stock box has no extent in X, Y or Z; give M250 a size above 0',
    3: 'the stock is larger than the map; enlarge [CHIPWISE]MAP_SIZE or its CELL, or use a smaller '
       'box; the stock is what it was before',
    4: 'the stock was not restored to its end, the machine went on meanwhile, or another program has written into it: it is not known any more; define it '
       'with M250 or restore it with M254',
    11: 'the tool in the spindle has no diameter from 0.001 to 2000 mm; load a tool or give it a D in the tool table',
    12: 'the corner radius of the tool is larger than the tool; correct the tool geometry file',
    13: 'the tip angle of the tool is neither 0 nor from 0.1 to below 180 degrees; correct the tool geometry file',
    14: 'the flute length of the tool is not from 0 to 10000 mm; correct the tool geometry file',
    15: 'the tool in the spindle is not known: chipwise-monitor does not follow it; see the log and start `chipwise monitor`',
    16: 'chipwise-monitor does not answer; start `chipwise monitor` in a shell',
    20: 'an axis position is not a number; define the stock again with M250',
    21: 'an axis position jumped, the stock is not known any more; define it again with M250',
    22: 'units-per-mm is not from 0.001 to 1000; see docs/Config.md',
    23: 'an axis beside X Y Z (A, B, C, U, V or W) has moved since the stock was defined, and the map shows the stock as '
        'it was: the feed is F, the guards are off; define the stock again with M250'}

TOOL_FAULTS = (11, 12, 13, 14, 15, 16)
FEED_MOTION = (2, 3)    # motion type of a feed move and an arc
DISOBEYED = ('the machine does not obey the volumetric feed and would go at its ceiling: adaptive feed is disabled '
             '(M52 P0); the program is aborted; switch off with M252 before M52 P0')

RAPID_CONTACT, FLUTE_EXCESS = 1, 2       # chipwise-guard.0.reason; 3 is told by follow_override
WAY_OUT = 'press Stop, then jog away'


def add_arguments(parser):
    del parser


class Tool:
    """The tool in the spindle for the pins: machine units and degrees, mm3/min; 0: unknown."""

    def __init__(self, diameter=0.0, corner_radius=0.0, tip_angle=0.0, flute_length=0.0, flutes=0, max_rate=0.0):
        self.diameter = diameter
        self.corner_radius = corner_radius
        self.tip_angle = tip_angle
        self.flute_length = flute_length
        self.flutes = flutes
        self.max_rate = max_rate


def tool_shape(number, diameter, path, units):
    """Tool for the pins: number and diameter (machine units) of LinuxCNC, the rest from the file
    `path`, whose lengths are mm; `units`: machine units per mm.  Raises CycleError."""
    if number <= 0 or not diameter > 0:
        return Tool()
    geometry = tool_geometry(path, number)
    if geometry is None:
        return Tool(diameter)
    corner = {'ball': diameter / 2, 'bull': (geometry.corner_radius or 0.0) * units,
              'tapered-ball': (geometry.corner_radius or 0.0) * units}.get(geometry.shape, 0.0)
    tip = geometry.tip_angle if geometry.shape in ('vee', 'tapered-ball') else 0.0
    return Tool(diameter, corner, tip or 0.0, (geometry.flute_length or 0.0) * units, geometry.flutes or 0,
                geometry.max_removal_rate or 0.0)


class Monitor:
    """One LinuxCNC, watched."""

    def __init__(self, component, settings, died=''):
        """died: how the one before has ended, '' for the first one."""
        import linuxcnc
        self.linuxcnc = linuxcnc
        self.component = component
        self.settings = settings
        self.status = self.command = None
        self.units = 1.0
        self.said_fault = 0
        self.fallback_since = None
        self.said_fallback = False
        self.said_disobeyed = False
        self.said_tool = None
        self.noted_tool = None
        self.said_guard = 0
        self.guard_depth = None                 # of the last look, during a flute excess
        self.machine_tool = 0                   # iocontrol.0.tool-number, before the last look at the status
        self.differ_since = None                # HAL and status name different tools
        self.told_trouble = {}                  # part of the work: (text, time.monotonic()) of the last message
        self.died = died
        self.keeper = Keeper(component, settings, self.say, self.working)
        self.loaded = LoadedProgram(self.tell, feed_is_remapped())

    def connect(self):
        """True when LinuxCNC's task answers; it starts after HAL."""
        if self.status is None:
            try:
                status = self.linuxcnc.stat()
                status.poll()
                command = self.linuxcnc.command()
            except self.linuxcnc.error:
                return False
            self.status, self.command = status, command
        try:
            self.status.poll()
        except self.linuxcnc.error:
            return False
        self.units = self.status.linear_units or 1.0
        return True

    def say(self, text):
        """An error message on the operator's screen, in the log where there is none."""
        text = printable(f'chipwise: {text}')
        print(text, flush=True)
        if self.command:
            self.command.error_msg(text[:250])

    def follow_run(self, _now):
        """Whether a program runs, also while it is paused; MDI is none."""
        status = self.status
        self.component['program-running'] = (status.task_mode == self.linuxcnc.MODE_AUTO
                                             and status.interp_state != self.linuxcnc.INTERP_IDLE)

    def tell(self, text):
        """A message on the operator's screen that is no error."""
        self.command.text_msg(f'chipwise: {text}'[:250])

    def beat(self):
        self.component['heartbeat'] = (self.component['heartbeat'] + 1) % MOST_BEATS

    @contextmanager
    def working(self):
        """The heart beats on while a file is worked on, for LONGEST_FILE_S at most."""
        done = threading.Event()

        def keep_beating():
            end = time.monotonic() + LONGEST_FILE_S
            while not done.is_set() and time.monotonic() < end:
                self.beat()
                time.sleep(POLL_S)      # libfaketime does not know the clock of done.wait(POLL_S)
        thread = threading.Thread(target=keep_beating, daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()

    def acknowledge_tool(self, machine_tool, number, now):
        """The machine's own number of the tool, as it was before the status was read, -> tool-followed, once the status names
        the same tool: it comes some ms later.  Two numbers that keep differing are a peculiarity of the machine."""
        if machine_tool == number:
            self.differ_since = None
        elif self.differ_since is None or self.differ_since[0] != (machine_tool, number):
            self.differ_since = (machine_tool, number), now
        if self.differ_since is None or now - self.differ_since[1] > patience(DIFFER_S):
            self.component['tool-followed'] = machine_tool

    def follow_tool(self, now):
        """Tool in the spindle -> pins; whatever goes wrong, it is an unknown one."""
        try:
            self.describe_tool()
        except Exception:
            self.show_tool(self.status.tool_in_spindle, Tool())
            raise
        finally:
            self.acknowledge_tool(self.machine_tool, self.status.tool_in_spindle, now)

    def describe_tool(self):
        """Tool in the spindle -> pins; what is wrong with its description is said once."""
        tool = self.status.tool_table[0]
        number = self.status.tool_in_spindle
        path = self.settings.path('TOOL_GEOMETRY')
        try:
            shape = tool_shape(number, tool.diameter, path, self.units)
            self.said_tool = None
            self.note_unknown_tool(number, path)
        except CycleError as error:
            shape = Tool()
            if self.said_tool != str(error):
                self.said_tool = str(error)
                self.say(str(error).removeprefix('chipwise: ')
                         + '; the volumetric feed leaves F as programmed')
        self.show_tool(number, shape)

    def show_tool(self, number, shape):
        pins = self.component
        pins['tool-number'] = number
        pins['tool-corner-radius'] = shape.corner_radius
        pins['tool-tip-angle'] = shape.tip_angle
        pins['tool-flute-length'] = shape.flute_length
        pins['tool-flutes'] = shape.flutes
        pins['tool-max-rate'] = shape.max_rate
        pins['tool-diameter'] = shape.diameter

    def note_unknown_tool(self, number, path):
        """A tool the geometry file does not name is taken for a flat one: said once per change, no error."""
        unknown = bool(path) and number > 0 and tool_geometry(path, number) is None
        if unknown and self.noted_tool != number:
            self.tell(f'{os.path.basename(path)}: tool {number} is not named: taken as a flat end mill of unknown flute '
                      f'length; add [tool.{number}] where that is wrong')
        self.noted_tool = number if unknown else None

    def falling_back(self, now):
        """Whether the feed has fallen back to F for SETTLE_S: a tool may be missing until then."""
        if self.component['limited-by'] != FALLBACK:
            self.fallback_since = None
        elif self.fallback_since is None:
            self.fallback_since = now
        return self.fallback_since is not None and now - self.fallback_since > SETTLE_S

    def follow_faults(self, now):
        """Faults and fallbacks -> messages, each once.  A missing tool matters when it should cut."""
        code = self.component['fault-code'] if self.component['fault'] else 0
        falling_back = self.falling_back(now)
        if code in TOOL_FAULTS and not falling_back and code != self.said_fault:
            return
        if code and code != self.said_fault and self.said_tool is None:
            self.say(FAULTS.get(code, f'fault {code} of the stock tracker'))
        self.said_fault = code
        if falling_back and not code and not self.component['ready'] and not self.said_fallback:
            self.say('no stock is known: the volumetric feed leaves F as programmed; define it with M250')
        self.said_fallback = falling_back

    def adaptive_feed_is_off(self):
        """Whether the machine cuts with F replaced by the ceiling and no override: one snapshot of the status, so
        that the move, the ceiling and the override belong together."""
        status = self.status
        programmed = status.aout[self.settings['ANALOG_OUT'] + 2]       # above 0 while F is replaced
        return status.motion_type in FEED_MOTION and programmed > 0 and not status.adaptive_feed_enabled

    def follow_override(self, _now):
        """Adaptive feed disabled -> pin; disobedience -> message once, and the program is aborted: feed-inhibit has
        no effect while the spindle override is disabled (M49, M51 P0; LinuxCNC 2.9, motion/control.c)."""
        self.component['adaptive-off'] = self.adaptive_feed_is_off()
        self.component['feed-override'] = self.status.feedrate if self.status.feed_override_enabled else 1.0
        disobeyed = self.component['disobeyed']
        if disobeyed and not self.said_disobeyed:
            self.command.abort()
            self.say(DISOBEYED)
        self.said_disobeyed = disobeyed

    def follow_guard(self, _now):
        """A stop by a guard -> one message with line and tool; of the flutes when the depth, which is seen in full only
        as the tool goes on into the stock, has not grown since the last look."""
        reason, depth, before = self.component['guard-reason'], self.component['guard-depth'], self.guard_depth
        self.guard_depth = depth if reason == FLUTE_EXCESS else None
        if reason == FLUTE_EXCESS and depth != before and reason != self.said_guard:
            return
        if reason in (RAPID_CONTACT, FLUTE_EXCESS) and reason != self.said_guard:    # the third: follow_override
            self.say(guard_text(reason, self.component['guard-line'], self.component['guard-distance'],
                                self.component['guard-depth'], self.component['tool-number'],
                                self.component['tool-diameter'], self.component['tool-flute-length'],
                                'mm' if self.units > 0.5 else 'in'))
        self.said_guard = reason

    def tell_death(self, _now):
        """The one before has died: the operator hears of it from the next."""
        if self.died:
            died, self.died = self.died, ''
            self.say(f'chipwise-monitor {died} and was started again; it follows the tool again, a guard or M253, M254 may have '
                     'missed a message')

    def trouble(self, part, error, now):
        """One part of the work has failed: told, and not again and again."""
        text = f'{type(error).__name__}: {error}'
        before, told = self.told_trouble.get(part, ('', -REPEAT_S))
        if now - told < REPEAT_S:
            return
        self.told_trouble[part] = text, now
        try:
            self.say(f'chipwise-monitor cannot {part}: {text}; it goes on with the rest')
        except Exception as second:             # the screen is gone: the log is there
            print(printable(f'chipwise: {second}'), flush=True)

    def follow_program(self, _now):
        self.loaded.follow(self.status.file)

    def step(self):
        self.machine_tool = self.component['tool-in-spindle']       # before the status, which follows it
        if self.connect():
            for part, work in (('tell of its start', self.tell_death), ('follow the run', self.follow_run),
                               ('watch the override', self.follow_override),
                               ('follow the tool', self.follow_tool), ('tell what a guard stopped', self.follow_guard),
                               ('tell faults', self.follow_faults), ('look at the program', self.follow_program),
                               ('save and restore the stock', self.keeper.step)):
                now = time.monotonic()
                try:
                    work(now)
                except Exception as error:      # of one part: the others go on
                    self.trouble(part, error, now)
        self.beat()


def guard_text(reason, line, distance, depth, tool, diameter, flute, unit):
    """The operator's message for a stop; lengths in machine units, `unit` their name."""
    digits = 4 if unit == 'in' else 2
    where = f'line {line}' if line > 0 else 'MDI'
    who = f'tool {tool} ({diameter:.{digits}f} {unit})'
    if reason == RAPID_CONTACT:
        return (f'{where}: {who} would have met stock {distance:.{digits}f} {unit} on in this traverse and was stopped; '
                f'{WAY_OUT}, and let the program retract higher ([CHIPWISE]GUARD_RAPID = no: no such guard)')
    return (f'{where}: {who} cuts at least {max(depth, flute):.{digits}f} {unit} deep, its flutes are {flute:.{digits}f} {unit} long, and was '
            f'stopped; {WAY_OUT}, and cut in more passes ([CHIPWISE]GUARD_FLUTE = no: no such guard)')


def make_component():
    """(the component, whether it has taken the place of a dead one)."""
    import hal
    name, dead = heir.choose_name(COMPONENT)
    component = hal.component(name)
    for name in ('tool-diameter', 'tool-corner-radius', 'tool-tip-angle', 'tool-flute-length'):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    for name in ('tool-number', 'tool-followed', 'heartbeat'):
        component.newpin(name, hal.HAL_S32, hal.HAL_OUT)
    component.newpin('tool-max-rate', hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin('tool-flutes', hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin('adaptive-off', hal.HAL_BIT, hal.HAL_OUT)
    component.newpin('feed-override', hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin('program-running', hal.HAL_BIT, hal.HAL_OUT)
    component.newpin('reply', hal.HAL_S32, hal.HAL_OUT)
    component.newpin('hold', hal.HAL_BIT, hal.HAL_OUT)
    for name in ('ready', 'fault', 'disobeyed', 'held'):
        component.newpin(name, hal.HAL_BIT, hal.HAL_IN)
    for name in ('guard-distance', 'guard-depth'):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_IN)
    for name in ('fault-code', 'limited-by', 'mode', 'request', 'slot', 'guard-reason', 'guard-line', 'tool-in-spindle'):
        component.newpin(name, hal.HAL_S32, hal.HAL_IN)
    if dead:
        heir.take_over(component.getprefix(), dead)
    else:
        signal_there = load.signal_of('stock-tracker.0.tool-in-spindle')
        if signal_there:                        # the machine's own tool number, by whatever name
            load.halcmd('net', signal_there, component.getprefix() + '.tool-in-spindle')
    return component, bool(dead)


def leave(_number, _frame):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)      # the stock may have to be saved in peace
    raise SystemExit(0)


def run(options):
    """Runs until LinuxCNC ends it."""
    del options
    from chipwise.cli import CommandError
    import linuxcnc
    try:
        settings = load_settings(heir.ini_file(linuxcnc))
        if not load.pins('stock-tracker.0.'):
            raise CycleError('no stock tracker in HAL', 'start LinuxCNC with chipwise.hal first')
        component, inherited = make_component()
    except CycleError as error:
        raise CommandError(str(error).removeprefix('chipwise: ')) from error
    component.ready()
    try:
        Supervisor(lambda died: watch(component, settings, inherited, died), lambda: component['heartbeat']).run()
    finally:
        component.exit()


def watch(component, settings, inherited, died):
    """The work, in a process of its own.  inherited, died: it has taken the place of another one."""
    signal.signal(signal.SIGTERM, leave)
    monitor = Monitor(component, settings, died)
    if inherited or died:
        monitor.keeper.kept_is_due = False              # the stock is that of this run
        component['reply'] = component['hold'] = 0      # what the dead one has left there
    try:
        while True:
            monitor.step()
            time.sleep(POLL_S)
    finally:
        monitor.keeper.end()
