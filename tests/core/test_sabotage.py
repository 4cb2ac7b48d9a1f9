# SPDX-License-Identifier: GPL-2.0-or-later
"""Every checker is seen to fail: the core is built with one fault at a time, and the test that
guards against it must turn red.  Also the C tests with the flags of the realtime build."""

import os
import re
import subprocess
import sys

import pytest

from support import ROOT, unchanged

CORE = ROOT / "components" / "core"
C_TESTS = [ROOT / "tests" / "core" / name for name in ("test_core.c", "test_core_load.c")]
OUTCOME_TIMEOUT_S = 600  # a loaded machine

# Fault of components/core and components/offline (fault.h): what it is, test that must fail; in tests/core without a
# folder.
FAULTS = {
    "OUTLINE_WIDE": ("outline a fifth of a cell too wide", "test_stock.py::test_known_volume[slot 17 deg-0.25]"),
    "PLUNGE_OUTLINE_MISSED": ("plunge misses its outline", "test_stock.py::test_known_volume[plunge flat-0.25]"),
    "ROUND_END_AGAIN": (
        "round tool cuts a bit more each time",
        "test_stock.py::test_known_volume_in_servo_steps[ball groove 31 deg-0.25]",
    ),
    "SHARES_ADDED": ("shares are added", "test_stock.py::test_layers_share_a_wall"),
    "CUT_VOLUME_FORGOTTEN": (
        "volume of a partly cut cell forgotten",
        "test_stock.py::test_known_volume[slot 17 deg-0.25]",
    ),
    "RIM_WHOLE": ("rim cells treated as whole ones", "test_rim.py::test_faced_and_cut_deeper"),
    "BOX_AS_HULL": ("a turned box is its hull", "test_rim.py::test_turned_box"),
    "READ_IN_CUT": ("front read where the tool has cut", "test_section.py::test_section[slot flat 17 deg]"),
    "BANDS_WIDE": ("bands too wide", "test_section.py::test_section[plunge ball]"),
    "SAMPLES_LATE": ("samples a point too far", "test_lookahead.py::test_a_wall_is_seen_in_time"),
    "CELLS_COUNTED": (
        "cells counted, in the look-ahead",
        "test_section.py::test_through_the_look_ahead[slot flat 17 deg]",
    ),
    "EDGE_SMEARED": ("walls at the tool's edge smeared", "test_profiles.py::test_area[flat D6, depth 3]"),
    "CONE_AS_CYLINDERS": ("a cone treated as cylinders", "test_profiles.py::test_area[taper D8, 40 % beside]"),
    "ONE_SEGMENT_ONLY": (
        "points of a cell cut by one segment only",
        "test_profiles.py::test_volume_in_servo_steps[vee 60]",
    ),
    "RAMPS_BY_ONE_SEGMENT": (
        "points of a cell on a ramp cut by one segment only",
        "test_profiles.py::test_volume_on_a_ramp[vee 60]",
    ),
    "BACK_LEFT": ("all behind a falling tool left", "test_profiles.py::test_volume_on_a_ramp[bull D10]"),
    "LOWEST_TOO_SOON": ("the lowest place on a ramp guessed", "test_lowest.c"),
    "CELLS_WHOLE": ("cells cut wholly or not at all", "test_section.py::test_section[side flat 10 % 0 deg]"),
    "PLUNGE_AS_WIDE": ("the ring of a plunging tool looked at", "test_plunge.c"),
    "PATH_NOT_PROBED": ("traverses behind an arc not probed", "test_guard_path.c"),
    "BLEND_AS_LINE": ("a parabolic blend followed as a line", "test_guard_path.c"),
    "INTERVALS_KEPT": (
        "the load between samples kept when they change",
        "test_lookahead.py::test_load_steps_rise_with_the_entry",
    ),
    "LOOKAHEAD_OFF": ("look-ahead off", "test_feed.py::test_ahead_is_braked_in_time"),
    "ARCS_STRAIGHT": ("arcs treated as straight", "test_lookahead.py::test_arc_and_helix_are_followed"),
    "TOO_FAST": ("five percent too fast", "test_feed.py::test_at_the_tool"),
    "BRAKES_LATE": ("brakes too late", "test_feed.py::test_ahead_is_braked_in_time"),
    "DESCENDS_UNBRAKED": ("no braking before the tool goes down", "test_descent.py::test_it_is_braked_in_time"),
    "PACE_IGNORED": (
        "no braking before the path comes down to the stock",
        "test_pace.py::test_no_place_is_passed_too_fast",
    ),
    "CEILING_NOT_BRAKED": ("highest velocity not braked to", "test_feed.py::test_fastest_while_cutting"),
    "CHIP_OF_SMALL_CUT": ("chip as at the small engagement", "test_feed.py::test_mean_chip"),
    "CHIP_WHERE_TOUCHED": (
        "the largest chip where stock is touched at all",
        "test_tooth.py::test_side_cut[0.05-10-0.25]",
    ),
    "NO_BRINKS": (
        "the side force every 5 degrees alone, not where the stock begins",
        "test_tooth_force.py::test_side_cut[0.1-10-0.25]",
    ),
    "BANDS_SPREAD": (
        "the stock beside a round end on a slope begins as gradually as the cells have it",
        "test_force_rows.py::test_rows[tool0-0.1-0.1]",
    ),
    "TOOTH_NOT_AHEAD": (
        "the chip of a sample where it is read, not two cells before",
        "test_tooth_loop.py::test_the_chip_is_known_before_contact",
    ),
    "OVERRIDE_RAISES_CHIP": ("the override raises the chip", "test_tooth.py::test_the_override_raises_no_chip"),
    "NO_RATE_IS_NONE": (
        "M251 without Q at the ceiling where no limit is known",
        "test_tooth.py::test_without_a_rate_and_a_limit_the_feed_is_f[limits0]",
    ),
    "UNREAD_IS_AIR": (
        "at the ceiling until the tooth load is read",
        "test_tooth.py::test_limits_alone_that_are_not_read_yet",
    ),
    "BAD_SAMPLE_TAKEN": ("samples taken that are not numbers", "test_spindle_load.c"),
    "STANDSTILL_COUNTED": ("the monitor blamed for a computer that was stopped", "test_seldom.c"),
    "TOOL_NOT_AWAITED": ("a traverse of an unknown tool goes on", "test_seldom.c"),
    "AWAITED_FOR_EVER": ("a traverse waits for a tool that never comes", "test_seldom.c"),
    "START_FORGOTTEN": ("a tool that is described late cuts where it appeared", "test_offset.c"),
    "BURIED_FORGOTTEN": ("a tip that its length has placed in the stock cuts where it is jogged to", "test_offset.c"),
    "BURIED_LOST": ("a tip that its length has placed in the stock cuts a stock that is restored", "test_offset.c"),
    "UNDESCRIBED_STAYS": ("a tool without a description stays where it appeared", "test_offset.c"),
    "RIM_BURIED": ("the wall of a tool's own slot counts as stock over its tip", "test_offset.c"),
    "LAG_NOT_ALLOWED": ("the sensor of the spindle's load late by nothing", "test_spindle_load.c"),
    "TRUSTED_ANYHOW": ("a load compared where nothing of it is known", "test_spindle_load.c"),
    "RUBS_UNKNOWN": ("a chip that is not known rubs", "test_run_sums.py::test_the_time_that_a_tool_rubs"),
    "RISES_AT_ONCE": ("rises at once", "test_feed_easing.py::test_drops_pass_at_once_and_rises_climb"),
    "FEED_NOT_HELD": ("F while the load is lost", "test_load_lost.py::test_held_in_the_stock"),
    "LOSS_NOT_SEEN": ("a lost load not seen", "test_load_lost.py::test_lost_and_found"),
    "CHANGE_NOT_SEEN": (
        "another tool that nobody followed",
        "test_load_lost.py::test_another_tool_or_stock_that_nobody_followed",
    ),
    "BRAKING_AS_IGNORED": (
        "braking treated as an ignored override",
        "test_watchdog.py::test_a_machine_that_follows_is_never_stopped",
    ),
    "BLEND_AS_IGNORED": (
        "a blend treated as an ignored override",
        "test_watchdog.py::test_a_parabolic_blend_is_no_ignored_override",
    ),
    "CEILING_EXPLAINS": ("an ignored override explained by the ceiling", "test_watchdog.py::test_it_is_seen_in_time"),
    "CHORD_AT_ITS_END": ("chord of friction judged at its end", "test_tracer.py::test_friction_on_a_ball"),
    "FRICTION_AS_NORMAL": ("friction left in the normal", "test_tracer.py::test_slope_at_a_low_gain"),
    "HEADING_LATE": ("heading not turned ahead", "test_tracer.py::test_heading_with_dead_time"),
    "BEND_FORGOTTEN": ("deflection that turns in a bend forgotten", "test_tracer.py::test_bend_at_a_low_gain"),
    "STICKING_FORGOTTEN": (
        "a stylus that sticks treated as one that slides",
        "test_tracer.py::test_ball[3-20-3-0.003-False]",
    ),
    "RISES_WITHOUT_RATE": (
        "a line that begins faster than its bend is known",
        "test_tracer.py::test_ball[3-20-3-0.003-False]",
    ),
    "GAIN_UNLIMITED": ("any gain", "test_tracer.py::test_a_loop_at_the_limit_of_its_gain_is_stable"),
    "RANGE_UNLIMITED": ("any velocity", "test_tracer.py::test_inside_corner[90-0-300-5.0-0-1.0]"),
    "VELOCITY_UNLIMITED": ("velocity above its limit", "test_tracer.py::test_no_velocity_above_its_limit"),
    "FEED_FIRST": ("acceleration for the feed first", "test_tracer.py::test_inside_corner[90-0-300-5.0-0-1.0]"),
    "NAN_AS_NUMBER": ("NaN passed on", "test_tracer.py::test_not_finite[position-nan]"),
    "JUMP_FOLLOWED": ("a jump of the sensor followed", "test_tracer.py::test_sensor_jump"),
    "OVER_RANGE_IGNORED": ("over-range ignored", "test_tracer.py::test_over_range"),
    "SOFT_LIMITS_OFF": ("soft limits passed", "test_tracer.py::test_soft_limit"),
    "WINDOW_PASSED": ("lines end 1 mm early", "test_tracer.py::test_partial"),
    "POSITION_NOT_LATE": ("position not as old as the deflection", "test_tracer.py::test_friction_with_dead_time"),
    "DRIVE_AS_SENSOR": (
        "time of the drive treated as the sensor's",
        "test_tracer.py::test_the_ball_behind_a_slow_drive",
    ),
    "LAG_LEFT": (
        "lag of LinuxCNC's external offsets left",
        "test_axis_offset.py::test_the_request_is_ahead_by_the_lag_of_the_planner",
    ),
    "ASTRAY_IGNORED": (
        "another planner ignored",
        "test_axis_offset.py::test_a_planner_that_does_not_follow_is_a_fault[slower planner]",
    ),
    "STARTS_BY_LEVEL": ("a trace begins again by itself", "test_axis_offset.py::test_a_stop_brakes_and_holds[permit]"),
    "OFFSET_NAN_AS_NUMBER": (
        "NaN passed on to the offset",
        "test_axis_offset.py::test_settings_and_inputs_that_cannot_be",
    ),
    "LOST_IGNORED": ("lost contact ignored", "test_tracer.py::test_nothing_below_the_edge"),
    "FALL_FOLLOWED": ("a broken cable followed", "test_tracer_sensor.py::test_a_broken_cable[0.0]"),
    "NOISE_NOT_MISSED": ("noise that ends not missed", "test_tracer_sensor.py::test_one_axis_stands_still"),
    "FROZEN_FOLLOWED": ("a frozen reading followed", "test_tracer_sensor.py::test_a_frozen_sensor[0.0]"),
    "CONTRADICTION_FOLLOWED": (
        "a reading that contradicts the head followed",
        "test_tracer_sensor.py::test_a_weak_sensor",
    ),
    "SWING_UNHEARD": ("a swing without an answer", "test_tracer_sensor.py::test_air_is_not_traced"),
    "OLD_PACKETS_USED": (
        "a packet older than the last used",
        "test_master_slave.py::test_doubled_and_old_packets_change_nothing",
    ),
    "DOUBLED_PACKETS_USED": (
        "a dead master not seen for doubled packets",
        "test_master_slave.py::test_a_dead_master_stops_it",
    ),
    "GAPS_IGNORED": ("a lost packet forgotten", "test_master_slave.py::test_a_lost_packet_costs_time"),
    "CORRUPT_USED": ("a wrong packet used", "test_master_slave.py::test_a_wrong_packet_is_a_fault"),
    "CATCHES_UP_AT_ONCE": ("what is missing done in one period", "test_master_slave.py::test_a_lost_packet_costs_time"),
    "ANY_ACCELERATION": ("any acceleration of the slave", "test_master_slave.py::test_the_slaves_own_acceleration"),
    "REMAINDER_DROPPED": ("remainder of the scale dropped", "test_master_slave.py::test_scale_and_mirror"),
    "DEAD_MASTER_AWAITED": ("a dead master awaited", "test_master_slave.py::test_a_dead_master_stops_it"),
    "MISSED_PULSES_DROPPED": ("missed pulses dropped", "test_master_slave.py::test_parts_that_are_missing_come_later"),
    "PULSES_BUNCHED": ("pulses at the beginning of the period", "test_master_slave.py::test_pulses_are_even"),
    "GUARDED_BY_ASSUMPTION": ("a guard that acts on an assumed stock", "test_assumed.c"),
    "ASSUMED_OVER_CERTAIN": ("an assumed stock in the place of a certain one", "test_assumed.c"),
    "STATION_BEYOND": (
        "a station behind the last read",
        "surface/test_arcs.py::test_nothing_is_read_behind_the_last_station",
    ),
    "BAND_LEFT": ("a line above its band", "surface/test_arcs.py::test_every_station_is_in_its_band"),
    "LINES_ONLY": ("no arcs", "surface/test_arcs.py::test_a_circle_is_few_arcs_and_without_them_lines"),
    "CARRIER_MEASURED": (
        "the line through an element measured",
        "geometry/test_pocket_size.py::test_nearest_by_the_tree",
    ),
    "FIRST_LEAF_ONLY": (
        "the first element met treated as the nearest",
        "geometry/test_pocket_size.py::test_nearest_by_the_tree",
    ),
    "BINS_SHORT": (
        "triangles in their first bins only",
        "surface/test_drop_cutter.py::test_points_against_brute_force[flat]",
    ),
    "EDGES_NOT_MET": ("edges not met", "surface/test_drop_cutter.py::test_points_against_brute_force[ball]"),
    "FACET_AT_AXIS": ("a facet met at the axis", "surface/test_drop_cutter.py::test_closed_forms[ball]"),
    "ENDS_ONLY": (
        "a segment judged at its ends",
        "surface/test_drop_cutter.py::test_excess_is_the_largest_between_points[ball]",
    ),
    "STAMPS_APART": ("stamps a diameter apart", "check/test_check_sweep.py::test_slot"),
    "SKIN_LEFT": (
        "the skin of the last stamps left",
        "check/test_check_sweep.py::test_no_skin_is_left_where_short_moves_end",
    ),
    "HOLDER_NOT_MET": ("the holder not met", "check/test_check_sweep.py::test_holder"),
    "BESIDE_ALL": (
        "every move beside an earlier one",
        "rewrite/test_rewrite_depths.py::test_a_contact_that_no_needle_meets",
    ),
    "PARTS_NOT_CUT": ("cells not cut", "rewrite/test_rewrite_depths.py::test_short_moves_along_a_wall"),
    "CUTS_ABOVE_LEFT": (
        "cuts that are not deep enough left out of a witness",
        "rewrite/test_rewrite_depths.py::test_the_height_of_a_witness_counts_cuts_that_are_not_deep_enough",
    ),
    "FIRST_WITNESS_KEPT": (
        "the first witness of a segment in place of the deepest",
        "rewrite/test_rewrite_depths.py::test_the_deepest_of_the_first_witnesses_counts",
    ),
    "MOVES_STAY": ("moves stay that were taken back", "rewrite/test_rewrite_sought.py::test_in_parts_as_in_one"),
    "SETTLED_UNSPREAD": (
        "cells settled that another move meets",
        "rewrite/test_rewrite_depths.py::test_never_less_than_the_needles_and_never_more_than_there_is",
    ),
    "ENGAGEMENT_LESS": (
        "engagement read a fifth too small",
        "geometry/test_pocket_engage.py::test_engagement_as_the_judge_reads_it",
    ),
    "COVER_UNASKED": (
        "what covered one place covers all others",
        "geometry/test_pocket_engage.py::test_engagement_as_the_judge_reads_it",
    ),
    "NEXT_LEFT_OUT": (
        "a segment that goes on from another left out where that one reaches",
        "geometry/test_pocket_engage.py::test_cleared_is_what_a_segment_is_near_to[0]",
    ),
    "TURN_UNLOOKED": (
        "no room kept to turn away from a wall",
        "geometry/test_pocket_engage.py::test_a_trace_can_turn_away_from_every_wall[rectangle-1.25]",
    ),
    "DIPS_UNLOOKED": (
        "steps that dip into a wall between their ends",
        "geometry/test_pocket_engage.py::test_a_trace_does_not_dip_into_a_wall_between_its_steps[star-0.1]",
    ),
    "FIT_WIDE": (
        "arcs far from the poses they go through",
        "geometry/test_pocket_engage.py::test_fitted_arcs_stay_by_the_poses",
    ),
    "SWEEP_UNLOOKED": (
        "links over cleared ground not looked at",
        "geometry/test_pocket_engage.py::test_a_rib_thinner_than_the_tool_is_seen_under_it",
    ),
    "CORNERS_CUT": ("corners of the path done cut off", "test_path_done.py::test_random_paths"),
    "CLAMPS_LATE": (
        "the braking before a clamp forgotten",
        "test_clamp_guard.py::test_a_feed_is_stopped_before_the_clearance[at-True-200.0]",
    ),
    "CLAMPS_CREEP": (
        "nearer and nearer to a clamp",
        "test_clamp_guard.py::test_a_feed_is_stopped_before_the_clearance[slope-True-1.0]",
    ),
    "HOLDER_FORGOTTEN": ("the holder kept from no clamp", "test_clamp_guard.py::test_holder_and_shank"),
    "BLENDS_FREE": ("a clamp inside of a blend", "test_clamp_guard.py::test_a_pin_inside_of_a_corner"),
    "CLAMPS_TRUSTED": ("a table of clamps that cannot be", "test_clamp_table.c"),
    "ANY_NUMBER": ("no number comes through", "test_feed.py::test_fallback_is_the_programmed_feed"),
}

FAULT_OF = {what: fault for fault, (what, _test) in FAULTS.items()}


def spoiled(fault):
    """Source files a fault is in: all where a header has it."""
    sources = sorted([*CORE.glob("*.c"), *CORE.parent.glob("offline/*.c")])
    named = re.compile(rf"CHIP_FAULTY?\({fault}\b")
    if fault is None or any(named.search(header.read_text()) for header in CORE.glob("*.h")):
        return sources
    return [source for source in sources if named.search(source.read_text())]


def build(folder, fault=None):
    """The core as a shared library, with one fault compiled in; -> its path.  What the fault is not in is from `make
    build`."""
    library = folder / "libchipwise.so"
    sources = spoiled(fault)
    objects = [
        path
        for path in sorted([*(ROOT / "build/core").glob("*.o"), *(ROOT / "build/offline").glob("*.o")])
        if (CORE.parent / path.relative_to(ROOT / "build")).with_suffix(".c").is_file()
    ]
    others = [path for path in objects if path.stem not in [source.stem for source in sources]]
    subprocess.run(
        [
            "gcc",
            "-Os",
            "-fno-fast-math",
            "-w",
            "-shared",
            "-fPIC",
            "-I",
            str(CORE.parent),
            "-o",
            str(library),
            f'-DCHIPWISE_FAULT="{fault or ""}"',
            *map(str, [*sources, *others, ROOT / "build/layout_table.o"]),
            "-lm",
        ],
        check=True,
    )
    return library


def ended(command, env, folder=None):
    """(exit status, what it has printed)"""
    done = subprocess.run(
        command,
        cwd=folder,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=OUTCOME_TIMEOUT_S,
    )
    return done.returncode, done.stdout


def outcome(library, test):
    """Exit status of one test, or of a C program of tests/core, run with another library and all its random cases: it
    ends at the first that fails."""
    env = {name: value for name, value in os.environ.items() if name != "CHIPWISE_RANDOM_SHARE"}
    if test.endswith(".c"):
        program = library.with_name("program")
        subprocess.run(
            [
                "gcc",
                "-std=gnu11",
                "-w",
                "-I",
                str(CORE.parent),
                "-o",
                str(program),
                str(ROOT / "tests/core" / test),
                str(library),
                "-lm",
            ],
            check=True,
        )
        return ended([str(program)], env)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        str(ROOT / "tests" / (test if "/" in test.partition("::")[0] else f"core/{test}")),
    ]
    return ended(command, {**env, "CHIPWISE_CORE": str(library)}, ROOT)


def inputs_of(test):
    """What an outcome depends on."""
    name = test.partition("::")[0]
    programs = unchanged.package() if name.startswith(("check/", "rewrite/")) else ()
    return [
        *unchanged.c_files(),
        *ROOT.glob("tests/core/*.h"),
        f"tests/{name}" if "/" in name else f"tests/core/{name}",
        *programs,
    ]


def test_every_fault_is_tried():
    """No fault of the core or the offline files without a test, no test of a fault that is not there."""
    sources = [*CORE.glob("*.[ch]"), *CORE.parent.glob("offline/*.[ch]")]
    text = "".join(path.read_text() for path in sources if path.name != "fault.h")
    assert sorted(re.findall(r"CHIP_FAULT(?:Y?)\((\w+)", text)) == sorted(FAULTS)


@pytest.mark.inputs(lambda what: inputs_of(FAULTS[FAULT_OF[what]][1]))
@pytest.mark.parametrize("what", FAULT_OF)
def test_fault_is_seen(what, tmp_path):
    fault = FAULT_OF[what]
    status, text = outcome(build(tmp_path, fault), FAULTS[fault][1])
    assert status == 1, text  # 1: tests ran and some failed


@pytest.mark.inputs(lambda: inputs_of("test_feed.py"))
def test_without_fault(tmp_path):
    """The same way of building and running, with no fault, is green."""
    status, text = outcome(build(tmp_path), "test_feed.py")
    assert status == 0, text


@pytest.mark.inputs(lambda: [path for source in C_TESTS for path in unchanged.c_program(source.stem)])
def test_c_program(tmp_path):
    """The bound on the frame is for the realtime core, not for the test programs."""
    flags = ["-fno-fast-math", "-Wframe-larger-than=2560"]
    build_flags = ["gcc", "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Werror"]
    sources = [str(source) for source in sorted(CORE.glob("*.c"))]
    subprocess.run([*build_flags, *flags, "-c", *sources], check=True, cwd=tmp_path)
    objects = [str(path) for path in sorted(tmp_path.glob("*.o"))]
    for source in C_TESTS:
        program = tmp_path / source.stem
        subprocess.run(
            [*build_flags, *[f for f in flags if "frame" not in f], "-o", str(program), str(source), *objects, "-lm"],
            check=True,
        )
        done = subprocess.run([str(program)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == 0, done.stdout
        assert done.stdout.splitlines()[-1].endswith(" passed, 0 failed")
