# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the sub of a pattern: from a PatternJob to what the sub does, a Recorded.  Called by plans.py.

The file that holds the sub, with everything outside of sub definitions blanked so that line numbers stay, then the sub
definitions of the calling programs, the caller's parameters and modes, and the call go to a child process (runner.py) with LinuxCNC's
own interpreter and the remaps of the INI file: loops, calls, canned cycles, cutter compensation and the cycles of chipwise are
moves when they come back.

Departs from the call of a sub: what it assigns to parameters is gone afterwards, and the modes that it sets end with it.
"""

import json
import os
import signal
import subprocess
import tempfile
from functools import lru_cache

from chipwise.contour_sub.find import fault, find_sub, o_word, plain_text, read_file, sub_name
from chipwise.contour_sub.run import called_files
from chipwise.errors import MM_PER_INCH, CycleError, braceless
from chipwise.ini import expanded, section_of
from chipwise.machine import rs274
from chipwise.pattern.check import check_text, refuse_odd
from chipwise.pattern.recorded import ARC, AXIS_OF_PLANE, Code, Recorded, Step
from chipwise.sub_process import PYTHON, answer_of, assignments, decimal

RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "runner.py")
CPU_S = 5.0             # computing time of LinuxCNC's interpreter for one run of the sub; cycles in it have their own budget
MAX_MOVES = 200_000     # of one run of the sub
MAX_DEPTH = 8           # patterns in patterns
DEPTH = "CHIPWISE_PATTERN_DEPTH"        # environment: how many patterns this process is in
BEGIN, END = "chipwise: pattern begins", "chipwise: pattern has ended"
_SETTLED = ("", "%")


def read_pattern(job) -> Recorded:
    """What a sub does from the position in its Job.  Raises CycleError."""
    if int(os.environ.get(DEPTH, "0")) >= MAX_DEPTH:
        raise CycleError(f"sub O{job.sub.sub} is called by patterns more than {MAX_DEPTH} deep", "see whether it calls itself")
    found = find_sub(job.sub)
    check_text(found)
    return _read(found, job, called_files(job.sub, found))


@lru_cache(maxsize=64)
def _read(found, job, _files):
    """Kept by the text of the files and all that the sub can read."""
    result = _child(found, job)
    if result["stop"] or result["error"]:
        line, text, remedy = result["stop"] or (*result["error"], "")
        text = text.strip().rstrip(".").removeprefix("chipwise: ")
        if text.startswith("G75: sub O"):       # a pattern in this one: its own line says more
            raise CycleError(braceless(text.removeprefix("G75: ")))
        raise fault(found, line or found.first, text, remedy or ("" if ";" in text else "correct the line"))
    if not result["ended"]:
        raise fault(found, result["line"] or found.first, "the program ends inside the sub", "take the M2 or M30 out of it")
    own_lines = len(called_files(job.sub, found)) == 0
    steps = tuple(_step(found, row, own_lines) for row in result["rows"])
    recorded = Recorded(steps, tuple(result["messages"]), job.sub.position, result["own_cut"])
    if not recorded.moves:
        raise fault(found, found.first, "the sub moves nothing", "put the pattern in it")
    return recorded


def _step(found, row, own_lines):
    """A row of runner.py: [kind, line, feed, x, y, z (, plane, cx, cy, cz, turns)] or ["code", line, text]."""
    kind, line, *rest = row
    line = line if own_lines else 0
    if kind == "code":
        return Code(rest[0], line)
    feed, *numbers = rest
    refuse_odd(found, row[1], [feed, *numbers[:3], *numbers[4:]])
    if kind == ARC:
        return Step(ARC, line, tuple(numbers[:3]), feed, tuple(numbers[4:7]), AXIS_OF_PLANE[numbers[3]], int(numbers[7]))
    return Step(kind, line, tuple(numbers[:3]), feed)


# ---- the child ---------------------------------------------------------------------------------------------------


def _program(found, job):
    """Text for the runner."""
    sub = job.sub
    lines = _definitions(found.path)
    for path in sub.programs:
        if path and os.path.abspath(path) != found.path:
            lines += [text for text in _definitions(path) if text]
    scale = 1.0 / (MM_PER_INCH if sub.unit == "in" else 1.0)
    x, y, z = (value * scale for value in sub.position)
    turn, speed = job.spindle
    lines += ["G17 G40 G49 G80 G90 G91.1 G94", f"F{decimal(sub.feed)}" if sub.feed > 0 else "", f"S{decimal(speed)} M{turn}"]
    lines += [f"M{code}" for code, on in zip((7, 8), job.coolant) if on]
    lines += assignments(sub.named)
    lines += [f"G0 X{decimal(x)} Y{decimal(y)} Z{decimal(z)}", f"G{job.motion}" if sub.feed > 0 or not job.motion else "",
              ("G91" if sub.incremental else "G90") + (" G90.1" if sub.ijk_absolute else " G91.1"),
              f"({BEGIN})", f"o{sub_name(found)} call", f"({END})", "M2"]
    return "\n".join(lines) + "\n"


def _definitions(path):
    """Lines of a file with everything outside of its subs blanked.  Each line of a sub gets a comment of its own: the interpreter then
    reports every one of them (runner.py)."""
    lines, inside = [], None
    read = read_file(path)
    for number, text in enumerate(read[0], 1) if read else ():
        word = read[1].get(number)
        if inside is None and word and word[1] == "sub":
            inside = word[0]
        plain = plain_text(text)
        if inside is None:
            text = ""
        elif not word and plain not in _SETTLED and not plain.startswith("o") and "(" not in text and ";" not in text and len(text) < 240:
            text += " (.)"
        lines.append(text)
        if word == (inside, "endsub"):
            inside = None
    return lines


def _child(found, job):
    """Result of runner.py."""
    sub = job.sub
    ini_folder = os.path.dirname(os.path.abspath(sub.ini)) if sub.ini else os.getcwd()
    machine_folder = os.getcwd()            # LinuxCNC's relative paths count from here, also if the INI file is a copy elsewhere
    with tempfile.TemporaryDirectory(prefix="chipwise-") as folder:
        name = os.path.basename(found.path)
        paths = {"program": os.path.join(folder, name), "ini": os.path.join(folder, "machine.ini"),
                 "parameters": os.path.join(folder, "machine.var")}
        text = expanded(sub.ini) if sub.ini else "[RS274NGC]\n"
        contents = {"program": _program(found, job), "ini": rs274.usable_elsewhere(text, ini_folder),
                    "parameters": "".join(f"{n} {v!r}\n" for n, v in sub.numbered) or "5161 0\n"}
        for key, content in contents.items():
            with open(paths[key], "w", encoding="utf-8", errors="surrogateescape") as file:
                file.write(content)
        section = section_of(text.splitlines(), "EMCIO")
        order = json.dumps({
            "program": paths["program"], "parameters": paths["parameters"], "units_per_mm": 1.0 / sub.machine_unit, "tool": sub.tool,
            "table": os.path.join(machine_folder, os.path.expanduser(section.get("TOOL_TABLE", ""))),
            "random": section.get("RANDOM_TOOLCHANGER", "0").strip() == "1", "codes": ["G20" if sub.unit == "in" else "G21", "G0"],
            "begin": BEGIN, "end": END, "max_moves": MAX_MOVES, "cpu_s": CPU_S, "mirrored": job.mirrored,
            "stock_top": job.stock_top})
        environment = {**os.environ, "HOME": folder, "INI_FILE_NAME": paths["ini"], "LC_ALL": "C", "OPENBLAS_NUM_THREADS": "1",
                       DEPTH: str(int(os.environ.get(DEPTH, "0")) + 1)}
        process = subprocess.Popen([PYTHON, "-s", RUNNER, str(os.getpid())], env=environment, cwd=machine_folder, text=True,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        answer = answer_of(process, order)
    if answer is None:
        raise fault(found, found.first, "the sub waits for a file that does not answer", "look at the files that it calls on the SUBROUTINE_PATH")
    if process.returncode == -signal.SIGPROF:
        loops = [n for n, text in found.body if (o_word(text) or ("", ""))[1] in ("while", "do", "repeat", "call")]
        where = f" (loops and calls: line {', '.join(map(str, loops[:5]))})" if loops else ""
        raise fault(found, found.first, f"the sub does not end within {CPU_S:g} s of computing time" + where,
                    "correct the loop's condition, or make the sub simpler")
    if process.returncode != 0:
        said = (answer[1].strip().splitlines() or [f"exit {process.returncode}"])[-1]
        raise fault(found, found.first, f"LinuxCNC's interpreter did not run it ({said})", "see whether `rs274` runs")
    return json.loads(answer[0])
