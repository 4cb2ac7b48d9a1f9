/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_state.h - what the files of engage.h share. */
#ifndef CHIPWISE_ENGAGE_STATE_H
#define CHIPWISE_ENGAGE_STATE_H

#include "core/chip_math.h"
#include "core/fault.h"
#include "engage.h"

#define CHIP_ENGAGE_WHOLE 0.70711 /* half a diagonal, in squares */

/* A line or an arc, ready to be asked for distances. */
struct chip_engage_segment {
    double ax, ay, bx, by;
    double cx, cy, radius; /* of an arc; radius 0: a line */
    double mx, my, open;   /* unit vector to the middle of the arc, cosine of half its sweep */
    double turn;           /* sweep, with its sign */
};

/* Numbers of segments of a square; count -1: all of it is cleared, or nothing is known yet (walls). */
struct chip_engage_square {
    int32_t *segment;
    int32_t count, room;
};

/* A grid of squares over segments. */
struct chip_engage_grid {
    double x0, y0, size, per_mm;
    long columns, rows;
    struct chip_engage_square *square;
    struct chip_engage_segment *segment;
    long count, room;
};

struct chip_engage_pose {
    double x, y, heading;
};

/* The nearest of the region's border. */
struct chip_engage_foot {
    double depth;  /* positive within */
    double nx, ny; /* unit vector into the region, from the border to the point */
};

#define CHIP_ENGAGE_HALVINGS 9 /* of a part at the end of stock */

/* A half circle in even parts: unit vectors at the angle of a part, of its half, of a quarter ... */
struct chip_engage_fan {
    double turn[CHIP_ENGAGE_HALVINGS + 1][2];
};

struct chip_engage {
    double radius;
    struct chip_engage_fan inner, whole; /* the front half circle but for its ends, and all of it */
    struct chip_engage_grid ground, wall;
    int64_t *next; /* of the walls */
    double asked_x, asked_y;
    struct chip_engage_foot asked; /* of the border, for the place that was asked last */
    int any_asked, failed;
};

struct chip_engage_segment chip_engage_segment_of(const double element[CHIP_ENGAGE_COLUMNS]);
struct chip_engage_segment chip_engage_segment_between(struct chip_engage_pose a, struct chip_engage_pose b);

int chip_engage_grid_make(struct chip_engage_grid *g, const double box[4], double size);
void chip_engage_grid_free(struct chip_engage_grid *g);
int chip_engage_list(struct chip_engage_square *s, long number);

void chip_engage_near(const struct chip_engage_grid *g, const struct chip_engage_segment *p, double reach,
                      long near[4]);

struct chip_engage_foot chip_engage_wall_foot(struct chip_engage *e, double x, double y);

void chip_engage_fans(struct chip_engage *e);
void chip_engage_put(struct chip_engage *e, const struct chip_engage_segment *p);
int chip_engage_uncut(const struct chip_engage *e, double x, double y, double within);
double chip_engage_front(const struct chip_engage *e, struct chip_engage_pose p);
int chip_engage_above(const struct chip_engage *e, struct chip_engage_pose p, double limit); /* of the engagement */
int chip_engage_leftmost(const struct chip_engage *e, struct chip_engage_pose p, double *toward);

/* The two that are asked most are compiled into their callers. */

/* Square of the distance of a point. */
static inline double chip_engage_gap2(const struct chip_engage_segment *p, double x, double y)
{
    double ux = x - p->ax, uy = y - p->ay, wx, wy;
    if (p->radius > 0.0) {
        double vx = x - p->cx, vy = y - p->cy, out = chip_sqrt(vx * vx + vy * vy);
        if (vx * p->mx + vy * p->my >= out * p->open) return (out - p->radius) * (out - p->radius);
        wx = x - p->bx;
        wy = y - p->by;
        return chip_min(ux * ux + uy * uy, wx * wx + wy * wy);
    }
    wx = p->bx - p->ax;
    wy = p->by - p->ay;
    {
        double length2 = wx * wx + wy * wy,
               t = length2 > 0.0 ? chip_clamp((ux * wx + uy * wy) / length2, 0.0, 1.0) : 0.0;
        ux -= t * wx;
        uy -= t * wy;
    }
    return ux * ux + uy * uy;
}

/* Whether the distance of a point is below `within`: without a root. */
static inline int chip_engage_covers(const struct chip_engage_segment *p, double x, double y, double within)
{
    double ux = x - p->ax, uy = y - p->ay, wx = x - p->bx, wy = y - p->by, within2 = within * within, along, length2;
    if (chip_min(ux * ux + uy * uy, wx * wx + wy * wy) < within2) return 1;
    if (p->radius > 0.0) {
        double vx = x - p->cx, vy = y - p->cy, out2 = vx * vx + vy * vy, low = p->radius - within,
               high = p->radius + within;
        if (out2 >= high * high || (low > 0.0 && out2 <= low * low)) return 0;
        along = vx * p->mx + vy * p->my; /* beside the arc: at least out * open */
        if (p->open >= 0.0) return along >= 0.0 && along * along >= out2 * p->open * p->open;
        return along >= 0.0 || along * along <= out2 * p->open * p->open;
    }
    wx = p->bx - p->ax;
    wy = p->by - p->ay;
    along = ux * wx + uy * wy;
    length2 = wx * wx + wy * wy;
    if (along <= 0.0 || along >= length2) return 0;
    ux = ux * wy - uy * wx;
    return ux * ux < within2 * length2;
}

/* The square of a point; 0 outside the grid. */
static inline struct chip_engage_square *chip_engage_square_at(const struct chip_engage_grid *g, double x, double y)
{
    double i = (x - g->x0) * g->per_mm, j = (y - g->y0) * g->per_mm;
    if (!(i >= 0.0 && j >= 0.0 && i < g->columns && j < g->rows)) return 0;
    return &g->square[(long)j * g->columns + (long)i];
}

#define CHIP_ENGAGE_SLACK 0.0005 /* share of the radius that cleared ground is asked smaller by */

#endif
