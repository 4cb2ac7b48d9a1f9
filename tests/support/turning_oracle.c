/* SPDX-License-Identifier: GPL-2.0-or-later */
/* One move of a turning tool over heights on a grid: the inner loop of turning_oracle.py, which describes it and calls it.
 *
 * The frame is that of the tool's side: x away from the axis outside, towards it inside.  Units: mm.
 */
#include <math.h>

struct tool {
    double radius;              /* of the nose; 0 for a drill */
    double flat;                /* from corner to corner */
    double begin[2], end[2];    /* of each edge beside its corner: right, left; begin > end: none */
    double foot[2], rise[2];    /* height at the corner, mm per mm */
    double holder[3];           /* left, right, up */
    double point;               /* rise of a drill's point; 0: not a drill */
    double drill_radius;
};

enum { GOUGE, RAPID, HOLDER, KINDS };

struct found {
    double depth[KINDS];        /* largest so far */
    int at[KINDS];              /* point where it grew, -1 for none */
    int cutting;                /* points that took stock */
};

static double lower_edge(const struct tool *t, double u)
{
    double low = INFINITY;

    if (t->point > 0.0)
        return u >= 0.0 ? fmax(-u * t->point, -t->drill_radius) : INFINITY;
    for (int corner = 0; corner < 2; corner++) {
        double v = u - (corner ? t->flat : 0.0);
        if (fabs(v) < t->radius - 1e-9)
            low = fmin(low, -sqrt(t->radius * t->radius - v * v));
    }
    if (u >= 0.0 && u <= t->flat)
        low = -t->radius;
    for (int edge = 0; edge < 2; edge++) {
        double v = edge ? -u : u - t->flat;
        if (v >= t->begin[edge] && v <= t->end[edge])
            low = fmin(low, t->foot[edge] + (v - t->begin[edge]) * t->rise[edge]);
    }
    return low;
}

static void note(struct found *found, int kind, double depth, int point)
{
    if (depth > found->depth[kind]) {
        found->depth[kind] = depth;
        found->at[kind] = point;
    }
}

static int cell_of(double z, double z0, double cell, int count)
{
    double k = (z - z0) / cell + 1.0;
    return k < 0.0 ? 0 : k > count ? count : (int)k;
}

static void holder(struct found *found, const struct tool *t, const double *part, const double *stock, const double *z, int count, double cz, double cx,
                   int point, double cell)
{
    int k = cell_of(cz + t->holder[0], z[0], cell, count) - 2;
    for (k = k < 0 ? 0 : k; k < count && z[k] < cz + t->holder[0]; k++)
        ;
    for (; k < count && z[k] < cz + t->holder[1] + 1e-9; k++) {
        note(found, GOUGE, part[k] - cx - t->holder[2], point);
        note(found, HOLDER, stock[k] - cx - t->holder[2], point);
    }
}

/* points: (z, x) of the nose's centre, `many` of them.  rapid: stock is judged, else it is cut. */
void follow(struct found *found, const double *part, double *stock, const double *z, int count, double cell, const struct tool *t, const double *points,
            int many, int rapid)
{
    for (int i = 0; i < many; i++) {
        double cz = points[2 * i], cx = points[2 * i + 1];
        int whole = i % 8 == 0 || i == many - 1 || t->point > 0.0, cut = 0;    /* far from the nose the edges are straight */
        int first = whole ? 0 : cell_of(cz - t->radius - 0.3, z[0], cell, count);
        int last = whole ? count : cell_of(cz + t->flat + t->radius + 1.0, z[0], cell, count);

        if (whole)
            holder(found, t, part, stock, z, count, cz, cx, i, cell);
        for (int k = first; k < last; k++) {
            double edge = cx + lower_edge(t, z[k] - cz);
            note(found, GOUGE, part[k] - edge, i);
            if (rapid)
                note(found, RAPID, stock[k] - edge, i);
            else if (stock[k] > edge) {
                cut |= stock[k] > edge + 1e-4;
                stock[k] = edge;
            }
        }
        found->cutting += cut;
    }
}
