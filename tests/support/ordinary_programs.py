# SPDX-License-Identifier: GPL-2.0-or-later
"""Sixty ordinary programs, twelve CAM systems' manners (cam_programs.py) with five shapes of work each, in clothes that
programs have: CRLF, small letters, no end, no blanks, a traverse home under G91, a tool that the machine does not know,
a tool that is called by nobody.

Called by bench/bench_any_program.py and tests/check/test_check_ordinary.py.
"""

import random
import re

from support.cam_programs import INCH, MANNERS, TOOL_MM, WORKS, Writer

CLOTHES = ("plain", "crlf", "small", "endless", "packed", "home", "strange", "nobody")
STRANGE = 912  # a number that no tool table has


def _code(line):
    """Whether a line has words, not a comment alone."""
    return line[:1] not in "(;%"


def _small(lines):
    return [line.lower() if _code(line) else line for line in lines]


def _endless(lines):
    return [line for line in lines if not re.search(r"M(2|02|30)$|^%", line)]


def _packed(lines):
    return [line.replace(" ", "") if _code(line) and "(" not in line else line for line in lines]


def _home(lines):
    """Up by machine coordinates and under G91 before the end, as many posts do."""
    last = next(k for k in reversed(range(len(lines))) if "M5" in lines[k] or "M05" in lines[k] or "M09" in lines[k])
    return [*lines[:last], "G91 G28 Z0", "G90", *lines[last:]]


def _strange(lines):
    return [
        re.sub(r"(?<![\w.])T[12](?!\d)|(?<=M6)T1\b", f"T{STRANGE}", line)
        .replace("(1 = ", f"({STRANGE} = ")
        .replace("tool#=1 ", f"tool#={STRANGE} ")
        for line in lines
    ]


def _nobody(lines):
    return [line for line in lines if not (_code(line) and re.search(r"T\d ?M0?6|M0?6 ?T\d|G43", line))]


_DRESS = {
    "small": _small,
    "endless": _endless,
    "packed": _packed,
    "home": _home,
    "strange": _strange,
    "nobody": _nobody,
}


def programs(seed=1):
    """{name: (bytes, clothes)}."""
    found = {}
    for number, manner in enumerate(MANNERS):
        for place, (name, work) in enumerate(WORKS.items()):
            rng = random.Random(f"{seed} {manner.name} {name}")
            clothes = CLOTHES[(number + 3 * place + seed) % len(CLOTHES)]
            x, y, diameter = rng.uniform(36, 60), rng.uniform(22, 40), TOOL_MM.get(manner.name, 6.0)
            body, writer = Writer(manner), Writer(manner)
            work(body, rng, x, y, diameter / 2)
            given = {"d": writer.value(diameter), "z": writer.value(-8), "x": writer.value(x), "y": writer.value(y)}
            writer.raw(*(line.format(**given) for line in (*manner.head, *manner.tool)))
            writer.raw(
                *(body.lines if not manner.numbers else [line.partition(" ")[2] for line in body.lines]), *manner.end
            )
            lines = _DRESS.get(clothes, list)(writer.lines)
            end = "\r\n" if clothes == "crlf" else "\n"
            found[f"{manner.name}_{name}_{clothes}.nc"] = ((end.join(lines) + end).encode(), clothes)
    return found


def unit_mm(text):
    """mm per unit of a program."""
    return INCH if re.search(r"G20(?!\d)", text, re.IGNORECASE) else 1.0
