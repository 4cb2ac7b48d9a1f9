/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_swept.c - see engage.h: whether all that the tool sweeps is cleared.
 *
 * Squares are divided until one segment of the cleared ground holds a square, or the sweep does not touch it, or it is as
 * small as what is not to be seen: then its middle decides. */
#include "engage_state.h"

#define SKIN_MM 0.002 /* at the edge of what the tool reaches: is not looked at */

struct sweep {
    struct chip_engage *e;
    struct chip_engage_segment segment;
    double reach, fine;
};

/* Whether all of a square (middle, half a side) that the sweep touches is cleared. */
static int square_cleared(const struct sweep *s, double x, double y, double half)
{
    double diagonal = 2.0 * CHIP_ENGAGE_WHOLE * half, away = chip_sqrt(chip_engage_gap2(&s->segment, x, y));
    double within = s->e->radius - diagonal, side = 0.5 * half;
    if (away > s->reach + diagonal) return 1;
    if (within > 0.0 && !chip_engage_uncut(s->e, x, y, within)) return 1;
    if (half < s->fine) return away > s->reach || !chip_engage_uncut(s->e, x, y, s->e->radius);
    return square_cleared(s, x - side, y - side, side) && square_cleared(s, x + side, y - side, side)
        && square_cleared(s, x - side, y + side, side) && square_cleared(s, x + side, y + side, side);
}

int chip_engage_swept(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double more,
                      double fine)
{
    const struct chip_engage_grid *g = &e->ground;
    struct sweep s;
    long k, i, j, near[4];
    CHIP_FAULT(SWEEP_UNLOOKED, return 1)
    s.e = e;
    s.reach = e->radius + more;
    s.fine = 0.5 * fine;
    for (k = 0; k < n; k++) {
        s.segment = chip_engage_segment_of(element[k]);
        chip_engage_near(g, &s.segment, s.reach, near);
        for (j = near[1]; j <= near[3]; j++)
            for (i = near[0]; i <= near[2]; i++)
                if (!square_cleared(&s, g->x0 + ((double)i + 0.5) * g->size, g->y0 + ((double)j + 0.5) * g->size,
                                    0.5 * g->size))
                    return 0;
    }
    return 1;
}

/* What is left of what the tool can reach, in a square (middle, half a side): mm2; the place of some of it. */
static double square_left(struct chip_engage *e, double x, double y, double half, double fine, double place[2])
{
    double diagonal = 2.0 * CHIP_ENGAGE_WHOLE * half, within = e->radius - diagonal, side = 0.5 * half;
    double whole = e->radius + diagonal, out;
    if (within > 0.0 && !chip_engage_uncut(e, x, y, within)) return 0.0;
    out = e->radius + chip_engage_wall_foot(e, x, y).depth; /* within what the tool can reach */
    if (out < SKIN_MM - diagonal) return 0.0;
    if (out > SKIN_MM + diagonal && chip_engage_uncut(e, x, y, whole)) {
        place[0] = x;
        place[1] = y;
        return 4.0 * half * half;
    }
    if (half < fine) {
        if (out < SKIN_MM || !chip_engage_uncut(e, x, y, e->radius)) return 0.0;
        place[0] = x;
        place[1] = y;
        return 4.0 * half * half;
    }
    return square_left(e, x - side, y - side, side, fine, place) + square_left(e, x + side, y - side, side, fine, place)
         + square_left(e, x - side, y + side, side, fine, place)
         + square_left(e, x + side, y + side, side, fine, place);
}

double chip_engage_left(struct chip_engage *e, double fine, double place[2])
{
    const struct chip_engage_grid *g = &e->ground;
    double sum = 0.0;
    long i, j;
    for (j = 0; j < g->rows; j++)
        for (i = 0; i < g->columns; i++)
            sum += square_left(e, g->x0 + ((double)i + 0.5) * g->size, g->y0 + ((double)j + 0.5) * g->size,
                               0.5 * g->size, 0.5 * fine, place);
    return sum;
}
