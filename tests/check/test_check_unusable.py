# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check on what cannot be checked: it is named, the rest goes on, and neither processes nor files are
left."""

import os
import re
import subprocess
import time

import pytest

from support import ROOT, forked
from support.check_runs import CHIPWISE, HEAD, STOCK, SLOT, chipwise_check, mill_with_tools


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


BAD = {
    "endless": (HEAD + "o1 while [1]\n#1 = 1\no1 endwhile\nM2\n", "does not end"),
    "endless moves": (SLOT.replace("G0 Z5\nM2", "o1 while [1]\nG1 X0\nG1 X1\no1 endwhile\nM2"), "computing time"),
    "binary": (b"\x7fELF\0\0\0\1" * 100, "not a text file"),
    "empty": ("", "empty"),
    "byte order mark": (
        SLOT.encode("utf-8-sig"),
        "it begins with a byte order mark, which LinuxCNC refuses; save it as UTF-8 without one (line 1)",
    ),
    "CR alone": (
        SLOT.replace("\n", "\r").encode(),
        "its lines end with CR alone, so LinuxCNC reads it as one line; save it with LF or CR LF at the ends (line 1)",
    ),
    "unknown code": (SLOT.replace("G1 X110", "G1234 X110"), "line 7"),
    "unknown word": (SLOT.replace("G1 X110", "G1 X110 @@"), "line 7"),
    "tool 0": (SLOT.replace("T1 M6", "T0 M6"), "tool 0"),
    "no tool": (SLOT.replace("T1 M6\n", ""), "tool 0"),
    "no diameter": (
        SLOT.replace("T1 M6", "T4 M6"),
        "tool 4 has no diameter in the tool table; give it a D there, or name it with --tool-diameter (line 7)",
    ),
    "unknown tool": (SLOT.replace("T1 M6", "T99 M6"), "99"),
    "per revolution": (SLOT.replace("G1 X110", "G95 G1 X110").replace("S8000 M3", "M5"), "zero spindle speed"),
    "one move per revolution": (
        SLOT.replace("G1 X110 F400", "G1 X50 F400\nG95 G1 X80 F0.1\nG94 F400 X110").replace("S8000 M3", "M5"),
        "Cannot feed with zero spindle speed in feed per rev mode; correct the line (line 8)",
    ),
    "no feed": (SLOT.replace(" F400", ""), "feed"),
    "no sub": (SLOT.replace("G1 X110 F400", "o<nothing> call"), "nothing"),
    "restored": (SLOT.replace(STOCK, "M254 P1\n"), "M254"),
    "far": (SLOT.replace("X110", "X1e9".replace("e", "0000000000")), "100 m"),
}

WITHOUT_TOOL = ("tool 0", "no tool", "no diameter", "unknown tool")  # what else is known of such a program is said


@pytest.mark.parametrize("name", BAD)
def test_unusable(tmp_path, machine, name):
    text, said = BAD[name]
    before = os.times()
    status, out, err, report = chipwise_check(tmp_path, {"bad.ngc": text}, "--time-limit", "5", machine=machine)
    assert status == 2 and re.search(re.escape(said), out), (out, err)
    assert report["programs"][0]["error"] and len(out.strip().splitlines()) == (4 if name in WITHOUT_TOOL else 1)
    assert sum(os.times()[2:4]) - sum(before[2:4]) < 120  # s of computing


def test_unusable_files(tmp_path):
    (tmp_path / "folder").mkdir()
    big = tmp_path / "big.ngc"
    with open(big, "wb") as file:
        file.truncate(200_000_000)
    os.mkfifo(tmp_path / "fifo.ngc")
    for path, said in (
        (big, "200 MB"),
        (tmp_path / "none.ngc", "No such file"),
        (tmp_path / "fifo.ngc", "regular file"),
    ):
        done = forked.run([CHIPWISE, "check", path], timeout=300)
        assert done.returncode == 2 and said in done.stdout
    done = forked.run([CHIPWISE, "check", tmp_path / "folder"], timeout=300)
    assert done.returncode == 2 and "no program" in done.stderr
    for options in (
        ["--jobs", "0"],
        ["--cell", "0"],
        ["--ini", "/nowhere.ini"],
        ["--json", "/nowhere/x.json"],
        ["--stock", "0", "0", "0", "0", "1", "1"],
        ["--time-limit", "nan"],
    ):
        done = forked.run([CHIPWISE, "check", tmp_path / "none.ngc", *options], timeout=300)
        assert done.returncode == 2 and done.stderr.startswith("chipwise: check: "), options
        assert len(done.stderr.strip().splitlines()) == 1


def test_an_include_that_is_missing_is_named(tmp_path):
    machine = tmp_path / "machine.ini"
    machine.write_text("#INCLUDE none.inc\n")
    _status, _out, err, _report = chipwise_check(tmp_path, {"a.ngc": SLOT}, machine=machine)
    assert f"machine.ini: #INCLUDE {tmp_path}/none.inc: No such file or directory; correct the line" in err


def test_many_programs_one_bad_and_progress(tmp_path):
    programs = {f"p{k}.ngc": SLOT.replace("X110", "X" + ("110" if k != 2 else "@")) for k in range(5)}
    status, out, err, report = chipwise_check(
        tmp_path,
        programs,
        "--jobs",
        "2",
        "--report",
        str(tmp_path / "page.html"),
        environment={"AXIS_PROGRESS_BAR": "1"},
    )
    written = (tmp_path / "page.html").read_text()
    assert written.count("<section") == 5 and written.count("Removal rate, cm3/min, over time") == 4
    assert status == 2 and [p["status"] for p in report["programs"]] == [0, 0, 2, 0, 0]
    assert [os.path.basename(p["program"]) for p in report["programs"]] == sorted(programs)
    assert out.count("no findings") == 4
    shown = [int(n) for n in re.findall(r"^FILTER_PROGRESS=(\d+)$", err, re.MULTILINE)]
    assert shown == sorted(set(shown)) and len(shown) <= 100 and all(0 < n < 100 for n in shown)


def test_a_killed_worker_is_named_and_the_rest_goes_on(tmp_path):
    import signal
    from chipwise.check import run

    original = run.check
    run.check = lambda program, **_: (
        os.kill(os.getpid(), signal.SIGKILL) if "bad" in program else original(program, **_)
    )
    try:
        from chipwise.program.reader import Machine

        for name in ("a.ngc", "bad.ngc", "z.ngc"):
            (tmp_path / name).write_text(SLOT)
        machine = Machine(os.path.join(ROOT, "configs", "mill.ini"))
        found = dict(run.check_all([str(tmp_path / n) for n in ("a.ngc", "bad.ngc", "z.ngc")], 2, machine=machine))
    finally:
        run.check = original
    assert [found[k].status for k in range(3)] == [0, 2, 0] and "signal 9" in found[1].error[0]


def test_nothing_is_left_behind(tmp_path):
    """Neither processes nor files, when the command is ended in the middle."""
    text = HEAD + STOCK + "T1 M6\nG0 X0 Y0 Z5\nF6000\nG1 Z-1\no1 while [1]\nG1 X50\nG1 X0\no1 endwhile\nM2\n"
    (tmp_path / "endless.ngc").write_text(text)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    process = subprocess.Popen(
        [CHIPWISE, "check", str(tmp_path / "endless.ngc")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(scratch)},
    )
    for _ in range(6000):
        if any(scratch.iterdir()):
            break
        time.sleep(0.05)
    assert any(scratch.iterdir())
    process.terminate()
    assert process.wait(timeout=300) == 143
    assert not list(scratch.iterdir())
    until, marked = time.monotonic() + 300.0, True  # a process that was being started sees its parent's end itself
    while marked and time.monotonic() < until:
        marked = [pid for pid in os.listdir("/proc") if pid.isdigit() and _is_about(pid, str(scratch))]
        time.sleep(0.05)
    assert not marked


def _is_about(pid, text):
    try:
        with open(f"/proc/{pid}/environ", "rb") as file:
            return text.encode() in file.read()
    except OSError:
        return False


def test_the_time_of_children_counts():
    """A program whose cycle is being planned in another process is not stuck."""
    from chipwise.host.processes import cpu_s, tree_cpu_s

    process = subprocess.Popen(["/bin/sh", "-c", "sh -c 'while :; do :; done' & wait"], start_new_session=True)
    try:
        end = time.monotonic() + 300
        while tree_cpu_s(process.pid) < 0.3 and time.monotonic() < end:
            time.sleep(0.05)
        assert tree_cpu_s(process.pid) >= 0.3 and cpu_s(process.pid) < 0.2
    finally:
        os.killpg(process.pid, 9)
        process.wait()


def test_a_program_that_waits_for_a_file_is_given_up(tmp_path, monkeypatch):
    """A sub that is a FIFO nobody writes to."""
    from chipwise.program import reader
    from chipwise.check.answer import check

    monkeypatch.setattr(reader, "STUCK_S", 2.0)
    subs = tmp_path / "subs"
    subs.mkdir()
    os.mkfifo(subs / "wait.ngc")
    with open(os.path.join(ROOT, "configs", "mill.ini"), encoding="utf-8") as file:
        text = file.read().replace("SUBROUTINE_PATH = nc_files:../nc_files", f"SUBROUTINE_PATH = {subs}")
    text = text.replace("= remap", f"= {ROOT}/remap").replace("= tools.toml", f"= {ROOT}/configs/tools.toml")
    (tmp_path / "mill.ini").write_text(text.replace("= mill.tbl", f"= {ROOT}/configs/mill.tbl"))
    (tmp_path / "part.ngc").write_text(SLOT.replace("G1 X110 F400", "o<wait> call"))
    result = check(str(tmp_path / "part.ngc"), reader.Machine(str(tmp_path / "mill.ini")))
    assert result.status == 2 and "does not answer" in result.error[0]


def test_no_lines_for_a_filter_in_a_shell(tmp_path, monkeypatch):
    """FILTER_PROGRESS= is for the GUIs, which set AXIS_PROGRESS_BAR; into a file or a pipe it is noise."""
    monkeypatch.delenv("AXIS_PROGRESS_BAR", raising=False)
    programs = {f"p{k}.ngc": SLOT for k in range(3)}
    status, _out, err, _report = chipwise_check(tmp_path, programs)
    assert status == 0 and err == ""
