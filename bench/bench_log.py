# SPDX-License-Identifier: GPL-2.0-or-later
"""What the load log and the tool editor of `chipwise panel` cost: computing time of a look, of the answer to a page, of
a program's lines, of a change.

Computing times of this process, so other load on the computer does not count; a look is one of ten a second.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

from roots import ROOT
from rows import row

from chipwise.tool_data import editor
from chipwise.panel import load_log, log_file, operations
from support.panel_rig import Machine

assert ROOT
LOOKS = 3000
LOOKS_A_SECOND = 10


def show(*values, **more):
    print(json.dumps(row(*values, **more)), flush=True)


def spent(work):
    """Computing time of a function, s."""
    began = time.process_time()
    work()
    return time.process_time() - began


def log_of(folder):
    """A program whose operations last 4 looks: (a log, a function that makes one look)."""
    log = load_log.LoadLog(os.path.join(folder, "load.csv"))
    log.begin("/nowhere/part.ngc", time.time())
    pins, count = {**Machine().values, "motion_type": 2.0, "mode": 1.0, "target": 6000.0, "mrr": 5900.0}, [0]

    def look():
        count[0] += 1
        pins.update(removed=10.0 * count[0], tool=float(1 + count[0] // 4 % 2))
        log.look(0.1, pins, time.time())
        log.write()

    return log, look


def main():
    with tempfile.TemporaryDirectory() as folder:
        log, look = log_of(folder)
        share = spent(lambda: [look() for _ in range(LOOKS)]) / LOOKS * LOOKS_A_SECOND
        show(
            "log, ten looks a second",
            100 * share,
            "%",
            "of a core; an operation ends every 0.4 s and is written",
            target=1,
        )
        show(
            "log, a page that shows it",
            100 * spent(lambda: [json.dumps(log.shown()) for _ in range(100)]) / 100,
            "%",
            f"of a core; {operations.SHOWN} operations once a second",
            target=1,
        )
        size = os.path.getsize(log_file.operations_path(log.path)) / (LOOKS // 4)
        show(
            "log, bytes of an operation",
            size,
            "bytes",
            f"so {log_file.MOST_BYTES / size:.0f} operations until a new file begins",
        )
        program = Path(folder, "long.ngc")
        program.write_text(
            "".join(f"N{k} G1 X{k * 0.01:.3f} Y{k * 0.02:.3f} (cut)\n" for k in range(31000))[: operations.MOST_PROGRAM]
        )
        show(
            "log, cycles of the longest program",
            1000 * spent(lambda: operations.cycle_lines(str(program))),
            "ms",
            "1 MB, once when it begins",
            target=200,
        )
        tools = Path(folder, "tools.toml")
        tools.write_text(
            "# tools\n"
            + "".join(
                f'\n[tool.{k}]\nshape = "flat"   # tool {k}\nflute_length = {k}\nflutes = 2\n' for k in range(1, 4000)
            )[:250_000].rpartition("\n[")[0]
        )
        seen = editor.checksum(tools.read_bytes())
        show(
            "tool editor, a change in a file of 250 kB",
            spent(lambda: editor.change(str(tools), seen, 7, {"flutes": 3})),
            "s",
            "some 3,700 tools; in a process of its own",
        )


if __name__ == "__main__":
    sys.exit(main())
