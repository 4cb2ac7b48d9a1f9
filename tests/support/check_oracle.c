/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Steps of a tool through needles: the inner loops of check_oracle.py, which describes them and calls them.
 *
 * Needles on a grid, heights row by row.  The cutting edge is nowhere lower than the tip, so a needle that is not higher than the tip, or than
 * what was met already, is left out before its distance is computed.  Units: mm.
 */
#include <math.h>
#include <stddef.h>

struct needles {
    double low[3];
    double spacing;
    const double *x, *y;        /* of the columns, of the rows */
    long columns, rows;
};

struct edge {
    double radius, corner;
    double touch;               /* radius at which the corner's round becomes the cone; below 0: no cone */
    double foot, tangent;       /* of the cone: height at the touch, mm across per mm up */
};

struct range {
    long first, end;
};

static double above_tip(const struct edge *e, double r)
{
    double over = fmax(r - (e->radius - e->corner), 0.0);

    if (e->touch >= 0.0) {
        if (r >= e->touch)
            return e->foot + (r - e->touch) / e->tangent;
        over = r;
    }
    return e->corner - sqrt(fmax(e->corner * e->corner - over * over, 0.0));
}

static struct range window(const struct needles *n, int axis, double place, double radius)
{
    long count = axis ? n->rows : n->columns;
    double first = (place - radius - n->low[axis]) / n->spacing - 2.0, end = (place + radius - n->low[axis]) / n->spacing + 2.0;
    struct range found = {first > 0.0 ? (long)fmin(first, count) : 0, end > 0.0 ? (long)fmin(end, count) : 0};

    return found;
}

/* Lower the needles under a tool. */
void needles_cut(const struct needles *n, double *heights, const struct edge *tool, double x, double y, double z)
{
    struct range column = window(n, 0, x, tool->radius), row = window(n, 1, y, tool->radius);
    double lowest = fmax(z, n->low[2]);

    for (long j = row.first; j < row.end; j++) {
        double *own = heights + j * n->columns, v = n->y[j] - y;
        for (long i = column.first; i < column.end; i++) {
            if (own[i] <= lowest)
                continue;
            double r = hypot(n->x[i] - x, v);
            if (r <= tool->radius)
                own[i] = fmin(own[i], fmax(z + above_tip(tool, r), n->low[2]));
        }
    }
}

/* How far the highest needle that a tool meets reaches above z; 0 for none.  skin: mm, what is left in the stock is not met. */
double needles_meet(const struct needles *n, const double *heights, const struct edge *tool, double x, double y, double z, double lifted, double skin)
{
    struct range column = window(n, 0, x, tool->radius + skin), row = window(n, 1, y, tool->radius + skin);
    double floor = n->low[2] + skin, best = fmax(lifted, floor);
    int met = 0;

    for (long j = row.first; j < row.end; j++) {
        const double *own = heights + j * n->columns;
        double v = n->y[j] - y;
        for (long i = column.first; i < column.end; i++) {
            if (own[i] <= best)
                continue;
            double r = hypot(n->x[i] - x, v);
            if (r < tool->radius && own[i] > fmax(lifted + above_tip(tool, r), floor)) {
                best = own[i];
                met = 1;
            }
        }
    }
    return met ? best - z : 0.0;
}

/* All steps of a straight move: the depth for each of the skins, whose smaller tools are lifted; then the whole tool cuts. */
void needles_move(const struct needles *n, double *heights, const struct edge *tool, const double start[3], const double travel[3], long steps, long skins,
                  const struct edge *smaller, const double *lifts, const double *skin, double *depth)
{
    for (long k = 1; k <= steps; k++) {
        double at[3];

        for (int axis = 0; axis < 3; axis++)
            at[axis] = start[axis] + travel[axis] * (double)k / (double)steps;
        for (long s = 0; s < skins; s++)
            depth[s] = fmax(depth[s], needles_meet(n, heights, &smaller[s], at[0], at[1], at[2], at[2] + lifts[s], skin[s]));
        needles_cut(n, heights, tool, at[0], at[1], at[2]);
    }
}
