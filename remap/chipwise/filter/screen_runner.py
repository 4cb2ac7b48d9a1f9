# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows standard input as a message on the operator's screen.  A program, not a module.

    /usr/bin/python3 -s screen_runner.py error|text  < message

Started by screen.py: LinuxCNC's library may wait, and writes to standard output.
"""

import sys

import linuxcnc

WAIT_S = 1.0


def main():
    text = sys.stdin.buffer.read().decode("utf-8", "replace")
    command = linuxcnc.command()
    (command.error_msg if sys.argv[1] == "error" else command.text_msg)(text)
    command.wait_complete(WAIT_S)


if __name__ == "__main__":
    main()
