# SPDX-License-Identifier: GPL-2.0-or-later
"""The command in the sandbox: its environment, its X display, its end.  Called by sandbox.py and unisolated.py."""

import glob
import os
import signal
import subprocess
import sys

from chipwise import ROOT


def environment(options, home):
    """The command's environment: HOME, X authority, faked time."""
    env = dict(os.environ)
    authority = os.path.expanduser("~/.Xauthority")
    if "DISPLAY" in env and "XAUTHORITY" not in env and os.path.exists(authority):
        env["XAUTHORITY"] = authority
    env["HOME"] = home
    if not options.installed:
        env["PATH"] = os.path.join(ROOT, "bin") + os.pathsep + env.get("PATH", os.defpath)
    env["XDG_CACHE_HOME"] = os.path.join(home, ".cache")
    env["TMPDIR"] = os.path.join(home, ".tmp")
    os.makedirs(env["TMPDIR"], exist_ok=True)
    env["RTAPI_FIFO_PATH"] = os.path.join(home, ".rtapi_fifo")
    if options.xvfb:
        env.pop("DISPLAY", None)
    if options.speed != 1.0:
        libraries = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
        if not libraries:
            raise SystemExit("chipwise-sandbox: --speed needs libfaketime; use `apt-get install libfaketime`")
        env["LD_PRELOAD"] = libraries[0]
        env["FAKETIME"] = "+0 x%g" % options.speed
        env["CHIPWISE_SPEED"] = "%g" % options.speed
        env["NO_FAKE_STAT"] = "1"
    return env


def start_xvfb(size, env):
    """Start a virtual X display and name it in env."""
    reading, writing = os.pipe()
    plain = {key: value for key, value in env.items() if key != "LD_PRELOAD"}
    subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", size + "x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[writing],
        env=plain,
        stdin=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as pipe:
        number = pipe.readline().strip()
    if not number:
        raise SystemExit("chipwise-sandbox: Xvfb did not start")
    env["DISPLAY"] = ":" + number
    env["LIBGL_ALWAYS_SOFTWARE"] = "1"


# A bash below the one that made libfaketime's shared clock removes it with exec, as inivar of LinuxCNC 2.10 does; below
# this sh it does not.
CLOCK_HOLDER = ("sh", "-c", '"$@"; exit "$?"', "sh")


def run_and_reap(command, env, prefix=()):
    """Run the command as a child of this PID 1, reaping every orphan."""
    holder = CLOCK_HOLDER if "FAKETIME" in env else ()
    try:
        main = subprocess.Popen([*prefix, *holder, *command], env=env, process_group=0)
    except OSError as error:
        print("chipwise-sandbox: %s: %s" % (command[0], error.strerror), file=sys.stderr)
        return 127
    pass_terminal_to(main.pid)

    def forward(number, _frame):
        os.kill(-main.pid, number)

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, forward)
    while True:
        pid, status = os.wait()
        if pid == main.pid:
            code = os.waitstatus_to_exitcode(status)
            return code if code >= 0 else 128 - code


def pass_terminal_to(group):
    """Make a process group the terminal's foreground, if there is one."""
    if os.isatty(0):
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
        try:
            os.tcsetpgrp(0, group)
        except OSError:
            pass
