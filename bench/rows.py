# SPDX-License-Identifier: GPL-2.0-or-later
"""A row of the benchmarks' table, as bench/run.py reads it.  Called by the bench_*.py."""


def row(name, value, unit="", note="", target=None):
    """A row; with a target its verdict goes before the note."""
    made = {"name": name, "value": value, "unit": unit, "note": note}
    if target is not None:
        verdict = f"{'meets' if value <= target else 'MISSES'} {target:g}"
        made.update(target=target, note=f"{verdict}; {note}" if note else verdict)
    return made
