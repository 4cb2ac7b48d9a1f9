# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise digitise as a user calls it."""

import subprocess

from support import ROOT


def digitise(*arguments):
    return subprocess.run(
        [str(ROOT / "bin/chipwise"), "digitise", *map(str, arguments)],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
