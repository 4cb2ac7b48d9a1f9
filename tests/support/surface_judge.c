/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lowest edge of a tool over needles, for surface_judge.py, which calls it.  Units: mm. */
#include "tool_profile.h"

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
