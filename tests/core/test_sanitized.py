# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole C core under ASan and UBSan: each C program of this folder, and the tests that call the library from Python."""
import pytest

from support import ROOT, sanitized

PROGRAMS = sorted(path.stem for path in (ROOT / "tests/core").glob("*.c"))

# Tests of the library, in groups of some ten seconds; of a long file those that `make test` has too.
GROUPS = {
    "stock": ["tests/core/test_stock.py", "tests/core/test_rim.py", "tests/core/test_shapes.py", "tests/core/test_walls.py",
              "tests/stock/test_shared.py"],
    "load": ["tests/core/test_lookahead.py", "tests/core/test_section.py", "tests/core/test_path.py", "tests/core/test_blends.py",
             "tests/core/test_run_sums.py"],
    "feed": ["tests/core/test_feed.py", "tests/core/test_feed_braking.py", "tests/core/test_feed_easing.py",
             "tests/core/test_load_lost.py", "tests/core/test_watchdog.py"],
    "tracer": ["tests/core/test_tracer.py", "tests/core/test_tracer_sensor.py", "tests/core/test_stylus.py",
               "tests/core/test_axis_offset.py", "tests/core/test_master_slave.py"],
    "surfaces": ["tests/surface/test_arcs.py", "tests/surface/test_drop_cutter.py", "tests/surface/test_needed.py"],
    "programs": ["tests/check/test_check_sweep.py", "tests/rewrite/test_rewrite_depths.py", "tests/rewrite/test_rewrite_sought.py"],
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_program(name):
    status, text = sanitized.run([sanitized.folder() / "tests" / name])
    assert status == 0, text


@pytest.mark.parametrize("group", GROUPS)
def test_library(group):
    status, text = sanitized.run_tests(sanitized.folder() / "libchipwise.so", "-m", "not long", *GROUPS[group])
    assert status == 0, text[-8000:]
