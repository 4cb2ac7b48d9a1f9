# SPDX-License-Identifier: GPL-2.0-or-later
"""What of an installation is the user's, and the list of what was installed.  Called by install.py.

The manifest has a line for each file, "f PATH", for each regular file "h SHA256 PATH", the hash of what was put there,
and for each directory made "d PATH".  A file whose hash is another one now was changed by the user; where there is no
hash (a manifest of chipwise 0.4.0 or before) a file that differs counts as changed.

1. Settings, samples and programs that were changed stay.  The new version is put beside them as FILE.new.
2. HAL files have to fit the components.  One that was changed is replaced, and the user's stays beside it as
   FILE.yours.
3. Both stay when chipwise is removed, and are named.
"""

import filecmp
import hashlib
import os

SETTINGS = ("/share/chipwise/configs/", "/share/chipwise/nc_files/", "/aux_examples/chipwise/")


def is_setting(path):
    """Whether a file is one that users change and that may stay as they have it."""
    return any(part in path for part in SETTINGS)


def is_users(path):
    """Whether a change of a file must not be lost."""
    return is_setting(path) or path.endswith(".hal")


def hash_of(path):
    """SHA256 of a regular file; '' for anything else."""
    if os.path.islink(path) or not os.path.isfile(path):
        return ""
    with open(path, "rb") as handle:
        return hashlib.sha256(handle.read()).hexdigest()


class Manifest:
    """The list of an installation: files {path: hash or ''}, folders made; paths are without DESTDIR."""

    def __init__(self, path):
        self.path, self.files, self.folders = path, {}, []
        if os.path.exists(path):
            with open(path) as handle:
                self._read(handle.read().split("\n"))

    def _read(self, lines):
        for line in lines:
            kind, _, rest = line.partition(" ")
            if kind == "f":
                self.files.setdefault(rest, "")
            elif kind == "h":
                self.files[rest[65:]] = rest[:64]
            elif kind == "d":
                self.folders.append(rest)

    def write(self):
        """Write it to its path."""
        lines = ["f %s\n" % name for name in sorted(self.files)]
        lines += ["h %s %s\n" % (self.files[name], name) for name in sorted(self.files) if self.files[name]]
        with open(self.path, "w") as handle:
            handle.write("".join(lines + ["d %s\n" % name for name in self.folders]))
        os.chmod(self.path, 0o644)


def is_changed(old, target, destdir, source=None):
    """Whether the user has changed a file that was installed; source: the file it would be compared with where no hash
    is known."""
    there = hash_of(destdir + target)
    if not there:
        return False
    if old.files.get(target):
        return there != old.files[target]
    return not (isinstance(source, str) and filecmp.cmp(source, destdir + target, shallow=False))


def free_name(path):
    """FILE.yours, or FILE.yours.2 and so on where a user's earlier file is there already."""
    name, number = path + ".yours", 1
    while os.path.lexists(name) and not filecmp.cmp(name, path, shallow=False):
        number += 1
        name = "%s.yours.%d" % (path, number)
    return name


def with_users_files(plan, old, destdir):
    """-> (what to put {target: source}, settings that stay {target: hash}, HAL files whose old ones stay beside
    them)."""
    to_put, stay, beside = {}, {}, []
    for target, source in plan.items():
        users = is_users(target) and isinstance(source, str) and is_changed(old, target, destdir, source)
        if users and hash_of(source) == hash_of(destdir + target):
            users = False
        if users and is_setting(target):
            stay[target] = old.files.get(target, "")
            if stay[target] != hash_of(source):
                to_put[target + ".new"] = source
        else:
            to_put[target] = source
            if users:
                beside.append(target)
    return to_put, stay, beside
