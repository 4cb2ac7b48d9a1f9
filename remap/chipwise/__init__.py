# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise: stock-aware feed and machining cycles for LinuxCNC."""

import os

ROOT = os.path.dirname(
    os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
)  # of the repository, or share/chipwise


def version() -> str:
    """The content of the file VERSION."""
    with open(os.path.join(ROOT, "VERSION"), encoding="ascii") as handle:
        return handle.read().strip()
