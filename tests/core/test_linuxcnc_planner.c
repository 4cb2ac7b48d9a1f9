/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The reader of LinuxCNC's motion planner (components/linuxcnc_planner.c) on fake structures: a block of motion's
 * memory
 * and a queue made here.
 *
 * What the queue holds comes out as lines, arcs and chords in mm, with the planner's braking and joins. A block of memory is ours in every form LinuxCNC runs in, and in no other.
 */
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

#define TEST_FILE "test_linuxcnc_planner.c"
#include "fake_planner.h"

static void test_lines(void)
{
    TC_STRUCT *tc;
    double tip[3], dir[3];
    begin(1.0);
    in.tool_offset_mu[2] = 10.0;
    append_line(point(0, 2, 3), point(10, 2, 3))->progress = 1.0;
    tc = append_line(point(10, 2, 3), point(10, 8, 3));
    tc->term_cond = TC_TERM_COND_TANGENT;
    append_line(point(10, 8, 3), point(10, 8, -1));
    follow(50.0);
    CHECK(!path.known); /* after one period it is unknown whether motion runs */
    follow(50.0);
    CHECK(path.known && path.count == 3 && near(path.s, 1.0) && near(path.end_s, 20.0));
    CHECK(near(path.segment[0].accel, 400.0) && path.segment[0].join == CHIP_JOIN_STOP);
    CHECK(path.segment[1].join == CHIP_JOIN_TANGENT && path.segment[2].join == CHIP_JOIN_PARABOLIC);
    chip_path_at(&path, path.s, tip, dir);
    CHECK(near(tip[0], 1.0) && near(tip[1], 2.0) && near(tip[2], -7.0) && near(dir[0], 1.0));
    chip_path_at(&path, 18.0, tip, dir);
    CHECK(near(tip[1], 8.0) && near(tip[2], -9.0) && near(dir[2], -1.0));
    queue[0].progress = 2.5; /* the tool goes on, the last segment becomes final */
    append_line(point(10, 8, -1), point(0, 8, -1));
    follow(50.0);
    CHECK(path.known && near(path.s, 2.5) && path.count == 4 && path.segment[2].join == CHIP_JOIN_STOP);
    end.status.heartbeat--; /* motion has stopped: the same count as the period before */
    follow(50.0);
    CHECK(!path.known);
}

static void test_units_and_braking(void)
{
    TC_STRUCT *tc;
    begin(1.0 / 25.4);
    tc = append_line(point(0, 2, 3), point(1, 2, 3));
    tc->term_cond = TC_TERM_COND_PARABOLIC;
    tc->kink_accel_reduce = 0.25;
    tc->canon_motion_type = EMC_MOTION_TYPE_TRAVERSE;
    follow(50.0);
    follow(50.0);
    CHECK(path.count == 1 && near(path.segment[0].length, 25.4) && path.segment[0].rapid);
    CHECK(near(path.segment[0].accel, 25.4 * 400.0 * 0.75 * 0.5));
}

static void test_arcs(void)
{
    double tip[3], dir[3];
    int turn, i;
    for (turn = -1; turn <= 1; turn += 2) {
        begin(1.0);
        append_circle(PI / 2, 1, turn);
        follow(50.0);
        follow(50.0);
        CHECK(path.count == 1 && near(path.segment[0].curvature, turn / 5.0) && near(path.segment[0].length, 2.5 * PI));
        CHECK(near(path.segment[0].accel, 200.0)); /* the tangential share */
        chip_path_at(&path, path.end_s, tip, dir);
        CHECK(near(tip[0], 0.0) && near(tip[1], 5.0 * turn) && near(dir[0], -1.0));
    }
    begin(1.0);
    append_circle(PI / 2, 0, 1.0);
    follow(50.0);
    follow(50.0);
    CHECK(path.count == CHIP_PLANNER_CHORDS && path.end_s < 2.5 * PI && path.end_s > 2.498 * PI);
    for (i = 0; i + 1 < path.count; i++) CHECK(path.segment[i].join == CHIP_JOIN_TANGENT);
    CHECK(path.segment[path.count - 1].join == CHIP_JOIN_STOP);
    chip_path_at(&path, path.end_s, tip, dir);
    CHECK(near(tip[0], 0.0) && near(tip[2], 5.0));
}

static void test_blend_arc(void)
{
    TC_STRUCT *tc;
    SphericalArc *arc;
    double tip[3], dir[3];
    begin(1.0);
    tc = append(TC_SPHERICAL);
    arc = &tc->coords.arc.xyz;
    arc->start = point(5, 0, 0);
    arc->end = point(0, 5, 0);
    arc->rStart = point(5, 0, 0);
    arc->rEnd = point(0, 5, 0);
    arc->uTan = point(0, 1, 0);
    arc->binormal = point(0, 0, 1);
    arc->angle = PI / 2;
    arc->Sangle = 1.0;
    arc->radius = 5.0;
    arc->line_length = 2.0;
    tc->target = 2.0 + 2.5 * PI;
    follow(50.0);
    follow(50.0);
    CHECK(path.count == 2 && near(path.segment[0].length, 2.0) && near(path.segment[1].curvature, 0.2));
    chip_path_at(&path, 0.0, tip, dir);
    CHECK(near(tip[0], 5.0) && near(tip[1], -2.0));
    chip_path_at(&path, path.end_s, tip, dir);
    CHECK(near(tip[0], 0.0) && near(tip[1], 5.0));
}

static void test_parabolic_blend(void)
{
    TC_STRUCT *first, *next;
    begin(1.0);
    first = append_line(point(0, 2, 3), point(10, 2, 3));
    next = append_line(point(10, 2, 3), point(10, 12, 3));
    first->canon_motion_type = next->canon_motion_type = EMC_MOTION_TYPE_TRAVERSE;
    first->term_cond = TC_TERM_COND_PARABOLIC;
    first->progress = 9.0;
    follow(50.0);
    follow(50.0);
    CHECK(!path.blend.active);
    first->blending_next = 1;
    first->blend_vel = 20.0;
    first->vel_at_blend_start = 10.0;
    first->currentvel = 8.0;
    next->progress = 0.5;
    next->currentvel = 3.0;
    next->blend_vel = 30.0;
    follow(50.0);
    CHECK(path.blend.active && near(path.blend.travelled, 0.5) && near(path.blend.length, 10.0));
    CHECK(near(path.blend.speed, 3.0) && near(path.blend.end_speed, 15.0));
    CHECK(near(path.blend.first_left, 1.0) && near(path.blend.first_speed, 8.0) && near(path.blend.dir[1], 1.0));
}

static void test_where_it_ends(void)
{
    int i;
    begin(1.0);
    append_line(point(0, 2, 3), point(10, 2, 3));
    append(TC_RIGIDTAP)->coords.rigidtap.xyz.start = point(10, 2, 3);
    append_line(point(10, 2, 3), point(10, 8, 3));
    follow(50.0);
    follow(50.0);
    CHECK(path.known && path.count == 1); /* a tap is nowhere the core could look ahead */
    begin(1.0);
    tp()->queue.start = tp()->queue.size - 2; /* the queue is a ring */
    for (i = 0; i < 40; i++) append_line(point(i, 2, 3), point(i + 1, 2, 3));
    for (i = 0; i < 4; i++) follow(10.0);
    CHECK(path.known && path.end_s > 10.0 && path.end_s < 10.0 + CHIP_PLANNER_MARGIN + 1.1);
    begin(1.0);
    follow(50.0);
    follow(50.0);
    CHECK(!path.known); /* an empty queue */
}

static uid_t users[3]; /* real, effective and saved of this process, for the getresuid below */

int getresuid(uid_t *real, uid_t *effective, uid_t *saved)
{
    *real = users[0];
    *effective = users[1];
    *saved = users[2];
    return 0;
}

/* A block of `owner`, made by `maker`, as a process with these three uids sees it. */
static int ours(uid_t real, uid_t effective, uid_t saved, uid_t owner, uid_t maker, int mode)
{
    struct shmid_ds about = { 0 };
    users[0] = real;
    users[1] = effective;
    users[2] = saved;
    about.shm_perm.uid = owner;
    about.shm_perm.cuid = maker;
    about.shm_perm.mode = mode;
    return chip_planner_ours(&about);
}

static void test_whose_block(void)
{
    static const int open_to_others[] = { 0640, 0620, 0610, 0604, 0602, 0601, 0660, 0666 };
    size_t i;
    enum { ROOT, USER = 1000, OTHER = 1001 };
    CHECK(ours(ROOT, ROOT, USER, USER, ROOT, 0600)); /* the package's rtapi_app, setuid root: given to the user */
    CHECK(ours(ROOT, ROOT, USER, USER, USER, 0600)); /* there, a block that the user's milltask has made (2.10) */
    CHECK(ours(ROOT, ROOT, USER, ROOT, ROOT, 0600)); /* there, between its making and its giving */
    CHECK(ours(USER, USER, USER, USER, USER, 0600)); /* not setuid: a sandbox, capabilities in place of setuid */
    CHECK(ours(USER, USER, USER, USER, ROOT, 0600)); /* the user's own programs, a block of a setuid rtapi_app */
    CHECK(ours(USER, ROOT, ROOT, USER, ROOT, 0600)); /* setuid root, and nothing given up */
    CHECK(ours(ROOT, USER, ROOT, USER, ROOT, 0600));
    CHECK(
        ours(USER, USER, USER, USER, ROOT, 0600 | 01000 | 02000)); /* marked for removal, locked: no rights of others */
    CHECK(!ours(ROOT, ROOT, USER, OTHER, ROOT, 0600));             /* another user's LinuxCNC has left it */
    CHECK(!ours(ROOT, ROOT, USER, OTHER, OTHER, 0600));
    CHECK(!ours(ROOT, ROOT, USER, USER, OTHER, 0600)); /* made by another user, then given to us by root's rtapi_app */
    CHECK(!ours(USER, USER, USER, OTHER, USER, 0600)); /* given away */
    CHECK(!ours(USER, USER, USER, OTHER, ROOT, 0600));
    for (i = 0; i < sizeof open_to_others / sizeof *open_to_others; i++) {
        CHECK(!ours(ROOT, ROOT, USER, USER, ROOT, open_to_others[i]));
        CHECK(!ours(USER, USER, USER, USER, USER, open_to_others[i]));
    }
}

int main(void)
{
    test_whose_block();
    test_lines();
    test_units_and_braking();
    test_arcs();
    test_blend_arc();
    test_parabolic_blend();
    test_where_it_ends();
    if (!failures) printf("planner: every case as it must be\n");
    return failures != 0;
}
