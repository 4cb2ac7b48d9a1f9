# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/repeat_tests: a run that fails is counted, and its output kept."""

import pytest

from support.scripts import load_script

repeat_tests = load_script("repeat_tests")


@pytest.mark.parametrize(
    "recipe, status, summary",
    [
        ("@echo 'bringing up'; echo '3 passed, 1 skipped in 2.00s'", 0, "3 passed, 1 skipped in 2.00s"),
        ("@echo '1 failed, 2 passed in 2.00s'; exit 1", 2, "1 failed, 2 passed in 2.00s"),
        ("@exit 3", 2, "no summary"),
    ],
)
def test_a_run(recipe, status, summary, tmp_path):
    (tmp_path / "Makefile").write_text(f"test:\n\t{recipe}\n")
    got = repeat_tests.run(tmp_path, "test", tmp_path / "log")
    assert got[0] == status and got[3] == summary and got[1] < 1
    assert summary == "no summary" or summary in (tmp_path / "log").read_text()
