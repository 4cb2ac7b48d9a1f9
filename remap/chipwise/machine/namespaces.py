# SPDX-License-Identifier: GPL-2.0-or-later
"""Private namespaces of Linux: which kind works here, and entering it.

Called by sandbox.py and tools/on_debian.py.  A user namespace lets an ordinary user have the others; if they are
forbidden, root has them without one.
"""

import ctypes
import fcntl
import os
import pwd
import shutil
import signal
import socket
import struct
import subprocess

from chipwise import ROOT

UID_INSIDE_FOR_ROOT = 1000

CLONE_NEWNS, CLONE_NEWIPC, CLONE_NEWUSER = 0x00020000, 0x08000000, 0x10000000
CLONE_NEWPID, CLONE_NEWNET = 0x20000000, 0x40000000
MS_BIND, MS_REC, MS_PRIVATE = 4096, 16384, 1 << 18
PR_SET_PDEATHSIG = 1

libc = ctypes.CDLL(None, use_errno=True)


def check(result, what):
    """Raise OSError with errno when a libc call failed."""
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, "%s: %s" % (what, os.strerror(number)))


def mount(source, target, kind=None, flags=0):
    check(
        libc.mount(os.fsencode(source), os.fsencode(target), kind and kind.encode(), ctypes.c_ulong(flags), None),
        "mount " + target,
    )


def die_with_parent():
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def write_file(path, text):
    with open(path, "w") as handle:
        handle.write(text)


def map_user(uid, gid):
    """Be an ordinary user inside who owns the caller's files."""
    write_file("/proc/self/setgroups", "deny")
    write_file("/proc/self/uid_map", "%d %d 1" % (uid or UID_INSIDE_FOR_ROOT, uid))
    write_file("/proc/self/gid_map", "%d %d 1" % (gid or UID_INSIDE_FOR_ROOT, gid))


def works(action):
    """Try an action that changes this process for good in a child first."""
    child = os.fork()
    if child == 0:
        try:
            action()
            os._exit(0)
        except OSError:
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def enter(flags, with_user):
    """Enter the namespaces; the next child is their PID 1."""
    uid, gid = os.getuid(), os.getgid()
    if with_user:
        check(libc.unshare(CLONE_NEWUSER), "unshare user")
        map_user(uid, gid)
    check(libc.unshare(flags), "unshare")
    mount("none", "/", None, MS_REC | MS_PRIVATE)
    if flags & CLONE_NEWNET:
        loopback_up()


def enter_and_mount_proc(flags, with_user):
    """enter(), and see whether a PID 1 may mount its /proc and this program's files be read.

    Root's own user namespace knows root's files only: not a checkout in somebody's closed home.
    """
    enter(flags, with_user)
    os.listdir(ROOT)
    if not works(lambda: mount("proc", "/proc", "proc")):
        raise OSError(1, "mount /proc")


def loopback_up():
    SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP = 0x8913, 0x8914, 1
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        request = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16sh14x", fcntl.ioctl(sock, SIOCGIFFLAGS, request))[1]
        fcntl.ioctl(sock, SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", flags | IFF_UP))


def choose_isolation(flags):
    """-> 'user', 'root', 'sudo' or 'none': the first that works here."""
    if works(lambda: enter_and_mount_proc(flags, True)):
        return "user"
    if os.getuid() == 0:
        return "root" if works(lambda: enter_and_mount_proc(flags, False)) else "none"
    if (
        shutil.which("sudo")
        and subprocess.run(["sudo", "-n", "true"], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    ):
        return "sudo"
    return "none"


def user_to_become():
    """(uid, gid) for COMMAND where root has no user namespace."""
    if os.environ.get("SUDO_UID", "0") != "0":
        return int(os.environ["SUDO_UID"]), int(os.environ["SUDO_GID"])
    nobody = pwd.getpwnam("nobody")
    return nobody.pw_uid, nobody.pw_gid


def as_user(drop_to):
    """2. A command prefix: become that user, who may still read and write as root."""
    return [
        "setpriv",
        "--reuid=%d" % drop_to[0],
        "--regid=%d" % drop_to[1],
        "--clear-groups",
        "--inh-caps=+dac_override",
        "--ambient-caps=+dac_override",
        "--",
    ]
