"""Contour subs: from an O-sub number to loops of lines and arcs.  Pure Python: no interpreter object, no HAL.

Called by glue/shape.py (G77, G78, G79) and by bin/chipwise contour.

    shape = read_shape(Job(program="part.ngc", sub=100, ini="mill.ini"))
    shape.loops             ((LineElement | ArcElement, ..), ..): mm, absolute work coordinates, source lines
    one_contour(shape)      the Contour of its only loop

How a sub is run: the file that holds it, with everything outside of sub definitions blanked so that line numbers stay,
then the caller's parameters and modes, then its call, go to a child process (sub_runner.py) with LinuxCNC's own
interpreter.  So whatever LinuxCNC understands (expressions, loops, calls, subs in files of their own) is understood, and
nothing the sub does can hang or hurt the caller.  The child takes about 50 ms; results are kept by the text of the files
and, where the sub reads parameters, by their values.

Departs from the call of a sub: what it assigns to parameters is gone afterwards.
"""

import json
import math
import os
import re
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass, replace
from functools import lru_cache

from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.geometry.contour import (ArcElement, ContourError, LineElement, make_contour,
                                       refuse_nearly_closed)
from chipwise.geometry.tolerances import CONNECT_MM, NEARLY_CLOSED_MM
from chipwise.files import NoRegularFile, TooLong, read_bytes
from chipwise.processes import cpu_s
from chipwise.settings import read_section

PYTHON = "/usr/bin/python3"     # the interpreter LinuxCNC is built for
RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "sub_runner.py")

CPU_S = 1.0             # computing time a sub may take, whatever else the machine does meanwhile, ..
LINE_S = 5e-5           # .. and more for each line of it: LinuxCNC reads 80,000 a second here
STUCK_S = 20.0          # a runner that computes nothing for so long waits for something that never comes
LINE_LENGTH = 255       # linuxcnc.h: LINELEN; a longer line is an error in LinuxCNC, too
MAX_BYTES = 1 << 28     # of a program or a file of subs
MAX_LINES = 100_000     # lines of one sub, as many as it may make moves
MAX_MOVES = 100_000     # moves of one sub; 20,000 elements are offset in half a second
HEIGHT_MM = 1e-6        # a move that leaves its height by more is a Z move

_BEGIN, _END, _MARK = "chipwise: sub begins", "chipwise: sub has ended", "chipwise: line "


@dataclass(frozen=True)
class Job:
    """A sub and what it may read.

    program         path of the program the sub is looked for first; also a tuple of paths: the caller's, its caller's
    sub             O-number
    ini             path of the INI file, "" for none: [RS274NGC]SUBROUTINE_PATH, [DISPLAY]PROGRAM_PREFIX
    unit            "mm" or "in": G21 or G20 where it is called
    incremental     G91; ijk_absolute: G90.1
    position        (x, y, z) mm, work coordinates, where the tool stands
    feed            program units/min
    machine_unit    mm of a machine unit
    tool            (number, diameter in machine units)
    numbered        ((number, value), ..) of numbered parameters
    named           ((name, value), ..) of global named parameters
    close_gap       mm: a G0 of up to this length between two elements joins them
    """

    program: object
    sub: int
    ini: str = ""
    unit: str = "mm"
    incremental: bool = False
    ijk_absolute: bool = False
    position: tuple = (0.0, 0.0, 0.0)
    feed: float = 1000.0
    machine_unit: float = 1.0
    tool: tuple = (0, 0.0)
    numbered: tuple = ()
    named: tuple = ()
    close_gap: float = CONNECT_MM

    @property
    def programs(self):
        return (self.program,) if isinstance(self.program, str) else tuple(self.program)


@dataclass(frozen=True, eq=False)
class Shape:
    """loops: tuples of elements, one per contour; sub: O-number; file: where it stands; close_gap: as in the Job."""

    sub: int
    file: str
    loops: tuple
    close_gap: float = CONNECT_MM


def read_shape(job):
    """Shape of a contour sub.  Raises CycleError for whatever is none."""
    found = find_sub(job)
    return _run(found, _relevant(job, found), _called(job, found))


# ---- where the sub stands ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """A file that holds the sub: path, its lines, first and last line number of the definition."""

    path: str
    lines: tuple
    first: int
    last: int

    @property
    def body(self):
        """[(line number, text)] between sub and endsub."""
        return [(n, self.lines[n - 1]) for n in range(self.first + 1, self.last)]


_O_LINE = re.compile(r"^/?(?:n\d+(?:\.\d+)?)?o(\d+|<[^>]*>)(sub|endsub|while|do|repeat|call|\w+)?", re.IGNORECASE)


def _plain(text):
    """A line without comments and blanks, lower case."""
    return re.sub(r"\([^)]*\)?|;.*|\s", "", text).lower()


def _o_word(text):
    """(name, keyword) of an O-line, else None.  O0100 is O100, as in LinuxCNC."""
    match = _O_LINE.match(_plain(text)) if "o" in text.lower() else None
    if not match:
        return None
    name = match.group(1).strip("<>")
    return (str(int(name)) if name.isdigit() else name), match.group(2) or ""


@lru_cache(maxsize=8)
def _lines_of(path, _stamp):
    """Lines of a file and its O-lines {number: (name, keyword)}."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "surrogateescape")
    except (NoRegularFile, TooLong) as error:
        if os.path.isdir(path):
            raise
        raise CycleError(f"{_quoted(path)}: {error.strerror}", "put the contour sub into a file of its own") from error
    lines = tuple(text.replace("\r\n", "\n").split("\n"))     # not splitlines(): it knows more line ends than LinuxCNC
    return lines, {n: word for n, word in ((n, _o_word(text)) for n, text in enumerate(lines, 1)) if word}


def _read(path):
    """(lines, O-lines) of a file, None where it cannot be read; kept by its time of change and size."""
    try:
        status = os.stat(path)
        return _lines_of(os.path.abspath(path), (status.st_mtime_ns, status.st_size))
    except (OSError, ValueError):
        return None


def find_sub(job):
    """Found: the definition in the programs, in their order, else in a file of its own as LinuxCNC looks for it."""
    name = str(job.sub)
    places = [p for p in job.programs if p] + [os.path.join(folder, name + ".ngc") for folder in sub_folders(job.ini)]
    for path in places:
        read = _read(path)
        first = next((n for n, word in read[1].items() if word == (name, "sub")), None) if read else None
        if first is None:
            continue
        last = next((n for n, word in read[1].items() if n > first and word == (name, "endsub")), None)
        if last is None:
            raise CycleError(f"sub O{name} begins in line {first} of {_quoted(path)} and has no endsub",
                             f"end it with a line O{name} endsub")
        return Found(os.path.abspath(path), read[0], first, last)
    own = [p for p in job.programs if p]
    raise CycleError(f"there is no sub O{name}" + (f" in {_quoted(own[0])}" if own else "")
                     + f" and no file {name}.ngc with it on the SUBROUTINE_PATH",
                     f"put the contour between O{name} sub and O{name} endsub, before or after the program's M2")


def sub_folders(ini):
    """Folders of sub files, in LinuxCNC's order: the current one, PROGRAM_PREFIX, SUBROUTINE_PATH."""
    folders = ["."]
    try:
        with open(ini, encoding="utf-8", errors="replace") as file:
            lines = file.readlines()
    except OSError:
        return folders
    folders += [read_section(lines, "DISPLAY").get("PROGRAM_PREFIX", "")]
    folders += read_section(lines, "RS274NGC").get("SUBROUTINE_PATH", "").split(":")
    return [os.path.expanduser(folder) for folder in folders if folder]


def _quoted(path):
    return os.path.basename(path).replace("{", "{{").replace("}", "}}")


# ---- what the text says --------------------------------------------------------------------------------------------

_ASSIGNMENT = re.compile(r"#+(?:<[^>]*>|\[[^]]*\]|\d+)=.*?(?=#+(?:<[^>]*>|\[[^]]*\]|\d+)=|$)")
_FUNCTION = re.compile(r"#+\d*|(?:exists|acos|asin|atan|round|sqrt|abs|cos|exp|fix|fup|sin|tan|ln)(?=#)")
_WORD = re.compile(r"([a-z@^])((?:[+-]?[0-9.]+)?)")
_MOVE = re.compile(r"\s*(?:[gG]0*[0-3])?(?:\s*[xXyYiIjJrRfF]\s*[-+]?(?:\d+\.?\d*|\.\d+))*\s*")     # most lines are one
_CODES = {0.0, 1.0, 2.0, 3.0, 40.0}
_LETTERS = "gnxyijrpf@^"


def _without_values(plain):
    """A line with parameters and expressions taken out: what is left are letters and literal numbers."""
    plain = _ASSIGNMENT.sub("", plain)
    while True:
        fewer = re.sub(r"\[[^][]*\]|#<[^>]*>", "#", plain)
        if fewer == plain:
            return _FUNCTION.sub("", plain)
        plain = fewer


def _check_text(found):
    """Refuse what no contour sub may hold, by its exact line; what hides behind an expression the runner finds."""
    if found.last - found.first > MAX_LINES:
        raise _fault(found, found.first, f"the sub has {found.last - found.first - 1} lines, more than {MAX_LINES}",
                     "divide the contour, or use a loop")
    for number, text in found.body:
        if len(text) > LINE_LENGTH:
            raise _fault(found, number, f"the line has {len(text)} characters, more than LinuxCNC's {LINE_LENGTH}",
                         "divide the line")
    _refuse_arguments(found)
    for number, text in found.body:
        if _MOVE.fullmatch(text):
            continue
        plain = _plain(text).lstrip("/")
        if re.match(r"(n\d+)?o", plain):
            continue
        words = _WORD.findall(_without_values(plain))
        for letter, value in words:
            wrong = None
            if letter == "z":
                wrong, remedy = "a move in Z", "a contour lies in XY; heights are the words Z and R of the cycle"
            elif letter not in _LETTERS or (letter == "g" and value and _number(value) not in _CODES):
                wrong, remedy = letter.upper() + value, "a contour sub holds G0 G1 G2 G3 in XY (G40 and F are ignored)"
            if wrong:
                raise _fault(found, number, f"{wrong} has no place in a contour sub", remedy)


_ARGUMENT = re.compile(r"#([1-9]|[12][0-9]|30)(?![0-9.])")


def _refuse_arguments(found):
    """A sub that reads #1 .. #30 before the line that sets them: written for a call with arguments, and there are none."""
    known = set()
    for number, text in found.body:
        plain = _plain(text)
        if "#" not in plain:
            continue
        assigned = set(re.findall(r"#(\d+)=", plain))
        for argument in _ARGUMENT.findall(re.sub(r"#\d+=", "", plain)):
            if argument not in known | assigned:
                raise _fault(found, number, f"#{argument} is an argument of the sub, and a contour sub is called without any",
                             f"set #{argument} in the sub, or use a named parameter: #<_name>")
        known |= assigned


def _number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan


def _fault(found, line, text, remedy, before=None):
    """CycleError about a line of the sub."""
    where = f"sub O{_name(found)}, line {line}" + (f" (after line {before})" if before not in (None, line) else "")
    text, remedy = (t.replace("{", "{{").replace("}", "}}") for t in (text, remedy))
    return CycleError(f"{where} of {_quoted(found.path)}: {text}", remedy)


def _name(found):
    return _o_word(found.lines[found.first - 1])[0]


# ---- running it ----------------------------------------------------------------------------------------------------


_START = re.compile(r"(n\d+)?(g40)?g0+(?=[xy])(?=.*x)(?=.*y)")


def _relevant(job, found):
    """The job without what this sub cannot see, so that equal calls are equal jobs.

    A plain list of moves depends on units and modes, and on the position only where it does not begin with G0 X Y."""
    body = [_plain(text) for _, text in found.body]
    if any("#" in text or "o" in text for text in body):
        return replace(job, program=found.path)
    if not job.incremental and _START.match(next((text for text in body if text), "")):
        job = replace(job, position=(0.0, 0.0, 0.0))
    return replace(job, numbered=(), named=(), feed=1000.0, tool=(0, 0.0), program=found.path)


def _called(job, found):
    """((path, time of change), ..) of the files whose subs this one may call; something new every time where their
    names are expressions."""
    known, waiting = {}, [found.path]
    while waiting:
        read = _read(waiting.pop())
        defined = {name for name, keyword in read[1].values() if keyword == "sub"}
        for name in {name for name, keyword in read[1].values() if keyword == "call"} - defined:
            for folder in sub_folders(job.ini):
                path = os.path.abspath(os.path.join(folder, name + ".ngc"))
                if _read(path) and path not in known:
                    known[path] = os.stat(path).st_mtime_ns
                    waiting.append(path)
    if any(re.match(r"(n\d+)?o\[", _plain(text)) for _, text in found.body):
        known[""] = time.monotonic_ns()
    return tuple(sorted(known.items()))


@lru_cache(maxsize=128)
def _run(found, job, _files):
    """Shape of a found sub; kept by the text of its file, the files it calls, and all it can read."""
    _check_text(found)
    result = _child(found, job)
    if result is None:
        loops = [n for n, text in found.body if (_o_word(text) or ("", ""))[1] in ("while", "do", "repeat", "call")]
        where = f" (loops and calls: line {', '.join(map(str, loops[:5]))})" if loops else ""
        raise CycleError(f"sub O{_name(found)}, line {found.first} of {_quoted(found.path)}, does not end within "
                         f"{_cpu_limit(found):g} s of computing time" + where, "correct the loop's condition, or make the sub simpler")
    last = result["moves"][-1][1] if result["moves"] else None
    for line, text in filter(None, (result["stop"], result["error"])):
        missing = re.search(r"EOF in file.*seeking o-word: o?<?(\w+)", text)
        text = f"there is no sub O{missing.group(1)}" if missing else text.rstrip(".")
        raise _fault(found, line or found.first, text, "correct the line", last)
    if not result["ended"]:
        raise _fault(found, result["line"] or found.first, "the program ends inside the sub", "take the M2 or M30 out of it")
    return _shape(found, job, result["moves"])


def _program(found, job):
    """Text for the runner: the sub definitions of the file, a mark before each line; the caller's state; the call."""
    lines, inside = [], None
    words = _read(found.path)[1]
    for number, text in enumerate(found.lines, 1):
        word = words.get(number)
        if inside is None and word and word[1] == "sub":
            inside = word[0]
        if inside is not None:
            lines += [f"({_MARK}{number})", text]
        if word == (inside, "endsub"):
            inside = None
    scale = 1.0 / (MM_PER_INCH if job.unit == "in" else 1.0)
    x, y, z = (value * scale for value in job.position)
    lines += ["G17 G40 G90 G91.1 G94", f"F{_decimal(job.feed if job.feed > 0 else 1000.0)}"]
    for number, (name, value) in enumerate(job.named):
        if math.isfinite(value):
            # names that LinuxCNC itself keeps exist already, and may be read-only
            lines += [f"o<chipwise-{number}> if [EXISTS[#<{name}>] EQ 0]", f"#<{name}> = {_decimal(value)}",
                      f"o<chipwise-{number}> endif"]
    lines += [f"G0 X{_decimal(x)} Y{_decimal(y)} Z{_decimal(z)}",
              ("G91" if job.incremental else "G90") + (" G90.1" if job.ijk_absolute else " G91.1"),
              f"({_BEGIN})", f"o{_name(found)} call", f"({_END})", "M2"]
    return "\n".join(lines) + "\n"


def _decimal(value):
    """A number LinuxCNC reads: it knows no exponents, and no lines of more than 255 characters."""
    if value == 0 or 1e-3 <= abs(value) < 1e15:
        return f"{value:.12f}"
    mantissa, _, exponent = f"{value:.17e}".partition("e")
    return f"[{mantissa} * 10 ** {int(exponent)}]" if int(exponent) > 0 else f"[{mantissa} / 10 ** {-int(exponent)}]"


_FOREIGN = re.compile(r"^\s*(REMAP|TOPLEVEL|PATH_PREPEND|PATH_APPEND|RS274NGC_STARTUP_CODE|ON_ABORT_COMMAND|"
                      r"PARAMETER_FILE|LOG_LEVEL|USER_M_PATH)\s*=", re.IGNORECASE)


_PATHS = re.compile(r"^\s*(SUBROUTINE_PATH|PROGRAM_PREFIX|WIZARD_ROOT)\s*=", re.IGNORECASE)


def _ini_text(path):
    """The INI file as the runner may see it: without remaps, Python and start-up codes, ~ as it is here."""
    try:
        with open(path, encoding="utf-8", errors="surrogateescape") as file:
            lines = [line for line in file if not _FOREIGN.match(line)]
    except OSError:
        return "[RS274NGC]\n"
    home = os.path.expanduser("~")
    return "".join(re.sub(r"(?<=[=:\s])~(?=/|:|\s)", lambda m: home, line) if _PATHS.match(line) else line for line in lines)


def _child(found, job):
    """Result of sub_runner.py, None where the sub does not end."""
    with tempfile.TemporaryDirectory(prefix="chipwise-") as folder:
        paths = {name: os.path.join(folder, name) for name in ("sub.ngc", "sub.ini", "sub.var")}
        texts = {"sub.ngc": _program(found, job), "sub.ini": _ini_text(job.ini),
                 "sub.var": "".join(f"{n} {v!r}\n" for n, v in job.numbered) or "5161 0\n"}
        for name, text in texts.items():
            with open(paths[name], "w", encoding="utf-8", errors="surrogateescape") as file:
                file.write(text)
        order = json.dumps({
            "program": paths["sub.ngc"], "parameters": paths["sub.var"], "units_per_mm": 1.0 / job.machine_unit,
            "tool": job.tool, "codes": ["G20" if job.unit == "in" else "G21", "G0"], "begin": _BEGIN, "end": _END,
            "mark": _MARK, "max_moves": MAX_MOVES, "cpu_s": _cpu_limit(found)})
        environment = {**os.environ, "HOME": folder, "INI_FILE_NAME": paths["sub.ini"], "LC_ALL": "C"}
        process = subprocess.Popen([PYTHON, "-s", RUNNER, str(os.getpid())], env=environment, text=True,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        answer = _answer(process, order)
    if answer is None:
        raise _fault(found, found.first, "the sub waits for something that does not come",
                     "look at the files that it calls on the SUBROUTINE_PATH")
    if process.returncode == -signal.SIGPROF:
        return None
    if process.returncode != 0:
        said = (answer[1].strip().splitlines() or [f"exit {process.returncode}"])[-1]
        raise _fault(found, found.first, f"LinuxCNC's interpreter did not run it ({said})", "see whether `rs274` runs")
    return json.loads(answer[0])


def _cpu_limit(found):
    """Computing time (s) the sub may take."""
    return CPU_S + round(LINE_S * len(found.body), 1)


def _answer(process, order):
    """(stdout, stderr) of the runner, None where it was given up: it computed nothing for STUCK_S.  Its computing time it
    limits itself."""
    had, since = -1.0, time.monotonic()
    while True:
        try:
            return process.communicate(order, timeout=0.5)
        except subprocess.TimeoutExpired:
            order = None                    # communicate() keeps what is left of it
        now = cpu_s(process.pid)
        if now != had:
            had, since = now, time.monotonic()
        elif time.monotonic() - since > STUCK_S:
            process.kill()
            process.communicate()
            return None


# ---- from moves to loops -------------------------------------------------------------------------------------------


def _shape(found, job, moves):
    """Loops of elements from the runner's moves, a new one after every G0 that goes somewhere."""
    here, loops, before = job.position, [[]], None
    for kind, line, *numbers in moves:
        there = tuple(numbers[:3])
        if not all(math.isfinite(v) for v in numbers):
            raise _fault(found, line, "a coordinate is not a finite number", "give every expression a value", before)
        if abs(there[2] - here[2]) > HEIGHT_MM:
            raise _fault(found, line, "a move in Z has no place in a contour sub",
                         "a contour lies in XY; heights are the words Z and R of the cycle", before)
        if kind != "rapid":
            loops[-1].append(_element(found, kind, line, here[:2], numbers, before))
        elif loops[-1] and math.dist(there[:2], loops[-1][-1].end) > job.close_gap:
            loops.append([])
        here, before = there, line
    kept = tuple(tuple(loop) for loop in loops if loop)
    if not kept:
        raise _fault(found, found.first, "the sub holds no G1, G2 or G3", "put the contour in it")
    return Shape(int(job.sub), found.path, kept, job.close_gap)


def _element(found, kind, line, start, numbers, before):
    """Element of a feed move or an arc."""
    end = tuple(numbers[:2])
    if kind == "feed":
        return LineElement(start, end, line)
    centre, turns = tuple(numbers[3:5]), int(numbers[5])
    if abs(turns) > 1:
        raise _fault(found, line, f"an arc of {abs(turns)} turns runs over itself", "leave P out", before)
    return ArcElement(start, end, centre, turns > 0, line)


# ---- from loops to contours ----------------------------------------------------------------------------------------


def shape_error(shape, error):
    """A ContourError of the kernel about a shape -> CycleError naming the sub."""
    problem, _, remedy = error.template.partition("; ")
    return CycleError(f"sub O{shape.sub} of {_quoted(shape.file)}: {problem}", remedy, **error.lengths)


def contours(shape):
    """Contour of every loop, in order; CycleError for what is no contour."""
    try:
        made = tuple(make_contour(list(loop), shape.close_gap) for loop in shape.loops)
        for contour in made:
            refuse_nearly_closed(contour, shape.close_gap)
        return made
    except ContourError as error:
        raise shape_error(shape, error) from error


def _refuse_near_gaps(shape):
    """Loops of which one begins where another ends, but for a gap: parts of one contour."""
    for loop, other in zip(shape.loops, shape.loops[1:]):
        gap = math.dist(loop[-1].end, other[0].start)
        if gap <= NEARLY_CLOSED_MM and math.dist(loop[-1].end, loop[0].start) > gap:
            x, y = other[0].start
            raise CycleError(f"sub O{shape.sub} of {_quoted(shape.file)}: the contour is not connected: line {loop[-1].line} "
                             f"ends {{gap}} from where line {other[0].line} starts, more than the {{most}} that are closed",
                             f"end line {loop[-1].line} at X{{x}} Y{{y}}", gap=gap, most=shape.close_gap, x=x, y=y)


def one_contour(shape):
    """The Contour of a sub that holds exactly one."""
    if len(shape.loops) > 1:
        _refuse_near_gaps(shape)
        lines = ", ".join(f"line {loop[0].line}" for loop in shape.loops[:4])
        raise CycleError(f"sub O{shape.sub} of {_quoted(shape.file)} holds {len(shape.loops)} contours (from {lines}), "
                         "separated by G0", "use one sub for each")
    return contours(shape)[0]
