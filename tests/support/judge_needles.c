/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge's second path to the volume: needles on a turned grid, each lowered by every chord in turn (4 in judge.c).
 *
 * Called by tests/support/judge.py.  Units: mm, rad.
 */
#include "judge_stock.h"

struct grid {
    const struct blank *blank;
    double spacing;             /* mm */
    double co, si;              /* of its turn against the machine's axes */
    int side;                   /* needles along u and v */
    float *needle;              /* mm above the blank's lower end */
};

/* Positions of column i and of row j of needles in the grid's own axes, mm. */
static double column_u(const struct grid *g, int i)
{
    return (i - 0.5 * g->side + 0.237) * g->spacing;
}

static double row_v(const struct grid *g, int j)
{
    return (j - 0.5 * g->side + 0.411) * g->spacing;
}

static int plant(struct grid *g)
{
    const struct blank *b = g->blank;
    int i, j;

    g->needle = malloc((size_t)g->side * g->side * sizeof *g->needle);
    if (!g->needle)
        return -1;
    for (j = 0; j < g->side; j++) {
        for (i = 0; i < g->side; i++) {
            double u = column_u(g, i), v = row_v(g, j);
            g->needle[(long)j * g->side + i] =
                inside(b, b->x + g->co * u - g->si * v, b->y + g->si * u + g->co * v) ? (float)(b->high - b->low) : 0.0f;
        }
    }
    return 0;
}

/* Lowers the needles i0..i1 of row j; -> `gone` and what they lose, mm. */
static double cut_row(const struct grid *g, const struct chord *c, int j, int i0, int i1, double gone)
{
    const struct blank *b = g->blank;
    double v = row_v(g, j), z;
    int i;

    for (i = i0; i <= i1; i++) {
        float *n = g->needle + (long)j * g->side + i;
        double u = column_u(g, i), old = *n;
        if (old <= c->low - b->low || old <= 0.0)
            continue;
        z = swept(c, b->x + g->co * u - g->si * v, b->y + g->si * u + g->co * v, 1.0, old + b->low) - b->low;
        if (z < 0.0)
            z = 0.0;
        if (z < old) {
            gone += (old - (double)(float)z);
            *n = (float)z;
        }
    }
    return gone;
}

/* Lowers the needles under a chord; -> `gone` and what they lose, mm. */
static double cut_chord(const struct grid *g, const struct chord *c, double gone)
{
    const struct blank *b = g->blank;
    double R = c->tool->radius, u0 = g->co * (c->x - b->x) + g->si * (c->y - b->y);
    double v0 = g->co * (c->y - b->y) - g->si * (c->x - b->x);
    double u1 = u0 + g->co * c->dx + g->si * c->dy, v1 = v0 + g->co * c->dy - g->si * c->dx;
    int top = g->side - 1, j0 = limited((fmin(v0, v1) - R) / g->spacing + 0.5 * g->side - 0.411, top);
    int j1 = limited((fmax(v0, v1) + R) / g->spacing + 0.5 * g->side + 0.589, top), j;

    for (j = j0; j <= j1; j++) {
        /* the chord's part that reaches this row bounds the columns */
        double v = row_v(g, j), dv = v1 - v0, ta = 0.0, tb = 1.0, ua, ub;
        if (fabs(dv) > 1e-12) {
            double p = (v - R - v0) / dv, q = (v + R - v0) / dv;
            ta = fmax(fmin(p, q), 0.0);
            tb = fmin(fmax(p, q), 1.0);
            if (ta > tb)
                continue;
        }
        ua = u0 + ta * (u1 - u0);
        ub = u0 + tb * (u1 - u0);
        gone = cut_row(g, c, j, limited((fmin(ua, ub) - R) / g->spacing + 0.5 * g->side - 0.237, top),
                       limited((fmax(ua, ub) + R) / g->spacing + 0.5 * g->side + 0.763, top), gone);
    }
    return gone;
}

/* The volume (mm3) gone at the end of every chord, by needles `spacing` apart on a grid turned by `turn`. */
int judge_needles(const double *blank, long tool_count, const double *sizes, long count, const double *ends,
                  const int *tool_of, double spacing, double turn, double *volume)
{
    const struct blank *b = (const struct blank *)blank;
    struct grid g = {b, spacing, cos(turn), sin(turn), (int)(2.0 * reach(b) / spacing) + 3, NULL};
    struct run r;
    double gone = 0.0;
    long k;

    if (plant(&g))
        return -1;
    r = open_run(tool_count, sizes, count, ends, tool_of);
    for (k = 0; k < count; k++) {
        if (!in_air(b, r.chords + k))
            gone = cut_chord(&g, r.chords + k, gone);
        volume[k] = gone * spacing * spacing;
    }
    free(g.needle);
    close_run(&r);
    return 0;
}
