# SPDX-License-Identifier: GPL-2.0-or-later
"""What is in force on a machine (chipwise.monitor.loaded.scene), as the processes that read its program get it.  Called
by the tests of monitor, panel, resume, setup, check and cycles."""

SCENE = {
    "index": 1,
    "offset": [0.0, 0.0, 0.0],
    "g92": [0.0, 0.0, 0.0],
    "turn": 0.0,
    "tool": 1,
    "codes": "G17 G21",
    "block_delete": False,
}
