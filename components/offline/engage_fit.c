/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_fit.c - see engage.h: pairs of arcs through poses (biarcs: K. M. Bolton, "Biarc curves", 1975).
 *
 * Between two poses a pair of arcs with equal tangent lengths d: |v|^2 - 2 d v.(t1 + t2) + 2 d^2 (t1.t2 - 1) = 0, v the
 * chord. How far a pair reaches is found by doubling and halving. */
#include <string.h>

#include "engage_state.h"

#define MOST_TURN 2.5   /* rad of the poses that a pair spans */
#define MOST_RADIUS 2e4 /* mm: what is flatter is a line */
#define NARROW 1e-9
#define SHORT_MM 0.005 /* a shorter arc is a line: with its ends rounded to one place it would be a full circle */

struct vec {
    double x, y;
};

/* The arc from a, along the unit vector t, to b. */
static void arc_of(struct vec a, struct vec t, struct vec b, double v[CHIP_ENGAGE_COLUMNS])
{
    double cx = b.x - a.x, cy = b.y - a.y, along = cx * t.x + cy * t.y, left = t.x * cy - t.y * cx;
    double chord2 = cx * cx + cy * cy, radius;
    v[0] = a.x;
    v[1] = a.y;
    v[2] = b.x;
    v[3] = b.y;
    v[4] = v[5] = v[6] = 0.0;
    if (chord2 < SHORT_MM * SHORT_MM || fabs(left) < NARROW * chip_sqrt(chord2)
        || (radius = 0.5 * chord2 / left, fabs(radius) > MOST_RADIUS))
        return;
    v[4] = a.x - radius * t.y;
    v[5] = a.y + radius * t.x;
    v[6] = 2.0 * atan2(left, along);
}

/* The pair of arcs from pose a to pose b; 0 if there is none. */
static int pair_of(const double a[3], const double b[3], double v[2][CHIP_ENGAGE_COLUMNS])
{
    struct vec p = { a[0], a[1] }, q = { b[0], b[1] }, s = { cos(a[2]), sin(a[2]) }, t = { cos(b[2]), sin(b[2]) };
    double cx = q.x - p.x, cy = q.y - p.y, chord2 = cx * cx + cy * cy;
    double sum = cx * (s.x + t.x) + cy * (s.y + t.y), less = 2.0 * (1.0 - (s.x * t.x + s.y * t.y)), d;
    struct vec joint, middle;
    double size;
    if (chord2 < NARROW * NARROW || (less < 1e-12 && sum <= 0.0)) return 0;
    d = less < 1e-12 ? 0.5 * chord2 / sum : chord2 / (sum + chip_sqrt(sum * sum + less * chord2));
    joint.x = 0.5 * (p.x + q.x + d * (s.x - t.x));
    joint.y = 0.5 * (p.y + q.y + d * (s.y - t.y));
    middle.x = q.x - d * t.x - p.x - d * s.x;
    middle.y = q.y - d * t.y - p.y - d * s.y;
    size = hypot(middle.x, middle.y);
    if (!(d > 0.0) || size < NARROW) return 0;
    middle.x /= size;
    middle.y /= size;
    arc_of(p, s, joint, v[0]);
    arc_of(joint, middle, q, v[1]);
    return fabs(v[0][6]) < CHIP_PI && fabs(v[1][6]) < CHIP_PI;
}

static double apart(const struct chip_engage_segment *first, const struct chip_engage_segment *second, double x,
                    double y)
{
    return chip_sqrt(chip_min(chip_engage_gap2(first, x, y), chip_engage_gap2(second, x, y)));
}

/* Of the middle of the arc between two poses. */
static double half_apart(const struct chip_engage_segment *first, const struct chip_engage_segment *second,
                         const double a[3], const double b[3])
{
    double turn = remainder(b[2] - a[2], 2.0 * CHIP_PI), high = 0.5 * tan(0.25 * turn); /* over the chord, in chords */
    double x = 0.5 * (a[0] + b[0]) + high * (b[1] - a[1]), y = 0.5 * (a[1] + b[1]) - high * (b[0] - a[0]);
    return apart(first, second, x, y);
}

/* Whether the pair from pose i to pose j is within `within` of those between. */
static int reaches(const double (*pose)[3], long i, long j, double within, double v[2][CHIP_ENGAGE_COLUMNS])
{
    struct chip_engage_segment first, second;
    long k;
    double turned = 0.0;
    if (!pair_of(pose[i], pose[j], v)) return 0;
    first = chip_engage_segment_of(v[0]);
    second = chip_engage_segment_of(v[1]);
    for (k = i; k < j; k++) turned += fabs(remainder(pose[k + 1][2] - pose[k][2], 2.0 * CHIP_PI));
    if (turned > MOST_TURN) return 0;
    for (k = i; k < j; k++)
        if ((k > i && apart(&first, &second, pose[k][0], pose[k][1]) > within)
            || half_apart(&first, &second, pose[k], pose[k + 1]) > within)
            return 0;
    return 1;
}

/* A pair whose arcs are one is one element. */
static long written(double v[2][CHIP_ENGAGE_COLUMNS], double (*element)[CHIP_ENGAGE_COLUMNS])
{
    int lines = v[0][6] == 0.0 && v[1][6] == 0.0;
    int one = v[0][6] * v[1][6] > 0.0 && hypot(v[0][4] - v[1][4], v[0][5] - v[1][5]) < 1e-6;
    memcpy(element[0], v[0], sizeof v[0]);
    if (lines || one) {
        element[0][2] = v[1][2];
        element[0][3] = v[1][3];
        element[0][6] = v[0][6] + v[1][6];
        return 1;
    }
    memcpy(element[1], v[1], sizeof v[1]);
    return 2;
}

/* The furthest pose that a pair from i reaches, and the pair. */
static long furthest(long n, const double (*pose)[3], long i, double within, double best[2][CHIP_ENGAGE_COLUMNS])
{
    double v[2][CHIP_ENGAGE_COLUMNS];
    long far = i + 1, stride = 1, low, high;
    if (!pair_of(pose[i], pose[far], best)) {
        arc_of((struct vec){ pose[i][0], pose[i][1] },
               (struct vec){ pose[far][0] - pose[i][0], pose[far][1] - pose[i][1] },
               (struct vec){ pose[far][0], pose[far][1] }, best[0]);
        memcpy(best[1], best[0], sizeof best[0]);
        best[1][0] = best[0][2];
        best[1][1] = best[0][3];
        return far;
    }
    while (far + stride < n && reaches(pose, i, far + stride, within, v)) {
        far += stride;
        stride *= 2;
        memcpy(best, v, sizeof v);
    }
    for (low = far, high = far + stride < n ? far + stride : n; high - low > 1;) {
        long middle = (low + high) / 2;
        if (reaches(pose, i, middle, within, v)) {
            low = middle;
            memcpy(best, v, sizeof v);
        } else {
            high = middle;
        }
    }
    return low;
}

long chip_engage_fit(long n, const double (*pose)[3], double within, double (*element)[CHIP_ENGAGE_COLUMNS])
{
    double v[2][CHIP_ENGAGE_COLUMNS];
    long i = 0, count = 0;
    CHIP_FAULT(FIT_WIDE, within *= 100.0)
    while (i + 1 < n) {
        i = furthest(n, pose, i, within, v);
        count += written(v, element + count);
    }
    return count;
}
