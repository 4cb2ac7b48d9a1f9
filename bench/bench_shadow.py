# SPDX-License-Identifier: GPL-2.0-or-later
"""SHADOW changes nothing: twenty-four programs in the manner of twelve CAM systems, with SHADOW = yes and no, servo
period by servo period.

Called by bench/run.py (prints JSON rows, of the programs of SHORT on the metric mill); by hand with --table:
`/usr/bin/python3 bench/bench_shadow.py --table --machine inch`.

 1. tests/support/cam_programs.py has the programs.  Each is loaded, what is said of its stock is waited for, and it
    runs with the sampler: OFF times with SHADOW = no, ON times with yes, all programs of a run in one LinuxCNC.
 2. Servo rows are the commanded positions, the tool offset and the adaptive feed of each period in which something
    moves.  They are the same if each row is that of a run without SHADOW, to the six decimals of the log; with OFF
    above 1 the control compares such runs.  Both overrides are 0 % until the task has sent the moves: how a move begins
    after a rest depends on whether the next one is there already, with SHADOW or without.
 3. Canonical calls are those of rs274 with the INI file of either.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

import roots  # noqa: F401  puts tests/ and remap/ on the path
from rows import row

from support import ROOT, cam_programs, shipped
from support.shadow_runs import MACHINES, canonical, run, strange

SHORT = ("fusion_personal_profile", "mastercam_profile", "estlcam_engrave")
OFF, ON = 1, 1  # runs
SHIPPED = "shipped"


def run_of(folder, texts, machine, shadow):
    """shadow_runs.run(); the machine `shipped` is the installed mill of an ordinary user, with the package's setuid
    rtapi_app, in real time."""
    if machine != SHIPPED:
        return run(folder, texts, machine, shadow)
    found = shipped.scene(
        "scenes.shadow",
        shipped.stage(folder.with_name("installed")),
        folder,
        texts=texts,
        word="yes" if shadow else "no",
        sampler=(ROOT / "hal" / "headless.hal").read_text(),
    )
    return {
        name: (errors, np.load(folder / f"{name}.npy") if whole else None, said, pins)
        for name, (errors, whole, said, pins) in found.items()
    }


def measure(folder, texts, machine):
    """Rows of the table: {"program", "stock" (what was said), "calls", "same_calls", "rows" of each run, "strange",
    "control", "lost", "errors", "volume", "certain"}."""
    off = [run_of(folder / f"off-{n}", texts, machine, False) for n in range(OFF)]
    on = [run_of(folder / f"on-{n}", texts, machine, True) for n in range(ON)]
    for name, text in texts.items():
        calls = [canonical(folder, text, "metric" if machine == SHIPPED else machine, word) for word in ("no", "yes")]
        without, with_it = ([one[name][1] for one in some if one[name][1] is not None] for some in (off, on))
        yield {
            "program": name,
            "stock": "".join(on[0][name][2][-1:]).partition(": ")[2].partition(": ")[2],
            "calls": calls[0].count("\n"),
            "same_calls": calls[0] == calls[1],
            "rows": [len(one) for one in without + with_it],
            "strange": [min(strange(one, other) for other in without) for one in with_it] if without else [],
            "control": [strange(one, without[0]) for one in without[1:]],
            "lost": OFF + ON - len(without) - len(with_it),
            "errors": sum((one[name][0] for one in off + on), []),
            "volume": [float(one[name][3][2]) for one in on],
            "certain": [one[name][3][1] for one in on],
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--machine", choices=[*MACHINES, SHIPPED], default="metric")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--keep", help="folder for programs and logs")
    options = parser.parse_args()
    wanted = options.only or ([] if options.table else SHORT)
    texts = {name: text for name, text in cam_programs.programs(options.seed).items() if not wanted or name in wanted}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(options.keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(0o755)
        for f in measure(folder, texts, options.machine):
            if options.table:
                print(
                    f"{f['program']:26s} {options.machine:8s} calls {f['calls']:5d} "
                    f"{'same' if f['same_calls'] else 'DIFFER':6s} rows {f['rows']} "
                    f"differ {f['strange']} control {f['control']} lost {f['lost']} errors {len(f['errors'])} removed "
                    f"{f['volume']} certain {f['certain']} | {f['stock']}",
                    flush=True,
                )
                for error in f["errors"]:
                    print("    " + error, flush=True)
                continue
            name = f"{f['program']}, {options.machine}"
            for made in (
                row(
                    f"{name}: servo rows with SHADOW that none without it has",
                    max(f["strange"], default=-1),
                    "",
                    target=0,
                    note=f"of {f['rows'][-1:]}",
                ),
                row(
                    f"{name}: canonical calls that differ",
                    int(not f["same_calls"]),
                    "",
                    target=0,
                    note=f"of {f['calls']}",
                ),
            ):
                print(json.dumps(made), flush=True)


if __name__ == "__main__":
    main()
