/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge's tool, blank and chords, and the stock that the chords before have left (2 in judge.c).
 *
 * Included by judge.c and judge_needles.c.  Units: mm, rad.
 */
#ifndef CHIPWISE_TESTS_JUDGE_STOCK_H
#define CHIPWISE_TESTS_JUDGE_STOCK_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 1e-6          /* mm: a point this near the rim of an earlier cut is outside of it */
#define NONE (-1e30)
#define FAR 1e30

/* --- the tool ------------------------------------------------------------------------------- */

struct tool {
    double radius;              /* mm */
    double flat;                /* mm, radius of the flat at the tip */
    double corner;              /* mm, radius of the arc beside it */
    double turn;                /* rad, angle the arc goes through */
    double arc_r, arc_z;        /* mm, end of the arc */
    double slope;               /* of the cone from there to the radius */
};

/* diameter, corner radius, included tip angle (degrees, 0: no cone) -> tool */
static inline struct tool make_tool(const double *size)
{
    struct tool t;
    double R = 0.5 * size[0], corner = size[1], angle = size[2];

    t.radius = R;
    t.corner = corner;
    if (angle > 0.0) {
        t.slope = 1.0 / tan(angle * M_PI / 360.0);
        t.flat = 0.0;
        t.turn = atan(t.slope);
    } else {
        t.slope = 0.0;
        t.flat = R - corner;
        t.turn = 0.5 * M_PI;
    }
    t.arc_r = t.flat + corner * sin(t.turn);
    t.arc_z = corner * (1.0 - cos(t.turn));
    if (corner <= 0.0)
        t.arc_z = 0.0;
    return t;
}

/* height of the profile above the tip at radius r */
static inline double profile(const struct tool *t, double r)
{
    if (r <= t->flat)
        return 0.0;
    if (r < t->arc_r) {
        double x = r - t->flat;
        return t->corner - sqrt(fmax(t->corner * t->corner - x * x, 0.0));
    }
    return t->arc_z + (r - t->arc_r) * t->slope;
}

static inline double steepness(const struct tool *t, double r)
{
    if (r <= t->flat)
        return 0.0;
    if (r < t->arc_r) {
        double x = r - t->flat;
        return x / sqrt(fmax(t->corner * t->corner - x * x, 1e-18));
    }
    return t->slope;
}

/* --- the blank ------------------------------------------------------------------------------ */

struct blank {                  /* as tests/support/judge.py packs it */
    double round;               /* 0 box, 1 cylinder */
    double x, y;                /* centre */
    double half_x, half_y;      /* half the sides; of a cylinder the radius, twice */
    double cos_turn, sin_turn;
    double low, high;           /* z */
};

static inline int inside(const struct blank *b, double x, double y)
{
    double u = x - b->x, v = y - b->y;

    if (b->round > 0.5)
        return u * u + v * v < b->half_x * b->half_x;
    return fabs(b->cos_turn * u + b->sin_turn * v) < b->half_x && fabs(b->cos_turn * v - b->sin_turn * u) < b->half_y;
}

/* radius of a circle about the centre that holds the blank */
static inline double reach(const struct blank *b)
{
    return b->round > 0.5 ? b->half_x : sqrt(b->half_x * b->half_x + b->half_y * b->half_y);
}

/* --- (2) one chord ---------------------------------------------------------------------------- */

struct chord {
    double x, y, z, dx, dy, dz;
    double low;                 /* lower end's z */
    double l2;                  /* dx^2 + dy^2 */
    const struct tool *tool;
};

static inline double at(const struct chord *c, double t, double qx, double qy)
{
    double x = c->x + t * c->dx - qx, y = c->y + t * c->dy - qy;

    return c->z + t * c->dz + profile(c->tool, sqrt(x * x + y * y));
}

static inline double gain(const struct chord *c, double t, double qx, double qy)
{
    double x = c->x + t * c->dx - qx, y = c->y + t * c->dy - qy, r = sqrt(x * x + y * y);

    if (r < 1e-12)
        return c->dz;
    return c->dz + steepness(c->tool, r) * (x * c->dx + y * c->dy) / r;
}

/* Lowest the tool gets over (qx, qy) on the first `end` (0..1) of the chord, if below `best`; else FAR. */
static inline double swept(const struct chord *c, double qx, double qy, double end, double best)
{
    double px = qx - c->x, py = qy - c->y, R = c->tool->radius - EDGE, along, tn, ex, ey, d2, z, half, t0, t1, g0, g1;
    int i;

    along = c->l2 > 1e-18 ? (px * c->dx + py * c->dy) / c->l2 : 0.0;
    tn = along < 0.0 ? 0.0 : along > end ? end : along;
    ex = px - tn * c->dx;
    ey = py - tn * c->dy;
    d2 = ex * ex + ey * ey;
    if (d2 >= R * R)
        return FAR;
    z = profile(c->tool, sqrt(d2));
    if (fabs(c->dz) < 1e-9)
        return c->z + z;
    if (c->low + z >= best)
        return FAR;
    if (c->l2 <= 1e-18)
        return fmin(c->z, c->z + end * c->dz) + z;
    ex = px - along * c->dx;
    ey = py - along * c->dy;
    half = sqrt(fmax(R * R - ex * ex - ey * ey, 0.0) / c->l2);
    t0 = fmax(along - half, 0.0);
    t1 = fmin(along + half, end);
    if (t0 >= t1)
        return at(c, tn, qx, qy);
    g0 = gain(c, t0, qx, qy);
    if (g0 >= 0.0)
        return at(c, t0, qx, qy);
    g1 = gain(c, t1, qx, qy);
    if (g1 <= 0.0)
        return at(c, t1, qx, qy);
    for (i = 0; i < 60 && (t1 - t0) * fmin(-g0, g1) > 1e-9; i++) {      /* what is left to gain is less: g is convex */
        double mid = (i & 1) ? 0.5 * (t0 + t1) : t0 - g0 * (t1 - t0) / (g1 - g0), g;
        if (mid <= t0 || mid >= t1)
            mid = 0.5 * (t0 + t1);
        g = gain(c, mid, qx, qy);
        if (g > 0.0) {
            t1 = mid;
            g1 = g;
        } else {
            t0 = mid;
            g0 = g;
        }
    }
    return -g0 < g1 ? at(c, t0, qx, qy) : at(c, t1, qx, qy);
}

/* --- (2) all chords before now ------------------------------------------------------------------ */

struct patch {
    int count, room;
    int *chord;
};

struct history {
    const struct blank *blank;
    struct chord *chords;
    struct patch *patches;
    double x0, y0, side;
    int wide, high;
    const struct chord *now;    /* the chord being run, up to `now_end` of it */
    double now_end;
    long asked;
};

static inline void open_history(struct history *h, const struct blank *b, struct chord *chords, double side)
{
    double r = reach(b);

    memset(h, 0, sizeof *h);
    h->blank = b;
    h->chords = chords;
    h->side = side;
    h->x0 = b->x - r - side;
    h->y0 = b->y - r - side;
    h->wide = h->high = (int)(2.0 * (r + side) / side) + 2;
    h->patches = calloc((size_t)h->wide * h->high, sizeof *h->patches);
}

static inline void close_history(struct history *h)
{
    long i;

    for (i = 0; i < (long)h->wide * h->high; i++)
        free(h->patches[i].chord);
    free(h->patches);
}

static inline double gap(const struct chord *c, double qx, double qy)
{
    double px = qx - c->x, py = qy - c->y, t = c->l2 > 1e-18 ? (px * c->dx + py * c->dy) / c->l2 : 0.0;

    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return hypot(px - t * c->dx, py - t * c->dy);
}

static inline int limited(double value, int top)
{
    return value < 0.0 ? 0 : value > top ? top : (int)value;
}

static inline void remember(struct history *h, int number)
{
    const struct chord *c = h->chords + number;
    double R = c->tool->radius, x1 = c->x + c->dx, y1 = c->y + c->dy;
    int i0, i1, j0, j1, i, j;

    if (c->low >= h->blank->high)
        return;
    if (fmax(c->x, x1) + R < h->x0 || fmin(c->x, x1) - R > h->x0 + h->wide * h->side ||
        fmax(c->y, y1) + R < h->y0 || fmin(c->y, y1) - R > h->y0 + h->high * h->side)
        return;
    i0 = limited((fmin(c->x, x1) - R - h->x0) / h->side, h->wide - 1);
    i1 = limited((fmax(c->x, x1) + R - h->x0) / h->side, h->wide - 1);
    j0 = limited((fmin(c->y, y1) - R - h->y0) / h->side, h->high - 1);
    j1 = limited((fmax(c->y, y1) + R - h->y0) / h->side, h->high - 1);
    for (j = j0; j <= j1; j++) {
        for (i = i0; i <= i1; i++) {
            struct patch *p = h->patches + (long)j * h->wide + i;
            if (gap(c, h->x0 + (i + 0.5) * h->side, h->y0 + (j + 0.5) * h->side) > R + 0.7072 * h->side)
                continue;
            if (p->count == p->room) {
                p->room = p->room ? 2 * p->room : 16;
                p->chord = realloc(p->chord, (size_t)p->room * sizeof *p->chord);
            }
            p->chord[p->count++] = number;
        }
    }
}

/* height of the stock at a point; NONE outside the blank */
static inline double height(struct history *h, double qx, double qy)
{
    const struct patch *p;
    double best = h->blank->high, z;
    int k;

    if (!inside(h->blank, qx, qy))
        return NONE;
    h->asked++;
    if (h->now_end > 0.0) {
        z = swept(h->now, qx, qy, h->now_end, best);
        best = z < best ? z : best;
    }
    p = h->patches + (long)((qy - h->y0) / h->side) * h->wide + (long)((qx - h->x0) / h->side);
    for (k = p->count - 1; k >= 0; k--) {
        const struct chord *c = h->chords + p->chord[k];
        if (c->low >= best)
            continue;
        z = swept(c, qx, qy, 1.0, best);
        best = z < best ? z : best;
    }
    return best;
}

/* --- chords from the ends that judge.py packs ------------------------------------------------- */

static inline int in_air(const struct blank *b, const struct chord *c)
{
    double r = reach(b) + c->tool->radius, u = b->x - c->x, v = b->y - c->y;
    double t = c->l2 > 1e-18 ? (u * c->dx + v * c->dy) / c->l2 : 0.0;

    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return c->low >= b->high || hypot(u - t * c->dx, v - t * c->dy) > r;
}

static inline struct chord *make_chords(long count, const double *ends, const int *tool_of, const struct tool *tools)
{
    struct chord *made = calloc(count ? count : 1, sizeof *made);
    long i;

    for (i = 0; i < count; i++) {
        const double *e = ends + 6 * i;
        struct chord *c = made + i;
        c->x = e[0];
        c->y = e[1];
        c->z = e[2];
        c->dx = e[3] - e[0];
        c->dy = e[4] - e[1];
        c->dz = e[5] - e[2];
        c->low = fmin(e[2], e[5]);
        c->l2 = c->dx * c->dx + c->dy * c->dy;
        c->tool = tools + tool_of[i];
    }
    return made;
}

/* Tools and chords of a run. */
struct run {
    struct tool *tools;
    struct chord *chords;
    double widest;              /* radius of its largest tool */
};

/* sizes: 3 of each tool */
static inline struct run open_run(long tool_count, const double *sizes, long count, const double *ends, const int *tool_of)
{
    struct run r = {calloc(tool_count, sizeof *r.tools), NULL, 0.0};
    long k;

    for (k = 0; k < tool_count; k++) {
        r.tools[k] = make_tool(sizes + 3 * k);
        r.widest = fmax(r.widest, r.tools[k].radius);
    }
    r.chords = make_chords(count, ends, tool_of, r.tools);
    return r;
}

/* The history of a run, with patches that suit its tools. */
static inline void open_history_of(struct history *h, const struct blank *b, const struct run *r)
{
    open_history(h, b, r->chords, fmax(0.3, r->widest / 6.0));
}

static inline void close_run(struct run *r)
{
    free(r->chords);
    free(r->tools);
}

#endif
