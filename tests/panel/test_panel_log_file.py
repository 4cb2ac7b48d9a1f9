# SPDX-License-Identifier: GPL-2.0-or-later
"""log_file.py: a spreadsheet shows texts of programs and computes none of them; a job file nested deeply is refused in
a line."""

import pytest

from chipwise.options.surface_job import read_job
from chipwise.errors import CycleError
from chipwise.panel.log_file import append, safe


@pytest.mark.parametrize(
    "value, shown",
    [
        ("=cmd|x", "'=cmd|x"),
        ("a;=cmd", "a;'=cmd"),
        ("a; +cmd", "a; '+cmd"),
        ("a\t@cmd", "a\t'@cmd"),
        (";;=c", ";;'=c"),
        ("a-b", "a-b"),
        ("x;y", "x;y"),
        (-3, -3),
    ],
)
def test_a_text_is_shown(value, shown, tmp_path):
    """With semicolons between cells, as German spreadsheets have it, too."""
    assert safe(value) == shown
    append(str(tmp_path / "log.csv"), ["program"], [{"program": value}])
    cells = (tmp_path / "log.csv").read_text().splitlines()[1].replace("\t", ";").split(";")
    assert isinstance(value, int) or not any(cell.strip()[:1] in ("=", "+", "@") for cell in cells)


@pytest.mark.parametrize("text", ["a = " + "[" * 2000 + "]" * 2000, "a = " + "9" * 5000, 'a = "\udcff"'])
def test_a_hostile_job_file(text, tmp_path):
    path = tmp_path / "job.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(CycleError) as caught:
        read_job(str(path), {})
    assert str(caught.value).startswith("chipwise: job.toml: ")
