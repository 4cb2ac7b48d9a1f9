# SPDX-License-Identifier: GPL-2.0-or-later
"""A true stock that is 1 to 10 mm larger than the one that SHADOW assumes: nothing goes above F, nothing stops, and the
line at the end says that it was assumed.

Called by hand: `/usr/bin/python3 bench/bench_larger_stock.py [--only NAME ..] [--seed N]`.

 1. The programs are those of tests/support/cam_programs.py, with odd sizes from the seed, as CAM wrote them, on the
    real LinuxCNC with SHADOW = yes.
 2. The true stock is the assumed one and 1 to 10 mm more, another amount at each side and on top.
    tests/support/judge.py says from the servo-rate log what the tool removes of it; the tracker's pin says what the
    model has lost.
 3. The largest adaptive feed of the log, and the largest velocity of feed moves over the F of their line.
"""

import argparse
import random
import re
import tempfile
from pathlib import Path

import numpy as np

import roots  # noqa: F401  puts tests/ and remap/ on the path
from bench_set_up import feeds_of
from support import cam_programs, claims
from support import judge as judging
from support.operate import operate
from support.shadow_runs import MACHINES, PINS, SPEED, SWITCH, TIMEOUT_S

SHORT = (
    "fusion_pocket",
    "fusion_personal_profile",
    "freecad_drill",
    "vectric_profile",
    "makera_relief",
    "carbide_create_pocket",
    "mastercam_drill",
    "jscut_pocket",
)
AT_END, PER = "on an assumed stock", 11
SAID = re.compile(r"a stock is assumed from .*, from (\S+) (\S+) (\S+) to (\S+) (\S+) (\S+) mm")
# says the line at the end
DISPLAY = "\ns#^POSTGUI_HALFILE = ../hal/chipwise_display.hal#HALFILE = ../hal/chipwise_display.hal#"
HEAD = (
    f"{'program':26s} {'larger by mm':>22s} {'removed':>9s} {'model':>9s} {'adaptive':>9s} {'v / F':>7s} {'errors':>6s}"
)


def place_of(at):
    """mm, the zero of the work coordinates of a program."""
    return np.array([30 + 0.37 * at, 25 + 0.23 * at, -25])


def steps_of(paths):
    """For operate(): PER each."""
    found = []
    for at, path in enumerate(paths):
        found += [
            ["mdi", "G21 G10 L2 P1 X{:.2f} Y{:.2f} Z{:.2f}".format(*place_of(at))],
            ["mdi", "G64 P0.01"],
            ["mdi", "T0 M6"],
            ["mdi", "G53 G0 Z60"],
            ["mdi", "G53 G0 X5 Y5"],
            ["open", str(path)],
            ["messages", f"{path.name}: a stock is assumed"],
            ["log", str(path)],
            ["sleep", 8.0],
            ["messages"],
            PINS,
        ]
    return found


def run(folder, texts):
    """{name: (what was said of the stock, (errors, path of the log), what was said at the end, pins)}."""
    paths = [folder / f"{name}.ngc" for name in texts]
    for path in paths:
        path.write_text(texts[path.stem])
    answers = operate(
        folder,
        steps_of(paths),
        ini=MACHINES["metric"],
        edit=SWITCH.format("yes") + DISPLAY,
        speed=SPEED,
        timeout=TIMEOUT_S,
    )
    return {path.stem: answers[PER * at + 6 : PER * at + PER] for at, path in enumerate(paths)}


def removed(run, blank, diameter):
    """mm3 that a run takes from a blank, by needles."""
    tools = [judging.Tool(diameter)]
    first, last, _path = judging.chords(run.tips, run.apart)
    ends = np.ascontiguousarray(np.hstack([run.tips[first], run.tips[last]]))
    return float(judging.needles(blank, tools, ends, np.zeros(len(ends), np.int32), diameter / 40)[-1])


def fastest(run, text):
    """The largest velocity of a feed move over the F of its line."""
    lines = [re.sub(r"\([^)]*\)|;.*", "", line).replace(" ", "") for line in text.splitlines()]
    feeds = feeds_of(lines, 25.4 if any("G20" in line for line in lines) else 1.0)
    velocity = np.linalg.norm(np.diff(run.tips, axis=0, prepend=run.tips[:1]), axis=1) / run.period
    feed = feeds[run.line.clip(0, len(feeds) - 1)]
    rows = run.feeding & (feed > 0) & ~run.apart
    return float((velocity[rows] / feed[rows]).max(initial=0.0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=SHORT, help="programs")
    parser.add_argument("--seed", default="1")
    options = parser.parse_args()
    texts = {name: text for name, text in cam_programs.programs(options.seed).items() if name in options.only}
    print(HEAD, flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        found = run(Path(scratch), texts)
        for at, (name, (said, (errors, path), _, end, pins)) in enumerate(found.items()):
            low, high = np.reshape([float(value) for value in SAID.search(said[-1]).groups()], (2, 3)) + place_of(at)
            more = np.array([random.Random(f"{options.seed} {name} {side}").uniform(1.0, 10.0) for side in range(5)])
            log = claims.loaded(path)
            one = judging.Run(log)
            blank = judging.Blank.corners(low - (more[0], more[1], 0.0), high + more[2:])
            gone = removed(one, blank, cam_programs.TOOL_MM.get(name.rpartition("_")[0], 6.0))
            print(
                f"{name:26s} {' '.join(f'{value:.1f}' for value in more):>22s} {gone:9.0f} {float(pins[2]):9.0f} "
                f"{log['adaptive_feed'].max():9.6f} {fastest(one, texts[name]):7.3f} "
                f"{len(errors):6d}" + (f"  {one.lost} servo periods lost" if one.lost else ""),
                flush=True,
            )
            for text in (*errors, *(text for text in end if AT_END in text and f": {name}.ngc: " in text)):
                print("    " + text, flush=True)


if __name__ == "__main__":
    main()
