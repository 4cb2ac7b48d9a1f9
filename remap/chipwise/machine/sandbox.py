# SPDX-License-Identifier: GPL-2.0-or-later
"""Run a command on a private LinuxCNC: own HAL, own processes, own HOME.

HAL is one object per machine, LinuxCNC refuses root, and it keeps its lock
file in /tmp and its realtime modules in a system directory.  This program
gives COMMAND a machine of its own, so that any number of LinuxCNCs can run
side by side, as root or as an ordinary user, with nothing installed and
nothing left behind.  Called by `make run`, by `chipwise demo` and by the tests.

1. Namespaces: user, mount, IPC (HAL and NML are in System V shared memory),
   PID (whatever COMMAND starts ends with it) and, without an X display,
   network (NML's TCP port).  Inside, the caller is an ordinary user and still
   owns the caller's files: root outside is uid 1000 inside.
2. If user namespaces are forbidden: the same without one, as root; COMMAND
   runs as the user who called sudo, else as nobody.  An ordinary user gets
   there through `sudo -n`.
3. If neither works (a container without CAP_SYS_ADMIN): COMMAND runs on the
   machine itself, with a warning: with the installed components, one at a time,
   and only while no other LinuxCNC runs.  Its arguments that are in a --private
   directory are replaced by those of the copy; processes that it leaves running
   are ended, unless this program is killed.  --require-isolation refuses
   instead, and so do the tests.
4. The module directory is covered by one with LinuxCNC's modules and the
   freshly built ones; the linuxcnc script by a copy that keeps its lock file
   and logs in HOME; each --private directory by a copy (default: configs/,
   where LinuxCNC saves its parameters); with --xvfb, the sockets of X displays
   by an empty folder.
5. --speed N preloads libfaketime, so that N seconds pass in one.

Exit status: COMMAND's; 124 after --timeout; 128 + signal when killed.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile

from chipwise import ROOT, version
from chipwise.machine.command import environment, run_and_reap, start_xvfb
from chipwise.machine.covers import (
    cover_directory,
    cover_displays,
    cover_installed,
    cover_modules,
    cover_nml,
    cover_rtapi,
    cover_script,
)
from chipwise.machine.namespaces import (
    CLONE_NEWIPC,
    CLONE_NEWNET,
    CLONE_NEWNS,
    CLONE_NEWPID,
    as_user,
    choose_isolation,
    die_with_parent,
    enter,
    libc,
    mount,
    user_to_become,
)
from chipwise.machine.unisolated import end_descendants, refuse_without_isolation, run_without_isolation, shared_memory

EXIT_TIMEOUT = 124
PR_SET_CHILD_SUBREAPER = 36


def build_parser():
    parser = argparse.ArgumentParser(
        prog="chipwise-sandbox",
        description=__doc__,
        usage="chipwise-sandbox [options] [--] COMMAND [ARGUMENT...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version="chipwise " + version())
    parser.add_argument(
        "--modules", metavar="DIR", default=None, help="realtime modules to add (default: build/modules, if it exists)"
    )
    parser.add_argument(
        "--installed",
        metavar="DIR",
        help="show the files of `make install DESTDIR=DIR` as installed, and nothing of the repository",
    )
    parser.add_argument(
        "--private",
        metavar="DIR",
        action="append",
        default=None,
        help="replace DIR by a temporary copy (default: configs)",
    )
    parser.add_argument("--home", metavar="DIR", help="HOME of the command, which is kept (default: a temporary one)")
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="N", help="let time pass N times as fast (needs libfaketime)"
    )
    parser.add_argument("--timeout", type=float, metavar="S", help="kill everything after S seconds of real time")
    parser.add_argument("--xvfb", metavar="WxH", help="give the command a virtual X display of that size")
    parser.add_argument(
        "--require-isolation", action="store_true", help="fail instead of running on the machine itself"
    )
    parser.add_argument("--inner", help=argparse.SUPPRESS)
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="COMMAND", help="the command and its arguments")
    return parser


def parse_arguments(argv):
    parser = build_parser()
    options = parser.parse_args(argv)
    if options.command[:1] == ["--"]:
        options.command = options.command[1:]
    if not options.command:
        parser.error("no command")
    if options.speed <= 0:
        parser.error("--speed %g must be larger than 0" % options.speed)
    if options.installed and not os.path.isdir(options.installed):
        parser.error("--installed %s is not a directory" % options.installed)
    if options.modules is None and not options.installed:
        built = os.path.join(ROOT, "build", "modules")
        options.modules = built if os.path.isdir(built) else None
    if options.private is None:
        options.private = [os.path.join(ROOT, "configs")]
    return options


def inside(options, home, scratch, drop_to):
    """PID 1 of the namespaces: cover the system, drop root, run the command."""
    die_with_parent()
    mount("proc", "/proc", "proc")
    mount("tmpfs", "/dev/shm", "tmpfs")
    cover_modules(options.modules, scratch)
    if options.installed:
        cover_installed(options.installed, scratch)
    cover_script(scratch, home)
    if options.speed > 1.0:
        cover_nml(scratch)
    for number, directory in enumerate(options.private):
        cover_directory(directory, scratch, number)
    if drop_to:
        cover_rtapi(scratch)
    env = environment(options, home)
    if drop_to:
        subprocess.run(["chown", "-R", "-h", "%d:%d" % drop_to, scratch, home], check=True)
    if options.xvfb:
        cover_displays()
        start_xvfb(options.xvfb, env)
    return run_and_reap(options.command, env, as_user(drop_to) if drop_to else [])


def wait_for(child, timeout):
    """Wait for PID 1, passing signals on; kill it, and all it holds, in the end."""
    late = False
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda received, _frame: os.kill(child, received))
    if timeout:

        def expired(_number, _frame):
            print("chipwise-sandbox: stopped after %g s" % timeout, file=sys.stderr)
            nonlocal late
            late = True
            os.kill(child, signal.SIGKILL)

        signal.signal(signal.SIGALRM, expired)
        signal.setitimer(signal.ITIMER_REAL, timeout)
    late = False
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if late:
        return EXIT_TIMEOUT
    return code if code >= 0 else 128 - code


def run_through_sudo(options, argv):
    """2. Again as root, keeping the environment; root drops to this user."""
    os.execvp(
        "sudo",
        [
            "sudo",
            "-n",
            "-E",
            "env",
            "PATH=" + os.environ["PATH"],
            os.path.join(ROOT, "bin", "chipwise-sandbox"),
            "--inner",
            "sudo",
        ]
        + argv,
    )


def main(argv):
    options = parse_arguments(argv)
    if options.inner:
        die_with_parent()
    flags = CLONE_NEWNS | CLONE_NEWIPC | CLONE_NEWPID
    if options.xvfb or "DISPLAY" not in os.environ:
        flags |= CLONE_NEWNET
    isolation = choose_isolation(flags)
    if isolation == "sudo" and not options.inner:
        run_through_sudo(options, argv)
    alone = isolation not in ("user", "root")
    if alone:
        refuse_without_isolation(options)
        libc.prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        segments = shared_memory()
    scratch = tempfile.mkdtemp(prefix="chipwise-sandbox.")
    home = options.home and os.path.abspath(options.home) or os.path.join(scratch, "home")
    os.makedirs(home, exist_ok=True)
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            if alone:
                code = run_without_isolation(options, home, scratch)
            else:
                code = supervise(options, flags, isolation, home, scratch)
        except SystemExit as stop:
            print(stop, file=sys.stderr)
        except OSError as error:
            print("chipwise-sandbox: %s" % error, file=sys.stderr)
        finally:
            os._exit(code)
    try:
        return wait_for(child, options.timeout)
    finally:
        if alone:
            end_descendants(segments)
        shutil.rmtree(scratch, ignore_errors=True)


def supervise(options, flags, isolation, home, scratch):
    """Enter the namespaces and hand over to their PID 1."""
    die_with_parent()
    enter(flags, isolation == "user")
    drop_to = user_to_become() if isolation == "root" else None
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = inside(options, home, scratch, drop_to)
        except SystemExit as stop:
            print(stop, file=sys.stderr)
        except OSError as error:
            print("chipwise-sandbox: %s" % error, file=sys.stderr)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    return wait_for(child, None)
