# SPDX-License-Identifier: GPL-2.0-or-later
"""A row of the benchmarks' table, as bench/run.py reads it, and the command line of those that run programs one by one.
Called by the bench_*.py."""

import argparse
import json
import tempfile
from pathlib import Path


def row(name, value, unit="", note="", target=None):
    """A row; with a target its verdict goes before the note."""
    made = {"name": name, "value": value, "unit": unit, "note": note}
    if target is not None:
        verdict = f"{'meets' if value <= target else 'MISSES'} {target:g}"
        made.update(target=target, note=f"{verdict}; {note}" if note else verdict)
    return made


def by_program(bench, programs):
    """The command line of a benchmark of programs.  bench: its module, with HEAD, SHORT (what bench/run.py runs),
    measured(program, folder, step), line_of() and rows_of() of what that gives, which has "errors"; programs: seed ->
    {name: Program}."""
    parser = argparse.ArgumentParser(description=bench.__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="programs")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--step", type=float, help="mm between judged places")
    parser.add_argument("--keep", help="folder for programs and logs")
    options = parser.parse_args()
    chosen = options.only or ([] if options.table else bench.SHORT)
    if options.table:
        print(bench.HEAD, flush=True)
    for name, program in programs(options.seed).items():
        if chosen and name not in chosen:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(options.keep or scratch) / name
            folder.mkdir(parents=True, exist_ok=True)
            found = bench.measured(program, folder, options.step)
        if options.table:
            print(bench.line_of(found), *found["errors"], sep="\n    ", flush=True)
            continue
        for made in bench.rows_of(found):
            print(json.dumps(made), flush=True)
