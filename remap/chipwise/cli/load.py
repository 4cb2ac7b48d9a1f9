# SPDX-License-Identifier: GPL-2.0-or-later
"""Load the realtime components with the settings of the INI file.

Called by hal/chipwise.hal while LinuxCNC starts (`loadusr -w chipwise load`), which sets
INI_FILE_NAME.  A setting that cannot be used ends it with a message and exit status 1, and LinuxCNC
does not start: a map of another size than the one asked for would be worse.

`chipwise load --check` only compares the components with the programs and with LinuxCNC; the Debian package does so
when LinuxCNC's folder of modules has changed.
"""

import ctypes
import math
import os
import pwd
import subprocess
import sys

from chipwise import ROOT, version
from chipwise.cli.python_section import check_codes, check_includes
from chipwise.cli.start_window import open_window
from chipwise.host.clock import monitor_patience, patience
from chipwise.errors import NAME as NAMED, CycleError, braceless, printable, unnamed
from chipwise.host.fit import check_fit, linuxcnc_version
from chipwise.host.halcmd import halcmd, halcmds, pins, signal_of, thread_functions
from chipwise.ini import Ini, file_name, limits_jerk
from chipwise.host.processes import is_ours, shared_memory
from chipwise.monitor.start_line import forgetful
from chipwise.settings import LOAD_ACTIONS, load_settings
from chipwise.clib.layout import STOCK_MAGIC, Cell
from chipwise.clib.work_trial import choose
from chipwise.tool_data.table import diameters
from chipwise.tool_data.geometry import ToolGeometry, load_tools

NAME = "load"
HELP = "load the HAL components (called by chipwise.hal)"

BYTES_PER_CELL = ctypes.sizeof(Cell)
# machine units/s2: LinuxCNC's for an axis without one, whatever [TRAJ] and the joint have (emccfg.h, 2.9 and 2.10)
AXIS_ACCELERATION = 1.0
NOTICE_S = 0.5  # that a traverse waits for the shape of a new tool until a message says so
MONITOR_TIMEOUT_S = 5.0  # without a heartbeat of chipwise-monitor until fault 16
TOOL_NUMBER = "iocontrol.0.tool-number"
# Cells across a tool: with more, a period takes more than 10 us on average.  A round end lowers all cells in front of
# it, a flat one those at its rim.
CELLS_ACROSS_FLAT, CELLS_ACROSS_ROUND = 90.0, 48.0
SHARE_OF_MEMORY = 0.25  # of the machine's memory, at most, for the map


def add_arguments(parser):
    parser.add_argument(
        "--check", action="store_true", help="only say whether components, programs and LinuxCNC belong together"
    )
    parser.add_argument(
        "--folder", action="store_true", help="only say if the folder of the INI file cannot be written"
    )


def planner_acceleration(ini):
    """Smallest acceleration the planner may use in a straight move, machine units/s2."""
    return min(ini.number("TRAJ", "MAX_LINEAR_ACCELERATION", math.inf), *axis_accelerations(ini).values())


def planner_jerk(ini):
    """Jerk limit of the planner, machine units/s3: [TRAJ]MAX_LINEAR_JERK where the planner limits it (LinuxCNC 2.10),
    at most that of each axis; 0: no bound."""
    if not limits_jerk(ini.lines):
        return 0.0
    found = [ini.number("TRAJ", "MAX_LINEAR_JERK"), *(ini.number("AXIS_" + axis, "MAX_JERK") for axis in "XYZ")]
    return min((number for number in found if number), default=0.0)


def axis_accelerations(ini):
    """{axis: machine units/s2}: the deceleration of a traverse."""
    return {axis: ini.number("AXIS_" + axis.upper(), "MAX_ACCELERATION", AXIS_ACCELERATION) for axis in "xyz"}


def check_memory(settings):
    """Raise CycleError for a map of more than SHARE_OF_MEMORY."""
    size_x, size_y = settings["MAP_SIZE"]
    cell = settings["CELL"]
    wanted = (size_x / cell + 2) * (size_y / cell + 2) * BYTES_PER_CELL
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if wanted > SHARE_OF_MEMORY * memory:
        raise CycleError(
            f"the map needs {wanted / 2**20:.0f} MiB ([CHIPWISE]MAP_SIZE = {size_x:g} {size_y:g} mm, "
            f"CELL = {cell:g} mm), more than a quarter of the {memory / 2**20:.0f} MiB of this machine",
            "use larger cells or a smaller map",
        )


def check_map_key():
    """Raise CycleError if another user or program has the memory under the map's key.  stock_tracker refuses it as
    well, but rtapi_app prints its reason for itself, lines before the end of what LinuxCNC says."""
    try:
        blocks = shared_memory()
    except OSError:
        return
    for block in blocks:
        if block["key"] == STOCK_MAGIC and not is_ours(block):
            try:
                owner = pwd.getpwuid(block["uid"]).pw_name
            except KeyError:
                owner = str(block["uid"])
            raise CycleError(
                f"the shared memory of the stock map belongs to user {braceless(owner)}, whose LinuxCNC runs or was "
                f"killed",
                f"end that LinuxCNC, then run `ipcrm -M {STOCK_MAGIC:#x}` as {braceless(owner)} or as root",
            )


def finest_cell(ini, settings, shapes):
    """mm, side of the cells of a small stock: FINEST_CELL, or larger for the tools of the tool table.

    shapes: {tool number: ToolGeometry}, None if it is not known.
    """

    def across(number):
        flat = shapes is not None and shapes.get(number, ToolGeometry()).shape == "flat"
        return CELLS_ACROSS_FLAT if flat else CELLS_ACROSS_ROUND

    units = ini.units_per_mm()
    needed = [diameter / units / across(number) for number, diameter in diameters(ini.tool_table())]
    return min(settings["CELL"], max(settings["FINEST_CELL"], *needed)) if needed else settings["CELL"]


def work_of(ini, settings):
    """Per cent of the stock model's work in a servo period: WORK, else what this computer has time for; less than all
    is said."""
    percent = settings["WORK"] or choose(ini.servo_period_s())
    if percent < 100:
        print(
            f"chipwise: a servo period does {percent} % of the stock model's work"
            + (
                " ([CHIPWISE]WORK)"
                if settings["WORK"]
                else ": this computer has no time for more; set [EMCMOT]SERVO_PERIOD longer for all of it"
            ),
            flush=True,
        )
    return percent


def tool_shapes(settings):
    """{tool number: ToolGeometry}; None where the file cannot be used: who needs a tool of it says why."""
    try:
        return load_tools(settings.path("TOOL_GEOMETRY"))
    except CycleError:
        return None


def user_of(signal):
    """-> "signal NAME of PIN": who writes it, else who reads it."""
    members = sorted(
        (arrow != "==>", pin)
        for pin, (arrow, name) in pins().items()
        if name == signal and not pin.startswith("motion.")
    )
    return f"signal {signal}" + (f" of {members[0][1]}" if members else "")


def max_feed_override(ini):
    """[DISPLAY]MAX_FEED_OVERRIDE; 1 is LinuxCNC's default."""
    return ini.number("DISPLAY", "MAX_FEED_OVERRIDE", 1.0)


def feed_parameters(ini, settings, units, acceleration):
    """{parameter of volumetric_feed: value}; feeds mm/min -> machine units/s."""
    return {
        "units-per-mm": units,
        "acceleration": acceleration,
        "min-vel": settings["MIN_FEED"] / 60 * units,
        "max-vel": settings["MAX_FEED"] / 60 * units,
        "min-scale": settings["MIN_FEED_SHARE"],
        "max-scale": settings["MAX_FEED_SHARE"],
        "air-vel": settings["AIR_FEED"] / 60 * units,
        "plunge-vel": settings["PLUNGE_FEED"] / 60 * units,
        "max-chip-thickness": settings["MAX_CHIP"],
        "max-torque": settings["SPINDLE_TORQUE"],
        "spindle-load-scale": settings["SPINDLE_LOAD_SCALE"],
        "recover-accel": settings["RECOVERY"] * units,
        "deadband": settings["DEADBAND"],
        "max-jerk": planner_jerk(ini),
        "max-override": max_feed_override(ini),
    }


def tap(source, signal, copy, *targets):
    """Connect `targets` to the signal of `source`; if it has none, to `copy`, which leaves `source` free."""
    found = signal_of(source)
    halcmd(*(("net", found) if found else ("net", signal, copy)), *targets)


def check_machine(ini):
    """Raise CycleError for a machine that chipwise cannot work on, or whose HAL is not ready."""
    if "plasmac" in ini.text("DISPLAY", "DISPLAY") or ini.section("PLASMAC") or pins("plasmac."):
        raise CycleError(
            "this is a plasma machine, on which plasmac sets motion.adaptive-feed",
            "remove chipwise's lines from this INI file",
        )
    coordinates = ini.text("TRAJ", "COORDINATES", "X Y Z").upper()  # motion has pins of every axis
    for axis in "XYZ":
        if axis not in coordinates:
            raise CycleError(
                f"this machine has no {axis} axis ([TRAJ]COORDINATES = {braceless(coordinates)}), "
                "and chipwise is for mills with X, Y and Z",
                "remove chipwise's lines from this INI file",
            )
    if "motion-controller" not in thread_functions():
        if ini.text("HAL", "TWOPASS"):
            raise CycleError(
                "[HAL]TWOPASS is set, and chipwise.hal cannot be run in two passes",
                f"let the screen run it: POSTGUI_HALFILE = {braceless(ROOT)}/hal/chipwise.hal in place of "
                "HALFILE = chipwise.hal",
            )
        raise CycleError(
            "motion-controller is not in a thread yet", "put HALFILE = chipwise.hal after your machine's own HAL files"
        )


def check_free(settings):
    """Raise CycleError if a pin of motion that chipwise needs for itself is in use or missing."""
    signal = signal_of("motion.adaptive-feed")
    if signal:
        raise CycleError(
            f"motion.adaptive-feed is in use ({user_of(signal)}), and chipwise sets the feed with it",
            "disconnect it in your HAL files, or, on a plasma machine, remove chipwise's lines from this INI file",
        )
    for key, kind, number, count in (
        ("ANALOG_OUT", "motion.analog-out-", settings["ANALOG_OUT"], 3),
        ("ANALOG_IN", "motion.analog-in-", settings["ANALOG_IN"], 1),
    ):
        check_analog(key, kind, number, count)


def check_analog(key, kind, number, count):
    """Raise CycleError, with the pins that are free, unless `count` analog pins from `number` on exist and are free."""
    present = pins(kind)
    free = {int(pin.removeprefix(kind)) for pin, (_arrow, signal) in present.items() if not signal}
    wanted = range(number, number + count)
    if free.issuperset(wanted):
        return
    first = [n for n in sorted(free) if free.issuperset(range(n, n + count))]
    remedy = (
        f"set [CHIPWISE]{key} = {first[0]}"
        if first
        else f"load motmod with num_aio={len(present) + count} and set [CHIPWISE]{key} = {len(present)}"
    )
    for n in wanted:
        pin = f"{kind}{n:02d}"
        if pin not in present:
            raise CycleError(
                f"[CHIPWISE]{key} = {number}: there is no {pin}, motion has {len(present)} of them", remedy
            )
        if n not in free:
            raise CycleError(f"{pin} is in use ({user_of(present[pin][1])})", remedy)


def watch_the_tool():
    """Connect the machine's own tool number, which changes at the moment of a tool change."""
    if pins(TOOL_NUMBER):
        tap(
            TOOL_NUMBER,
            "chipwise-tool-in-spindle",
            "chipwise-inputs.0.tool-number",
            "stock-tracker.0.tool-in-spindle",
            "chipwise-guard.0.tool-in-spindle",
        )
    else:
        print(
            f"chipwise: there is no {TOOL_NUMBER}, so a tool change while chipwise-monitor is stopped is noticed after "
            f"{MONITOR_TIMEOUT_S:g} s",
            flush=True,
        )


def run(options):
    """-> exit status; everything the components need that depends on a setting."""
    from chipwise.options.machine import CommandError

    try:
        check_folder(file_name())
        if options.folder:
            return
        check_fit()
        if options.check:
            print(f"chipwise {version()}: the components fit LinuxCNC {linuxcnc_version()}")
            return
        load(Ini(), load_settings())
    except (CycleError, ValueError) as error:
        raise CommandError(unnamed(error)) from error


def check_folder(ini):
    """Say, before anything else, if nothing can be written beside the INI file: LinuxCNC forgets the work offsets
    without a word then, and gmoccapy ends."""
    text = ini and forgetful(os.path.dirname(os.path.abspath(ini)))
    if text:
        print(printable(NAMED + text), flush=True)
        open_window(text)


def load(ini, settings):
    """Check settings, machine and HAL, then load and connect the components.  Raises CycleError."""
    check_memory(settings)
    acceleration = planner_acceleration(ini)
    check_codes(ini)
    check_machine(ini)
    check_includes(ini)
    check_free(settings)
    check_map_key()
    halcmds(*_loaded(ini, settings), *_parameters(ini, settings, acceleration), *_connections(settings))
    watch_the_tool()
    join("motion.feed-inhibit", "chipwise-guard.0.inhibit", "chipwise-feed-inhibit")
    join("motion.feed-hold", "chipwise-guard.0.hold", "chipwise-feed-hold")
    if settings["PANEL"]:
        start_panel()


def start_panel():
    """The page of `chipwise panel`, a process of its own: LinuxCNC starts and runs without it as well."""
    try:
        subprocess.Popen([sys.executable, os.path.join(ROOT, "bin", "chipwise"), "panel"], stdin=subprocess.DEVNULL)
    except OSError as error:
        print(f"chipwise: the panel cannot be started: {error.strerror}", flush=True)


def join(pin, ours, signal):
    """Put one of motion's input pins under `ours`; the signal it was connected to goes to `ours`-in.

    pin, ours: bit pins; ours includes its -in.
    """
    theirs = signal_of(pin)
    if theirs:
        halcmd("unlinkp", pin)
        halcmd("net", theirs, ours + "-in")
    halcmd("net", signal, ours, pin)


def _loaded(ini, settings):
    """Commands of HAL that load the components."""
    size_x, size_y = settings["MAP_SIZE"]
    return [
        ("loadrt", "chipwise_inputs"),
        ("loadrt", "chipwise_command"),
        (
            "loadrt",
            "stock_tracker",
            f"cell={settings['CELL']:.9g}",
            f"finest_cell={finest_cell(ini, settings, tool_shapes(settings)):.9g}",
            f"size_x={size_x:.9g}",
            f"size_y={size_y:.9g}",
            f"work={work_of(ini, settings)}",
        ),
        ("loadrt", "volumetric_feed"),
        ("loadrt", "chipwise_guard"),
    ]


def _parameters(ini, settings, acceleration):
    """Commands of HAL that set what settings and INI file say."""
    units = ini.units_per_mm()
    return [
        ("setp", "chipwise-guard.0.guard-rapid", f"{settings['GUARD_RAPID']:d}"),
        ("setp", "chipwise-guard.0.guard-flute", f"{settings['GUARD_FLUTE']:d}"),
        ("setp", "chipwise-guard.0.notice", f"{patience(NOTICE_S):g}"),
        ("setp", "stock-tracker.0.units-per-mm", f"{units:.17g}"),
        ("setp", "stock-tracker.0.monitor-timeout", f"{monitor_patience(MONITOR_TIMEOUT_S):g}"),
        ("setp", "stock-tracker.0.read-path", f"{settings['READ_PATH']:d}"),
        ("setp", "stock-tracker.0.acceleration", f"{acceleration:.9g}"),
        ("setp", "stock-tracker.0.air-clearance", f"{settings['AIR_CLEARANCE'] * units:.9g}"),
        ("setp", "stock-tracker.0.feed-output", f"{settings['ANALOG_OUT'] + 2}"),
        ("setp", "stock-tracker.0.max-jerk", f"{planner_jerk(ini):.9g}"),
        ("setp", "volumetric-feed.0.load-action", f"{LOAD_ACTIONS.index(settings['SPINDLE_LOAD_ACTION'])}"),
        *(
            ("setp", f"volumetric-feed.0.{name}", f"{value:.17g}")
            for name, value in feed_parameters(ini, settings, units, acceleration).items()
        ),
        *(
            ("setp", f"stock-tracker.0.acceleration-{axis}", f"{value:.9g}")
            for axis, value in axis_accelerations(ini).items()
        ),
    ]


def _connections(settings):
    """Commands of HAL that connect the components with motion's analog pins."""
    first, status = settings["ANALOG_OUT"], settings["ANALOG_IN"]
    return [
        ("net", "chipwise-word", f"motion.analog-out-{first:02d}", "chipwise-command.0.word"),
        ("net", "chipwise-value", f"motion.analog-out-{first + 1:02d}", "chipwise-command.0.value"),
        (
            "net",
            "chipwise-programmed",
            f"motion.analog-out-{first + 2:02d}",
            "volumetric-feed.0.programmed-vel",
            "stock-tracker.0.programmed-vel",
        ),
        ("net", "chipwise-status", "chipwise-command.0.status", f"motion.analog-in-{status:02d}"),
    ]
