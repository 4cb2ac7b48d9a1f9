# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the sub of a pattern: from a PatternJob to what the sub does, a Recorded.  Called by planner/plans.py.

The file that holds the sub, with everything outside of sub definitions blanked so that line numbers stay, then the subs
of the calling programs that it does not have, the caller's parameters and modes, and the call go to a child process
(runner.py) with LinuxCNC's own interpreter and the remaps of the INI file: loops, calls, canned cycles, cutter
compensation and the cycles of chipwise are moves when they come back.

Departs from the call of a sub: what it assigns to parameters is gone afterwards, and the modes that it sets end with
it.
"""

import os
import re

from chipwise.program.find_sub import find_sub, plain_text, read_file
from chipwise.contour_sub.run import called_files
from chipwise.errors import MM_PER_INCH, CycleError, braceless, unnamed
from chipwise.ini import expanded, section_of
from chipwise.gcode_lines import AXES, path_text
from chipwise.program import rs274
from chipwise.moves import CALLERS_PATH
from chipwise.pattern.check import check_text, refuse_odd
from chipwise.pattern.job import DEPTH
from chipwise.pattern.recorded import ARC, AXIS_OF_PLANE, SAME_DEGREES, THREAD, Code, Recorded, Step
from chipwise.program.sub_process import Runner, call_of, decimal, run_sub

RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "runner.py")
CPU_S = 5.0  # computing time of LinuxCNC's interpreter for one run of the sub; cycles in it have their own budget
MAX_MOVES = 200_000  # of one run of the sub
MAX_DEPTH = 8  # patterns in patterns
_SETTLED = ("", "%")
_NO_SUB = re.compile(r"EOF in file:.* seeking o-word: o<(.*)> from line: \d+")  # interp_o_word.cc
_OTHER_AXIS = re.compile(r"Bad character '([abcuvw])' used")  # the child has only those of the job
# F remapped by the package does what LinuxCNC does; without it F works under G93 (docs/design/code_overview.md), and
# its lines have their numbers
_OWN_F = re.compile(r"(?mi)^\s*REMAP\s*=\s*F\s[^\n]*\bpython\s*=\s*feed\s*$")


def read_pattern(job) -> Recorded:
    """What a sub does from the position in its Job.  Raises CycleError."""
    if int(os.environ.get(DEPTH, "0")) >= MAX_DEPTH:
        raise CycleError(
            f"sub O{job.sub.sub} is called by patterns more than {MAX_DEPTH} deep", "see whether it calls itself"
        )
    found = find_sub(job.sub)
    check_text(found, job.per_rev)
    return _read(found, job, called_files(job.sub, found))


def _read(found, job, files):
    """Not kept for the next time: a sub may read files that nobody knows beforehand, of other patterns and contours, of
    tools.  files: of called_files()."""
    result = _run(found, job)
    if result["stop"] or result["error"]:
        line, text, remedy = result["stop"] or (*result["error"], "")
        text = unnamed(text.strip().rstrip("."))
        other = _OTHER_AXIS.match(text)
        if other:
            raise found.fault(
                line or _first_line(found),
                _other_axis(other[1].upper()),
                f"use {', '.join(job.axes[:-1])} and {job.axes[-1]}",
            )
        missing = _NO_SUB.match(text)
        if missing:
            raise found.fault(
                line or _first_line(found),
                f"the sub O{missing[1]} that it calls is missing",
                f"write it from O{missing[1]} sub to "
                f"O{missing[1]} endsub, and call it with O{missing[1]} call; M98 finds only files",
            )
        if text.startswith("G75: sub O"):  # a pattern in this one: its own line says more
            raise CycleError(braceless(text.removeprefix("G75: ")))
        raise found.fault(line or _first_line(found), text, remedy or ("" if ";" in text else "correct the line"))
    # a line of another file must not be shown as one of the program's
    own_lines = not files and bool(job.sub.programs) and found.path == os.path.abspath(job.sub.programs[0])
    rows = result["rows"]
    turning = any(
        abs(now - was) > SAME_DEGREES
        for row in rows
        if row[0] not in ("code", "path")
        for now, was in zip(row[7:10], job.abc)
    )
    steps = tuple(_step(found, row, own_lines, job, turning) for row in rows)
    recorded = Recorded(
        steps, tuple(result["messages"]), job.sub.position, job.abc, any(row[0] == "path" for row in rows)
    )
    if not recorded.moves:
        raise found.fault(found.first, "the sub moves nothing", "put the pattern in it")
    return recorded


def _other_axis(letter):
    """What is wrong with a word of an axis that the sub may not move."""
    why = ": the machine has none, or [CHIPWISE]TOOL_POSE turns the tool with it" if letter in "ABC" else ""
    return f"word {letter} is an axis that a pattern does not move" + why


def _first_line(found):
    """Number of the first line in the sub that does anything."""
    return next((number for number, text in found.body if plain_text(text)), found.first)


def _step(found, row, own_lines, job, turning):
    """A row of runner.py -> Step or Code; turning: whether the sub turns an axis."""
    kind, line, *rest = row
    line = line if own_lines else 0
    if kind == "code":
        return Code(rest[0], line)
    if kind == "path":
        code, p, q = rest
        return Code(path_text(code, p, q, MM_PER_INCH if job.sub.unit == "in" else 1.0) if code else CALLERS_PATH, line)
    own, feed, *numbers = rest
    refuse_odd(found, row[1], [feed, *numbers[:6], *numbers[7:]])
    more = {"own": own, "source": row[1], "abc": tuple(round(angle, 9) for angle in numbers[3:6]) if turning else None}
    if kind == ARC:
        if job.sub.lathe and numbers[6] != "G18":
            raise found.fault(row[1], f"an arc of {numbers[6]} leaves the plane of a lathe", "program G18")
        return Step(
            ARC,
            line,
            tuple(numbers[:3]),
            feed,
            tuple(numbers[7:10]),
            AXIS_OF_PLANE[numbers[6]],
            int(numbers[10]),
            **more,
        )
    if kind == THREAD:
        return Step(THREAD, line, tuple(numbers[:3]), pitch=feed, **more)
    return Step(kind, line, tuple(numbers[:3]), feed, **more)


# ---- the child ---------------------------------------------------------------------------------------------------


def _program(found, job):
    """Lines for the runner."""
    sub = job.sub
    lines, known = _definitions(found.path, set())
    for path in sub.programs:
        if path and os.path.abspath(path) != found.path:
            more, names = _definitions(path, known)
            lines, known = lines + [text for text in more if text], known | names
    turn, speed = job.spindle
    before = [
        f"G{18 if sub.lathe else 17} G8 G40 G49 G80 G90 G91.1 G94",
        f"F{decimal(sub.feed)}" if sub.feed > 0 else "",
        f"S{decimal(speed)} M{turn}",
    ]
    before += [f"M{code}" for code, on in zip((7, 8), job.coolant) if on]
    behind = [f"G{job.motion}" if sub.feed > 0 or not job.motion else "", "G7" if sub.diameter else ""]
    turned = tuple((letter, angle) for letter, angle in zip("ABC", job.abc) if letter in job.axes)
    return lines + call_of(found, sub, before, behind, job.axes, turned)


def _definitions(path, known):
    """(lines, names of subs) of a file with everything outside of its subs blanked, and subs whose name is known
    already.  Each line of a sub gets a comment of its own: the interpreter then reports every one of them
    (runner.py)."""
    lines, names, read = [], set(), read_file(path)
    numbered = read[1] if read else {}
    inside, sub = None, []
    for number, text in enumerate(read[0], 1) if read else ():
        word = numbered.get(number)
        if inside is None and word and word[1] == "sub":
            inside, sub = word[0], []
        if inside is None:
            lines.append("")
            continue
        sub.append(text if word else _reported(text))
        if word == (inside, "endsub"):
            lines += [""] * len(sub) if inside in known else sub
            names.add(inside)
            inside = None
    return lines + (sub if inside is not None else []), names


def _reported(text):
    """A line that the interpreter reports by its comment."""
    plain = plain_text(text)
    silent = plain in _SETTLED or plain.startswith("o") or "(" in text or ";" in text or len(text) >= 240
    return text if silent else text + " (.)"


def _run(found, job):
    """Result of runner.py."""
    sub = job.sub
    ini_folder = os.path.dirname(os.path.abspath(sub.ini)) if sub.ini else os.getcwd()
    text = expanded(sub.ini) if sub.ini else "[RS274NGC]\n"
    section = section_of(text.splitlines(), "EMCIO")
    order = {
        "table": os.path.join(os.getcwd(), os.path.expanduser(section.get("TOOL_TABLE", ""))),
        "random": section.get("RANDOM_TOOLCHANGER", "0").strip() == "1",
        "max_moves": MAX_MOVES,
        "cpu_s": CPU_S,
        "mirrored": job.mirrored,
        "stock_top": job.stock_top,
        "axis_mask": sum(1 << AXES.index(letter) for letter in job.axes),
        "tool": (*sub.tool, job.orientation),
        "per_rev": job.per_rev,
        "unit_mm": MM_PER_INCH if sub.unit == "in" else 1.0,
    }
    environment = {"OPENBLAS_NUM_THREADS": "1", DEPTH: str(int(os.environ.get(DEPTH, "0")) + 1)}
    return run_sub(
        found,
        sub,
        Runner(RUNNER, order, environment),
        _program(found, job),
        _OWN_F.sub("", rs274.usable_elsewhere(text, ini_folder)),
    )
