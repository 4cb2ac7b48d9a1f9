# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise-sandbox: what runs in it is alone, and nothing of it is left."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from chipwise.headless import runner
from support import operate

pytestmark = pytest.mark.machine

# What needs no private namespaces.
OTHERS = " ".join(
    "tests/" + name
    for name in (
        "assumed batch blank check cli common configs contour_sub core cycles digitise docs entry filter geometry glue "
        "headless importing install interpreter link monitor oracles panel planner resume rewrite setup stations stock "
        "surface turning"
    ).split()
)


def sandbox(*arguments, env=None, **options):
    return subprocess.run(
        [runner.SANDBOX, *arguments], text=True, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, **options
    )


def test_command_is_an_ordinary_user_with_its_own_home():
    done = sandbox(
        "--require-isolation",
        "--",
        "sh",
        "-c",
        "id -u; echo $HOME; touch $HOME/file && ls $HOME; ps -e -o pid= | wc -l",
    )
    uid, home, name, processes = done.stdout.split()
    assert uid != "0"
    assert not os.path.exists(home)
    assert name == "file"
    assert int(processes) < 10


@pytest.mark.parametrize(
    "command, status",
    [(["true"], 0), (["sh", "-c", "exit 7"], 7), (["sh", "-c", "kill -9 $$"], 137), (["/no/such/command"], 127)],
)
def test_exit_status(command, status):
    assert sandbox("--", *command).returncode == status


def test_timeout_kills_everything(tmp_path):
    """A background process that refuses to end dies with its PID namespace."""
    mark = str(tmp_path / "alive")
    ended = tmp_path / "ended"
    script = '(trap "" TERM INT HUP; while :; do date > %s; sleep 0.1; done) & sleep 100; date > %s' % (mark, ended)
    for timeout in ("8", "40", "200"):  # a busy computer may take seconds to begin
        done = sandbox("--timeout", timeout, "--", "sh", "-c", script)
        assert done.returncode == 124
        if os.path.exists(mark):
            break
    assert not ended.exists()  # it was killed before its last command
    os.unlink(mark)
    time.sleep(0.5)
    assert not os.path.exists(mark)


def test_orphans_die_when_the_command_ends(tmp_path):
    mark = str(tmp_path / "alive")
    sandbox(
        "--",
        "sh",
        "-c",
        'setsid sh -c "while :; do date > %s; sleep 0.1; done" & until [ -e %s ]; do sleep 0.1; done' % (mark, mark),
    )
    os.unlink(mark)
    time.sleep(0.5)
    assert not os.path.exists(mark)


def test_a_kill_from_outside_leaves_nothing(tmp_path):
    mark = str(tmp_path / "alive")
    process = subprocess.Popen(
        [runner.SANDBOX, "--", "sh", "-c", "while :; do date > %s; sleep 0.1; done" % mark],
        stdin=subprocess.DEVNULL,
        env=dict(os.environ, TMPDIR=str(tmp_path)),
    )
    while not os.path.exists(mark):
        time.sleep(0.05)
    process.kill()
    process.wait()
    end = time.monotonic() + 300
    while os.path.exists(mark) and time.monotonic() < end:  # the last ones may still be dying
        os.unlink(mark)
        time.sleep(0.5)
    assert not os.path.exists(mark)


def test_configs_are_not_written_to():
    configs = os.path.join(runner.ROOT, "configs")
    name = os.path.join(configs, "written-by-test")
    done = sandbox("--", "sh", "-c", "touch %s && ls %s" % (name, name))
    assert done.stdout.strip() == name
    assert not os.path.exists(name)


def test_fresh_modules_without_installing(tmp_path):
    """A component built a moment ago loads, and LinuxCNC's own still do."""
    source = tmp_path / "sandbox_probe.comp"
    source.write_text(
        'component sandbox_probe "For a test";\npin out s32 answer "42";\n'
        'function _;\nlicense "GPL";\nauthor "chipwise";\n;;\n'
        "FUNCTION(_) { answer = 42; }\n"
    )
    subprocess.run(["halcompile", "--compile", str(source)], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    commands = tmp_path / "probe.hal"
    commands.write_text(
        "loadrt threads name1=t period1=1000000\nloadrt sandbox_probe\n"
        "addf sandbox-probe.0 t\nstart\n"
        "loadusr -w sh %s\ngetp sandbox-probe.0.answer\n" % (tmp_path / "wait.sh")
    )
    (tmp_path / "wait.sh").write_text(
        'for i in $(seq 6000); do [ "$(halcmd getp sandbox-probe.0.answer)" = 42 ] && exit; sleep 0.05; done\n'
    )
    done = sandbox("--modules", str(tmp_path), "--", "halrun", "-f", str(commands))
    assert "42" in done.stdout.split(), done.stdout


def test_four_machines_at_once(tmp_path):
    """Each has its own HAL: each sees only the pin value it has set itself, and goes on when all four have."""
    count = 4
    meeting = tmp_path / "meeting"
    meeting.mkdir()
    (tmp_path / "meet.sh").write_text(
        "touch %s/$NUMBER; for i in $(seq 3000); do [ $(ls %s | wc -l) = %d ] && exit 0; "
        "sleep 0.1; done; exit 1\n" % (meeting, meeting, count)
    )
    commands = tmp_path / "one.hal"
    commands.write_text(
        "loadrt and2\nsetp and2.0.in0 $(VALUE)\nloadusr -w sh %s\ngetp and2.0.in0\n" % (tmp_path / "meet.sh")
    )
    running = []
    for number in range(count):
        env = dict(os.environ, VALUE=str(number % 2), NUMBER=str(number))
        running.append(
            subprocess.Popen(
                [runner.SANDBOX, "--", "halrun", "-f", str(commands)],
                env=env,
                text=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        )
    for number, process in enumerate(running):
        text = process.communicate(timeout=400)[0]
        assert process.returncode == 0, text
        assert ("TRUE" in text.split()) == (number % 2 == 1), text


def test_four_linuxcncs_at_once(tmp_path):
    program = tmp_path / "p.ngc"
    command = (
        "import sys; sys.path.insert(0, %r); from chipwise.headless import runner; "
        "s = runner.run_headless(sys.argv[1], speed=5, timeout=900); "
        'print(s["finished"], s["errors"], s["exit_status"])' % os.path.join(runner.ROOT, "remap")
    )
    program.write_text("G21 G90 F3000\nG1 X100\nG1 Y50\nG1 X0\nM2\n")
    running = [
        subprocess.Popen(
            [sys.executable, "-c", command, str(program)], text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE
        )
        for _number in range(4)
    ]
    for process in running:
        assert process.communicate(timeout=500)[0].strip() == "True [] 0"


# The sandbox's time and that of the machine (/proc/uptime, s), read together, before and after a sleep.
BOTH_CLOCKS = """
import time
from pathlib import Path
def uptime():
    return float(open('/proc/uptime').read().split()[0])
def both():
    while True:
        before, now, after = uptime(), time.time(), uptime()
        if after - before < 0.02:
            return now, before
first = both()
time.sleep(10)
print(*first, *both())
"""


def test_speed():
    """Ten seconds of sleep pass in about one."""
    done = sandbox("--speed", "10", "--", sys.executable, "-c", BOTH_CLOCKS)
    first, began, last, ended = (float(word) for word in done.stdout.split())
    assert last - first >= 10 and (last - first) / (ended - began) == pytest.approx(10, rel=0.05)


def test_a_fast_clock_leaves_the_processes_their_time(tmp_path):
    """LinuxCNC's processes wait for each other's shared buffers in real time: 2 s of that are 20 s of the clock."""
    assert operate.operate(tmp_path, [["hold status", 2], ["mdi", "G0 X1"], ["position"]], speed=10)[1:] == [
        [],
        pytest.approx([1.0, 0.0, 90.0], abs=1e-6),
    ]
    text = (tmp_path / "linuxcnc.txt").read_text()
    assert "semaphore" not in text, text


CLIENTS = """
import os, socket, struct
for _ in range(200):
    with socket.socket(socket.AF_UNIX) as client:
        client.connect('/tmp/.X11-unix/X' + os.environ['DISPLAY'][1:])
        client.sendall(struct.pack('<BxHHHHxx', ord('l'), 11, 0, 0, 0))
        print(client.recv(8)[:1] == b'\\x01')
"""


def test_the_display_outlives_its_clients():
    """Xvfb starts anew after its last client, and refuses those who come meanwhile, unless it has -noreset: a screen
    that looks at the display before it opens its window was one of them."""
    done = sandbox("--xvfb", "320x200", "--", sys.executable, "-c", CLIENTS, stderr=subprocess.STDOUT)
    assert done.stdout.split() == ["True"] * 200, done.stdout[-500:]


def test_a_display_has_a_socket_of_its_own():
    """Another sandbox's display has another process 3, so a lock in the common /tmp would keep nobody off its
    socket."""
    folder = Path("/tmp/.X11-unix")
    script = 'ls /tmp/.X11-unix; echo "X${DISPLAY#:}"'
    if (
        not folder.exists()
    ):  # as an X server makes it: a folder that umask narrows would shut out every other user of the machine
        folder.mkdir()
        folder.chmod(0o1777)
    if not os.access(folder, os.W_OK):
        pytest.skip(f"{folder} belongs to somebody who lets nobody else in")
    other = folder / f"X{os.getpid()}"
    other.touch()
    try:
        done = sandbox("--xvfb", "320x200", "--", "sh", "-c", script, stderr=subprocess.STDOUT)
        own, name = done.stdout.split()
        assert own == name and other.exists()
    finally:
        other.unlink()


def test_axis_starts(tmp_path):
    """AXIS comes up under Xvfb with the metric mill, and its window shows."""
    script = (
        "linuxcnc -r %s/configs/mill.ini </dev/null & main=$!\n"
        "for i in $(seq 300); do sleep 0.5; axis-remote --ping 2>/dev/null && break; done\n"
        "axis-remote --ping || exit 3\n"
        "sleep 1; axis-remote --quit; wait $main; echo left with $?\n" % runner.ROOT
    )
    done = sandbox("--xvfb", "1024x768", "--timeout", "900", "--", "sh", "-c", script)
    assert "left with 0" in done.stdout, done.stdout[-3000:]


# --- where there are no namespaces ------------------------------------------

# an ordinary user who may make no further user namespace: what most containers are
CONTAINER = [
    "unshare",
    "--user",
    "--map-root-user",
    "sh",
    "-c",
    'echo 1 >/proc/sys/user/max_user_namespaces && exec unshare --user --map-user=1000 --map-group=1000 -- "$@"',
    "sh",
]


def in_container(*command, **options):
    """A command without namespaces, but in a sandbox: HAL and processes are not the machine's."""
    return subprocess.run(
        [runner.SANDBOX, "--require-isolation", "--", *CONTAINER, *command],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=300,
        **options,
    )


@pytest.mark.parametrize("options", [["--require-isolation"], ["--speed", "2"]])
def test_without_namespaces_isolation_and_speed_are_refused(options):
    done = in_container(runner.SANDBOX, *options, "--", "echo", "ran")
    assert done.returncode == 1
    assert "no private namespaces on this machine; run it as root" in done.stdout
    assert "ran" not in done.stdout.split()


def test_the_faked_clock_outlives_scripts(tmp_path):
    """linuxcnc is a bash script, and inivar of LinuxCNC 2.10 another one that it calls, which ends with exec."""
    inner, outer = tmp_path / "inner", tmp_path / "outer"
    inner.write_text("#!/bin/bash\nx=$(/bin/echo told)\nexec /bin/echo $x\n")
    outer.write_text(f'#!/bin/bash\nfor k in 1 2 3; do x=$({inner} 2>&1); echo "$? $x"; done\nexit 5\n')
    for script in (inner, outer):
        script.chmod(0o755)
    tmp_path.chmod(0o777)
    done = subprocess.run(
        [runner.SANDBOX, "--speed", "3", "--", outer], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    )
    assert (done.stdout, done.returncode) == (3 * "0 told\n", 5)


def test_an_installed_chipwise_is_hidden_by_another(tmp_path):
    """As after `make run`: the tests' own installation is not mixed with that of the machine."""
    for name, files in (("old", ("codes.py", "gone.py")), ("new", ("codes.py",))):
        folder = tmp_path / name / "usr/local/share/chipwise/remap"
        folder.mkdir(parents=True)
        for file in files:
            (folder / file).write_text(name)
    shown = "cd /usr/local/share/chipwise/remap && pwd -P && cat *"
    done = subprocess.run(
        [
            runner.SANDBOX,
            "--installed",
            tmp_path / "old",
            "--",
            runner.SANDBOX,
            "--installed",
            tmp_path / "new",
            "--",
            "sh",
            "-c",
            shown,
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert done.stdout.split() == [str(tmp_path / "new/usr/local/share/chipwise/remap"), "new"], done.stdout


def test_without_namespaces_configs_are_copies_with_the_same_neighbours():
    configs = os.path.join(runner.ROOT, "configs")
    done = in_container(
        runner.SANDBOX,
        "--",
        "sh",
        "-c",
        "cd $0 && touch written && ls -d written ../hal/sim.hal; ls -d %s/written" % configs,
        configs,
    )
    assert done.stdout.split("\n")[1:3] == ["../hal/sim.hal", "written"]
    assert "cannot access" in done.stdout


def test_without_namespaces_nothing_is_left_running():
    script = "setsid sleep 7134 & echo; [ $0 = stays ] && sleep 100; sleep 0.3"
    count = 'ps -e -o args | grep -c "^sleep 713[4]"; ls $TMPDIR | wc -l'
    for word, status, timeout in (("ends", 0, 200), ("stays", 124, 2)):
        done = in_container(
            "sh", "-c", "%s --timeout %d -- sh -c '%s' %s; echo $?; %s" % (runner.SANDBOX, timeout, script, word, count)
        )
        assert done.stdout.split()[-3:] == [str(status), "0", "0"], done.stdout


def test_without_namespaces_commands_take_turns():
    one = '%s -- sh -c "echo in; sleep 0.5; echo out"' % runner.SANDBOX
    done = in_container("sh", "-c", "%s & %s & %s & wait" % (one, one, one))
    assert [line for line in done.stdout.split("\n") if line in ("in", "out")] == 3 * ["in", "out"]


def test_without_namespaces_a_running_linuxcnc_is_left_alone():
    """The machine that mills is not the one to try something on."""
    done = in_container(
        "sh",
        "-c",
        "cd $(mktemp -d); (echo loadrt and2; echo loadusr -w touch there; until [ -e done ]; do sleep 0.1; done; "
        "echo getp and2.0.out) | halrun & until [ -e there ]; do sleep 0.1; done; "
        "%s -- halrun -U; echo status $?; touch done; wait" % runner.SANDBOX,
    )
    assert "a LinuxCNC is running" in done.stdout and "status 1\n" in done.stdout
    assert "FALSE" in done.stdout.split("\n"), done.stdout


def test_without_namespaces_a_program_runs(tmp_path):
    """The whole machine, at its own speed; the components are those the outer sandbox has installed."""
    program = tmp_path / "program.ngc"
    program.write_text("G21 G90\nT3 M6\nM250 P0 Q0 R-5 I20 J20 K5\nF3000\nG0 X-8 Y10 Z-1\nG1 X28\nM2\n")
    done = in_container(
        os.path.join(runner.ROOT, "bin", "chipwise"), "demo", "--speed", "1", "--no-compare", str(program)
    )
    assert done.returncode == 0, done.stdout
    summary = json.loads(done.stdout.strip().split("\n")[-1])
    assert summary["finished"] and summary["volume_mm3"] == pytest.approx(20 * 10 * 1, rel=0.02)


def test_without_namespaces_the_tests_refuse_before_the_first_one():
    pytest_command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    before = os.times()
    for place in ("tests", "tests/machine", "tests/components/test_hal.py"):
        done = in_container(*pytest_command, place, cwd=runner.ROOT)
        assert done.returncode == 4
        assert "no private namespaces on this machine" in done.stdout
        assert "tools/test " + OTHERS in done.stdout
    assert sum(os.times()[2:4]) - sum(before[2:4]) < 120  # s of computing: nothing was run
    done = in_container(*pytest_command, "tests/common/test_report.py", cwd=runner.ROOT)
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root")
def test_sudo_in_somebodys_closed_home(tmp_path):
    """Root's own user namespace could not read it: the command runs as the user who called sudo."""
    home = tmp_path / "home"
    (home / "bin").mkdir(parents=True)
    (home / "configs").mkdir()
    shutil.copy(runner.SANDBOX, home / "bin")
    shutil.copytree(os.path.join(runner.ROOT, "remap"), home / "remap")
    shutil.copy(os.path.join(runner.ROOT, "VERSION"), home)
    for path in (home, home / "bin", home / "configs", *home.rglob("*")):
        os.chown(path, 1000, 1000)
    home.chmod(0o700)
    done = subprocess.run(
        [home / "bin" / "chipwise-sandbox", "--", "sh", "-c", "id -u; ls"],
        cwd=home,
        text=True,
        env=dict(os.environ, SUDO_UID="1000", SUDO_GID="1000"),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
    )
    assert done.stdout.split()[0] == "1000" and set(done.stdout.split()[1:]) == {"VERSION", "bin", "configs", "remap"}
