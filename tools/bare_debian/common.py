# SPDX-License-Identifier: GPL-2.0-or-later
"""What the parts share: the refusal, and what files and commands say."""

import subprocess

USER, USER_ID = "user", 1000


class Refusal(Exception):
    """What cannot be done, why, and what to do about it."""


def read(path):
    """The text of a file; '' if it cannot be read."""
    try:
        with open(path, errors="replace") as handle:
            return handle.read()
    except OSError:
        return ""


def output(*command):
    """What a command prints, or '' if it fails."""
    try:
        return subprocess.run(
            command, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ).stdout
    except OSError:
        return ""
