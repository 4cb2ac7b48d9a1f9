# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines behind M2, which LinuxCNC does not read: as long as they are, `rewrite` copies them.

Reading took time with the square of the length: minutes for these."""

import pytest
from support import ROOT, forked

LONG = 200_000
PROGRAM = "G21 G90\nM250 P0 Q0 R-10 I50 J50 K10\nT1 M6\nG43\nG0 Z5 X-10 Y10\nF500 M3 S1000\nG1 Z-1\nG1 X60\nG0 Z5\nM2\n"


@pytest.mark.parametrize(
    "line",
    [
        "9" * LONG,
        "G1 X" + "9" * LONG + "!",
        "X" + " " * LONG + "!",
        " " * LONG + "1",
        "#<" * (LONG // 2) + "=1",
        "N" + "1" * LONG + "o",
        "o" + "<" * LONG,
        "(" * LONG,
        "X 1" * (LONG // 3) + "!",
    ],
    ids=lambda line: line[:4].strip() or "blanks",
)
def test_a_long_line_behind_the_end(tmp_path, line):
    (tmp_path / "part.ngc").write_text(PROGRAM + line + "\n")
    for kind in (["--flute"], ["--feed", "5"]):
        done = forked.run(
            [
                forked.CHIPWISE,
                "rewrite",
                tmp_path / "part.ngc",
                "-o",
                tmp_path / "out.ngc",
                *kind,
                "--ini",
                ROOT / "configs" / "mill.ini",
            ],
            timeout=300,
        )
        assert done.returncode == 0 and line in (tmp_path / "out.ngc").read_text(), done.stderr[:500]
