/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_settled.c - see depth_proof.h: cells in which no move to come can be too deep [7].
 *
 * The lowest that each judged move allows is entered where its axis is, and then spread as far as the largest tool reaches, in rows and in columns.
 */
#include <math.h>
#include <stdlib.h>

#include "depth_state.h"

#define ANY 1e30f /* mm: no move comes there */

static void enter(struct chip_proof *p, const struct chip_swept *m, float allowed)
{
    long places = chip_depth_axis_places(p, m), i;
    for (i = 0; i <= places; i++) {
        double t = places ? (double)i / places : 0.0;
        float *own = &p->settled[(long)index_of(m->y + t * m->dy, p->y0, p->cell, p->ny) * p->nx
                                 + index_of(m->x + t * m->dx, p->x0, p->cell, p->nx)];
        if (allowed < *own) *own = allowed;
    }
}

/* Each of n values, `step` apart, becomes the least of those from it to the one `wide` behind it. */
static void least_behind(float *value, long n, long step, long wide)
{
    long done = 1, shift, i;
    for (; done <= wide; done += shift) {
        shift = done <= wide + 1 - done ? done : wide + 1 - done;
        for (i = 0; i + shift < n; i++)
            if (value[(i + shift) * step] < value[i * step]) value[i * step] = value[(i + shift) * step];
    }
}

/* The same of those on both sides. */
static void spread(float *value, long n, long step, long wide)
{
    CHIP_FAULT(SETTLED_UNSPREAD, return )
    least_behind(value, n, step, wide);
    least_behind(value + (n - 1) * step, n, -step, wide);
}

int chip_proof_expect(struct chip_proof *p, const struct chip_proof_path *path)
{
    long cells = (long)p->nx * p->ny, wide = (long)ceil(p->most_radius / p->cell + DIAGONAL) + 1, k;
    if (!p->settled && !(p->settled = malloc(sizeof *p->settled * (size_t)cells))) return -1;
    for (k = 0; k < cells; k++) p->settled[k] = ANY;
    for (k = 0; k < path->n; k++) {
        const double *from = k ? path->to + 3 * (k - 1) : path->start, *to = path->to + 3 * k;
        struct chip_swept m = chip_swept_of(from, to);
        if (path->tool[k] >= 0 && p->table[path->tool[k]].limit < 0.5 * CHIP_SWEPT_NEVER)
            enter(p, &m, (float)(chip_min(from[2], to[2]) + p->table[path->tool[k]].limit - CHIP_PROOF_LOWER));
    }
    for (k = 0; k < p->ny; k++) spread(p->settled + k * p->nx, p->nx, 1, wide);
    for (k = 0; k < p->nx; k++) spread(p->settled + k, p->ny, p->nx, wide);
    return 0;
}
