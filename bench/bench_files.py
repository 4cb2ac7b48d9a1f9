# SPDX-License-Identifier: GPL-2.0-or-later
"""What saving and restoring the stock costs.

Called by bench/run.py (prints JSON rows).  A map of 7.7 and of 64 MB, cut all over: the file work of M253 and M254 in
this process (stock/store.py and stock/shared.py, on a map in memory), each step the median of REPEATS; and the two
codes in a running LinuxCNC.
"""

import json
import os
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.headless import runner
from chipwise.clib import core
from chipwise.stock import store
from chipwise.stock.shared import SharedStock

REPEATS = 5
MAPS = {
    "7.7 MB": ((0.0, 0.0, -10.0), (300.0, 200.0, 0.0), 0.25),
    "64 MB": ((0.0, 0.0, -10.0), (320.0, 250.0, 0.0), 0.1),
}
HEAD = "G21 G90 G64 P0.01\nT1 M6\n"
LARGE = {"CELL": "0.1", "MAP_SIZE": "320 250"}
BOX = "M250 P0 Q0 R-10 I320 J250 K10\nG4 P0.2\n"


def row(name, value, unit, note=""):
    print(json.dumps({"name": name, "value": round(value, 4), "unit": unit, "note": note}), flush=True)


def median_s(work):
    """Median time of REPEATS runs, s; the last result."""
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), result


def raster(stock, high):
    """Pockets all over the map with a ball: most cells differ from their neighbours, as after a real job."""
    tool = core.Tool(12.0, 6.0)
    for i, y in enumerate(np.arange(10.0, high[1] - 10, 9.0)):
        core.Cutter(stock, tool, (10.0, y, -1.0 - i % 5)).to((high[0] - 10, y + 3.0, -2.0 - i % 4))


def file_rows():
    for name, (low, high, cell) in MAPS.items():
        stock = core.Stock(low, high, cell)
        raster(stock, high)
        shared = SharedStock(memoryview(stock._block))
        with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as folder:
            path = os.path.join(folder, "slot0.stock")
            take, taken = median_s(shared.take)
            write, _ = median_s(lambda: store.write(path, *taken))
            read, found = median_s(lambda: store.read(path, stock.head.capacity))
            put, _ = median_s(lambda: shared.put(*found))
            row(
                f"save a map of {name}",
                1000 * (take + write),
                "ms",
                f"{1000 * take:.1f} ms of it to copy the map; file of {os.path.getsize(path) / 1e6:.1f} MB",
            )
            row(
                f"restore a map of {name}",
                1000 * (read + put),
                "ms",
                f"the tracker is held for {1000 * put:.1f} ms of it",
            )


def cycle_s(text):
    """s a program takes on the simulated mill with the large map."""
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as folder:
        os.chmod(folder, 0o777)
        program = Path(folder) / "files.ngc"
        program.write_text(HEAD + BOX + text + "M2\n")
        summary = runner.run_headless(str(program), runner.Machine(settings={**LARGE, "STOCK_DIR": folder}))
        if not summary["finished"] or summary["errors"]:
            raise SystemExit(f"{text!r}: {summary['errors']}")
        return summary["cycle_s"]


def code_rows():
    without, saved, restored = (
        statistics.median(cycle_s(text) for _ in range(3)) for text in ("", "M253 P1\n", "M253 P1\nM254 P1\n")
    )
    row("M253 in LinuxCNC, 64 MB, a fresh stock", 1000 * (saved - without), "ms", "motion waits")
    row("M254 in LinuxCNC, 64 MB, a fresh stock", 1000 * (restored - saved), "ms", "motion waits")


def main():
    file_rows()
    code_rows()


if __name__ == "__main__":
    main()
