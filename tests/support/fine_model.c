/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fine_model.c - the section area along a logged path, exact up to the path's own resolution.
 *
 * Who calls it: bench/bench_time.py through ctypes (built as build/tests/support/fine_model.so).
 * It shares nothing with components/core: no map, no cells, no bands.
 *
 * Principle, for flat end mills:
 *  1. The stock is the box less what the tool's own earlier path has covered. The path is kept as
 *     straight segments that leave the path by less than CHORD; the height over a point is the
 *     lowest tip of any segment that comes within the tool's radius of it.
 *  2. The area of a step is the integral over the width of the tool of the stock's height above
 *     the tip just outside the front half of its outline, by halving where the height jumps, and
 *     of what a falling tool meets below itself.
 * All lengths mm.
 */
#include <math.h>
#include <stdlib.h>

#define CHORD 0.0005            /* mm, a segment may leave the path by */
#define PENDING 400             /* places in a segment at most */
#define PARTS 32                /* of the width, before halving */
#define HALVINGS 11
#define RINGS 6                 /* below a falling tool */
#define SPOKES 48
#define NEARLY 1e-7             /* mm, outside the tool all the same */

struct segment { double a[3], d[3], length2; };

struct model {
    double radius, low[3], high[3];
    struct segment *path;
    long used, room;
    int *near, nears;           /* segments that may matter at `centre` */
    double centre[2], slack;
    double place[PENDING][3];   /* of the segment that grows */
    int places;
    struct segment last;        /* the same as a segment */
    int has_last;
};

static struct segment make_segment(const double a[3], const double b[3])
{
    struct segment s;
    int i;
    for (i = 0; i < 3; i++) { s.a[i] = a[i]; s.d[i] = b[i] - a[i]; }
    s.length2 = s.d[0] * s.d[0] + s.d[1] * s.d[1];
    return s;
}

/* Distance^2 in plan from the segment; *t: the nearest place. */
static double distance2(const struct segment *s, double x, double y, double *t)
{
    double px = x - s->a[0], py = y - s->a[1], u = 0.0;
    if (s->length2 > 0.0) {
        u = (px * s->d[0] + py * s->d[1]) / s->length2;
        u = u < 0.0 ? 0.0 : (u > 1.0 ? 1.0 : u);
    }
    *t = u;
    px -= u * s->d[0];
    py -= u * s->d[1];
    return px * px + py * py;
}

/* Lowest tip of the segment that covers the point, or 1e30. */
static double lowest(const struct segment *s, double radius, double x, double y)
{
    double t, r2 = (radius - NEARLY) * (radius - NEARLY), d2 = distance2(s, x, y, &t), lo, hi, half;
    if (d2 >= r2) return 1e30;
    if (s->d[2] == 0.0) return s->a[2];
    if (s->length2 <= 0.0) return s->d[2] < 0.0 ? s->a[2] + s->d[2] : s->a[2];
    {   /* the part of the segment from which the disc covers the point */
        double along = ((x - s->a[0]) * s->d[0] + (y - s->a[1]) * s->d[1]) / s->length2;
        double ox = x - s->a[0] - along * s->d[0], oy = y - s->a[1] - along * s->d[1];
        half = sqrt(fmax(0.0, r2 - ox * ox - oy * oy) / s->length2);
        lo = fmax(0.0, along - half);
        hi = fmin(1.0, along + half);
    }
    return s->a[2] + s->d[2] * (s->d[2] < 0.0 ? hi : lo);
}

static double height(const struct model *m, double x, double y)
{
    double z = m->high[2], h;
    int i;
    if (x < m->low[0] || x > m->high[0] || y < m->low[1] || y > m->high[1]) return m->low[2];
    for (i = 0; i < m->nears; i++) {
        h = lowest(&m->path[m->near[i]], m->radius, x, y);
        if (h < z) z = h;
    }
    if (m->has_last && (h = lowest(&m->last, m->radius, x, y)) < z) z = h;
    return z > m->low[2] ? z : m->low[2];
}

static void add_segment(struct model *m, struct segment s)
{
    double t;
    if (fmin(s.a[2], s.a[2] + s.d[2]) >= m->high[2]) return;
    if (m->used == m->room) {
        m->room *= 2;
        m->path = realloc(m->path, m->room * sizeof *m->path);
        m->near = realloc(m->near, m->room * sizeof *m->near);
    }
    m->path[m->used] = s;
    if (sqrt(distance2(&s, m->centre[0], m->centre[1], &t)) < 2.0 * m->radius + m->slack)
        m->near[m->nears++] = (int)m->used;
    m->used++;
}

/* Whether the places of the growing segment and `p` are one straight, evenly falling line. */
static int straight(const struct model *m, const double p[3])
{
    const double *a = m->place[0];
    double d[3], l2 = 0.0;
    int i, k;
    for (k = 0; k < 3; k++) { d[k] = p[k] - a[k]; l2 += d[k] * d[k]; }
    if (m->places == PENDING || l2 <= 0.0) return m->places < PENDING;
    for (i = 1; i < m->places; i++) {
        double t = 0.0, off2 = 0.0, e;
        for (k = 0; k < 3; k++) t += (m->place[i][k] - a[k]) * d[k] / l2;
        if (t < -1e-9 || t > 1.0 + 1e-9) return 0;
        for (k = 0; k < 3; k++) { e = m->place[i][k] - a[k] - t * d[k]; off2 += e * e; }
        if (off2 > CHORD * CHORD) return 0;
    }
    return 1;
}

/* The tool has come to p. */
static void go(struct model *m, const double p[3])
{
    int k;
    if (m->places && !straight(m, p)) {
        double last[3];
        for (k = 0; k < 3; k++) last[k] = m->place[m->places - 1][k];
        add_segment(m, m->last);
        for (k = 0; k < 3; k++) m->place[0][k] = last[k];
        m->places = 1;
    }
    for (k = 0; k < 3; k++) m->place[m->places][k] = p[k];
    m->places++;
    m->last = make_segment(m->place[0], p);
    m->has_last = fmin(m->place[0][2], p[2]) < m->high[2];
}

static void gather(struct model *m, const double p[3])
{
    double t, reach = 2.0 * m->radius + m->slack;
    long i;
    if (hypot(p[0] - m->centre[0], p[1] - m->centre[1]) < m->slack - 1e-6 && m->nears >= 0) return;
    m->centre[0] = p[0];
    m->centre[1] = p[1];
    m->nears = 0;
    for (i = 0; i < m->used; i++)
        if (distance2(&m->path[i], p[0], p[1], &t) < reach * reach) m->near[m->nears++] = (int)i;
}

struct front { const struct model *m; double x, y, hx, hy, ahead, z; };

static double above(const struct front *f, double side)
{
    double r = f->m->radius, w = sqrt(fmax(0.0, r * r - side * side)) + f->ahead;
    double h = height(f->m, f->x + w * f->hx - side * f->hy, f->y + w * f->hy + side * f->hx) - f->z;
    return h > 0.0 ? h : 0.0;
}

static double integral(const struct front *f, double u0, double u1, double h0, double h1, int depth)
{
    double mid, h;
    if (fabs(h1 - h0) < 1e-4) return 0.5 * (h0 + h1) * (u1 - u0);
    if (depth == 0) return 0.5 * (h0 + h1) * (u1 - u0);
    mid = 0.5 * (u0 + u1);
    h = above(f, mid);
    if (fabs(h - 0.5 * (h0 + h1)) < 1e-5) return 0.5 * (h0 + h1) * (u1 - u0);
    return integral(f, u0, mid, h0, h, depth - 1) + integral(f, mid, u1, h, h1, depth - 1);
}

/* Volume per mm of the step from p to q. */
static double step_area(const struct model *m, const double p[3], const double q[3])
{
    double d[3], length, level, sum = 0.0, last;
    struct front f;
    int i, k;
    for (k = 0; k < 3; k++) d[k] = q[k] - p[k];
    length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (length <= 0.0 || fmin(p[2], q[2]) >= m->high[2]) return 0.0;
    level = hypot(d[0], d[1]);
    if (level > 1e-9) {
        f.m = m; f.x = p[0]; f.y = p[1]; f.z = fmax(m->low[2], 0.5 * (p[2] + q[2]));
        f.hx = d[0] / level; f.hy = d[1] / level;
        f.ahead = 0.5 * level;
        last = above(&f, -m->radius);
        for (i = 1; i <= PARTS; i++) {
            double u0 = -m->radius * cos(M_PI * (i - 1) / PARTS), u1 = -m->radius * cos(M_PI * i / PARTS);
            double h = above(&f, u1);
            sum += integral(&f, u0, u1, last, h, HALVINGS);
            last = h;
        }
        sum *= level / length;
    }
    if (d[2] < 0.0) {
        double weight = M_PI * m->radius * m->radius / (RINGS * SPOKES), under = 0.0;
        for (i = 0; i < RINGS; i++)
            for (k = 0; k < SPOKES; k++) {
                double r = m->radius * sqrt((i + 0.5) / RINGS), a = 2.0 * M_PI * (k + 0.5 * (i & 1)) / SPOKES;
                double h = height(m, p[0] + r * cos(a), p[1] + r * sin(a)) - fmax(m->low[2], q[2]);
                if (h > 0.0) under += fmin(h, -d[2]);
            }
        sum += under * weight / length;
    }
    return sum;
}

/* area[i]: mm2, of the step from tip[i] to tip[i + 1], for i = 0 .. n - 2; wanted[i] == 0: not asked
 * for (0 then), only driven. */
void fine_areas(double radius, const double low[3], const double high[3], const double *tip,
                const unsigned char *wanted, long n, double *area)
{
    struct model m;
    long i;
    int k;
    m.radius = radius;
    for (k = 0; k < 3; k++) { m.low[k] = low[k]; m.high[k] = high[k]; }
    m.used = 0;
    m.room = 1024;
    m.path = malloc(m.room * sizeof *m.path);
    m.near = malloc(m.room * sizeof *m.near);
    m.nears = m.places = m.has_last = 0;
    m.slack = 0.5 * radius;
    m.centre[0] = m.centre[1] = 1e9;
    for (i = 0; i + 1 < n; i++) {
        const double *p = tip + 3 * i;
        gather(&m, p);
        go(&m, p);
        area[i] = wanted[i] ? step_area(&m, p, p + 3) : 0.0;
    }
    free(m.path);
    free(m.near);
}
