# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of the repository.  Called by words.py, bare_debian/system.py and tests/docs/."""

import os
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MADE = {".git", "build", "__pycache__", ".pytest_cache", ".mypy_cache", ".ruff_cache"}  # what no clone begins with


def repository_files() -> set:
    """Paths of the files, changed and new ones included, without what git ignores; also in a copy that is not a
    clone."""
    listed = (
        subprocess.run(
            ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        .stdout.decode("utf-8", "surrogateescape")
        .split("\0")
    )
    names = {name for name in listed if name and os.path.lexists(os.path.join(ROOT, name))}
    if names:
        return names
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in MADE]
        names.update(os.path.relpath(os.path.join(folder, name), ROOT) for name in files)
    return names
