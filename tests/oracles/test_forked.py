# SPDX-License-Identifier: GPL-2.0-or-later
"""A forked bin/chipwise, preview or rs274 (support/forked.py) is one that an interpreter was started for: the same
output, status, surroundings and end."""

import json
import os
import shutil
import signal
import subprocess
import threading
import time

import pytest

from chipwise.host.processes import stat_fields
from chipwise.program.reader import Machine, Reader
from support import ROOT, forked
from support.canon import PYTHON, write_ini, write_tools

SLOT = (
    "G21 G90 G17 G40 G49 G80 G94\nM250 P0 Q0 R-20 I100 J60 K20\nT1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\n"
    "G1 X110 F400\nG0 Z5\nM2\n"
)
# In place of bin/chipwise: what a program sees of itself.
LOOK = """
import json, os, resource, signal, sys, threading
print(json.dumps({
    "argv": sys.argv[1:], "name": __name__, "path": sys.path[:2], "cwd": os.getcwd(), "environment": dict(os.environ),
    "signals": [str(signal.getsignal(number)) for number in range(1, 32) if number not in (9, 19)],
    "masked": [int(number) for number in signal.pthread_sigmask(signal.SIG_BLOCK, [])],
    "handles": [name for name in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{name}")],
    "input": sys.stdin.read(),
    "streams": [(stream.encoding, stream.errors, stream.line_buffering, stream.write_through,
                 type(stream.buffer).__name__, stream.fileno())
                for stream in (sys.stdin, sys.stdout, sys.stderr)],
    "limits": [resource.getrlimit(number) for number in range(16)], "threads": threading.active_count(),
    "session": os.getsid(0),
    "group": os.getpgid(0), "nice": os.nice(0), "umask": os.umask(0),
    "children": open("/proc/self/task/%d/children" % os.getpid()).read()}))
print("to stderr", file=sys.stderr)
"""


def both(folder, *arguments, env=None, program=None):
    """What a forked process and a started one give: status, output, errors."""
    command = [forked.CHIPWISE if program is None else str(program), *arguments]
    done = [
        forked.run(command, timeout=300, cwd=folder, env=env),
        subprocess.run(
            command, text=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=300, cwd=folder, env=env
        ),
    ]
    return [(one.returncode, one.stdout, one.stderr) for one in done]


@pytest.fixture
def another(tmp_path, monkeypatch):
    """Path of a program that is run in place of bin/chipwise; text(program)."""

    def text(program):
        path = tmp_path / "bin" / "chipwise"
        path.parent.mkdir()
        path.write_text(f"#!/usr/bin/python3\n{program}")
        path.chmod(0o755)
        monkeypatch.setattr(forked, "CHIPWISE", str(path))
        return path

    return text


@pytest.mark.parametrize("name, text", [("slot.ngc", SLOT), ("bad.ngc", "G1 X1\nM2\n"), ("none.ngc", None)])
def test_the_same_answer(name, text, tmp_path):
    if text is not None:
        (tmp_path / name).write_text(text)
    ours, theirs = both(tmp_path, "check", name)
    assert ours == theirs


@pytest.mark.parametrize(
    "command",
    [
        f"contour {ROOT}/nc_files/contour.ngc --sub 100 --tool 12 -o out.svg",
        f"patterns --folder {ROOT}/nc_files/patterns --json out.svg",
        "surface none.stl -o out.svg --tool 4 --step 1",
        "new-config out.svg",
    ],
)
def test_the_same_answer_and_file(command, tmp_path):
    """With what is written to the output file."""
    found = []
    for call in (forked.run, subprocess.run):
        how = {} if call is forked.run else {"text": True, "stdin": subprocess.DEVNULL, "capture_output": True}
        done, out = call([forked.CHIPWISE, *command.split()], timeout=300, cwd=tmp_path, **how), tmp_path / "out.svg"
        found.append((done.returncode, done.stdout, done.stderr, out.is_file() and out.read_bytes()))
        shutil.rmtree(out) if out.is_dir() else out.unlink(missing_ok=True)
    assert found[0] == found[1] and (found[0][3] or done.returncode == 2 or "new-config" in command), found


def test_usage_is_refused_the_same(tmp_path):
    ours, theirs = both(tmp_path, "check", "--depth")
    assert ours == theirs and ours[0] == 2


def test_the_same_surroundings(another, tmp_path):
    program = another(LOOK)
    (tmp_path / "work").mkdir()
    (ours, out, errors), (theirs, expected, expected_errors) = both(
        tmp_path / "work", "a", "--b", env={**os.environ, "OWN": "ä\udcff", "HOME": str(tmp_path)}, program=program
    )
    out, expected = json.loads(out), json.loads(expected)
    for found in (out, expected):
        assert found["handles"][:3] == ["0", "1", "2"]
        found["handles"] = len(found["handles"])
        found["path"] = found["path"][0]
    assert (ours, errors) == (theirs, expected_errors)
    assert not {name: (out[name], expected[name]) for name in expected if out[name] != expected[name]}


def test_nothing_of_a_call_is_left_for_the_next(another, tmp_path):
    program = another(
        "import json, os, sys\nprint(os.getcwd(), os.environ.pop('LEFT', ''), getattr(json, 'left', ''))\n"
        "json.left = os.environ['LEFT'] = 'left'\nos.chdir('/')\nos.umask(0o777)\nprint(os.umask(0))\n"
    )
    first, _ = both(tmp_path, program=program)
    second, started = both(tmp_path, program=program)
    assert second == started and second[1].split("\n")[0] == first[1].split("\n")[0] == f"{tmp_path}  "


@pytest.mark.parametrize(
    "end, status",
    [
        ("sys.exit(3)", 3),
        ("sys.exit('why')", 1),
        ("sys.exit()", 0),
        ("raise KeyError('key')", 1),
        ("os.kill(os.getpid(), 9)", -9),
        ("os.abort()", -6),
        ("os._exit(7)", 7),
        ("signal.raise_signal(signal.SIGINT)", -signal.SIGINT),
        ("import atexit; atexit.register(print, 'at the end')", 0),
    ],
)
def test_the_same_end(end, status, another, tmp_path):
    program = another(f"import os, signal, sys\nprint('begun', flush=True)\n{end}\n")
    ours, theirs = both(tmp_path, program=program)
    assert ours[:2] == theirs[:2] and ours[0] == status
    assert ours[2].splitlines()[-1:] == theirs[2].splitlines()[-1:] and ("Traceback" in ours[2]) == (
        "Traceback" in theirs[2]
    )


def test_one_that_does_not_end_is_killed(another, tmp_path):
    program = another(
        "import os, time\nprint(os.getpid(), end='', file=open('pid', 'w'), flush=True)\ntime.sleep(600)\n"
    )
    for timeout in (2, 20, 200):  # a busy computer may take seconds to begin
        with pytest.raises(subprocess.TimeoutExpired):
            forked.run([str(program)], timeout=timeout, cwd=tmp_path)
        if (tmp_path / "pid").exists() and (tmp_path / "pid").read_text():
            break
    pid = int((tmp_path / "pid").read_text())
    while os.path.exists(f"/proc/{pid}"):
        time.sleep(0.05)
    program.write_text("#!/usr/bin/python3\nprint('next')\n")
    assert forked.run([str(program)], timeout=300, cwd=tmp_path).stdout == "next\n"


def test_two_at_once(another, tmp_path):
    """Each waits for the other: neither server nor caller does one after the other."""
    program = another(
        "import os, sys, time\nopen(sys.argv[1], 'w').close()\n"
        "while not os.path.exists(sys.argv[2]): time.sleep(0.01)\nprint(sys.argv[1])\n"
    )
    found = []
    threads = [
        threading.Thread(
            target=lambda names=names: found.append(
                forked.run([str(program), *names], timeout=300, cwd=tmp_path).stdout
            )
        )
        for names in (("a", "b"), ("b", "a"))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == ["a\n", "b\n"]


def test_another_library_or_language_starts_an_interpreter(another, tmp_path):
    program = another("import sys\nprint('chipwise.check' in sys.modules)\n")
    for env, expected in (
        (os.environ, "True\n"),
        ({**os.environ, "CHIPWISE_CORE": "other.so"}, "False\n"),
        ({**os.environ, "LC_ALL": "C"}, "False\n"),
    ):
        assert forked.run([str(program)], timeout=300, cwd=tmp_path, env=env).stdout == expected


HOLE = "G21 G90\nT1 M6\nS8000 M3 F300\nG0 X0 Y0 Z5\nG12 I5 Z-2 H0\nM2\n"
CONTOUR = (
    "G21 G90\nT1 M6\nS8000 M3 F300\nG0 X-20 Y-20 Z5\nG77 P42 Q100 Z-1\nM2\nO100 sub\nG1 X0 Y0\nX20\nY20\nO100 endsub\n"
)
REFUSED = HOLE.replace("I5", "I0.1")
# What the interpreter sees of its planner: its parent, whether it runs, whether it was forked, and how it ends.
SEEN = """G21 G90
T1 M6
S8000 M3 F300
G0 X0 Y0 Z5
G12 I5 Z-2 H0
;py,from chipwise.planner import client
;py,from chipwise.host.processes import stat_fields
;py,import os
;py,pid = client._current.pid
;py,forked = 'fork_server' in open(f'/proc/{pid}/cmdline').read()
;py,print('planner:', int(stat_fields(pid)[1]) == os.getpid(), client._current.alive, forked, client._current.end())
M2
"""


def three(folder, text, kind, started):
    """(status, output, errors) of a program in a preview or rs274."""
    (folder / "program.ngc").write_text(text)
    (folder / "test.var").write_text("5161 0\n")
    table = write_tools(folder, {1: 2.0}, 1.0 if kind == "preview" else 25.4)
    ini = write_ini(folder)
    env = {**os.environ, "HOME": str(folder), "INI_FILE_NAME": str(ini)}
    arguments = (
        [str(folder / "program.ngc"), "1.0", str(table), str(folder / "test.var")]
        if kind == "preview"
        else ["-g", "-i", str(ini), "-t", str(table), "-v", str(folder / "test.var"), str(folder / "program.ngc")]
    )
    if started:
        done = subprocess.run(
            [*([PYTHON, forked.PREVIEW] if kind == "preview" else ["rs274"]), *arguments],
            cwd=ROOT,
            env=env,
            text=True,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=300,
        )
    else:
        done = getattr(forked, kind)(arguments, cwd=ROOT, env=env, timeout=300)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("kind", ["preview", "rs274"])
@pytest.mark.parametrize(
    "text, moves",
    [(HOLE, True), (CONTOUR, True), (REFUSED, False), ("G1 X1\n", False)],
    ids=["hole", "contour", "refused", "no feed"],
)
def test_the_same_moves(kind, text, moves, tmp_path):
    ours, theirs = (three(tmp_path, text, kind, started) for started in (False, True))
    assert ours == theirs
    assert (theirs[1].count('"feed"') + theirs[1].count('"arc"') + theirs[1].count("_FEED(") > 3) == moves


@pytest.mark.parametrize("kind, started", [("preview", False), ("rs274", False), ("rs274", True)])
def test_the_planner_is_a_child_of_the_interpreter(kind, started, tmp_path):
    """Forked or started, and ends as one when it is killed."""
    _, out, errors = three(tmp_path, SEEN, kind, started)
    assert [line.split() for line in (out + errors).splitlines() if line.startswith("planner: ")] == [
        ["planner:", "True", "True", str(not started), "-9"]
    ]


# ---- here() ------------------------------------------------------------------------------------------------------


def read_here(folder):
    """(blocks of a program, whether its reader was forked, whether it is this process's child)."""
    (folder / "slot.ngc").write_text(SLOT)
    with Reader(str(folder / "slot.ngc"), Machine(str(ROOT / "configs" / "mill.ini"))) as reader:
        pid = reader._child.pid
        with open(f"/proc/{pid}/cmdline") as file:
            is_forked = "fork_server" in file.read()
        is_ours = int(stat_fields(pid)[1]) == os.getpid()
        return b"".join(block.tobytes() for block in reader), is_forked, is_ours


def test_a_reader_of_this_process(tmp_path):
    """Forked in here() and as before behind it, with the same blocks; each is waited for."""
    started, began = read_here(tmp_path), subprocess.Popen
    with forked.here():
        ours = [read_here(tmp_path) for _ in range(2)]
    behind = read_here(tmp_path)
    assert started[0] and {one[0] for one in (*ours, behind)} == {started[0]}
    assert [one[1:] for one in (started, *ours, behind)] == [(False, True), (True, True), (True, True), (False, True)]
    assert subprocess.Popen is began


def test_what_is_killed_in_here_leaves_nothing(tmp_path):
    """A reader that is killed while it reads has a nursery and may have a planner: they end, and are waited for."""
    (tmp_path / "loop.ngc").write_text("o1 while [1]\nG4 P0\no1 endwhile\nM2\n")
    with forked.here():
        other = subprocess.Popen(["sleep", "600"])
        before = children()
        for _ in range(3):
            with Reader(str(tmp_path / "loop.ngc"), Machine(str(ROOT / "configs" / "mill.ini"))) as reader:
                assert reader._child.poll() is None
        other.kill()
        assert other.wait() == -signal.SIGKILL  # and not somebody else's
    assert children() <= before - {other.pid}


def children():
    return {
        int(pid)
        for task in os.listdir("/proc/self/task")
        for pid in open(f"/proc/self/task/{task}/children").read().split()
    }
