/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The pace of the planner (components/linuxcnc_planner.h, 5) in a parabolic blend, and outside of one. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdio.h>
#include <string.h>

#undef CHIP_HALF_IN_OVERLAP /* as LinuxCNC 2.9 brakes, whatever is installed */
#define CHIP_HALF_IN_OVERLAP 0
#include "linuxcnc_planner.c"

#define TEST_FILE "test_linuxcnc_pace.c"
#include "fake_planner.h"

/* The two segments of a parabolic blend: the slower velocity and the weaker braking. */
static void test_pace(void)
{
    TC_STRUCT *arc, *line;
    begin(1.0);
    arc = append_circle(1.0, 1, 1.0);
    arc->term_cond = TC_TERM_COND_PARABOLIC;
    arc->currentvel = 20.0;
    arc->progress = 1.0;
    line = append_line(point(5 * cos(1.0), 5 * sin(1.0), 0), point(9, 2, 3));
    line->blend_prev = 1;
    line->currentvel = 7.0;
    follow(50.0);
    follow(50.0);
    CHECK(near(planner.blend_vel_mu_s, 0.0) && near(planner.braking_mu_s2, 400.0 * 0.5 * 0.5));
    arc->blending_next = 1;
    follow(50.0);
    CHECK(near(planner.blend_vel_mu_s, 7.0) && near(planner.braking_mu_s2, 100.0));
    line->currentvel = 30.0;
    line->kink_accel_reduce = 0.7;
    follow(50.0);
    CHECK(near(planner.blend_vel_mu_s, 20.0) && near(planner.braking_mu_s2, 400.0 * 0.5 * 0.3));
    look(50.0); /* motion does not run */
    CHECK(near(planner.blend_vel_mu_s, 0.0) && near(planner.braking_mu_s2, 0.0));
    follow(50.0);
    follow(50.0);
    queue[0].term_cond = TC_TERM_COND_TANGENT;
    follow(50.0);
    CHECK(near(planner.blend_vel_mu_s, 0.0));
}

/* F along the path: what the output shows now, and what the segments in the queue will set [9]. */
static void test_feeds_ahead(void)
{
    TC_STRUCT *tc;
    begin(1.0 / 25.4);
    in.f_output = 2;
    in.programmed_vel_mu_s = 0.5;
    append_line(point(0, 2, 3), point(1, 2, 3));
    tc = append_line(point(1, 2, 3), point(1, 3, 3));
    tc->syncdio.anychanged = 1;
    tc->syncdio.aio_mask = 1 << 2;
    tc->syncdio.aios[2] = 0.25;
    tc = append_line(point(1, 3, 3), point(1, 3, 2));
    tc->syncdio.aio_mask = 1 << 2; /* left over: nothing has changed */
    tc->syncdio.aios[2] = 9.0;
    tc = append_line(point(1, 3, 2), point(2, 3, 2));
    tc->syncdio.anychanged = 1;
    tc->syncdio.aio_mask = 1 << 3; /* another output */
    tc->syncdio.aios[2] = 9.0;
    follow(500.0);
    follow(500.0);
    CHECK(path.count == 4 && near(path.segment[0].feed, 12.7) && near(path.segment[1].feed, 6.35));
    CHECK(near(path.segment[2].feed, 6.35) && near(path.segment[3].feed, 6.35));
    tc = append_line(point(2, 3, 2), point(2, 4, 2)); /* the one before is final now */
    tc->syncdio.anychanged = 1;
    tc->syncdio.aio_mask = 1 << 2;
    tc->syncdio.aios[2] = NAN;
    in.programmed_vel_mu_s = 7.0; /* counts where a chain begins */
    follow(500.0);
    CHECK(path.count == 5 && near(path.segment[0].feed, 12.7) && near(path.segment[3].feed, 6.35));
    CHECK(path.segment[4].feed == 0.0);
    in.f_output = -1;
    chip_path_reset(&path);
    planner.tentative = 0;
    follow(500.0);
    CHECK(path.count == 5 && path.segment[1].feed == 0.0);
}

int main(void)
{
    test_pace();
    test_feeds_ahead();
    if (!failures) printf("pace: every case as it must be\n");
    return failures != 0;
}
