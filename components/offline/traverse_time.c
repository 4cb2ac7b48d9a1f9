/* SPDX-License-Identifier: GPL-2.0-or-later */
/* traverse_time.c - see height_sweep.h: chip_traverse_seconds. */
#include "core/chip_math.h"

#include "height_sweep.h"

#define SAME 1e-6     /* mm: a shorter move does not count */
#define ALONG_ARC 0.5 /* of the acceleration, along an arc: as check/times.py */
#define ACROSS 0.75   /* square of the share that is left across it */

/* The moves of a path: a straight one, the arc that rounds the corner after it, a straight one, and so on. */
struct moves {
    long n;
    double length[2 * CHIP_TRAVERSE_POINTS], most[2 * CHIP_TRAVERSE_POINTS], accel[2 * CHIP_TRAVERSE_POINTS];
    double corner[2 * CHIP_TRAVERSE_POINTS], end[2 * CHIP_TRAVERSE_POINTS], seconds[2 * CHIP_TRAVERSE_POINTS];
};

static void add(struct moves *m, double length, double most, double accel)
{
    m->length[m->n] = length;
    m->most[m->n] = most;
    m->accel[m->n] = accel;
    m->corner[m->n++] = 1e9;
}

/* The arc between the last move, of direction u, and one of direction v. It is off the corner by at most `blend`, and its ends
 * by at most half of a move. Returns how much of both moves it is in place of. */
static double round_corner(struct moves *m, const double u[3], const double v[3], double half, double blend,
                           double accel)
{
    double cosine = chip_max(-1.0, chip_min(1.0, u[0] * v[0] + u[1] * v[1] + u[2] * v[2])), turn = acos(cosine);
    double near = chip_max(cos(0.5 * turn), 1e-9), slope = tan(chip_min(0.5 * turn, 1.57)), radius;
    if (turn < 1e-6) {
        add(m, 0.0, 1e9, accel);
        return 0.0;
    }
    radius = chip_min(blend * near / (1.0 - near), half / slope);
    add(m, radius * turn, sqrt(sqrt(ACROSS) * accel * radius), ALONG_ARC * accel);
    return radius * slope;
}

double chip_traverse_seconds(long n, const double (*points)[3], double speed, double accel, double blend)
{
    struct moves m;
    double before[3] = { 0.0, 0.0, 0.0 }, length_before = 0.0, now = 0.0;
    long k;
    int a;
    m.n = 0;
    for (k = 1; k < n && k < CHIP_TRAVERSE_POINTS; k++) {
        double u[3], length = 0.0, most = 0.0, taken = 0.0;
        for (a = 0; a < 3; a++) {
            u[a] = points[k][a] - points[k - 1][a];
            length += u[a] * u[a];
        }
        length = sqrt(length);
        if (length < SAME) continue;
        for (a = 0; a < 3; a++) {
            u[a] /= length;
            most = chip_max(most, fabs(u[a]));
        }
        if (m.n) {
            taken = round_corner(&m, before, u, 0.5 * chip_min(length, length_before), blend, accel);
            m.length[m.n - 2] = chip_max(m.length[m.n - 2] - taken, 0.0);
        }
        add(&m, length - taken, speed / most, accel / most);
        for (a = 0; a < 3; a++) before[a] = u[a];
        length_before = length;
    }
    if (!m.n) return 0.0;
    m.corner[m.n - 1] = 0.0;
    return chip_height_times(m.n, m.length, m.most, m.accel, m.corner, m.end, &now, m.seconds);
}
