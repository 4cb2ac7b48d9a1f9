# SPDX-License-Identifier: GPL-2.0-or-later
"""A command on the machine itself, for containers in which private namespaces are not possible.

Called by sandbox.py.  The command runs as this user, with the installed components, one at a time, and only while no
other LinuxCNC runs; what it leaves running is ended.
"""

import errno
import os
import signal
import socket
import sys
import time

from chipwise.host import processes
from chipwise.machine.command import environment, run_and_reap, start_xvfb
from chipwise.machine.covers import copy_directory, own_script
from chipwise.machine.namespaces import die_with_parent, libc, user_to_become

IPC_RMID = 0
HAL_KEY = 0x48414C32  # hal_priv.h, 2.9.0~pre1 to 2.9.4

NO_NAMESPACES = (
    "no private namespaces on this machine; run it as root, allow user namespaces, or give the container CAP_SYS_ADMIN"
)


def refuse_without_isolation(options):
    """Raise SystemExit when the command must not run on the machine itself."""
    for wanted, what in (
        (options.require_isolation, ""),
        (options.speed != 1.0, "--speed needs them: "),
        (options.installed, "--installed needs them: "),
    ):
        if wanted:
            raise SystemExit("chipwise-sandbox: %s%s" % (what, NO_NAMESPACES))


def run_without_isolation(options, home, scratch):
    """The command on the machine itself, as this user, with copies of the --private directories."""
    die_with_parent()
    turn = wait_for_turn()
    if any(segment["key"] == HAL_KEY for segment in shared_memory()):
        raise SystemExit(
            "chipwise-sandbox: a LinuxCNC is running, and without private namespaces "
            "there can be only one; stop it first (or `halrun -U`)"
        )
    print(
        "chipwise-sandbox: no private namespaces here: running on the machine itself, with the installed components",
        file=sys.stderr,
    )
    env = environment(options, home)
    programs = os.path.join(scratch, "bin")
    os.mkdir(programs)
    own_script(programs, home)
    env["PATH"] = programs + os.pathsep + env["PATH"]
    options.command = with_copies(options.command, options.private, scratch)
    if os.getuid() == 0:  # rtapi_app alone refuses root; it has its socket in HOME
        env["RTAPI_UID"] = str(user_to_become()[0])
        os.chmod(scratch, 0o711)
        os.chmod(home, 0o777)
    if options.xvfb:
        start_xvfb(options.xvfb, env)
    with turn:
        return run_and_reap(options.command, env)


def wait_for_turn():
    """A socket's name as a lock: one command at a time, and a dead one holds nothing."""
    turn = socket.socket(socket.AF_UNIX)
    while True:
        try:
            turn.bind("\0chipwise-sandbox")
            return turn
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            time.sleep(0.2)


def with_copies(command, private, scratch):
    """The command with the copy's path for every argument in a private directory.

    A copy has the same neighbours, as links: what it names by .. is found.
    """
    places = {}
    for number, directory in enumerate(map(os.path.realpath, private)):
        if not os.path.isdir(directory):
            continue
        beside = os.path.join(scratch, "beside%d" % number)
        os.mkdir(beside)
        for name in os.listdir(os.path.dirname(directory)):
            if name != os.path.basename(directory):
                os.symlink(os.path.join(os.path.dirname(directory), name), os.path.join(beside, name))
        places[directory] = os.path.join(beside, os.path.basename(directory))
        copy_directory(directory, places[directory])

    def place(word):
        path = os.path.realpath(word)
        for directory, copy in places.items():
            if path == directory or path.startswith(directory + os.sep):
                return copy + path[len(directory) :]
        return word

    return [command[0], *map(place, command[1:])]


def shared_memory():
    """The machine's System V shared memory (processes.shared_memory), [] if it cannot be read."""
    try:
        return processes.shared_memory()
    except OSError:
        return []


def end_descendants(segments_before):
    """End the processes that the command has left, and remove its unused shared memory."""
    while True:
        left = processes.descendants(os.getpid())
        for pid in left:
            try:
                os.kill(pid, signal.SIGKILL)
            except OSError:
                pass
        try:
            while os.waitpid(-1, os.WNOHANG if not left else 0)[0]:
                pass
        except ChildProcessError:
            break
    known = {segment["shmid"] for segment in segments_before}
    for segment in shared_memory():
        if segment["shmid"] not in known and segment["nattch"] == 0:
            libc.shmctl(segment["shmid"], IPC_RMID, None)
