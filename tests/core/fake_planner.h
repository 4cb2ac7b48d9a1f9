/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fake_planner.h - a block of motion's memory and a queue, made by hand, for the tests of components/linuxcnc_planner.c.
 *
 * Who calls it: test_linuxcnc_planner.c, test_linuxcnc_pace.c, which define TEST_FILE and include linuxcnc_planner.c before.
 * Source: none.
 */
#ifndef FAKE_PLANNER_H
#define FAKE_PLANNER_H

#define PI 3.14159265358979323846

static struct chip_motion_end end;
static TC_STRUCT queue[DEFAULT_TC_QUEUE_SIZE];
static struct chip_planner planner;
static struct chip_path path;
static struct chip_tracker_in in;
static int failures;

#define CHECK(condition) check((condition) != 0, __LINE__, #condition)

static void check(int good, int line, const char *text)
{
    if (good) return;
    printf("%s:%d: %s\n", TEST_FILE, line, text);
    failures++;
}

static inline int near(double a, double b) { return fabs(a - b) < 1e-9; }

static TP_STRUCT *tp(void) { return &end.internal.coord_tp; }

static PmCartesian point(double x, double y, double z)
{
    PmCartesian at = { x, y, z };
    return at;
}

/* An empty queue of a planner at X1 Y2 Z3, machine units mm unless `unit` says otherwise. */
static void begin(double unit)
{
    memset(&end, 0, sizeof end);
    memset(queue, 0, sizeof queue);
    memset(&planner, 0, sizeof planner);
    memset(&path, 0, sizeof path);
    memset(&in, 0, sizeof in);
    chip_path_reset(&path);
    tp()->queue.queue = queue;
    tp()->queue.size = DEFAULT_TC_QUEUE_SIZE;
    tp()->cycleTime = 0.001;
    tp()->currentPos.tran = point(1, 2, 3);
    in.pos_mu[0] = 1;
    in.pos_mu[1] = 2;
    in.pos_mu[2] = 3;
    in.mu_per_mm = unit;
    in.period_s = 0.001;
    planner.motion = &end.internal;
    planner.queue = queue;
}

static TC_STRUCT *append(int type)
{
    TC_STRUCT *tc = &queue[(tp()->queue.start + tp()->queue._len++) % tp()->queue.size];
    memset(tc, 0, sizeof *tc);
    tp()->queue.end = (tp()->queue.start + tp()->queue._len) % tp()->queue.size;
    tc->motion_type = type;
    tc->canon_motion_type = EMC_MOTION_TYPE_FEED;
    tc->maxaccel = 400.0;
    tc->acc_ratio_tan = 0.5;
    tc->term_cond = TC_TERM_COND_STOP;
    return tc;
}

static TC_STRUCT *append_line(PmCartesian from, PmCartesian to)
{
    TC_STRUCT *tc = append(TC_LINEAR);
    tc->coords.line.xyz.start = from;
    tc->coords.line.xyz.end = to;
    tc->target = sqrt(pow(to.x - from.x, 2) + pow(to.y - from.y, 2) + pow(to.z - from.z, 2));
    return tc;
}

/* A circle of radius 5 about X0 Y0 by `angle`: in XY with its normal up or down, or in XZ. */
static TC_STRUCT *append_circle(double angle, int upright, double sign)
{
    TC_STRUCT *tc = append(TC_CIRCULAR);
    PmCircle *circle = &tc->coords.circle.xyz;
    circle->radius = 5.0;
    circle->angle = angle;
    circle->rTan = point(5, 0, 0);
    circle->rPerp = upright ? point(0, 5 * sign, 0) : point(0, 0, 5);
    circle->normal = upright ? point(0, 0, sign) : point(0, -1, 0);
    tc->target = 5.0 * angle;
    return tc;
}

/* The planner and the axes where the first segments say, and of its kind. */
static void settle(void)
{
    const TC_STRUCT *tc = queue_item(tp(), 0), *next = queue_item(tp(), 1);
    PmCartesian at = tp()->currentPos.tran, more, less;
    if (tp()->queue._len == 0 || tc->motion_type == TC_RIGIDTAP) return;
    planned_at(tc, tc->progress, &at);
    if (tp()->queue._len > 1 && next->progress > 0.0) {
        planned_at(next, next->progress, &more);
        planned_at(next, 0.0, &less);
        at = point(at.x + more.x - less.x, at.y + more.y - less.y, at.z + more.z - less.z);
    }
    tp()->currentPos.tran = at;
    tp()->motionType = end.status.motionType = in.motion = tc->canon_motion_type;
    end.status.distance_to_go = in.distance_to_go_mu = tc->target - tc->progress;
    in.pos_mu[0] = at.x;
    in.pos_mu[1] = at.y;
    in.pos_mu[2] = at.z;
}

/* A period, with everything as it is. */
static void look(double horizon)
{
    chip_planner_aborted(&planner);
    chip_planner_follow(&planner, &in, horizon, &path);
}

/* One period in which motion-controller has run. */
static void follow(double horizon)
{
    settle();
    end.status.heartbeat++;
    look(horizon);
}

#endif
