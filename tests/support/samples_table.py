# SPDX-License-Identifier: GPL-2.0-or-later
"""The table of docs/user/machines.md: the rows are samples.SAMPLES, the columns of the Debians what tools/samples has
found there.  Called by tools/samples and test_samples.py."""

import os
import re

from support import ROOT, samples

TABLE = os.path.join(ROOT, "docs", "user", "machines.md")
RELEASES = {
    "bookworm": "Debian 12",
    "trixie": "Debian 13",
}  # the columns in which tools/samples --shipped --write notes what it has found
AS_IT_SAYS, NOT_THERE, NOT_TRIED = "yes", "no such sample", ""


def table_cells():
    """-> {name of a sample: {column: what the table has there}}."""
    with open(TABLE) as handle:
        rows = [[cell.strip() for cell in line.strip("|\n").split(" | ")] for line in handle if line.startswith("| ")]
    table = [row for row in rows if len(row) == 5 + len(RELEASES)][1:]
    return {row[0]: dict(zip(RELEASES.values(), row[5:])) for row in table}


def table_lines(cells):
    """The rows of docs/user/machines.md; cells as table_cells()."""
    lines = [
        "| machine | INI file, below `sample-configs` | screen | with README's lines | its HAL files connect | "
        + " | ".join(RELEASES.values())
        + " |",
        "|---|---|---|---|---|" + "---|" * len(RELEASES),
    ]
    for sample in samples.SAMPLES:
        outcome = f'refused: "{sample.refused} .."' if sample.refused else "runs"
        if sample.postgui:
            outcome = f"runs with `{samples.POSTGUI}` in place of `HALFILE = chipwise.hal`"
        if sample.recipe:
            outcome = "runs with the two lines of [Install](install.md#a-machine-with-codes-of-its-own)"
        if sample.lathe:
            outcome = "runs with the lines of [Install](install.md#on-a-lathe)"
        if sample.display:
            outcome = f"runs with `DISPLAY = {sample.display}`"
        joined = ", ".join(f"`{pin}`" for pin in sample.joined)
        tried = " | ".join(cells.get(sample.name, {}).get(column, NOT_TRIED) for column in RELEASES.values())
        lines.append(f"| {sample.name} | `{sample.path}` | {sample.screen} | {outcome} | {joined or ' '} | {tried} |")
    return lines


def write_table(found):
    """found: {name: cell} of this machine's release; other cells stay."""
    release = re.search(r"^VERSION_CODENAME=(\w+)", open("/etc/os-release").read(), re.MULTILINE)[1]
    cells = table_cells()
    for name, cell in found.items():
        cells.setdefault(name, {})[RELEASES[release]] = cell
    with open(TABLE) as handle:
        head, _old = handle.read().split("\n| machine |", 1)
    with open(TABLE, "w") as handle:
        handle.write(head + "\n" + "\n".join(table_lines(cells)) + "\n")
