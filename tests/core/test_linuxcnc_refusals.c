/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the reader of LinuxCNC's motion planner (components/linuxcnc_planner.c) refuses, on fake structures: whatever
 * does not fit leaves the path unknown, and the check that failed has a name. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#undef CHIP_HALF_IN_OVERLAP /* as LinuxCNC 2.9 brakes, whatever is installed */
#define CHIP_HALF_IN_OVERLAP 0
#include "linuxcnc_planner.c"

#define TEST_FILE "test_linuxcnc_refusals.c"
#include "fake_planner.h"

/* Two lines of which the first is half done, known. */
static void begin_two_lines(void)
{
    begin(1.0);
    append_line(point(0, 2, 3), point(10, 2, 3))->progress = 5.0;
    append_line(point(10, 2, 3), point(10, 8, 3));
    follow(50.0);
    follow(50.0);
    CHECK(path.known && path.count == 2 && planner.refusal == CHIP_REFUSAL_NONE);
    settle();
    end.status.heartbeat++;
}

static void spoil(int k)
{
    if (k == 0) planner.motion = 0, planner.refused = CHIP_REFUSAL_NOT_OURS;
    if (k == 1) tp()->queue.size--;
    if (k == 2) tp()->queue.queue = 0;
    if (k == 3) tp()->queue._len = -1;
    if (k == 4) tp()->queue._len = tp()->queue.size + 1;
    if (k == 5) tp()->queue.start = -1;
    if (k == 6) tp()->queue.start = tp()->queue.size;
    if (k == 7) tp()->cycleTime = NAN;
    if (k == 8) tp()->cycleTime = 1.0;
    if (k == 9) tp()->reverse_run = 1;
    if (k == 10) tp()->currentPos.tran.x += 0.01;
    if (k == 11) tp()->currentPos.tran.z = NAN;
    if (k == 12) end.status.heartbeat--;
    if (k == 13) end.status.heartbeat++;
    if (k == 14) end.status.motionType = planner.last_kind = EMC_MOTION_TYPE_PROBING;
    if (k == 15) end.status.distance_to_go = planner.last_to_go = 5.1;
    if (k == 16) queue[0].progress += 0.002;
    if (k == 17) queue[0].canon_motion_type = queue[1].canon_motion_type = planner.last_canon = EMC_MOTION_TYPE_ARC;
    if (k == 18) queue[0].term_cond = 4;
    if (k == 19) queue[0].maxaccel = NAN;
    if (k == 20) tp()->queue._len = tp()->queue.end = 0;
    if (k == 23) tp()->queue.end = 1;
    if (k == 21) append_line(point(10, 8.01, 3), point(0, 8, 3)); /* does not begin where the one before ends */
    if (k == 22) append_line(point(10, 8, 3), point(0, NAN, 3));
}

static void test_unsound(void)
{
    static const int why[] = { CHIP_REFUSAL_NOT_OURS,  CHIP_REFUSAL_COUNTS,    CHIP_REFUSAL_COUNTS,
                               CHIP_REFUSAL_COUNTS,    CHIP_REFUSAL_COUNTS,    CHIP_REFUSAL_COUNTS,
                               CHIP_REFUSAL_COUNTS,    CHIP_REFUSAL_COUNTS,    CHIP_REFUSAL_COUNTS,
                               CHIP_REFUSAL_REVERSED,  CHIP_REFUSAL_POSITION,  CHIP_REFUSAL_POSITION,
                               CHIP_REFUSAL_HEARTBEAT, CHIP_REFUSAL_HEARTBEAT, CHIP_REFUSAL_PINS,
                               CHIP_REFUSAL_PINS,      CHIP_REFUSAL_STATION,   CHIP_REFUSAL_SEGMENT,
                               CHIP_REFUSAL_SEGMENT,   CHIP_REFUSAL_SEGMENT,   CHIP_REFUSAL_EMPTY,
                               CHIP_REFUSAL_CHAIN,     CHIP_REFUSAL_CHAIN,     CHIP_REFUSAL_COUNTS };
    size_t k;
    for (k = 0; k < sizeof why / sizeof *why; k++) {
        begin_two_lines();
        spoil((int)k);
        look(50.0);
        if (path.known || planner.refusal != why[k]) printf("case %d, refusal %d: ", (int)k, planner.refusal);
        CHECK(!path.known && path.count == 0 && planner.refusal == why[k]);
    }
}

/* A spiral that grows by 1 in a right angle, above it a helix: the position on it is the planner's own. */
static void test_point_at_a_spiral(void)
{
    double b0, b1 = sqrt(25.0 + 4.0 / PI / PI), angle = PI / 2;
    TC_STRUCT *tc;
    PmCartesian at;
    begin(1.0);
    tc = append_circle(angle, 1, 1.0);
    tc->coords.circle.xyz.spiral = 1.0;
    tc->coords.circle.xyz.rHelix = point(0, 0, 2);
    b0 = (sqrt(36.0 + 4.0 / PI / PI) - b1) / (2.0 * angle);
    tc->coords.circle.fit.b0 = b0;
    tc->coords.circle.fit.b1 = b1;
    tc->coords.circle.fit.total_planar_length = b0 * angle * angle + b1 * angle;
    tc->target = hypot(tc->coords.circle.fit.total_planar_length, 2.0);
    planned_at(tc, tc->target, &at);
    CHECK(near(at.x, 0.0) && near(at.y, 6.0) && near(at.z, 2.0));
    planned_at(tc, tc->target * (b0 * 0.25 + b1 * 0.5) / tc->coords.circle.fit.total_planar_length, &at); /* 0.5 rad */
    CHECK(near(hypot(at.x, at.y), 5.0 + 1.0 / PI) && near(atan2(at.y, at.x), 0.5));
}

/* An abort counts only in a block whose heartbeat counts. */
static void test_aborted(void)
{
    begin_two_lines();
    end.status.commandNumEcho++;
    end.status.commandEcho = EMCMOT_ABORT;
    CHECK(chip_planner_aborted(&planner));
    end.status.heartbeat++;
    CHECK(!chip_planner_aborted(&planner));
    end.status.commandNumEcho++;
    CHECK(!chip_planner_aborted(&planner)); /* the counter stands */
}

/* Once a second of cutting has gone by unknown, and until the path has been known for as long. */
static void test_when_it_is_said(void)
{
    struct chip_path_watch watch = { 0.0, 0 };
    int i;
    CHECK(chip_path_watch_step(&watch, CHIP_REFUSAL_NOT_OURS, 0, 0.001) == CHIP_REFUSAL_NOT_OURS);
    watch.code = 0;
    for (i = 0; i < 3000; i++) CHECK(!chip_path_watch_step(&watch, CHIP_REFUSAL_CHAIN, 0, 0.001)); /* in the air */
    for (i = 0; i < 990; i++) CHECK(!chip_path_watch_step(&watch, CHIP_REFUSAL_CHAIN, 1, 0.001));
    for (i = 0; i < 990; i++) CHECK(!chip_path_watch_step(&watch, CHIP_REFUSAL_NONE, 1, 0.001));
    for (i = 0; i < 3990; i++) chip_path_watch_step(&watch, i % 4 ? CHIP_REFUSAL_STATION : CHIP_REFUSAL_NONE, 1, 0.001);
    CHECK(watch.code == CHIP_REFUSAL_STATION); /* known in every fourth period is not known */
    for (i = 0; i < 990; i++) CHECK(chip_path_watch_step(&watch, CHIP_REFUSAL_NONE, 1, 0.001) == CHIP_REFUSAL_STATION);
    for (i = 0; i < 20; i++) chip_path_watch_step(&watch, CHIP_REFUSAL_NONE, 0, 0.001);
    CHECK(watch.code == CHIP_REFUSAL_NONE);
    CHECK(!chip_path_watch_step(&watch, CHIP_REFUSAL_STATION, 1, NAN));
    for (i = 0; i < 1010; i++) chip_path_watch_step(&watch, CHIP_REFUSAL_CHAIN, 1, 0.001);
    CHECK(watch.code == CHIP_REFUSAL_CHAIN);
    watch.unknown_s = 0.0; /* M251 begins */
    CHECK(!chip_path_watch_step(&watch, CHIP_REFUSAL_CHAIN, 1, 0.001));
}

int main(void)
{
    test_unsound();
    test_point_at_a_spiral();
    test_aborted();
    test_when_it_is_said();
    if (!failures) printf("refusals: every case as it must be\n");
    return failures != 0;
}
