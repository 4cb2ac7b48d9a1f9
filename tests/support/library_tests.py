# SPDX-License-Identifier: GPL-2.0-or-later
"""The tests that call the library with the C core from Python, in groups of some ten seconds.

Who calls it: tests/core/test_sanitized.py (each of GROUPS under ASan and UBSan), tools/coverage (all of them, counted).
"""
GROUPS = {
    "stock": ["tests/core/test_stock.py", "tests/core/test_rim.py", "tests/core/test_shapes.py", "tests/core/test_walls.py",
              "tests/core/test_strokes.py", "tests/stock/test_shared.py", "tests/stock/test_library_borders.py"],
    "load": ["tests/core/test_lookahead.py", "tests/core/test_section.py", "tests/core/test_path.py", "tests/core/test_blends.py",
             "tests/core/test_run_sums.py", "tests/core/test_path_done.py"],
    "profiles": ["tests/core/test_profiles.py"],
    "feed": ["tests/core/test_feed.py", "tests/core/test_feed_braking.py", "tests/core/test_feed_easing.py",
             "tests/core/test_load_lost.py", "tests/core/test_watchdog.py"],
    "tracer": ["tests/core/test_tracer.py", "tests/core/test_tracer_sensor.py", "tests/core/test_stylus.py",
               "tests/core/test_axis_offset.py", "tests/core/test_master_slave.py"],
    "surfaces": ["tests/surface/test_arcs.py", "tests/surface/test_drop_cutter.py", "tests/surface/test_needed.py"],
    "pockets": ["tests/geometry/test_pocket_engage.py"],
    "programs": ["tests/check/test_check_sweep.py", "tests/rewrite/test_rewrite_depths.py", "tests/rewrite/test_rewrite_sought.py"],
}

# Counted only: each of them starts interpreters and whole programs.
COUNTED = ["tests/check/test_check_clearance.py", "tests/check/test_planned_times.py", "tests/cycles/test_surface_links.py",
           "tests/surface/test_model_files.py", "tests/surface/test_route.py", "tests/rewrite/test_rewrite_traverses.py"]
