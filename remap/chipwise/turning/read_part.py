# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads part and blank of a request, and its tools, into an Order.  Called by cli/turn.py and g26_plan.py."""

import math
import tomllib
from dataclasses import replace

from chipwise.ini import Ini
from chipwise.program.find_sub import find_sub
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import UnknownStart, one_contour, read_shape
from chipwise.errors import MM_PER_INCH, Across, CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.machine.limits import trivial_joints
from chipwise.settings import Settings
from chipwise.turning.profile import Profile, blank_of_comment, make_profile
from chipwise.turning.request import Request, Words, rpm
from chipwise.turning.state import ORDER, Drive, Order
from chipwise.turning.thread_comment import Thread, read_threads
from chipwise.turning.times import Motion
from chipwise.turning.tool import ROLES, LatheTable, LatheTool, TableTool, make_tool, read_geometry, read_table

MAX_STEPS_BYTES = 1 << 16
UNKNOWN_MM_S = 50.0  # velocity of such an axis
UNKNOWN_MM_S2 = 50.0  # acceleration of an axis whose INI file has none: slow, so that a run-in is long


def read_profile(job: Job) -> Profile:
    """Profile of an O-sub.  Raises CycleError."""
    try:
        shape = read_shape(job)
        profile = make_profile(shape, one_contour(shape))
        return replace(
            profile,
            threads=read_threads(
                find_sub(job), profile.outside, profile.bore, MM_PER_INCH if job.unit == "in" else 1.0
            ),
        )
    except CycleError as error:
        raise _lathe_axes(error).across(job.diameter) from error


def _lathe_axes(error: CycleError) -> CycleError:
    """An error of the contour kernel, whose first coordinate is Z here, with the axes of a lathe."""
    if "X{x} Y{y}" in error.problem + error.remedy:
        error.values["y"] = Across(error.values["y"])
    texts = (
        text.replace("X{x} Y{y}", "Z{x} X{y}").replace("in XY", "in X and Z") for text in (error.problem, error.remedy)
    )
    return CycleError(*texts, **error.values)


def job_of(program: str, request: Request, machine: "Machine") -> Job:
    """Job of the part's sub, for a program that is not run."""
    return Job(
        program=program,
        sub=request.words["Q"],
        ini=machine.ini,
        unit=request.unit,
        machine_unit=machine.unit_mm,
        lathe=True,
        position=None,
        diameter=request.diameter,
        ijk_absolute=request.ijk_absolute,
        close_gap=machine.close_gap,
    )


def make_order(job: Job, text: str, request: Request, machine: "Machine", steps: tuple[str, ...] = ORDER) -> Order:
    """Order of a request.  job: of the part's sub; text: of the program; machine: Machine.  Raises CycleError."""
    words = request.words
    part = read_profile(job)
    blank = read_profile(replace(job, sub=words["P"])) if words["P"] else blank_of_comment(text, request.scale)
    if blank is None:
        raise CycleError(
            "there is neither a blank sub P nor a WORKPIECE comment",
            "add (WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=0.5) to the program",
            "G26",
        )
    part = replace(part, threads=tuple(replace(t, speed=_thread_speed(request, t)) for t in part.threads))
    return Order(
        part,
        blank,
        tools_of(request, machine),
        request.barriers,
        words["I"],
        words["D"],
        steps,
        replace(machine.drive, direction=request.direction),
        request.diameter,
        machine.barrier_clearance,
        machine.traverse_clearance,
    )


def with_start(error: CycleError, job: Job, words: Words) -> CycleError:
    """The error, and that part or blank are drawn from where the tool is, if they are."""
    for sub in filter(None, (words["Q"], words["P"])):
        try:
            read_shape(replace(job, sub=sub, position=None))
        except UnknownStart:
            z, x, _ = job.in_plane
            return CycleError(
                f"{error.problem} (the sub O{sub} is drawn from the tool's place, Z{{tool_z}} X{{tool_x}})",
                "begin the sub with G0 X.. Z..",
                error.code,
                **error.values,
                tool_z=z,
                tool_x=Across(x),
            ).across(job.diameter)
        except CycleError:
            pass
    return error


def _thread_speed(request: Request, thread: Thread) -> int:
    """1/min, whole: that of its comment, else the program's, under G96 that of its diameter.  Raises CycleError."""
    speed = math.floor(thread.speed or rpm(request, thread.x))
    if speed < 1:
        raise CycleError(
            f"a thread has no speed of the spindle (line {thread.line})",
            "give S before G26, or SPEED= in the THREAD comment",
        )
    return speed


def read_steps(path: str) -> tuple[str, ...]:
    """Names of the steps of a TOML file, the usual ones without a file.  Raises CycleError."""
    if not path:
        return ORDER
    try:
        steps = tomllib.loads(read_bytes(path, MAX_STEPS_BYTES).decode("utf-8")).get("steps")
    except OSError as error:
        raise CycleError(f"{braceless(path)}: {error.strerror}", "name a file that can be read") from error
    except (ValueError, RecursionError) as error:
        raise CycleError(f"{braceless(path)} is not TOML: {braceless(str(error))}", "correct the file") from error
    if not isinstance(steps, list) or not steps or not all(isinstance(s, str) for s in steps):
        raise CycleError(f"{braceless(path)} has no list of steps", 'write steps = ["face", "rough outside"]')
    return tuple(braceless(s) for s in steps)


def tools_of(request: Request, machine: "Machine") -> dict[str, tuple[LatheTool, ...]]:
    """{role: (LatheTool, ..)} of the program's LATHE comment, and for roles that it does not name of the tool geometry
    file."""
    table, geometry = read_table(machine.table), read_geometry(machine.geometry)
    tools = {}
    for role in ROLES:
        numbers = request.roles.get(role) or sorted(
            n for n, keys in geometry.items() if role in keys.get("roles", ()) and n in table
        )
        tools[role] = tuple(_of_role(make_tool(n, table, geometry, machine.unit_mm), role) for n in numbers)
    if not any(tools.values()):
        raise CycleError(
            "no tool has a role", "add (LATHE,ROUGH=1,FINISH=2) to the program, or roles to the tool geometry file"
        )
    return tools


def tool_notes(order: Order, request: Request, machine: "Machine") -> list[CycleError]:
    """CycleErrors with what the operator may not expect of the tools: those of a role that the LATHE comment hides,
    drills at the insert's speed."""
    found = []
    table, geometry = read_table(machine.table), read_geometry(machine.geometry)
    for role, numbers in request.roles.items():
        hidden = [
            n
            for n in sorted(geometry)
            if role in geometry[n].get("roles", ())
            and n in table
            and n not in numbers
            and _has_work(n, table, geometry, machine, order)
        ]
        if hidden:
            found.append(
                CycleError(
                    f"{' '.join(f'T{n}' for n in hidden)} of role {role.upper()} is not used, for the LATHE comment "
                    f"names others",
                    f"add {','.join(f'{role.upper()}={n}' for n in hidden)} to it",
                )
            )
    fast = [t for t in order.tools["drill"] if request.css and order.part.bore and not t.cutting_speed]
    if fast:
        found.append(
            CycleError(
                f"T{fast[0].number} drills at the S{request.speed:g} of G96",
                f"give its cutting_speed in [lathe.{fast[0].number}]",
            )
        )
    return found


def _has_work(
    number: int, table: dict[int, TableTool], geometry: dict[int, LatheTable], machine: "Machine", order: Order
) -> bool:
    """Whether a tool works on a side that the part has."""
    try:
        tool = make_tool(number, table, geometry, machine.unit_mm)
    except CycleError:
        return False
    return bool(order.part.bore) or not tool.inside


def _of_role(tool: LatheTool, role: str) -> LatheTool:
    """The tool, if its kind is that of the role.  Raises CycleError."""
    kind, key = (
        ("drill", "point_angle")
        if tool.point_angle
        else ("grooving tool", "width")
        if tool.flat
        else ("turning tool", "")
    )
    wanted = {"drill": "drill", "groove": "grooving tool", "partoff": "grooving tool"}.get(role, "turning tool")
    if kind != wanted:
        raise CycleError(
            f"tool {tool.number} has the role {role.upper()} and is a {kind}"
            + (
                f" ([lathe.{tool.number}] has {key})"
                if key
                else ", without a width larger than its nose"
                if wanted == "grooving tool"
                else ""
            ),
            "name another tool in (LATHE,..), or correct the tool geometry file",
        )
    return tool


class Machine:
    """What the plan needs of an INI file: ini, table and geometry (paths), unit_mm, close_gap, barrier_clearance,
    traverse_clearance (mm), steps, motion (times.Motion), drive (state.Drive), and startup (codes in force before a
    program).
    """

    def __init__(self, ini: Ini, settings: Settings, path: str) -> None:
        self.ini, self.table = path, ini.tool_table()
        if not self.table:
            raise CycleError("the INI file has no [EMCIO]TOOL_TABLE", "name the machine's INI file with --ini")
        self.unit_mm, self.startup = 1.0 / ini.units_per_mm(), ini.startup_codes()
        self.geometry, self.close_gap = settings.path("TOOL_GEOMETRY"), settings["CLOSE_GAP"]
        self.barrier_clearance, self.traverse_clearance = settings["BARRIER_CLEARANCE"], settings["TRAVERSE_CLEARANCE"]
        self.steps = read_steps(settings.path("TURNING_STEPS"))
        self.drive = _drive(ini, self.unit_mm)
        self.motion = _motion(ini, self.unit_mm)


def _motion(ini: Ini, unit_mm: float) -> Motion:
    """Motion of an INI file."""

    def of_axes(key: str, path_key: str, otherwise: float) -> tuple[tuple[float, float], float]:
        path = ini.number("TRAJ", path_key) or otherwise
        z, x = ((ini.number(f"AXIS_{letter}", key) or path) * unit_mm for letter in "ZX")
        return (z, x), path * unit_mm

    velocity, path_velocity = of_axes("MAX_VELOCITY", "MAX_LINEAR_VELOCITY", UNKNOWN_MM_S / unit_mm)
    acceleration, path_acceleration = of_axes("MAX_ACCELERATION", "MAX_LINEAR_ACCELERATION", UNKNOWN_MM_S2 / unit_mm)
    return Motion(velocity, acceleration, path_velocity, path_acceleration)


def _drive(ini: Ini, unit_mm: float) -> Drive:
    """Drive of an INI file, without the direction of the spindle: the lowest limits of the Z axis, its joint and the
    path."""
    joint = trivial_joints(ini.lines).find("Z")
    sections = ["AXIS_Z", *([f"JOINT_{joint}"] if joint >= 0 else [])]

    def least(key: str, path_key: str) -> float:
        found = [ini.number(section, key) for section in sections] + [ini.number("TRAJ", path_key)]
        return min((v for v in found if v), default=math.inf) * unit_mm

    acceleration = least("MAX_ACCELERATION", "MAX_LINEAR_ACCELERATION")
    return Drive(
        velocity=least("MAX_VELOCITY", "MAX_LINEAR_VELOCITY"),
        acceleration=acceleration if math.isfinite(acceleration) else UNKNOWN_MM_S2,
        override=max(ini.number("DISPLAY", "MAX_SPINDLE_OVERRIDE", 1.0) or 1.0, 1.0),
    )
