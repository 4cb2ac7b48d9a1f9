# SPDX-License-Identifier: GPL-2.0-or-later
"""The system a command sees: the base with changes over it, the repository's files, devices, namespaces.  Called by
on_debian.py."""

import contextlib
import ctypes
import glob
import os
import shutil
import subprocess

from bare_debian.common import USER, USER_ID, Refusal, read
from chipwise.machine import namespaces
from chipwise.machine.namespaces import libc
from repository import ROOT, repository_files

DEVICES = ("full", "null", "random", "tty", "urandom", "zero")
CLONE_NEWUTS = 0x04000000
MS_RDONLY, MS_REMOUNT, MNT_DETACH = 1, 32, 2


def lay_system(base, changes):
    """Mount base with changes over it at changes/root; -> (that, where new files land)."""
    system, upper, work = (os.path.join(changes, name) for name in ("root", "upper", "work"))
    for path in (system, upper, work):
        os.makedirs(path, exist_ok=True)
    copied = os.path.join(changes, "copied")
    if not os.path.exists(copied):
        try:
            mount_overlay(base, upper, work, system)
            return system, upper
        except OSError:
            subprocess.run(["cp", "-a", "--reflink=auto", base + "/.", upper], check=True)
            open(copied, "w").close()
    namespaces.mount(upper, system, None, namespaces.MS_BIND)
    return system, upper


def mount_overlay(base, upper, work, system):
    text = "lowerdir=%s,upperdir=%s,workdir=%s" % (base, upper, work)
    namespaces.check(
        libc.mount(b"overlay", os.fsencode(system), b"overlay", ctypes.c_ulong(0), os.fsencode(text)), "mount overlay"
    )


def lend_packages(cache, changes):
    """Link the packages downloaded by earlier calls into the system's cache."""
    archives = os.path.join(changes, "upper", "var", "cache", "apt", "archives")
    os.makedirs(cache, exist_ok=True)
    # as the base has them: what is made here covers the base's directories
    for part in ("var", "var/cache", "var/cache/apt", "var/cache/apt/archives"):
        path = os.path.join(changes, "upper", part)
        if not os.path.isdir(path):
            os.mkdir(path, 0o755)
    link_packages(cache, archives)


def take_packages_back(cache, changes):
    """Keep what the command has downloaded."""
    link_packages(os.path.join(changes, "upper", "var", "cache", "apt", "archives"), cache)


def link_packages(source, target):
    for path in glob.glob(os.path.join(source, "*.deb")):
        copy = os.path.join(target, os.path.basename(path))
        if not os.path.exists(copy):
            try:
                os.link(path, copy)
            except OSError:
                shutil.copy2(path, copy)


def home(options):
    """HOME of the command; the repository is in chipwise/ there."""
    return "/home/" + USER if options.user else "/root"


def copy_repository(system, changes, options):
    """Bring the repository's files to HOME/chipwise; a kept system loses those that are gone."""
    place = system + home(options) + "/chipwise"
    manifest = os.path.join(changes, "manifest" + home(options).replace("/", "-"))
    names = repository_files()
    for name in sorted(set(filter(None, read(manifest).split("\0"))) - names):
        with contextlib.suppress(OSError):
            os.unlink(os.path.join(place, name))
    for name in sorted(names):
        source, target = os.path.join(ROOT, name), os.path.join(place, name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        if os.path.islink(target) or not same_file(source, target):
            with contextlib.suppress(FileNotFoundError):
                os.unlink(target)
            shutil.copy2(source, target, follow_symlinks=False)
    with open(manifest, "w") as handle:
        handle.write("\0".join(sorted(names)))
    for folder in options.take:
        os.makedirs(os.path.join(place, folder), exist_ok=True)
        for name in os.listdir(os.path.join(ROOT, folder)):
            if os.path.isfile(os.path.join(ROOT, folder, name)):
                shutil.copy2(os.path.join(ROOT, folder, name), os.path.join(place, folder, name))
    owner = USER_ID if options.user else 0
    subprocess.run(["chown", "-R", "-h", "%d:%d" % (owner, owner), place], check=True)


def bring_back(options, changes):
    """Copy the files that the command has made in a folder of its copy of the repository into this one; they get its
    owner."""
    source, target = (
        os.path.join(changes, "upper" + home(options), "chipwise", options.bring),
        os.path.join(ROOT, options.bring),
    )
    if not os.path.isdir(source):
        raise Refusal("the command has made no folder %s; name one that it makes" % options.bring)
    owner = os.stat(ROOT)
    os.makedirs(target, exist_ok=True)
    for name in sorted(os.listdir(source)):
        if os.path.isfile(os.path.join(source, name)):
            shutil.copy2(os.path.join(source, name), os.path.join(target, name))
            os.chown(os.path.join(target, name), owner.st_uid, owner.st_gid)


def same_file(source, target):
    """Same size and date, and neither is a link."""
    try:
        one, other = os.lstat(source), os.lstat(target)
    except OSError:
        return False
    return (
        not os.path.islink(source)
        and one.st_size == other.st_size
        and one.st_mtime_ns == other.st_mtime_ns
        and one.st_mode == other.st_mode
    )


def mount_devices(system):
    """/dev with the harmless devices, terminals and shared memory; /sys to be read."""
    dev = system + "/dev"
    namespaces.mount("tmpfs", dev, "tmpfs")
    for name in DEVICES:
        open(os.path.join(dev, name), "w").close()
        namespaces.mount("/dev/" + name, os.path.join(dev, name), None, namespaces.MS_BIND)
    for name, kind in (("pts", "devpts"), ("shm", "tmpfs")):
        os.mkdir(os.path.join(dev, name))
        data = b"newinstance,ptmxmode=0666,mode=0620,gid=5" if kind == "devpts" else b"mode=1777"
        namespaces.check(
            libc.mount(kind.encode(), os.fsencode(os.path.join(dev, name)), kind.encode(), ctypes.c_ulong(0), data),
            "mount " + name,
        )
    for name, target in (
        ("ptmx", "pts/ptmx"),
        ("fd", "/proc/self/fd"),
        ("stdin", "/proc/self/fd/0"),
        ("stdout", "/proc/self/fd/1"),
        ("stderr", "/proc/self/fd/2"),
    ):
        os.symlink(target, os.path.join(dev, name))
    os.chmod(dev, 0o755)
    namespaces.mount("/sys", system + "/sys", None, namespaces.MS_BIND)
    namespaces.mount("none", system + "/sys", None, namespaces.MS_BIND | MS_REMOUNT | MS_RDONLY)


def map_same_numbers(pid):
    """Give a process in a new user namespace every user and group this one has."""
    for kind in ("uid_map", "gid_map"):
        lines = [line.split() for line in read("/proc/self/" + kind).splitlines()]
        namespaces.write_file(
            "/proc/%d/%s" % (pid, kind), "".join("%s %s %s\n" % (first, first, count) for first, _, count in lines)
        )


def enter_namespaces():
    """New namespaces for this process; its next child is their PID 1."""
    entered, go_on = os.pipe(), os.pipe()
    mapper = os.fork()
    if mapper == 0:  # root outside, who alone may write the maps
        os.read(entered[0], 1)
        code = 1
        try:
            map_same_numbers(os.getppid())
            code = 0
        finally:
            os.write(go_on[1], b"0" if code == 0 else b"1")
            os._exit(code)
    namespaces.check(libc.unshare(namespaces.CLONE_NEWUSER), "unshare user")
    os.write(entered[1], b"0")
    fine = os.read(go_on[0], 1) == b"0"
    os.waitpid(mapper, 0)
    if not fine:
        raise Refusal("user namespaces cannot be had here; run it on a machine, not in a container")
    os.setgroups([])
    os.setresgid(0, 0, 0)
    os.setresuid(0, 0, 0)
    namespaces.check(
        libc.unshare(namespaces.CLONE_NEWNS | namespaces.CLONE_NEWPID | namespaces.CLONE_NEWIPC | CLONE_NEWUTS),
        "unshare",
    )


def change_root(system):
    """Make system the root directory; the machine's is gone from sight."""
    namespaces.mount(system, system, None, namespaces.MS_BIND | namespaces.MS_REC)
    namespaces.mount("proc", system + "/proc", "proc")
    before = system + "/.before"
    os.makedirs(before, exist_ok=True)
    os.chdir(system)
    subprocess.run(["pivot_root", ".", ".before"], check=True)
    os.chdir("/")
    namespaces.check(libc.umount2(b"/.before", MNT_DETACH), "umount")
    os.rmdir("/.before")
