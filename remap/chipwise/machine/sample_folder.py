# SPDX-License-Identifier: GPL-2.0-or-later
"""The sample machines as one folder that works wherever it is copied to.

Called by cli/new_config.py (a folder of the user's) and by tools/install.py (the folder that LinuxCNC's configuration
selector offers).  In the repository the INI files of configs/ name what they need by relative paths.  The selector
copies one folder and changes PROGRAM_PREFIX only, so here

 1. what is the user's own machine is in the folder: INI files, tool tables, panels, programs, the HAL files in OWN_HAL;
 2. what belongs to chipwise is named by the absolute path of the installed tree, and stays one with it when it is
    upgraded;
 3. chipwise.hal is the one of LinuxCNC's HAL library, if it is there.
"""

import os
import re

OWN_HAL = ("sim.hal", "lathe.hal", "robot.hal", "tracer_head_sim.hal")  # of the simulated machines
KEPT = (".ini", ".tbl", ".toml", ".xml", ".py", ".ui")  # of configs/: no file that LinuxCNC has written there


def sample_files(root, share, in_library=True):
    """-> {name in the folder: content, bytes}.

    root: the repository, or an installed tree; share: where chipwise is used from, the same or where it will be
    installed; in_library: whether chipwise.hal is in LinuxCNC's HAL library.
    """
    found = {"README": _read(root, "configs", "README.samples")}
    for name in sorted(os.listdir(os.path.join(root, "configs"))):
        path = os.path.join(root, "configs", name)
        if name.endswith(KEPT) and os.path.isfile(path):
            content = _read(path)
            found[name] = rewritten(content.decode(), share, in_library).encode() if name.endswith(".ini") else content
    for name in OWN_HAL:
        found[name] = _read(root, "hal", name)
    top = os.path.join(root, "nc_files")
    for folder, _folders, names in sorted(os.walk(top)):
        for name in sorted(names):
            if name.endswith((".ngc", ".stl")):
                path = os.path.join(folder, name)
                found[os.path.join("nc_files", os.path.relpath(path, top))] = _read(path)
    return found


def _read(*path):
    with open(os.path.join(*path), "rb") as handle:
        return handle.read()


def rewritten(text, share, in_library):
    """The text of an INI file of configs/ -> that of one in a folder of its own."""
    main = "LIB:chipwise.hal" if in_library else share + "/hal/chipwise.hal"
    own = "|".join(re.escape(name) for name in OWN_HAL)
    for pattern, new in (
        (r"\bnc_files:\.\./nc_files\b", "nc_files"),
        (r"\.\./nc_files\b", "nc_files"),
        (r"^(HALFILE = )\.\./hal/chipwise\.hal$", lambda match: match[1] + main),
        (rf"(\.\./)?\bhal/({own})", r"\2"),
        (r"\.\./(hal|bin)/", lambda match: f"{share}/{match[1]}/"),
        (r"^(TOPLEVEL|PATH_PREPEND) = remap\b", lambda match: f"{match[1]} = {share}/remap"),
        (r"^(# .*)\bhal/chipwise\.hal", r"\1chipwise.hal"),
        (r"\bremap/chipwise/settings\.py", "docs/user/settings.md of chipwise"),
    ):
        text = re.sub(pattern, new, text, flags=re.MULTILINE)
    return text
