# SPDX-License-Identifier: GPL-2.0-or-later
"""Run every benchmark, print one table, write build/bench.json.

Called by `make bench`.  A benchmark is bench/NAME.c (built as
build/bench/NAME) or bench/bench_NAME.py.  It prints one JSON object per line:

    {"name": "section area, slot", "value": 1.43, "unit": "us", "note": "0.25 mm cells"}

`note` may be left out; every other line it prints is passed on.  Arguments
choose benchmarks by name; the exit status is 1 when one fails.
"""

import glob
import json
import os
import platform
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RESULT = os.path.join(ROOT, "build", "bench.json")
PYTHON = "/usr/bin/python3"


def benchmarks(chosen):
    """-> [(name, command)], C programs first."""
    found = [
        (os.path.basename(path)[:-2], [os.path.join(ROOT, "build", "bench", os.path.basename(path)[:-2])])
        for path in sorted(glob.glob(os.path.join(ROOT, "bench", "*.c")))
    ]
    found += [
        (os.path.basename(path)[len("bench_") : -3], [PYTHON, path])
        for path in sorted(glob.glob(os.path.join(ROOT, "bench", "bench_*.py")))
    ]
    return [(name, command) for name, command in found if not chosen or name in chosen]


def run(name, command):
    """-> (rows, whether it ended well)."""
    process = subprocess.Popen(command, cwd=ROOT, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
    rows = []
    for line in process.stdout:
        try:
            row = json.loads(line)
            rows.append(dict(row, benchmark=name, value=float(row["value"])))
        except (ValueError, TypeError, KeyError):
            print(line, end="", flush=True)
    return rows, process.wait() == 0


def print_table(rows):
    width = max([len(row["name"]) for row in rows] + [10])
    group = None
    for row in rows:
        if row["benchmark"] != group:
            group = row["benchmark"]
            print("\n%s" % group)
        print(
            (
                "  %-*s  %12.5g %-10s %s" % (width, row["name"], row["value"], row.get("unit", ""), row.get("note", ""))
            ).rstrip()
        )


def main(chosen):
    rows, failed = [], []
    for name, command in benchmarks(chosen):
        found, well = run(name, command)
        rows += found
        if not well:
            failed.append(name)
    os.makedirs(os.path.dirname(RESULT), exist_ok=True)
    with open(RESULT, "w") as handle:
        json.dump(
            {"machine": platform.processor() or platform.machine(), "processors": os.cpu_count(), "results": rows},
            handle,
            indent=1,
        )
    print_table(rows)
    for name in failed:
        print("bench: %s failed" % name, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
