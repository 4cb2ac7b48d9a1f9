/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The pace of the planner (components/linuxcnc_planner.h, 5) in a parabolic blend, and outside of one. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdio.h>
#include <string.h>

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

int main(void)
{
    test_pace();
    if (!failures) printf("pace: every case as it must be\n");
    return failures != 0;
}
