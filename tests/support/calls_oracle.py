# SPDX-License-Identifier: GPL-2.0-or-later
"""What a program does according to LinuxCNC's own `rs274 -g`, to compare a program with its calls and loops written
out.

Used by tests/rewrite/test_rewrite_calls.py.  Nothing here is the package's but how rs274 is started: the canonical
calls are those that the machine would get, spindle, coolant, outputs and messages among them.
"""

import math
import re

from chipwise.program import rs274

_CALL = re.compile(r"^\s*\d+\s+N\S*\s+(\w+)\((.*)\)\s*$")
_NUMBER = re.compile(r"-?\d+\.\d+")
_MOVES = {"STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED"}
# says nothing about what the machine does, or is said with the moves
_QUIET = {
    "COMMENT",
    "USE_LENGTH_UNITS",
    "SELECT_PLANE",
    "SET_FEED_RATE",
    "SET_FEED_MODE",
    "SET_FEED_REFERENCE",
    "ON_RESET",
}
APART = 2e-4  # in the unit in force: rs274 prints 4 decimals, and the text has 5


def acts(path, ini):
    """([(what, numbers in mm, how far they may be off)], error text): what a program does, moves that go nowhere left
    out."""
    done = rs274.run(path, ini, capture_output=True, timeout=300)
    result, offsets, unit, plane, feed, at = [], {}, 1.0, "", 0.0, None
    cycles = "G81" in path.read_text()  # it runs them in exact path mode, their moves written out are in the program's
    for line in done.stdout.splitlines():
        match = _CALL.match(line)
        if not match:
            continue
        name, text = match.groups()
        apart = APART * unit
        numbers = [float(n) for n in _NUMBER.findall(text)]
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in text else 1.0
        elif name == "SELECT_PLANE":
            plane = text
        elif name == "SET_FEED_RATE":
            feed = numbers[0] * unit
        elif name in _MOVES:
            end = [n * unit for n in numbers]
            if name == "ARC_FEED":
                result.append((f"{name} {plane} {text.split(',')[4].strip()}", [*end, feed], apart))
            elif at is None or math.dist(at, end[:3]) > apart:
                result.append((name, [*end[:3], feed if name == "STRAIGHT_FEED" else 0.0], apart))
            at = end[:3] if name != "ARC_FEED" else None
        elif name not in _QUIET and not (cycles and name in ("SET_MOTION_CONTROL_MODE", "SET_NAIVECAM_TOLERANCE")):
            lengths = name in ("SET_G5X_OFFSET", "SET_G92_OFFSET", "USE_TOOL_LENGTH_OFFSET")
            result.append(
                (name if numbers else f"{name} {text}", [n * (unit if lengths else 1.0) for n in numbers], apart)
            )
            if (lengths or name == "SET_XY_ROTATION") and offsets.get(name) != numbers:
                offsets[name], at = numbers, None
    return result, done.stderr.strip() if "PROGRAM_END" not in done.stdout else ""


def difference(one, two):
    """Text of the first difference of two lists of acts, None without one."""
    for k, (a, b) in enumerate(zip(one, two)):
        if (
            a[0] != b[0]
            or len(a[1]) != len(b[1])
            or any(abs(x - y) > max(a[2], b[2]) + 1e-5 * abs(x) for x, y in zip(a[1], b[1]))
        ):
            return f"act {k}: {b} instead of {a}"
    return f"{len(two)} acts instead of {len(one)}" if len(one) != len(two) else None
