# SPDX-License-Identifier: GPL-2.0-or-later
"""Random cuts in which the core itself commands the feed of a simulated planner (closed_loop.c), judged by needles.

The core may be built with a fault of components/core/fault.h, or with other values of its tuned constants.
"""

import re
import subprocess
from typing import NamedTuple

from support import ROOT

CORE = ROOT / "components" / "core"
BUILD_S, SCENE_S = 600, 300  # patience on a loaded computer


class Scene(NamedTuple):
    """The outcome of one scene."""

    seed: int
    peak: float  # true removal rate in 10 ms over the target, the largest
    over: float  # share of the cutting time above 102 % of the target
    seconds: float  # of machining
    volume: float  # removed volume of the map over the true one


def sources(folder, constants):
    """The core's C files, copied into a folder with other constants: {name: value}.  KeyError: it has none of that
    name."""
    copy = folder / "core"
    copy.mkdir()
    left = dict(constants)
    for path in sorted(CORE.glob("*.[ch]")):
        text = path.read_text()
        for name, value in constants.items():
            text, found = re.subn(rf"^(#define {name}\s+)\S+", rf"\g<1>({value!r})", text, flags=re.M)
            if found:
                left.pop(name, None)
        (copy / path.name).write_text(text)
    if left:
        raise KeyError(sorted(left))
    return sorted(copy.glob("*.c"))


def build(folder, fault="", constants=None):
    """-> the program, built in an empty folder."""
    program = folder / "closed_loop"
    subprocess.run(
        [
            "gcc",
            "-std=gnu11",
            "-O2",
            "-fno-fast-math",
            "-w",
            f'-DCHIPWISE_FAULT="{fault}"',
            "-I",
            str(folder),
            "-I",
            str(CORE.parent),
            "-o",
            str(program),
            str(ROOT / "tests/support/closed_loop.c"),
            *map(str, sources(folder, constants or {})),
            "-lm",
        ],
        check=True,
        timeout=BUILD_S,
    )
    return program


def run(program, first, count, cell=0.0):
    """-> [Scene] of so many seeds from `first` on; cell: mm, 0: as `chipwise load` chooses it for the tool."""
    done = subprocess.run(
        [str(program), str(first), str(count), f"{cell:g}"],
        check=True,
        capture_output=True,
        text=True,
        timeout=SCENE_S * count,
    )
    return [Scene(int(seed), *map(float, rest)) for seed, *rest in map(str.split, done.stdout.splitlines())]
