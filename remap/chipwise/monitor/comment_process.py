# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the CLAMP comments of the loaded program, in a process of its own: an order as JSON on standard input, the
answer as JSON on standard output.  Called by monitor/comment_clamps.py.

    {"ini", "program", "scene"}     scene: loaded.scene()
    -> {"why": the reason for having none, or ""; "clamps": [[how many M256 come before it, shape, turn (degrees), low,
    high, name]] mm, machine coordinates}

A program without subs is read as far as the last line with CLAMP.  Computing time and memory are limited, and LinuxCNC
comes first.
"""

import json
import re

from chipwise.check.asked import reasoned, take_order
from chipwise.check.in_force import machine_in_force
from chipwise.host.files import open_regular
from chipwise.program import records
from chipwise.program.program_file import MAX_BYTES
from chipwise.program.reader import Reader

NICE = 10
CPU_S = 60
MEMORY_MB = 1000  # of this process, and of the one that reads
MOST_MOVES = 5_000_000
JUMPS = re.compile(rb"^[\s/]*(?:n\s*[\d.]+\s*)?o|m\s*0*9\s*[89]", re.IGNORECASE | re.MULTILINE)


def last_line(program):
    """Number of the last line with CLAMP; None if the lines of the program are not executed one after the other."""
    with open_regular(program, MAX_BYTES) as file:
        text = file.read()
    return None if JUMPS.search(text) else text.count(b"\n", 0, text.lower().rfind(b"clamp")) + 1


def answer(order, folder):
    """-> the answer."""
    machine = machine_in_force(order["ini"], order["scene"], folder)
    if not machine.has_y:
        return {"why": "", "clamps": []}  # a lathe
    last, found, after = last_line(order["program"]), [], 0
    with Reader(
        order["program"], machine, cpu_s=CPU_S, most_moves=MOST_MOVES, memory_mb=MEMORY_MB, clamps=True
    ) as reader:
        for block in reader:
            for row in block[block[:, 0] >= records.CLAMP]:
                if row[0] == records.CLAMP_SET_UP:
                    after += 1
                elif row[0] == records.CLAMP:
                    values = row[2:].tolist()
                    found.append(
                        [after, int(values[0]), values[1], values[2:5], values[5:8], f"the clamp of line {int(row[1])}"]
                    )
            moves = block[block[:, 0] <= records.ARC]
            if last is not None and len(moves) and moves[-1, 1] > last:
                break
    return {"why": "", "clamps": found}


def main():
    order = take_order(NICE, 2 * MEMORY_MB)
    try:
        said = reasoned(answer, order, "clamps")
    except OSError as error:
        said = {"why": f"the program cannot be read: {error.strerror}"}
    print(json.dumps(said))


if __name__ == "__main__":
    main()
