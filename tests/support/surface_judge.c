/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lowest edge of a tool over needles, for surface_judge.py, which calls it.  Units: mm. */
#include <math.h>

struct tool {
    double radius, corner;
    double touch;               /* radius at which the corner's round becomes the cone; below 0: no cone */
    double foot, tangent;       /* of the cone: height that it would have on the axis, mm across per mm up */
};

static double above_tip(const struct tool *t, double r)
{
    double inner = fmax(r - (t->radius - t->corner), 0.0);

    if (t->touch >= 0.0) {
        if (r > t->touch)
            return t->foot + r / t->tangent;
        inner = r;
    }
    return t->corner - sqrt(fmax(t->corner * t->corner - inner * inner, 0.0));
}

/* under[k]: the lowest height of the edge over needle k with the tip at any of the points; infinite for a needle beside all of them.
 * xy: needles, x y; points: x y z. */
void surface_under(const struct tool *tool, const double *xy, long needles, const double *points, long count, double *under)
{
    double beside = tool->radius * tool->radius * (1.0 + 1e-9);

    for (long k = 0; k < needles; k++) {
        double x = xy[2 * k], y = xy[2 * k + 1], lowest = INFINITY;
        for (long i = 0; i < count; i++) {
            const double *at = points + 3 * i;
            double dx = x - at[0], dy = y - at[1], square = dx * dx + dy * dy;
            if (square > beside || at[2] >= lowest)     /* the edge is nowhere lower than the tip */
                continue;
            double r = sqrt(square);
            if (r <= tool->radius)
                lowest = fmin(lowest, at[2] + above_tip(tool, r));
        }
        under[k] = lowest;
    }
}
