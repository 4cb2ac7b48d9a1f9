# SPDX-License-Identifier: GPL-2.0-or-later
"""What a command in the sandbox sees instead of the system's files, by mounting something else over them.

Called by sandbox.py inside the namespaces, by unisolated.py, which only copies, and by kinematics.py, which asks for
the module directory.
"""

import glob
import os
import re
import shutil

from chipwise.machine.namespaces import MS_BIND, mount

# Where `halcompile --print-modinc` looks (2.9.0~pre1); that takes longer than the rest of a sandbox's start.
FOLDERS_OF_MODINC = ("src", "etc/linuxcnc", "/etc/linuxcnc", "share/linuxcnc")

DISPLAYS = "/tmp/.X11-unix"

NML_PATIENCE_S = 10.0  # s of real time (semtimedop), for a shared buffer


def realtime_folders(makefile):
    """The values of RTLIBDIR in a Makefile.modinc, none without one ('')."""
    if not makefile:
        return []
    with open(makefile, errors="surrogateescape") as handle:
        return [line.split(":=")[1].strip() for line in handle if line.startswith("RTLIBDIR")]


def module_directory():
    """LinuxCNC's realtime module directory, or None without LinuxCNC."""
    halcompile = shutil.which("halcompile")
    if halcompile:
        prefix = os.path.dirname(os.path.dirname(os.path.abspath(halcompile)))
        makefiles = [os.path.join(prefix, folder, "Makefile.modinc") for folder in FOLDERS_OF_MODINC]
        for value in reversed(realtime_folders(next(filter(os.path.isfile, makefiles), ""))):
            if os.path.isdir(value):
                return value
    standard = "/usr/lib/linuxcnc/modules"
    return standard if os.path.isdir(standard) else None


def cover_modules(fresh, scratch):
    """Cover the module directory by links to its content and the fresh ones."""
    system = module_directory()
    if system is None or fresh is None:
        return
    below, merged = os.path.join(scratch, "system"), os.path.join(scratch, "merged")
    os.mkdir(below)
    os.mkdir(merged)
    mount(system, below, None, MS_BIND)
    for name in os.listdir(below):
        os.symlink(os.path.join(below, name), os.path.join(merged, name))
    for path in glob.glob(os.path.join(os.path.abspath(fresh), "*.so")):
        link = os.path.join(merged, os.path.basename(path))
        if os.path.lexists(link):
            os.unlink(link)
        shutil.copy(path, link)
    mount(merged, system, None, MS_BIND)


def cover_installed(destdir, scratch):
    """Show the files below DESTDIR at their installed paths, beside the files that exist there.

    A folder `chipwise` is shown as it is in DESTDIR: mixed with that of an installed chipwise its modules would be
    found in two places."""
    for number, (folder, folders, names) in enumerate(os.walk(os.path.abspath(destdir))):
        place = os.path.join("/", os.path.relpath(folder, destdir))
        new = names + [
            name
            for name in folders
            if own_folder(os.path.join(place, name)) or not os.path.isdir(os.path.join(place, name))
        ]
        folders[:] = [name for name in folders if name not in new]
        if not new:
            continue
        below, merged = (os.path.join(scratch, "%s%d" % (kind, number)) for kind in ("below", "installed"))
        os.mkdir(below)
        os.mkdir(merged)
        mount(place, below, None, MS_BIND)
        for name in set(os.listdir(below)) - set(new):
            os.symlink(os.path.join(below, name), os.path.join(merged, name))
        for name in new:
            os.symlink(os.path.join(os.path.abspath(folder), name), os.path.join(merged, name))
        mount(merged, place, None, MS_BIND)


def own_folder(path):
    """Whether a folder is chipwise's own, and none above LinuxCNC, as that of somebody who builds both in it."""
    return os.path.basename(path) == "chipwise" and not os.path.realpath(shutil.which("linuxcnc") or "").startswith(
        os.path.realpath(path) + "/"
    )


def cover_script(scratch, home):
    """Cover the linuxcnc script by one whose files are in HOME, not in /tmp."""
    script, copy = own_script(scratch, home)
    if script:
        mount(copy, script, None, MS_BIND)


def own_script(folder, home):
    """-> (the linuxcnc script or None, a copy in folder whose lock file and logs are in HOME, and the HAL files that
    twopass.tcl writes)."""
    script = shutil.which("linuxcnc")
    if script is None:
        return None, None
    script = os.path.realpath(script)
    with open(script, errors="surrogateescape") as handle:
        text = handle.read()
    copy = os.path.join(folder, "linuxcnc")
    with open(copy, "w", errors="surrogateescape") as handle:
        handle.write(with_own_twopass(text.replace("/tmp/linuxcnc.", home + "/linuxcnc."), folder))
    os.chmod(copy, 0o755)
    return script, copy


def with_own_twopass(text, folder):
    """The text of the linuxcnc script with a copy of its twopass.tcl, which writes /tmp/tmp_NAME for each HAL file,
    lets it lie there, and does not start with that of another user."""
    found = re.search(r"^ *CFGFILE=(\S+/twopass\.tcl)$", text, re.MULTILINE)
    if not found or not os.path.isfile(found[1]):
        return text
    copy = os.path.join(folder, "twopass.tcl")
    with open(found[1], errors="surrogateescape") as source, open(copy, "w", errors="surrogateescape") as handle:
        handle.write(source.read().replace("/tmp/tmp_[file tail $f]", "[file join $::env(HOME) tmp_[file tail $f]]"))
    return text.replace(found[1], copy)


def nml_lists():
    """LinuxCNC's lists of shared buffers: where a package has them, and beside the script of a LinuxCNC that is run in
    place."""
    script = os.path.realpath(shutil.which("linuxcnc") or "/")
    in_place = os.path.join(os.path.dirname(os.path.dirname(script)), "configs/common/*.nml")
    return [path for places in ("/usr/share/linuxcnc/*.nml", in_place) for path in sorted(glob.glob(places))]


def cover_nml(scratch):
    """Cover LinuxCNC's lists of shared buffers: with a fast clock its processes come to a buffer so often that a busy
    computer exceeds the second that one waits for another ("SHMEM: Can't take semaphore").  Here they wait
    NML_PATIENCE_S."""
    for number, path in enumerate(nml_lists()):
        with open(path, errors="surrogateescape") as handle:
            lines = [patient(line) for line in handle]
        copy = os.path.join(scratch, "list%d.nml" % number)
        with open(copy, "w", errors="surrogateescape") as handle:
            handle.writelines(lines)
        mount(copy, path, None, MS_BIND)


def patient(line):
    """A line of such a list: that of a process has its time-out as eighth word."""
    words = line.split()
    if words[:1] != ["P"] or len(words) < 8:
        return line
    words[7] = "%g" % max(NML_PATIENCE_S, float(words[7]))
    return " ".join(words) + "\n"


def cover_displays():
    """Cover the folder of the X displays' sockets: a display of another sandbox, whose lock has a process number that
    means nothing here, would lose its socket to ours, and its screen would find ours or none."""
    os.makedirs(DISPLAYS, exist_ok=True)
    mount("tmpfs", DISPLAYS, "tmpfs")


def cover_rtapi(scratch):
    """Cover rtapi_app by a copy without the setuid bit, which drops LD_PRELOAD."""
    program = shutil.which("rtapi_app")
    if program:
        copy = shutil.copyfile(program, os.path.join(scratch, "rtapi_app"))
        os.chmod(copy, 0o755)
        mount(copy, os.path.realpath(program), None, MS_BIND)


def cover_directory(directory, scratch, number):
    """Cover a directory by a copy, so that what is written there is lost."""
    directory = os.path.realpath(directory)
    if not os.path.isdir(directory):
        return
    copy = os.path.join(scratch, "private%d" % number)
    copy_directory(directory, copy)
    mount(copy, directory, None, MS_BIND)


def copy_directory(directory, copy):
    """Copy a directory without what LinuxCNC has saved there."""
    shutil.copytree(directory, copy, symlinks=True, ignore=shutil.ignore_patterns("*.var", "*.var.bak", "*.expanded"))
