/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Braking on the segments of a parabolic blend as LinuxCNC 2.10 does it (components/linuxcnc_segment.h): with all of the acceleration but
 * where the two segments overlap. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdio.h>
#include <string.h>

#undef CHIP_HALF_IN_OVERLAP
#define CHIP_HALF_IN_OVERLAP 1
#include "linuxcnc_planner.c"

#define TEST_FILE "test_linuxcnc_overlap.c"
#include "fake_planner.h"

/* A line along X of 40 mm that blends into one of 30 mm along Y, which blends into one that ends in a stop; F 20 mm/s. */
static void blended(double maxvel, double reqvel)
{
    TC_STRUCT *tc;
    int i;
    begin(1.0);
    append_line(point(1, 2, 3), point(41, 2, 3))->term_cond = TC_TERM_COND_PARABOLIC;
    tc = append_line(point(41, 2, 3), point(41, 32, 3));
    tc->term_cond = TC_TERM_COND_PARABOLIC;
    tc->blend_prev = 1;
    append_line(point(41, 32, 3), point(61, 32, 3))->blend_prev = 1;
    append_line(point(61, 32, 3), point(61, 42, 3));
    for (i = 0; i < 4; i++) {
        queue[i].maxvel = maxvel;
        queue[i].reqvel = reqvel;
    }
    follow(500.0);
    follow(500.0);
}

static void test_overlaps(void)
{
    /* 2 x 20 mm/s: 40 x 40 / (2 x 400) = 2 mm, and two periods */
    blended(100.0, 20.0);
    CHECK(path.count == 4 && near(path.segment[0].accel, 400.0) && near(path.segment[1].accel, 400.0));
    CHECK(near(path.segment[0].overlap[0], 0.0) && near(path.segment[0].overlap[1], 2.08));
    CHECK(near(path.segment[1].overlap[0], 2.08) && near(path.segment[1].overlap[1], 2.08));
    CHECK(near(path.segment[2].overlap[0], 2.08) && near(path.segment[2].overlap[1], 0.0));
    CHECK(near(path.segment[3].overlap[0], 0.0) && near(path.segment[3].overlap[1], 0.0));
    blended(30.0, 20.0); /* the segment's own limit */
    CHECK(near(path.segment[0].overlap[1], 900.0 / 800.0 + 0.06));
    blended(1000.0, 500.0); /* half of the segment */
    CHECK(near(path.segment[0].overlap[1], 20.0) && near(path.segment[1].overlap[0], 15.0));
    blended(NAN, NAN);
    CHECK(near(path.segment[0].overlap[1], 20.0));
}

/* What braking takes off, and where the tool would stop: 37.92 mm with 400, 4.16 mm with 200, and so on. */
static void test_braking(void)
{
    double at, sum;
    blended(100.0, 20.0);
    CHECK(near(chip_path_braking(&path, 30.0), 400.0 * 30.0));
    CHECK(near(chip_path_braking(&path, 40.0), 400.0 * 37.92 + 200.0 * 2.08));
    CHECK(near(chip_path_braking(&path, 42.08), 400.0 * 37.92 + 200.0 * 4.16));
    CHECK(near(chip_path_braking(&path, 43.08), 400.0 * 38.92 + 200.0 * 4.16));
    for (at = 0.37; at < 100.0; at += 0.73) {
        sum = chip_path_braking(&path, at);
        CHECK(fabs(chip_path_stop(&path, sqrt(2.0 * sum), 0.0) - at) < 1e-6);
    }
    CHECK(near(chip_segment_blend_accel(&path.segment[0], 1), 200.0));
    CHECK(near(chip_segment_blend_accel(&path.segment[0], 0), 400.0));
}

/* Where the tool is: all of it, and half of the weaker one in a blend. */
static void test_pace(void)
{
    blended(100.0, 20.0);
    CHECK(near(planner.braking_mu_s2, 400.0));
    queue[0].progress = 39.0;
    queue[0].currentvel = 10.0;
    queue[1].currentvel = 4.0;
    queue[1].kink_accel_reduce = 0.25;
    queue[0].blending_next = 1;
    follow(500.0);
    CHECK(near(planner.braking_mu_s2, 150.0) && near(planner.blend_vel_mu_s, 4.0));
}

/* The chords of an arc: only the first and the last one may overlap. */
static void test_chords(void)
{
    TC_STRUCT *arc;
    int i, overlaps = 0;
    begin(1.0);
    tp()->currentPos.tran = point(5, 0, 0);
    arc = append_circle(1.0, 0, 1.0);
    arc->term_cond = TC_TERM_COND_PARABOLIC;
    arc->maxvel = arc->reqvel = 10.0;
    append_line(point(5 * cos(1.0), 0, 5 * sin(1.0)), point(9, 2, 3))->blend_prev = 1;
    append_line(point(9, 2, 3), point(9, 9, 3));
    follow(500.0);
    follow(500.0);
    CHECK(path.count == CHIP_PLANNER_CHORDS + 2);
    for (i = 0; i < CHIP_PLANNER_CHORDS; i++) overlaps += path.segment[i].overlap[0] + path.segment[i].overlap[1] > 0.0;
    CHECK(overlaps == 1 && path.segment[CHIP_PLANNER_CHORDS - 1].overlap[1] > 0.0);
}

int main(void)
{
    test_overlaps();
    test_braking();
    test_pace();
    test_chords();
    if (!failures) printf("overlap: every case as it must be\n");
    return failures != 0;
}
