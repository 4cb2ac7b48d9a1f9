# SPDX-License-Identifier: GPL-2.0-or-later
"""Run a command on a bare Debian of another release.

    tools/on-debian [options] RELEASE COMMAND [ARGUMENT...]
    tools/on-debian trixie make test
    tools/on-debian --bring build/deb trixie make deb
    tools/on-debian --processor arm64 bookworm uname -m

What a fresh machine has: Debian's smallest system, made by mmdebstrap from
Debian's packages, with git, make and sudo, and a copy of this repository's files
(those git knows or would add; no build/).  Whatever COMMAND needs besides, it
installs itself.  Called by hand, by CI and by tests/install/test_on_debian.py.

1. The base system is made once per release and kept in build/debian, or in
   CHIPWISE_DEBIAN_DIR.  Packages downloaded by a command are kept there too.
2. The archive, its keys, proxies and other settings are those of this machine's
   apt.  On a machine that is not a Debian, CHIPWISE_APT_SOURCES names a file
   with the lines of sources.list for the release.
3. Each call sees the base through an overlay of its own (a copy where the kernel
   has no overlay), thrown away at the end; --keep NAME keeps it, packages and
   build/ included, for the next call with that name.
4. Namespaces: user (every user keeps its number; root has no rights outside),
   mount, PID, IPC and host name.  The network is this machine's.  The root
   directory is changed by pivot_root, as in a chroot the kernel refuses user
   namespaces, and with them bin/chipwise-sandbox.
5. --container takes away what an ordinary container takes away: CAP_SYS_ADMIN
   and user namespaces.
6. --processor arm64 is a Debian of another processor, every program of it run by
   qemu-user-static; binfmt_misc of the user namespace knows it, not the machine's
   (Linux 6.7).

Exit status: COMMAND's; 128 + signal when killed.
"""

import argparse
import contextlib
import fcntl
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile

TOOLS = os.path.dirname(os.path.realpath(__file__))
sys.path[:0] = [TOOLS, os.path.join(os.path.dirname(TOOLS), "remap")]

from bare_debian.apt import apt_sources, carry_apt_over  # noqa: E402
from bare_debian.base import cache_directory, ensure_base, locked  # noqa: E402
from bare_debian.common import USER, USER_ID, Refusal  # noqa: E402
from bare_debian.processor import PROCESSORS, register  # noqa: E402
from bare_debian.system import (
    bring_back,
    change_root,
    copy_repository,
    enter_namespaces,
    home,
    lay_system,
    lend_packages,  # noqa: E402
    mount_devices,
    take_packages_back,
)
from chipwise.machine import command, namespaces, sandbox  # noqa: E402
from chipwise.machine.namespaces import libc  # noqa: E402

RELEASES = ("bookworm", "trixie")
PASSED_ON = re.compile(r"(CHIPWISE_(?!DEBIAN_DIR|APT_SOURCES).*|(http|https|ftp|no)_proxy|TERM)$", re.I)


def parse_arguments(argv):
    parser = argparse.ArgumentParser(
        prog="tools/on-debian",
        description="Run a command on a bare Debian of a release, with a copy of this repository.",
        epilog="Example: tools/on-debian trixie make test",
    )
    parser.add_argument(
        "--keep", metavar="NAME", help="keep what the command changes, for the next call with that name"
    )
    parser.add_argument(
        "--user", action="store_true", help="run the command as an ordinary user who may use sudo, not as root"
    )
    parser.add_argument(
        "--container", action="store_true", help="without CAP_SYS_ADMIN and user namespaces, as in a plain container"
    )
    parser.add_argument(
        "--take",
        metavar="FOLDER",
        action="append",
        default=[],
        help="give the command the files of this folder of the repository as well, as build/deb",
    )
    parser.add_argument(
        "--bring",
        metavar="FOLDER",
        help="afterwards, bring the files that the command has made in this folder of the repository back",
    )
    parser.add_argument("--processor", choices=PROCESSORS, help="a Debian of another processor, emulated")
    parser.add_argument(
        "--renew", action="store_true", help="make the base anew and forget what was kept of that release"
    )
    parser.add_argument("release", choices=RELEASES)
    parser.add_argument("command", nargs=argparse.REMAINDER)
    options = parser.parse_args(argv)
    if options.command[:1] == ["--"]:
        options.command = options.command[1:]
    if not options.command and not options.renew:
        parser.error("no command")
    for folder in filter(None, [options.bring, *options.take]):
        if os.path.isabs(folder) or ".." in folder.split("/"):
            parser.error("%s: name a folder of the repository" % folder)
    if options.keep and not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", options.keep):
        parser.error("--keep %s: use letters, digits, dot, minus and underscore" % options.keep)
    return options


def become_root(argv):
    """Again through sudo, with the variables that matter."""
    if not shutil.which("sudo"):
        raise Refusal("needs root; run it as root or install sudo")
    passed = [
        "%s=%s" % item
        for item in os.environ.items()
        if PASSED_ON.match(item[0]) or item[0] in ("CHIPWISE_DEBIAN_DIR", "CHIPWISE_APT_SOURCES")
    ]
    ask = [] if os.isatty(0) else ["-n"]
    os.execvp("sudo", ["sudo", *ask, "env", *passed, sys.executable, os.path.realpath(__file__), *argv])


def inside(options, system):
    """PID 1 of the namespaces: run the command."""
    namespaces.die_with_parent()
    if options.processor:
        register(options.processor, system + "/.processor")
    change_root(system)
    env = {name: value for name, value in os.environ.items() if PASSED_ON.match(name)}
    env.update(
        PATH="/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        LANG="C.UTF-8",
        HOME=home(options),
        USER=USER if options.user else "root",
    )
    prefix = ["setpriv"]
    if options.user:
        prefix += ["--reuid=%d" % USER_ID, "--regid=%d" % USER_ID, "--init-groups"]
    if options.container:
        namespaces.write_file("/proc/sys/user/max_user_namespaces", "0")
        prefix += ["--bounding-set=-sys_admin", "--inh-caps=-sys_admin"]
    os.chdir(home(options) + "/chipwise")
    return command.run_and_reap(options.command, env, prefix + ["--"] if len(prefix) > 1 else ())


def in_child(action):
    """Run an action in a child, whose status is the action's; -> the child."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = action()
        except (Refusal, OSError, subprocess.CalledProcessError) as error:
            print("chipwise: on-debian: %s" % error, file=sys.stderr)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    return child


def supervise(options, base, changes, sources):
    """Lay the system, enter the namespaces and hand over to their PID 1."""
    namespaces.check(libc.unshare(namespaces.CLONE_NEWNS), "unshare mount")
    namespaces.mount("none", "/", None, namespaces.MS_REC | namespaces.MS_PRIVATE)
    system, _ = lay_system(base, changes)
    carry_apt_over(system, sources)
    for path in ("/etc/resolv.conf", "/etc/hosts"):
        if os.path.exists(path):
            shutil.copyfile(path, system + path)
    copy_repository(system, changes, options)
    mount_devices(system)
    enter_namespaces()
    namespaces.die_with_parent()
    return sandbox.wait_for(in_child(lambda: inside(options, system)), None)


def remove_left_behind(folder):
    """Remove the changes of calls that were killed: no one holds their lock."""
    for changes in glob.glob(os.path.join(folder, "run.*")):
        with contextlib.suppress(OSError), open(os.path.join(changes, "lock")) as handle:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(changes, ignore_errors=True)


def run(options, folder, base, sources):
    """The command on a system of its own, or on the kept one; -> its exit status."""
    cache = os.path.join(folder, "packages")
    with contextlib.ExitStack() as stack:
        if options.keep:
            changes = os.path.join(folder, "kept", options.keep)
            os.makedirs(changes, mode=0o700, exist_ok=True)
            stack.enter_context(locked(os.path.join(changes, "lock")))
        else:
            remove_left_behind(folder)
            changes = tempfile.mkdtemp(prefix="run.", dir=folder)
            stack.enter_context(locked(os.path.join(changes, "lock")))
            stack.callback(shutil.rmtree, changes, ignore_errors=True)
        for name in ("upper", "work", "root"):
            os.makedirs(os.path.join(changes, name), exist_ok=True)
        lend_packages(cache, changes)
        try:
            status = sandbox.wait_for(in_child(lambda: supervise(options, base, changes, sources)), None)
            if options.bring and status == 0:
                bring_back(options, changes)
            return status
        finally:
            take_packages_back(cache, changes)


def main(argv):
    options = parse_arguments(argv)
    if os.geteuid() != 0:
        become_root(argv)
    if not namespaces.works(
        lambda: namespaces.check(libc.unshare(namespaces.CLONE_NEWNS | namespaces.CLONE_NEWUSER), "unshare")
    ):
        raise Refusal("no private namespaces here; run it on a machine, or give the container CAP_SYS_ADMIN")
    folder = os.path.join(cache_directory(), "-".join(filter(None, [options.release, options.processor])))
    os.makedirs(folder, mode=0o711, exist_ok=True)
    sources = apt_sources(options.release)
    base = ensure_base(folder, options, sources)
    return run(options, folder, base, sources) if options.command else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (Refusal, OSError) as error:
        sys.exit("chipwise: on-debian: %s" % error)
