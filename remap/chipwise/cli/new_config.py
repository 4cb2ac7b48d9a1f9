# SPDX-License-Identifier: GPL-2.0-or-later
"""Make a folder of your own with the sample machines: mills, lathes, robot, tracers, their tools and programs.

LinuxCNC writes beside the INI file (work offsets, tool table, preferences), and so does chipwise (stock, stations,
tools), so a configuration has to be yours. In this folder everything is; chipwise itself stays where it is installed.
Nothing that is there is replaced: a folder that is not empty is refused, and left as it is.

Exit status: 0 the folder is made, 1 it could not be written, 2 it cannot be used.
"""

import filecmp
import os
import shlex
import subprocess

from chipwise import ROOT
from chipwise.options.machine import refuser
from chipwise.machine.sample_folder import sample_files

NAME = "new-config"
HELP = "make a folder of your own with the sample machines"
DEFAULT = os.path.join("~", "linuxcnc", "configs", "chipwise")  # beside what LinuxCNC's configuration selector copies

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("folder", metavar="FOLDER", nargs="?", help=f"the folder to make (default: {DEFAULT})")
    parser.error = refuse


def run(options):
    """-> exit status."""
    if any(sign.isspace() or sign == "#" for sign in ROOT):
        refuse(f"an INI file cannot name {ROOT}, where chipwise is; move it to a path without blanks and number signs")
    folder = os.path.abspath(os.path.expanduser(options.folder or DEFAULT))
    make_folder(folder)
    files = sample_files(ROOT, ROOT, in_library())
    write(folder, files)
    print(f"{folder}: {sum(name.endswith('.ini') for name in files)} machines; start one with")
    print(f"  linuxcnc {shlex.quote(os.path.join(folder, 'mill.ini'))}")
    return 0


def in_library():
    """Whether LinuxCNC's HAL library has this chipwise.hal: not if the repository is not installed, or if another
    version is."""
    try:
        folder = subprocess.run(
            ["linuxcnc_var", "HALLIB_DIR"], text=True, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ).stdout.strip()
        return filecmp.cmp(
            os.path.join(folder, "chipwise.hal"), os.path.join(ROOT, "hal", "chipwise.hal"), shallow=False
        )
    except (OSError, subprocess.CalledProcessError):
        return False


def make_folder(folder):
    """The folder, empty and writable; refuse any other."""
    try:
        os.makedirs(folder, exist_ok=True)
        found = os.listdir(folder)
    except OSError as error:
        refuse(f"{folder} cannot be used: {error.strerror}; name another folder")
    if found:
        refuse(f"{folder} is not empty, and nothing in it is replaced; name another folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        refuse(f"{folder} cannot be used: you may not write there; name another folder")


def write(folder, files):
    """Write files {name: content} that do not exist; what an error leaves half done is taken away again."""
    written = []
    try:
        for name, content in files.items():
            path = os.path.join(folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "xb") as handle:
                written.append(path)
                handle.write(content)
    except OSError:
        for path in written:
            os.unlink(path)
        raise
