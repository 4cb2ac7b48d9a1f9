# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages of chipwise-monitor to the operator: faults of the stock tracker, stops by a guard, why the path ahead is
not known.

Called by worker.py and hints.py, and by panel/alarms.py.
"""

from dataclasses import dataclass

from chipwise.clib.layout import Fault, GuardReason, PathRefusal

FAULTS = {  # stock-tracker.0.fault-code (man stock_tracker)
    Fault.BOX_NOT_FINITE: "the stock box has a corner that is not a number, or 1000000 mm from machine zero; define it "
    "again with M250",
    Fault.BOX_EMPTY: "the stock box has less than 0.001 mm in X, Y or Z; give M250 a larger size",
    Fault.BOX_TOO_LARGE: "the stock is larger than the map and was not changed; enlarge [CHIPWISE]MAP_SIZE or CELL, or "
    "use a smaller box",
    Fault.MAP: "the stock map is incomplete (an interrupted restore, or another program wrote into it) and no longer "
    "valid; define the "
    "stock with M250 or restore it with M254",
    Fault.TOOL_DIAMETER: "the tool in the spindle has no diameter from 0.001 to 2000 mm; load a tool or give it a D in "
    "the tool table",
    Fault.TOOL_CORNER: "the corner radius of the tool is larger than the tool; correct the tool geometry file",
    Fault.TOOL_ANGLE: "the tip angle of the tool is neither 0 nor from 0.1 to below 180 degrees; correct the tool "
    "geometry file",
    Fault.TOOL_FLUTE: "the flute length of the tool is not from 0 to 10000 mm; correct the tool geometry file",
    Fault.TOOL_CHANGED: "the tool in the spindle is unknown because chipwise-monitor does not follow it; see the log "
    "and start `chipwise monitor`",
    Fault.NO_MONITOR: "chipwise-monitor does not answer; start `chipwise monitor` in a shell",
    Fault.POSITION: "an axis position is not a number; define the stock again with M250",
    Fault.JUMP: "an axis position jumped, so the stock is no longer known; define it again with M250",
    Fault.UNITS: "units-per-mm is not from 0.001 to 1000; load the components with chipwise.hal",
    Fault.TURNED: "an axis A, B, C, U, V or W has moved since the stock was defined, so the feed is at most F and the "
    "guards are off; define the "
    "stock again with M250",
}

PATH_REFUSALS = {  # stock-tracker.0.path-refused (man stock_tracker)
    PathRefusal.NO_BLOCK: "the path ahead is only predicted, because motion has no shared memory; load chipwise.hal "
    "after motmod",
    PathRefusal.TOO_SMALL: "the path ahead is only predicted, because the memory of motion is smaller than that of the "
    "LinuxCNC this chipwise was built "
    "for; install the chipwise built for this LinuxCNC",
    PathRefusal.NOT_OURS: "the path ahead is only predicted, because the memory of motion is of another user, or "
    "others may write it; end all "
    "LinuxCNCs, run `ipcrm -M 100` as root, start again",
    PathRefusal.NOT_MAPPED: "the path ahead is only predicted, because the memory with the key of motion is not of "
    "this LinuxCNC; end all LinuxCNCs, run "
    "`ipcrm -M 100`, start again",
    PathRefusal.NO_QUEUE: "the path ahead is only predicted, because the queue of motion is not where this chipwise "
    "looks for it; install the chipwise "
    "built for this LinuxCNC",
    PathRefusal.HEARTBEAT: "the path ahead is only predicted, because no counter of motion is where this chipwise "
    "looks for it; install the chipwise "
    "built for this LinuxCNC",
    PathRefusal.PINS: "the path ahead is only predicted, because memory and pins of motion differ; install the "
    "chipwise built for this LinuxCNC",
    PathRefusal.COUNTS: "the path ahead is only predicted, because the counts of the queue of motion cannot be; "
    "install the chipwise built for this "
    "LinuxCNC",
    PathRefusal.REVERSED: "the path ahead is only predicted while the program runs backwards; let it run forwards, or "
    "use M252",
    PathRefusal.POSITION: "the path ahead is only predicted, because the axes are not where the motion planner is, as "
    "with external offsets; clear them, "
    "or use M252",
    PathRefusal.SEGMENT: "the path ahead is only predicted, because a segment in the queue of motion cannot be; "
    "install the chipwise built for this "
    "LinuxCNC",
    PathRefusal.STATION: "the path ahead is only predicted, because the segment in the queue of motion does not lead "
    "through the place of the planner; "
    "install the chipwise built for this LinuxCNC",
    PathRefusal.CHAIN: "the path ahead is only predicted, because segments in the queue of motion do not join; install "
    "the chipwise built for this "
    "LinuxCNC",
    PathRefusal.EMPTY: "the path ahead is only predicted, because the queue of motion is empty while the machine cuts; "
    "use LinuxCNC's own planner, tpmod",
}


def override_text():
    """The operator's message for a machine that ignores the override."""
    return (
        "the machine ignores the volumetric feed because adaptive feed is disabled (M52 P0), and the program is "
        "aborted; "
        "use M252 before M52 P0"
    )


def slow_text(took_us, period_us):
    """The operator's message for a stock tracker that takes most of the servo period."""
    return (
        f"stock-tracker took {took_us:.0f} of {period_us:.0f} us; raise [CHIPWISE]FINEST_CELL or [EMCMOT]SERVO_PERIOD"
    )


def clamp_text(clamp, part, distance, line, tool, unit):
    """The operator's message for a stop before a clamp; part: 1 of the holder; distance in machine units, `unit` their
    name."""
    digits = 4 if unit == "in" else 2
    what = "holder" if part else "tool or its shank"
    where = f"{f'line {line}' if line > 0 else 'MDI'}, tool {tool}"
    return (
        f"move stopped {distance:.{digits}f} {unit} before the {what} comes too near to {clamp} ({where}); press Stop, "
        f"jog away and go over it or "
        "round it, or give M256 P0 if it is not there any more"
    )


@dataclass(frozen=True)
class Stop:
    """By a guard; lengths in machine units.  line: 0 in MDI; depth: that was cut; tool: its number, with diameter and
    length of the flutes."""

    reason: int
    line: int
    distance: float
    depth: float
    tool: int
    diameter: float
    flute: float


def guard_text(stop, unit):
    """The operator's message for a Stop; unit: the name of its lengths'."""
    digits, flute = 4 if unit == "in" else 2, stop.flute
    where = f"{f'line {stop.line}' if stop.line > 0 else 'MDI'}, tool {stop.tool}, {stop.diameter:.{digits}f} {unit}"
    if stop.reason == GuardReason.RAPID_CONTACT and round(stop.distance, digits) <= 0:
        return (
            f"rapid stopped in contact with stock ({where}); press Stop, jog away and leave the stock with G1 "
            f"before G0 (guard: [CHIPWISE]GUARD_RAPID)"
        )
    if stop.reason == GuardReason.RAPID_CONTACT:
        return (
            f"rapid stopped {stop.distance:.{digits}f} {unit} before stock ({where}); press Stop, jog away and retract "
            f"higher "
            "(guard: [CHIPWISE]GUARD_RAPID)"
        )
    return (
        f"cut stopped at {max(stop.depth, flute):.{digits}f} {unit} or more of depth, "
        f"flutes {flute:.{digits}f} {unit} long ({where}); "
        "press Stop, jog away and take more passes (guard: [CHIPWISE]GUARD_FLUTE)"
    )
