# SPDX-License-Identifier: GPL-2.0-or-later
"""A program that makes LinuxCNC's interpreter run Python or a shell is refused with its line, wherever chipwise would
read it, and has run nothing."""

import os
import subprocess
import sys

import pytest

from chipwise.program import program_code
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import read_shape
from chipwise.errors import CycleError
from chipwise.panel import look_ahead_process
from chipwise.pattern.job import PatternJob
from chipwise.pattern.run import read_pattern
from support import ROOT, canon, forked
from support.check_runs import CHIPWISE, SLOT, chipwise_check, mill_with_tools
from support.filter_runs import mill_ini, run as run_filter
from support.scenes import SCENE

MARK = "chipwise_ran"  # a file that what runs would write
LINE = 7  # of SLOT, replaced by what runs

# each writes the file MARK in a way of its own; {folder}: of the test, on Python's path, with the module `mark`
RUNS = {
    "parentheses": "(py,import mark)",
    "blanks and case": "S8000 ( \t PY,import mark)",
    "a file": "(pyrun,{folder}/mark.py)",
    "semicolon": ";py,import mark",
    "last of two comments": "(slot) (py,import mark)",
    "a shell": "o<$(touch {folder}/{mark})> call",
    "a shell, spaced": "O <$(touch {folder}/{mark})> c a l l [3]",
}
# nothing of these runs anything
QUIET = [
    "; (py,import mark)",
    "S8000 ;py,import mark",
    "(copy,import mark)",
    "(py;import mark)",
    "(see o<$HOME> call)",
    "(occupy, run)",
    "(pyramid)",
]


@pytest.fixture(name="folder")
def make_folder(tmp_path, monkeypatch):
    """A folder on Python's path with a module that writes MARK."""
    (tmp_path / "mark.py").write_text(f"open({str(tmp_path / MARK)!r}, 'w').close()\n")
    monkeypatch.setenv(
        "PYTHONPATH", str(tmp_path), prepend=os.pathsep
    )  # behind it what a LinuxCNC that is run in place has there
    return tmp_path


@pytest.fixture(name="machine")
def make_machine(folder):
    return mill_with_tools(folder)


def text_of(line, folder):
    return SLOT.replace("G1 X110 F400", line.format(folder=folder, mark=MARK) + "\nG1 X110 F400")


@pytest.mark.parametrize("name", RUNS)
def test_refused_with_its_line(folder, machine, name):
    status, out, _err, report = chipwise_check(folder, {"part.ngc": text_of(RUNS[name], folder)}, machine=machine)
    shell = "shell" in name
    assert status == 2 and report["programs"][0]["error_line"] == LINE, out
    assert (
        "has the name of a sub expanded by a shell" if shell else "it runs Python: "
    ) in out and f"(line {LINE})" in out
    assert ("PROGRAM_PYTHON" in out) != shell
    assert not (folder / MARK).exists()


@pytest.mark.parametrize("line", QUIET)
def test_what_runs_nothing_is_read(folder, machine, line):
    status, out, _err, _report = chipwise_check(folder, {"part.ngc": text_of(line, folder)}, machine=machine)
    assert status == 0 and not (folder / MARK).exists(), out


CALLS = {
    "named": ("o<helper> call", "helper", "o<helper> sub\n{}\no<helper> endsub\nM2\n"),
    "numbered": ("O 0300 Call", "300", "o300 sub\n{}\no300 endsub\nM2\n"),
    "M98": ("M98 P300", "300", "O300\n{}\nM99\nM2\n"),
    "an expression": ("o[200 + 100] call", "300", "o300 sub\n{}\no300 endsub\nM2\n"),
}


@pytest.mark.parametrize("what", ["parentheses", "semicolon", "a shell"])
@pytest.mark.parametrize("name", CALLS)
def test_a_file_on_the_subroutine_path(folder, machine, name, what):
    call, file, text = CALLS[name]
    (machine.parent / "subs" / f"{file}.ngc").write_text(text.format(RUNS[what].format(folder=folder, mark=MARK)))
    status, out, _err, _report = chipwise_check(folder, {"part.ngc": text_of(call, folder)}, machine=machine)
    assert status == 2 and f"{file}.ngc, which it may call, " in out and "in line 2" in out, out
    assert not (folder / MARK).exists()


def test_a_file_called_by_a_file(folder, machine):
    subs = machine.parent / "subs"
    (subs / "one.ngc").write_text("o<one> sub\no<two> call\no<one> endsub\nM2\n")
    (subs / "two.ngc").write_text("o<two> sub\n(py,import mark)\no<two> endsub\nM2\n")
    status, out, _err, _report = chipwise_check(folder, {"part.ngc": text_of("o<one> call", folder)}, machine=machine)
    assert (
        status == 2
        and "two.ngc, which it may call, runs Python: (py,import mark) in line 2" in out
        and not (folder / MARK).exists()
    ), out


def test_what_the_text_hides_is_seen_when_it_runs(folder, machine, monkeypatch):
    """The second defence alone: without the search of the text."""
    code = (
        "import sys\n"
        "from chipwise.program import program_code; program_code.first_code = lambda *_: None\n"
        "from chipwise.program.reader import Machine, Reader, Unreadable\n"
        "try:\n"
        "    with Reader(sys.argv[1], Machine(sys.argv[2])) as reader:\n"
        "        for block in reader: pass\n"
        "except Unreadable as error: print(error, error.line)\n"
    )
    env = {**os.environ, "PYTHONPATH": f"{ROOT / 'remap'}{os.pathsep}{os.environ['PYTHONPATH']}"}
    for name in ("parentheses", "a file", "semicolon"):
        (folder / "part.ngc").write_text(text_of(RUNS[name], folder))
        done = subprocess.run(
            [sys.executable, "-c", code, str(folder / "part.ngc"), str(machine)],
            cwd=ROOT,
            env=env,
            text=True,
            capture_output=True,
            timeout=300,
        )
        assert "part.ngc runs Python" in done.stdout and not (folder / MARK).exists(), (name, done.stdout, done.stderr)


def test_the_owner_of_the_machine_may_allow_it(folder, machine):
    machine.write_text(machine.read_text().replace("[CHIPWISE]\n", "[CHIPWISE]\nPROGRAM_PYTHON = yes\n", 1))
    for name, line in RUNS.items():
        (folder / MARK).unlink(missing_ok=True)
        status, out, _err, _report = chipwise_check(folder, {"part.ngc": text_of(line, folder)}, machine=machine)
        assert (status, (folder / MARK).exists()) == ((2, False) if "shell" in name else (0, True)), (name, out)


def test_remapped_codes_of_the_machine_run(folder, machine):
    """Python functions as ever, and Python in the file of a remapped code, which is the machine's own; called by the
    program it is not."""
    machine.write_text(
        machine.read_text().replace("[RS274NGC]\n", "[RS274NGC]\nREMAP = M410 modalgroup=10 ngc=own\n", 1)
    )
    (machine.parent / "subs" / "own.ngc").write_text("o<own> sub\n(py,import mark)\no<own> endsub\nM2\n")
    status, out, _err, _report = chipwise_check(folder, {"part.ngc": text_of("M410", folder)}, machine=machine)
    assert status == 0 and (folder / MARK).exists(), out
    (folder / MARK).unlink()
    status, out, _err, _report = chipwise_check(
        folder, {"part.ngc": text_of("M410\no<own> call", folder)}, machine=machine
    )
    assert status == 2 and not (folder / MARK).exists(), out


@pytest.mark.parametrize("command", ["rewrite", "try"])
@pytest.mark.parametrize("name", ["parentheses", "semicolon", "a shell"])
def test_the_other_commands(folder, machine, command, name):
    (folder / "part.ngc").write_text(text_of(RUNS[name], folder))
    options = ["-o", str(folder / "out.ngc"), "--flute"] if command == "rewrite" else []
    done = forked.run([CHIPWISE, command, folder / "part.ngc", "--ini", machine, *options], timeout=300)
    said = done.stdout + done.stderr
    assert done.returncode and f"(line {LINE})" in said and "Traceback" not in said and not (folder / MARK).exists(), (
        said
    )


@pytest.mark.parametrize("broken", [False, True])
def test_the_filter_gives_no_such_program_to_the_screen(folder, broken):
    """Its preview would execute it; also if the settings cannot be read."""
    ini = mill_ini(folder)
    if broken:
        ini("CELL = none")
    (folder / "part.nc").write_text(text_of(RUNS["parentheses"], folder))
    done = run_filter(ini.path, folder / "part.nc", folder)
    assert (
        done.status == 2 and b"mark" not in done.data and f"(line {LINE})" in done.said and not (folder / MARK).exists()
    ), done


def test_the_reader_of_the_panel(folder, machine):
    (folder / "part.ngc").write_text(text_of(RUNS["parentheses"], folder))
    scene = {**SCENE, "tool": 0, "codes": ""}
    head, path = look_ahead_process.read(
        {"ini": str(machine), "program": str(folder / "part.ngc"), "scene": scene, "tip": (0, 0, 0)}, str(folder)
    )
    assert "runs Python" in head["note"] and head["line"] == LINE and path is None and not (folder / MARK).exists()


def job_of(folder, line):
    """A sub O100 with a line in it that calls a file 300.ngc, or runs something itself."""
    ini = canon.write_ini(folder)
    ini.write_text(
        "\n".join(
            f"SUBROUTINE_PATH = {folder}" if row.startswith("SUBROUTINE_PATH") else row
            for row in ini.read_text().splitlines()
        )
    )
    (folder / "part.ngc").write_text(f"(py,import mark)\no100 sub\nG0 X0 Y0\n{line}\nG1 X5 F100\no100 endsub\nM2\n")
    return Job(
        program=str(folder / "part.ngc"), sub=100, ini=str(ini), position=(0.0, 0.0, 5.0), tool=(1, 2.0), feed=100.0
    )


@pytest.mark.parametrize("where", ["sub", "file"])
@pytest.mark.parametrize("name", ["parentheses", "semicolon", "a shell"])
@pytest.mark.parametrize(
    "read", [lambda job: read_pattern(PatternJob(job, spindle=(3, 1000.0))), read_shape], ids=["pattern", "contour"]
)
def test_a_sub(folder, monkeypatch, read, name, where):
    """What the program has outside of it does not count: the machine has executed it."""
    monkeypatch.chdir(os.path.join(ROOT, "configs"))
    line = RUNS[name].format(folder=folder, mark=MARK)
    (folder / "300.ngc").write_text(f"o300 sub\n{line}\no300 endsub\n")
    job = job_of(folder, line if where == "sub" else "o300 call")
    with pytest.raises(CycleError) as caught:
        read(job)
    said = str(caught.value)
    assert (
        ("expanded by a shell" if name == "a shell" else "runs Python") in said
        and "line 4" in said
        or "300.ngc" in said
    ), said
    assert not (folder / MARK).exists()


@pytest.mark.parametrize(
    "read", [lambda job: read_pattern(PatternJob(job, spindle=(3, 1000.0))), read_shape], ids=["pattern", "contour"]
)
def test_a_sub_without(folder, monkeypatch, read):
    monkeypatch.chdir(os.path.join(ROOT, "configs"))
    read(job_of(folder, "G1 X2 F100"))
    assert not (folder / MARK).exists()


@pytest.mark.parametrize("what", [";py,import mark", "o<$(touch {folder}/{mark})> call"])
@pytest.mark.parametrize("where", ["program", "sub"])
def test_a_byte_that_ends_a_line(folder, machine, what, where):
    """fgets() reads 254 bytes and the interpreter ends a line at a NUL: what comes behind is a line of its own."""
    hidden = "; a comment\0" + "x" * 242 + what.format(folder=folder, mark=MARK)
    (machine.parent / "subs" / "sub.ngc").write_text(f"o<sub> sub\n{hidden}\no<sub> endsub\n")
    text = text_of(hidden if where == "program" else "o<sub> call", folder)
    status, out, _err, _report = chipwise_check(
        folder, {"part.ngc": "".join(f"({'x' * 90})\n" for _ in range(1000)) + text}, machine=machine
    )
    assert status == 2 and "is not a text file, it has a byte 0" in out and not (folder / MARK).exists(), out


def test_lines_that_are_looked_at():
    data = b"G1 X1.234 Y2.345 Z-3.45 (slot)\n" * 100_000 + b"(py,x)\n"
    assert [number for number, _line in program_code.odd_lines(data)] == [100_001]
