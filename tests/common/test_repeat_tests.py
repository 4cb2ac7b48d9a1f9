# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/repeat_tests: a run that fails is counted, and its output kept."""

import importlib.util
from importlib.machinery import SourceFileLoader

import pytest

from support import ROOT

LOADER = SourceFileLoader("repeat_tests", str(ROOT / "tools/repeat_tests"))
SPEC = importlib.util.spec_from_loader("repeat_tests", LOADER)
repeat_tests = importlib.util.module_from_spec(SPEC)
LOADER.exec_module(repeat_tests)


@pytest.mark.parametrize("recipe, status, summary", [
    ("@echo 'bringing up'; echo '3 passed, 1 skipped in 2.00s'", 0, "3 passed, 1 skipped in 2.00s"),
    ("@echo '1 failed, 2 passed in 2.00s'; exit 1", 2, "1 failed, 2 passed in 2.00s"),
    ("@exit 3", 2, "no summary"),
])
def test_a_run(recipe, status, summary, tmp_path):
    (tmp_path / "Makefile").write_text(f"test:\n\t{recipe}\n")
    got = repeat_tests.run(tmp_path, "test", tmp_path / "log")
    assert got[0] == status and got[3] == summary and got[1] < 1
    assert summary == "no summary" or summary in (tmp_path / "log").read_text()
