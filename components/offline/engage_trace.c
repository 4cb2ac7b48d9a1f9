/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_trace.c - see engage.h: the path itself [3 to 6]. */
#include <string.h>

#include "engage_state.h"

#define AWAY 2.2         /* rad: turn of the arc to the left that has to stay within the region [4] */
#define LOADED 1.2       /* rad: part of it whose engagement is looked at */
#define LOOKS 4          /* at so many places */
#define TOUCH_MM 2e-4    /* may be over the border; the step itself is put back onto it */
#define PARTS 6          /* of a step, near the border */
#define HALVINGS 10      /* of the curvature */
#define ON_WALL 0.012    /* radii from the border: on it */
#define SHORTEST 0.05    /* steps: the arc onto a wall, which ends where it touches */
#define TIGHTER 0.85     /* least radii of that arc */
#define UNEVEN_MM 0.0015 /* four times what such a step may differ from one arc */
#define ALONG_WALL 0.5   /* rad of it */
#define OVER 0.012       /* rad over the angle that a step by [3] may be, */
#define UNDER 0.05       /* and under */
#define MORE 0.12        /* rad over the angle at which a path is stopped */
#define AIR 0.06         /* rad: less is air */
#define THIN 0.25        /* rad: less is a thin chip, */
#define THIN_SHARE 0.5   /* and less than that share of the angle */
#define THIN_LENGTHS 8.0 /* of air, of thin chips */

/* The state of a path, for the functions below. */
struct trace {
    struct chip_engage *e;
    const struct chip_engage_rule *rule;
    struct chip_engage_pose at;
    double bend;  /* curvature of the last step */
    double angle; /* its engagement */
    double known; /* engagement of the next pose where it has been asked already, or negative */
    double air, thin;
    int why;
};

static double depth(const struct trace *t, struct chip_engage_pose p)
{
    return chip_engage_wall_foot(t->e, p.x, p.y).depth - t->rule->inset;
}

/* A pose after a length of an even curvature. */
static struct chip_engage_pose ahead(struct chip_engage_pose p, double bend, double length)
{
    struct chip_engage_pose o = { p.x, p.y, p.heading + bend * length };
    if (fabs(bend * length) < 1e-7) {
        o.x += length * cos(p.heading);
        o.y += length * sin(p.heading);
    } else {
        o.x += (sin(o.heading) - sin(p.heading)) / bend;
        o.y -= (cos(o.heading) - cos(p.heading)) / bend;
    }
    return o;
}

/* Whether the arc to the left stays within the region: it goes on by what is free about it. */
static int room_to_turn(const struct trace *t, struct chip_engage_pose p, double touch)
{
    double rho = t->rule->rho, done = 0.0, least = chip_max(0.05 * rho, 0.01), last = AWAY * rho;
    CHIP_FAULT(TURN_UNLOOKED, return 1)
    for (;;) {
        double free_about = depth(t, ahead(p, 1.0 / rho, done));
        if (free_about < -touch) return 0;
        if (done >= last) return 1;
        done = chip_min(done + chip_max(free_about, least), last);
    }
}

/* Whether the engagement on that arc is low enough. */
static int may_turn(const struct trace *t, struct chip_engage_pose p)
{
    double rho = t->rule->rho;
    int k;
    for (k = 1; k <= LOOKS; k++)
        if (chip_engage_above(t->e, ahead(p, 1.0 / rho, LOADED * rho * k / LOOKS), t->rule->angle + t->rule->escape))
            return 0;
    return 1;
}

/* Whether a step of a curvature stays within the region: at its end, and where it may be nearer to the border than there. */
static int inside(const struct trace *t, double bend)
{
    double step = t->rule->step, at_end = depth(t, ahead(t->at, bend, step));
    int k;
    if (at_end < -TOUCH_MM) return 0;
    CHIP_FAULT(DIPS_UNLOOKED, return 1)
    for (k = 1; k < PARTS && at_end < step; k++)
        if (depth(t, ahead(t->at, bend, step * k / PARTS)) < -TOUCH_MM) return 0;
    return 1;
}

/* Whether a step of a curvature keeps to [4]. */
static int may_step(const struct trace *t, double bend)
{
    struct chip_engage_pose o = ahead(t->at, bend, t->rule->step);
    return inside(t, bend) && room_to_turn(t, o, TOUCH_MM) && !chip_engage_above(t->e, o, t->rule->angle)
        && may_turn(t, o);
}

/* Puts a pose at the depth of the border, along it or not across it; whether there is a clear direction to it. */
static int onto_border(const struct trace *t, struct chip_engage_pose *p, int along)
{
    double wall;
    int k;
    struct chip_engage_foot foot = { 0.0, 0.0, 0.0 };
    for (k = 0; k < 3; k++) {
        foot = chip_engage_wall_foot(t->e, p->x, p->y);
        if (hypot(foot.nx, foot.ny) < 0.5) return 0;
        p->x -= (foot.depth - t->rule->inset) * foot.nx;
        p->y -= (foot.depth - t->rule->inset) * foot.ny;
    }
    wall = atan2(-foot.nx, foot.ny);
    if (along || remainder(p->heading - wall, 2.0 * CHIP_PI) < 0.0) p->heading = wall;
    return 1;
}

/* A step along the border, if the path is on it and has it on the right [5]. */
static int border_step(const struct trace *t, struct chip_engage_pose *o)
{
    double step = t->rule->step, moved, toward, even;
    struct chip_engage_foot foot = chip_engage_wall_foot(t->e, t->at.x, t->at.y);
    if (fabs(foot.depth - t->rule->inset) > ON_WALL * t->e->radius) return 0;
    toward = remainder(atan2(-foot.nx, foot.ny) - t->at.heading, 2.0 * CHIP_PI);
    if (fabs(toward) > ALONG_WALL) return 0;
    if (toward > 0.0) step = chip_clamp(2.0 * (foot.depth - t->rule->inset) / toward, SHORTEST * step, step);
    *o = (struct chip_engage_pose){ t->at.x + step * foot.ny, t->at.y - step * foot.nx, 0.0 };
    if (!onto_border(t, o, 1)) return 0;
    moved = hypot(o->x - t->at.x, o->y - t->at.y);
    if (moved < 0.5 * step || moved > 1.3 * step) return 0;
    even = t->at.heading + 0.5 * remainder(o->heading - t->at.heading, 2.0 * CHIP_PI); /* the chord of a single arc */
    even = remainder(atan2(o->y - t->at.y, o->x - t->at.x) - even, 2.0 * CHIP_PI);
    if (fabs(even) * moved > UNEVEN_MM) return 0;
    if (fabs(remainder(o->heading - t->at.heading, 2.0 * CHIP_PI)) > step / (TIGHTER * t->rule->rho) + 0.02) return 0;
    return room_to_turn(t, *o, 10.0 * TOUCH_MM) && !chip_engage_above(t->e, *o, t->rule->angle) && may_turn(t, *o);
}

/* A step by the equation [3], if it is possible and keeps the angle; its curvature. */
static int even_step(struct trace *t, double *bend)
{
    const struct chip_engage_rule *rule = t->rule;
    double toward, now;
    struct chip_engage_pose o;
    if (!chip_engage_leftmost(t->e, ahead(t->at, t->bend, 0.5 * rule->step), &toward)) return 0;
    *bend = remainder(toward + 0.5 * CHIP_PI - rule->angle + 0.002 - t->at.heading, 2.0 * CHIP_PI) / rule->step;
    if (fabs(*bend) >= 1.0 / rule->rho) return 0;
    o = ahead(t->at, *bend, rule->step);
    now = chip_engage_front(t->e, o);
    if (now > rule->angle + OVER || now < rule->angle - UNDER || depth(t, o) < 0.0 || !inside(t, *bend)) return 0;
    if (!room_to_turn(t, o, TOUCH_MM)) return 0;
    if (chip_engage_above(t->e, ahead(o, 1.0 / rule->rho, 0.6 * rule->rho), rule->angle + rule->escape)) return 0;
    t->known = now;
    return 1;
}

/* The curvature furthest to the right that keeps to [4]; 0 if none does and the path has to end. */
static int rightmost(struct trace *t, double *bend)
{
    double least = -1.0 / t->rule->rho, most = 1.0 / t->rule->rho;
    int k;
    *bend = least;
    if (may_step(t, least)) return 1;
    *bend = most;
    if (!may_step(t, most)) {
        struct chip_engage_pose o = ahead(t->at, most, t->rule->step);
        if (!inside(t, most)) {
            t->why |= CHIP_ENGAGE_STUCK;
            return 0;
        }
        if (chip_engage_front(t->e, o) > t->rule->angle + MORE) {
            t->why |= CHIP_ENGAGE_LOADED;
            return 0;
        }
        return 1;
    }
    for (k = 0; k < HALVINGS; k++) {
        double middle = 0.5 * (least + most);
        if (may_step(t, middle))
            most = middle;
        else
            least = middle;
    }
    *bend = most;
    return 1;
}

/* The next pose; 0 where the path ends. */
static int next_pose(struct trace *t, struct chip_engage_pose *o)
{
    double bend;
    t->known = -1.0;
    if (border_step(t, o)) {
        t->bend = chip_clamp(remainder(o->heading - t->at.heading, 2.0 * CHIP_PI) / t->rule->step, -1.0 / t->rule->rho,
                             1.0 / t->rule->rho);
        return 1;
    }
    if (!even_step(t, &bend) && !rightmost(t, &bend)) return 0;
    t->bend = bend;
    *o = ahead(t->at, bend, t->rule->step);
    if (depth(t, *o) < 0.0) {
        struct chip_engage_pose put = *o;
        if (!onto_border(t, &put, 0) || hypot(put.x - o->x, put.y - o->y) > 2.0 * TOUCH_MM) {
            t->why |= CHIP_ENGAGE_STUCK;
            return 0;
        }
        *o = put;
        t->known = -1.0;
    }
    return 1;
}

/* Adds a step to what was done; whether the path goes on [6]. */
static int done(struct trace *t, struct chip_engage_pose o, int commit)
{
    double step = hypot(o.x - t->at.x, o.y - t->at.y);
    t->angle = t->known >= 0.0 ? t->known : chip_engage_front(t->e, o);
    if (commit) {
        struct chip_engage_segment p = chip_engage_segment_between(t->at, o);
        chip_engage_put(t->e, &p);
    }
    t->at = o;
    t->air = t->angle < AIR ? t->air + step : 0.0;
    t->thin = t->angle < chip_min(THIN, THIN_SHARE * t->rule->angle) ? t->thin + step : 0.0;
    if (t->air < t->rule->air && t->thin < THIN_LENGTHS * t->rule->air) return 1;
    t->why |= CHIP_ENGAGE_AIR;
    return 0;
}

long chip_engage_trace(struct chip_engage *e, const double pose[3], const struct chip_engage_rule *rule, int commit,
                       double (*out)[4], long room, int *why)
{
    struct trace t = { e, rule, { pose[0], pose[1], pose[2] }, 0.0, 0.0, -1.0, 0.0, 0.0, 0 };
    struct chip_engage_pose o;
    long n = 0;
    int going = 1;
    while (going && !e->failed && next_pose(&t, &o)) {
        if (n == room) {
            t.why |= CHIP_ENGAGE_NO_ROOM;
            break;
        }
        going = done(&t, o, commit);
        out[n][0] = o.x;
        out[n][1] = o.y;
        out[n][2] = o.heading;
        out[n++][3] = t.angle;
    }
    *why = t.why;
    return n;
}

long chip_engage_along(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double spacing,
                       double (*out)[4], long room)
{
    long k, rows = 0;
    for (k = 0; k < n; k++) {
        const double *v = element[k];
        double length = v[6] != 0.0 ? hypot(v[0] - v[4], v[1] - v[5]) * fabs(v[6]) : hypot(v[2] - v[0], v[3] - v[1]);
        struct chip_engage_pose at = { v[0], v[1], atan2(v[3] - v[1], v[2] - v[0]) };
        long parts = (long)ceil(length / spacing), part;
        if (v[6] != 0.0) at.heading = atan2(v[1] - v[5], v[0] - v[4]) + (v[6] > 0.0 ? 0.5 : -0.5) * CHIP_PI;
        for (part = 0; part < parts; part++) {
            struct chip_engage_pose to = ahead(at, v[6] / length, length / (double)parts);
            struct chip_engage_segment p = chip_engage_segment_between(at, to);
            if (rows == room) return rows;
            out[rows][0] = at.x;
            out[rows][1] = at.y;
            out[rows][2] = at.heading;
            out[rows++][3] = chip_engage_front(e, at);
            chip_engage_put(e, &p);
            at = to;
        }
    }
    return rows;
}
