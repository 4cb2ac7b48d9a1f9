# SPDX-License-Identifier: GPL-2.0-or-later
"""Ends of bin/chipwise filter: endless loops, want of time, of memory and of room on the disk, closed handles,
signals."""

import os
import signal
import subprocess
import sys
import time

import pytest

from chipwise.filter import work
from chipwise.filter.loops import may_loop
from chipwise.filter.process import Work
from chipwise.host.processes import descendants, lives
from chipwise.settings import parse_settings
from support.filter_rig import CLEAN, ENDLESS, HEAD, RAPID
from support.filter_runs import COMMAND, PATIENCE_S, mill_ini, start, run, put


@pytest.fixture(name="ini")
def make_ini(tmp_path):
    return mill_ini(tmp_path)


def family(child):
    """Wait until the filter, its process and LinuxCNC's interpreter are there; -> their numbers, the filter's first."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        found = descendants(child.pid)
        if len(found) >= 3 and child.poll() is None:
            return found
        time.sleep(0.02)
    raise AssertionError("the filter has not started its processes")


def gone(pids):
    end = time.monotonic() + PATIENCE_S
    while any(map(lives, pids)) and time.monotonic() < end:
        time.sleep(0.02)
    return not any(map(lives, pids))


@pytest.mark.parametrize(
    "text",
    [
        ENDLESS,
        "G21\no1 while [1]\no1 endwhile\nM2\n",
        HEAD + "F100\no1 while [1]\nG1 X1\nG1 X0\no1 endwhile\nM2\n",
        "G21\nF10\no1 while [1]\nG38.3 Z-5\nG1 X1\no1 endwhile\nM2\n",
    ],
)
def test_an_endless_loop_ends_at_the_limit_and_is_not_opened(text, ini, tmp_path):
    ini("FILTER_TIME = 3")
    path = put(tmp_path, text)
    begun = time.monotonic()
    child = start(ini.path, path, tmp_path / "out")
    pids = set()
    while child.poll() is None:
        pids.update(descendants(child.pid))
        time.sleep(0.02)
    said = child.stderr.read().decode()
    assert child.returncode == 2 and (tmp_path / "out").read_bytes() == b""
    assert time.monotonic() - begun >= 3 and not any(map(lives, pids))  # at once: the filter has waited for them
    assert f"{path}: it is not opened: it takes more than 3 s to check, and its loops or subs may have no end" in said


PLAIN = "G21 (no loop here) G1 X1 F100\nM2\n"


def judged_by(tmp_path, monkeypatch, text, work_of_it, seconds, **settings):
    """The Verdict when work.judged is another function."""
    monkeypatch.setattr(work, "judged", work_of_it)
    process = Work(str(put(tmp_path, text)), "", parse_settings(settings), str(tmp_path))
    try:
        return process.verdict(time.monotonic() + seconds, lambda share: None)
    finally:
        process.end()


@pytest.mark.parametrize("text, status", [(PLAIN, 0), (ENDLESS, 2)])
def test_a_program_that_takes_too_long_is_opened_as_it_is_unless_it_may_have_no_end(
    text, status, tmp_path, monkeypatch
):
    verdict = judged_by(tmp_path, monkeypatch, text, lambda *_: time.sleep(3600), 10.0)
    assert verdict.status == status and not verdict.path and "it takes more than 30 s to check" in verdict.notes[0][0]
    assert ("opened unchecked" in verdict.notes[0][0]) == (status == 0)


@pytest.mark.parametrize("text, status", [(PLAIN, 0), (ENDLESS, 2)])
def test_want_of_memory_ends_the_check_only(text, status, tmp_path, monkeypatch):
    verdict = judged_by(
        tmp_path, monkeypatch, text, lambda *_: [bytearray(1 << 20) for _ in range(400)], PATIENCE_S, PLAN_MEMORY="100"
    )
    assert verdict.status == status and "want of memory" in verdict.notes[0][0]


@pytest.mark.parametrize(
    "text, loops",
    [
        (PLAIN, False),
        ("O1 while [1]", True),
        ("n10 o<x> call", True),
        ("/ o 1 do", True),
        ("M98 P1", True),
        ("m 99", True),
        ("(o1 while)\nG1 X1", False),
        ("G1 X1 " * 300_000 + "\n\to2 repeat", True),
        ("G1 X0\r\no1 while [1]", True),
    ],
)
def test_which_programs_may_have_no_end(text, loops, tmp_path):
    assert may_loop(put(tmp_path, text)) == loops


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_filter_that_is_ended_leaves_nothing(number, ini, tmp_path):
    child = start(ini.path, put(tmp_path, ENDLESS), tmp_path / "out", environment={"TMPDIR": str(tmp_path)})
    pids = family(child)
    os.kill(pids[0], number)  # below sh
    assert child.wait(PATIENCE_S) == 128 + number
    assert gone(pids) and (tmp_path / "out").read_bytes() == b""
    child.stderr.read()  # no child holds the pipe open
    if number == signal.SIGKILL:  # the next one removes what it has left
        assert list(tmp_path.glob("chipwise-*"))
        run(ini.path, put(tmp_path, b"", "empty.nc"), tmp_path, environment={"TMPDIR": str(tmp_path)})
    assert not list(tmp_path.glob("chipwise-*"))


def test_a_filter_ends_with_its_gui(ini, tmp_path):
    ini("FILTER_TIME = 3600")  # the first of equal keys counts
    program, out = put(tmp_path, ENDLESS), tmp_path / "out"
    gui = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import subprocess, sys, time\n"
            'subprocess.Popen(["sh", "-c", sys.argv[1]], stdout=open(sys.argv[2], "w"), stderr=subprocess.PIPE)\n'
            "time.sleep(600)",
            f"{COMMAND} --ini {ini.path} {program}",
            out,
        ]
    )
    pids = family(gui)
    gui.kill()
    gui.wait()
    assert gone(pids) and out.read_bytes() == b""


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_handles(closed, ini, tmp_path):
    program, out = put(tmp_path, RAPID), tmp_path / "out"
    done = subprocess.run(
        ["sh", "-c", f"{COMMAND} --ini {ini.path} {program} >{out} {closed}"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        timeout=PATIENCE_S,
    )
    assert b"Traceback" not in done.stderr and b"internal" not in done.stderr
    assert out.read_bytes() == (b"" if ">&-" in closed.replace("2>&-", "") else RAPID.encode())


def test_no_room_on_the_disk(ini, tmp_path):
    long = CLEAN.replace("M2\n", "G0 Z6\nG0 Z5\n" * 4000 + "M2\n")
    path, disk = put(tmp_path, long), tmp_path / "disk"
    disk.mkdir()
    done = subprocess.run(
        [
            "unshare",
            "--user",
            "--map-root-user",
            "--mount",
            "sh",
            "-c",
            f"mount -t tmpfs -o size=16k none {disk} || exit 77\n"
            f"{COMMAND} --ini {ini.path} {path} >{disk}/out\necho $? $(wc -c <{disk}/out)",
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    if done.returncode != 77 and "unshare:" not in done.stderr:
        assert (
            done.stdout.split() == ["2", "0"]
            and f"{path}: it is not opened: No space left on device where the GUI" in done.stderr
        )
    full = subprocess.run(
        ["sh", "-c", f"{COMMAND} --ini {ini.path} {tmp_path / 'part.nc'} >/dev/full"], stderr=subprocess.PIPE, text=True
    )
    assert full.returncode == 2 and "No space left on device where the GUI keeps a copy" in full.stderr
