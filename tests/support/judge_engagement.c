/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge of engagement: exact, from the path alone.
 *
 * Called by tests/support/engagement_judge.py.  Nothing of the product is in it.
 *
 *  1. The tool is a disc of radius r.  What it has cleared is all within r of the path so far: lines and arcs, and of the one
 *     it is on the part behind it.
 *  2. A place of its circle is cleared by a piece if it is nearer to it than r.  Where that begins or ends along the circle, the
 *     circle crosses the border of what the piece clears: discs of radius r about its two ends, and for a line the two lines
 *     at r beside it, for an arc the two circles of radius R + r and |R - r|.
 *  3. So the crossings are found in closed form and sorted; between two of them one place tells.  The covered parts of
 *     all pieces are joined; what is left of the front half is the engagement.
 *
 * Units: mm, rad.
 */
#include <math.h>
#include <stdlib.h>

#define MOST_CROSSINGS 16
#define TAU (2.0 * M_PI)
#define SKIN 1e-7 /* mm: the tool's own circle is at r from where it stands */

struct piece {
    double ax, ay, bx, by, cx, cy, sweep;
};

struct part {
    double from, to;
};

static double radius_of(const struct piece *p) { return hypot(p->ax - p->cx, p->ay - p->cy); }

static double length_of(const struct piece *p)
{
    return p->sweep != 0.0 ? radius_of(p) * fabs(p->sweep) : hypot(p->bx - p->ax, p->by - p->ay);
}

static double gap_of(const struct piece *p, double x, double y)
{
    double from_ends = fmin(hypot(x - p->ax, y - p->ay), hypot(x - p->bx, y - p->by));
    if (p->sweep != 0.0) {
        double turn = atan2(y - p->cy, x - p->cx) - atan2(p->ay - p->cy, p->ax - p->cx);
        turn = p->sweep > 0.0 ? turn : -turn;
        turn -= TAU * floor(turn / TAU);
        return turn <= fabs(p->sweep) ? fabs(hypot(x - p->cx, y - p->cy) - radius_of(p)) : from_ends;
    } else {
        double dx = p->bx - p->ax, dy = p->by - p->ay, length2 = dx * dx + dy * dy, t;
        if (length2 <= 0.0) return from_ends;
        t = ((x - p->ax) * dx + (y - p->ay) * dy) / length2;
        return t < 0.0 || t > 1.0 ? from_ends : fabs((x - p->ax) * dy - (y - p->ay) * dx) / sqrt(length2);
    }
}

/* The first part of a piece, up to the share t of it. */
static struct piece cut_at(struct piece p, double t)
{
    if (p.sweep != 0.0) {
        double angle = atan2(p.ay - p.cy, p.ax - p.cx) + t * p.sweep, r = radius_of(&p);
        p.bx = p.cx + r * cos(angle);
        p.by = p.cy + r * sin(angle);
        p.sweep *= t;
    } else {
        p.bx = p.ax + t * (p.bx - p.ax);
        p.by = p.ay + t * (p.by - p.ay);
    }
    return p;
}

/* Angles at which the circle about (x, y) of radius r crosses one about (cx, cy) of radius R. */
static int cross_circle(double x, double y, double r, double cx, double cy, double big, double *angle)
{
    double d = hypot(cx - x, cy - y), c, middle;
    if (d < 1e-12 || d > r + big || d < fabs(r - big)) return 0;
    c = fmax(-1.0, fmin(1.0, (d * d + r * r - big * big) / (2.0 * d * r)));
    middle = atan2(cy - y, cx - x);
    angle[0] = middle - acos(c);
    angle[1] = middle + acos(c);
    return 2;
}

static int crossings(const struct piece *p, double x, double y, double r, double *angle)
{
    int n = cross_circle(x, y, r, p->ax, p->ay, r, angle), side;
    n += cross_circle(x, y, r, p->bx, p->by, r, angle + n);
    if (p->sweep != 0.0) {
        n += cross_circle(x, y, r, p->cx, p->cy, radius_of(p) + r, angle + n);
        n += cross_circle(x, y, r, p->cx, p->cy, fabs(radius_of(p) - r), angle + n);
    } else if (length_of(p) > 0.0) {
        double l = length_of(p), nx = -(p->by - p->ay) / l, ny = (p->bx - p->ax) / l, off = (x - p->ax) * nx + (y - p->ay) * ny;
        for (side = -1; side <= 1; side += 2) {
            double c = (side * r - off) / r;
            if (fabs(c) > 1.0) continue;
            angle[n++] = atan2(ny, nx) - acos(c);
            angle[n++] = atan2(ny, nx) + acos(c);
        }
    }
    return n;
}

static int by_value(const void *a, const void *b)
{
    double d = *(const double *)a - *(const double *)b;
    return d < 0.0 ? -1 : d > 0.0;
}

/* The parts of the angles from 0 to half a turn, counted from `first`, that a piece covers. */
static int covered(const struct piece *p, double x, double y, double r, double first, struct part *part)
{
    double at[MOST_CROSSINGS + 2], raw[MOST_CROSSINGS];
    int n = crossings(p, x, y, r, raw), k, m = 0, count = 0;
    at[m++] = 0.0;
    for (k = 0; k < n; k++) {
        double angle = raw[k] - first;
        angle -= TAU * floor(angle / TAU);
        if (angle > 0.0 && angle < M_PI) at[m++] = angle;
    }
    at[m++] = M_PI;
    qsort(at, (size_t)m, sizeof *at, by_value);
    for (k = 0; k + 1 < m; k++) {
        double middle = first + 0.5 * (at[k] + at[k + 1]);
        if (at[k + 1] > at[k] && gap_of(p, x + r * cos(middle), y + r * sin(middle)) < r - SKIN) part[count++] = (struct part){ at[k], at[k + 1] };
    }
    return count;
}

/* How much of half a turn no part covers [3]. */
static double uncovered(struct part *part, int n)
{
    double reached = 0.0, open = 0.0;
    int k;
    qsort(part, (size_t)n, sizeof *part, by_value);
    for (k = 0; k < n; k++) {
        if (part[k].from > reached) open += part[k].from - reached;
        reached = fmax(reached, part[k].to);
    }
    return open + (M_PI - fmin(reached, M_PI));
}

/* Engagement before every `spacing` of those of n pieces (7 columns) that are asked for. Rows: piece, x, y, heading, engagement, length;
 * returns their number, -1 without memory. */
long judge_engagement(long n, const struct piece *piece, const unsigned char *asked, double r, double spacing, double (*out)[6], long room)
{
    struct part *part = malloc(sizeof *part * (size_t)(n + 1) * MOST_CROSSINGS);
    long k, h, rows = 0, step;
    if (!part) return -1;
    for (k = 0; k < n; k++) {
        double length = length_of(&piece[k]);
        long steps = asked[k] ? (long)ceil(length / spacing) : 0;
        for (step = 0; step < steps && rows < room; step++) {
            double t = ((double)step + 0.5) / (double)steps;
            struct piece own = cut_at(piece[k], t);
            double x = own.bx, y = own.by, heading = atan2(piece[k].by - piece[k].ay, piece[k].bx - piece[k].ax), first;
            int parts = 0;
            if (own.sweep != 0.0) heading = atan2(y - own.cy, x - own.cx) + copysign(0.5 * M_PI, own.sweep);
            first = heading - 0.5 * M_PI;
            for (h = 0; h <= k; h++) {
                const struct piece *p = h == k ? &own : &piece[h];
                double reach = 2.0 * r + length_of(p);
                if (fabs(p->ax - x) < reach && fabs(p->ay - y) < reach && gap_of(p, x, y) < 2.0 * r)
                    parts += covered(p, x, y, r, first, part + parts);
            }
            double row[6] = { (double)k, x, y, heading, uncovered(part, parts), length / (double)steps };
            for (h = 0; h < 6; h++) out[rows][h] = row[h];
            rows++;
        }
    }
    free(part);
    return rows;
}
