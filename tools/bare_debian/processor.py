# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs of another processor, run by qemu-user-static in namespaces of their own.  Called by base.py and
on_debian.py.

A user namespace has had a binfmt_misc of its own since Linux 6.7: what is registered there is unknown to the machine,
and gone with the namespace.
"""

import os
import subprocess
import sys

from bare_debian.common import Refusal, read
from bare_debian.system import enter_namespaces
from chipwise.machine import namespaces

PROCESSORS = {"arm64": "/usr/lib/binfmt.d/qemu-aarch64.conf"}


def register(processor, place):
    """Mount this user namespace's binfmt_misc at place, and tell it the emulator, which is opened now (flag F) and so
    is found behind every change of root.  Raises Refusal where the kernel or the emulator is missing."""
    line = read(PROCESSORS[processor])
    if not line:
        raise Refusal("there is no emulator for %s; install qemu-user-static" % processor)
    os.makedirs(place, exist_ok=True)
    try:
        namespaces.mount("binfmt_misc", place, "binfmt_misc")
    except OSError as error:
        raise Refusal(
            "a user namespace has no binfmt_misc of its own here (%s); that needs Linux 6.7" % error
        ) from error
    namespaces.write_file(os.path.join(place, "register"), line)


def emulated(processor, action):
    """Do an action in namespaces where programs of that processor run.  Raises Refusal if it fails there."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            enter_namespaces()
            code = os.waitstatus_to_exitcode(os.waitpid(first_process(processor, action), 0)[1])
        except (Refusal, OSError) as error:
            print("chipwise: on-debian: %s" % error, file=sys.stderr)
        finally:
            os._exit(code)
    if os.waitpid(child, 0)[1]:
        raise Refusal("programs of %s do not run here; see the lines above" % processor)


def first_process(processor, action):
    """Fork the PID 1 of the namespaces, which does the action -> its number."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            namespaces.die_with_parent()
            namespaces.mount("none", "/", None, namespaces.MS_REC | namespaces.MS_PRIVATE)
            namespaces.mount("proc", "/proc", "proc")
            register(processor, "/proc/sys/fs/binfmt_misc")
            action()
            code = 0
        except (Refusal, OSError, subprocess.CalledProcessError) as error:
            print("chipwise: on-debian: %s" % error, file=sys.stderr)
        finally:
            os._exit(code)
    return child
