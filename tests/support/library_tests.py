# SPDX-License-Identifier: GPL-2.0-or-later
"""The tests that call the library with the C core from Python, in groups of some ten seconds.

Who calls it: tests/core/test_sanitized.py (each of GROUPS under ASan and UBSan), tools/coverage (all of them, counted).
"""

GROUPS = {
    "stock": [
        "tests/core/test_stock.py",
        "tests/core/test_rim.py",
        "tests/core/test_shapes.py",
        "tests/core/test_walls.py",
        "tests/core/test_strokes.py",
        "tests/stock/test_shared.py",
        "tests/stock/test_library_borders.py",
    ],
    "load": [
        "tests/core/test_lookahead.py",
        "tests/core/test_section.py",
        "tests/core/test_path.py",
        "tests/core/test_blends.py",
        "tests/core/test_run_sums.py",
        "tests/core/test_path_done.py",
    ],
    "profiles": ["tests/core/test_profiles.py"],
    "feed": [
        "tests/core/test_feed.py",
        "tests/core/test_feed_braking.py",
        "tests/core/test_feed_easing.py",
        "tests/core/test_load_lost.py",
        "tests/core/test_watchdog.py",
    ],
    "tracer": [
        "tests/core/test_tracer.py",
        "tests/core/test_tracer_sensor.py",
        "tests/core/test_stylus.py",
        "tests/core/test_axis_offset.py",
        "tests/core/test_master_slave.py",
    ],
    "surfaces": ["tests/surface/test_arcs.py", "tests/surface/test_drop_cutter.py", "tests/surface/test_needed.py"],
    "pockets": ["tests/geometry/test_pocket_engage.py"],
    "nearest": ["tests/geometry/test_pocket_size.py"],
    "programs": [
        "tests/check/test_check_sweep.py",
        "tests/rewrite/test_rewrite_depths.py",
        "tests/rewrite/test_rewrite_sought.py",
    ],
}

# Minutes each under the sanitizers, with many cases of what the others have a few of.
LEFT_OUT = [
    "tests/core/test_stock.py::test_a_small_stock_has_small_cells",
    "tests/core/test_stock.py::test_random_judge_sees_a_wrong_tool",
    "tests/core/test_stock.py::test_random_moves",
    "tests/core/test_stock.py::test_reference_meets_the_closed_forms",
    "tests/core/test_strokes.py::test_strokes",
    "tests/core/test_lookahead.py::test_behind_a_corner_at_the_rim",
    "tests/core/test_section.py::test_section",
    "tests/core/test_section.py::test_slot_against_the_reference",
    "tests/core/test_profiles.py::test_a_bend_ends_the_line",
    "tests/core/test_profiles.py::test_area",
    "tests/core/test_profiles.py::test_through_the_look_ahead",
    "tests/core/test_profiles.py::test_volume_on_a_ramp",
    "tests/core/test_feed.py::test_hostile_input",
    "tests/core/test_watchdog.py::test_a_machine_that_follows_is_never_stopped",
    "tests/core/test_tracer.py::test_limited_by",
    "tests/surface/test_arcs.py::test_arcs_gouge_nothing_and_leave_no_more_than_the_tolerance",
    "tests/surface/test_arcs.py::test_levels_and_rest_keep_arcs_and_gouge_nothing",
    "tests/surface/test_arcs.py::test_linuxcnc_reads_the_arcs_as_they_are_meant",
    "tests/surface/test_drop_cutter.py::test_against_opencamlib",
    "tests/surface/test_drop_cutter.py::test_points_against_brute_force",
    "tests/check/test_check_sweep.py::test_random_programs_against_fine_needles",
    "tests/check/test_check_sweep.py::test_random_steep_moves_to_a_wall_against_fine_needles",
    "tests/check/test_check_sweep.py::test_the_oracle_sees_steep_moves_and_moves_of_micrometres",
    "tests/check/test_check_sweep.py::test_the_verdict_sees_wrong_depths",
    "tests/rewrite/test_rewrite_depths.py::test_never_less_than_the_needles_and_never_more_than_there_is",
]

# Counted only: each of them starts interpreters and whole programs.
COUNTED = [
    "tests/check/test_check_clearance.py",
    "tests/check/test_planned_times.py",
    "tests/cycles/test_surface_links.py",
    "tests/surface/test_model_files.py",
    "tests/surface/test_route.py",
    "tests/rewrite/test_rewrite_traverses.py",
]


def sanitized_arguments(group):
    """What pytest runs of a group under the sanitizers."""
    return [*GROUPS[group], *(f"--deselect={test}" for test in LEFT_OUT if test.partition("::")[0] in GROUPS[group])]
