/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_wall.c - see engage.h: opening, and how deep in the region a place is. */
#include <stdlib.h>
#include <string.h>

#include "engage_state.h"

#define MOST_SQUARES 4e6
#define SAME_MM 1e-9 /* two feet as near as that are one corner */
#define TIE_MM 1e-7  /* two segments as near as that have to agree */
#define CUSP 0.2     /* sum of two unit normals of a corner that all but turns back */
#define PARTS 4      /* of an arc: none is more than a quarter */

static void frame(long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double box[4])
{
    long k;
    int end;
    box[0] = box[1] = 1e30;
    box[2] = box[3] = -1e30;
    for (k = 0; k < n; k++) {
        double bulge = element[k][6] != 0.0 ? hypot(element[k][0] - element[k][4], element[k][1] - element[k][5])
                                                  * (1.0 - cos(chip_min(0.5 * fabs(element[k][6]), CHIP_PI)))
                                            : 0.0;
        for (end = 0; end < 2; end++) {
            double x = element[k][2 * end], y = element[k][2 * end + 1];
            box[0] = chip_min(box[0], x - bulge);
            box[1] = chip_min(box[1], y - bulge);
            box[2] = chip_max(box[2], x + bulge);
            box[3] = chip_max(box[3], y + bulge);
        }
    }
}

struct chip_engage *chip_engage_open(long n, const double (*element)[CHIP_ENGAGE_COLUMNS], const int64_t *next,
                                     double radius, double size)
{
    struct chip_engage *e = calloc(1, sizeof *e);
    double box[4];
    long k;
    if (!e) return 0;
    frame(n, element, box);
    e->radius = radius;
    chip_engage_fans(e);
    for (k = 0; k < 2; k++) {
        box[k] -= 2.0 * radius;
        box[k + 2] += 2.0 * radius;
    }
    size = chip_max(size, chip_sqrt((box[2] - box[0]) * (box[3] - box[1]) / MOST_SQUARES));
    e->next = malloc(sizeof *e->next * (size_t)(n + 1));
    e->wall.segment = malloc(sizeof *e->wall.segment * (size_t)(n + 1));
    if (!e->next || !e->wall.segment || chip_engage_grid_make(&e->ground, box, size)
        || chip_engage_grid_make(&e->wall, box, 2.0 * size)) {
        chip_engage_close(e);
        return 0;
    }
    memcpy(e->next, next, sizeof *next * (size_t)n);
    for (k = 0; k < n; k++) e->wall.segment[k] = chip_engage_segment_of(element[k]);
    e->wall.count = n;
    return e;
}

void chip_engage_close(struct chip_engage *e)
{
    if (!e) return;
    chip_engage_grid_free(&e->ground);
    chip_engage_grid_free(&e->wall);
    free(e->next);
    free(e);
}

int chip_engage_failed(const struct chip_engage *e) { return e->failed; }

/* The segments of which one may be the nearest to a point of a square: found when it is first asked. */
static void fill(struct chip_engage *e, struct chip_engage_square *s)
{
    struct chip_engage_grid *g = &e->wall;
    long number = s - g->square, k;
    double x = g->x0 + ((double)(number % g->columns) + 0.5) * g->size;
    double y = g->y0 + ((double)(number / g->columns) + 0.5) * g->size, least = 1e60;
    for (k = 0; k < g->count; k++) least = chip_min(least, chip_engage_gap2(&g->segment[k], x, y));
    least = chip_sqrt(least) + 2.0 * CHIP_ENGAGE_WHOLE * g->size + 1e-9;
    for (k = 0; k < g->count; k++)
        if (chip_engage_gap2(&g->segment[k], x, y) <= least * least && chip_engage_list(s, k)) e->failed = 1;
}

/* The left normal of a segment at its start, its end, or towards a point beside it. */
static void normal_at(const struct chip_engage_segment *p, double x, double y, double n[2])
{
    double size;
    if (p->radius > 0.0) {
        double sign = p->turn > 0.0 ? -1.0 : 1.0;
        n[0] = sign * (x - p->cx);
        n[1] = sign * (y - p->cy);
    } else {
        n[0] = -(p->by - p->ay);
        n[1] = p->bx - p->ax;
    }
    size = hypot(n[0], n[1]);
    if (size > 0.0) {
        n[0] /= size;
        n[1] /= size;
    }
}

/* The sum of the left normals of the two segments at an end of one: which side of a corner is the region. */
static void corner(const struct chip_engage *e, const struct chip_engage_segment *p, int at_end, double n[2])
{
    long k = p - e->wall.segment, other;
    double second[2], x = at_end ? p->bx : p->ax, y = at_end ? p->by : p->ay;
    if (at_end) {
        other = e->next[k];
    } else {
        for (other = 0; other < e->wall.count && e->next[other] != k; other++) continue;
        if (other == e->wall.count) other = k;
    }
    normal_at(p, x, y, n);
    normal_at(&e->wall.segment[other], x, y, second);
    n[0] += second[0];
    n[1] += second[1];
}

/* Whether an end of a segment is as near to a point as the segment, `least` away; how far both ends are then. */
static int end_as_near(const struct chip_engage_segment *p, double x, double y, double least, double *to_start,
                       double *to_end)
{
    double ax = x - p->ax, ay = y - p->ay, bx = x - p->bx, by = y - p->by, most = least + 2.0 * SAME_MM;
    if (chip_min(ax * ax + ay * ay, bx * bx + by * by) > most * most * (1.0 + 1e-12))
        return 0; /* mostly: no root is needed */
    *to_start = hypot(ax, ay);
    *to_end = hypot(bx, by);
    return chip_min(*to_start, *to_end) <= least + SAME_MM;
}

/* How deep a point is by one of the nearest segments, `least` away; whether that is no more than a guess. */
static struct chip_engage_foot beside(const struct chip_engage *e, const struct chip_engage_segment *p, double x,
                                      double y, double least, int *guess)
{
    struct chip_engage_foot found;
    double n[2], to_start, to_end;
    if (least > SAME_MM && end_as_near(p, x, y, least, &to_start, &to_end)) {
        int at_end = to_end < to_start;
        double ox = x - (at_end ? p->bx : p->ax), oy = y - (at_end ? p->by : p->ay), side;
        corner(e, p, at_end, n);
        if (hypot(n[0], n[1]) < CUSP) *guess = 1;
        side = ox * n[0] + oy * n[1] >= 0.0 ? 1.0 : -1.0;
        found = (struct chip_engage_foot){ side * least, side * ox / least, side * oy / least };
        return found;
    }
    normal_at(p, x, y, n);
    found = (struct chip_engage_foot){ 0.0, n[0], n[1] };
    if (p->radius > 0.0)
        found.depth = (hypot(x - p->cx, y - p->cy) - p->radius) * (p->turn > 0.0 ? -1.0 : 1.0);
    else
        found.depth = (x - p->ax) * n[0] + (y - p->ay) * n[1];
    return found;
}

/* Angle by which a point sees a segment go round it. */
static double seen(const struct chip_engage_segment *p, double x, double y)
{
    double ax = p->ax - x, ay = p->ay - y, bx, by, sum = 0.0;
    int parts = p->radius > 0.0 ? PARTS : 1, k;
    for (k = 1; k <= parts; k++, ax = bx, ay = by) {
        double t = (double)k / parts, angle = atan2(p->ay - p->cy, p->ax - p->cx) + t * p->turn, chord;
        bx = k == parts ? p->bx - x : p->cx + p->radius * cos(angle) - x;
        by = k == parts ? p->by - y : p->cy + p->radius * sin(angle) - y;
        chord = ax * by - ay * bx; /* positive: the chord has the point on its left */
        sum += atan2(chord, ax * bx + ay * by);
        if (p->radius > 0.0 && chord * p->turn < 0.0 && hypot(x - p->cx, y - p->cy) < p->radius)
            sum += p->turn > 0.0 ? 2.0 * CHIP_PI : -2.0 * CHIP_PI;
    }
    return sum;
}

/* Whether the contours go once round a point. */
static int within(const struct chip_engage *e, double x, double y)
{
    double sum = 0.0;
    long k;
    for (k = 0; k < e->wall.count; k++) sum += seen(&e->wall.segment[k], x, y);
    return sum > CHIP_PI;
}

/* The nearest place of the border, and on which side of it a point is: where the nearest segments do not agree, all are asked. */
static struct chip_engage_foot foot_of(struct chip_engage *e, double x, double y)
{
    struct chip_engage_square *s = chip_engage_square_at(&e->wall, x, y);
    struct chip_engage_foot found = { -1e3, 0.0, 0.0 };
    const struct chip_engage_segment *nearest = 0;
    double least = 1e60;
    int guess = 0;
    int32_t k;
    if (!s) return found;
    if (!s->count) fill(e, s);
    for (k = 0; k < s->count; k++) {
        const struct chip_engage_segment *p = &e->wall.segment[s->segment[k]];
        double gap2 = chip_engage_gap2(p, x, y);
        if (gap2 < least) {
            least = gap2;
            nearest = p;
        }
    }
    if (!nearest) return found;
    least = chip_sqrt(least);
    found = beside(e, nearest, x, y, least, &guess);
    for (k = 0; k < s->count && !guess && least > SAME_MM; k++) {
        const struct chip_engage_segment *p = &e->wall.segment[s->segment[k]];
        double other = least + TIE_MM;
        if (p != nearest && chip_engage_gap2(p, x, y) < other * other
            && beside(e, p, x, y, least, &guess).depth * found.depth < 0.0)
            guess = 1;
    }
    if (guess && within(e, x, y) != (found.depth > 0.0))
        found = (struct chip_engage_foot){ -found.depth, -found.nx, -found.ny };
    return found;
}

struct chip_engage_foot chip_engage_wall_foot(struct chip_engage *e, double x, double y)
{
    if (e->any_asked && x == e->asked_x && y == e->asked_y) return e->asked;
    e->asked = foot_of(e, x, y);
    e->asked_x = x;
    e->asked_y = y;
    e->any_asked = 1;
    return e->asked;
}

void chip_engage_depth(struct chip_engage *e, long n, const double (*point)[2], double *depth)
{
    long k;
    for (k = 0; k < n; k++) depth[k] = chip_engage_wall_foot(e, point[k][0], point[k][1]).depth;
}

/* Whether an element stays within the region. */
static int stays_inside(struct chip_engage *e, const double v[CHIP_ENGAGE_COLUMNS], double slack, double stride)
{
    double radius = v[6] != 0.0 ? hypot(v[0] - v[4], v[1] - v[5]) : 0.0;
    double length = v[6] != 0.0 ? radius * fabs(v[6]) : hypot(v[2] - v[0], v[3] - v[1]);
    double first = v[6] != 0.0 ? atan2(v[1] - v[5], v[0] - v[4]) : 0.0, done = 0.0;
    for (;;) {
        double t = chip_min(done / chip_max(length, 1e-12), 1.0), angle = first + t * v[6], depth;
        double x = v[6] != 0.0 ? v[4] + radius * cos(angle) : v[0] + t * (v[2] - v[0]);
        double y = v[6] != 0.0 ? v[5] + radius * sin(angle) : v[1] + t * (v[3] - v[1]);
        depth = chip_engage_wall_foot(e, x, y).depth;
        if (depth < -slack) return 0;
        if (done >= length) return 1;
        done += chip_max(depth, stride);
    }
}

int chip_engage_inside(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double slack,
                       double stride)
{
    long k;
    for (k = 0; k < n; k++)
        if (!stays_inside(e, element[k], slack, stride)) return 0;
    return 1;
}
