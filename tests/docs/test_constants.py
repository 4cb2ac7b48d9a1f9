# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/design/constants.md against the source: the constants that bench/bench_constants.py varies, with the values they
have."""

import re

from support import ROOT

PAGE = (ROOT / "docs/design/constants.md").read_text()
ROWS = re.findall(r"^\| `(CHIP_\w+)` \((\w+\.[ch])\) \| (\S+) \|", PAGE, re.M)


def wrong_rows(rows):
    """Rows whose file defines no such constant with that value."""
    return [
        row
        for row in rows
        if not re.search(
            rf"^#define {row[0]}\s+{re.escape(row[2])}(\s|$)", (ROOT / "components/core" / row[1]).read_text(), re.M
        )
    ]


def test_every_row_is_the_source():
    assert wrong_rows(ROWS) == []
    name, file, value = ROWS[0]
    assert wrong_rows([(name, file, value + "1")]) and wrong_rows([(name + "X", file, value)])


def test_every_constant_that_is_varied_has_a_row():
    varied = re.findall(r'^    "(CHIP_\w+)": \(', (ROOT / "bench/bench_constants.py").read_text(), re.M)
    assert len(varied) > 30 and sorted(name for name, _file, _value in ROWS) == sorted(varied)
