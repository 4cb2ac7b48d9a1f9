/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lowest edge of a tool over needles, for surface_judge.py, which calls it.  Units: mm. */
#include "tool_profile.h"

/* The lowest height of the edge over (x, y) with the tip at any of the points, x y z; infinite beside all of them. */
static double under_at(const struct tool *tool, double x, double y, const double *points, long count)
{
    double beside = tool->radius * tool->radius * (1.0 + 1e-9), lowest = INFINITY;

    for (long i = 0; i < count; i++) {
        const double *at = points + 3 * i;
        double dx = x - at[0], dy = y - at[1], square = dx * dx + dy * dy;
        if (square > beside || at[2] >= lowest)     /* the edge is nowhere lower than the tip */
            continue;
        double r = sqrt(square);
        if (r <= tool->radius)
            lowest = fmin(lowest, at[2] + above_tip(tool, r));
    }
    return lowest;
}

/* under[k] of needle k; xy: needles, x y. */
void surface_under(const struct tool *tool, const double *xy, long needles, const double *points, long count, double *under)
{
    for (long k = 0; k < needles; k++)
        under[k] = under_at(tool, xy[2 * k], xy[2 * k + 1], points, count);
}

/* How much the points take off a needle at most, at least 0; with `cuts` the needles are as low afterwards. */
static double take(const struct tool *tool, const double *xy, double *height, long needles, const double *points, long count, int cuts)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, reach = tool->radius * (1.0 + 1e-9), most = 0.0;

    for (long i = 0; i < count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], points[3 * i + k] - reach);
            high[k] = fmax(high[k], points[3 * i + k] + reach);
        }
    for (long k = 0; k < needles; k++) {
        double x = xy[2 * k], y = xy[2 * k + 1], under;
        if (x < low[0] || x > high[0] || y < low[1] || y > high[1])
            continue;
        under = under_at(tool, x, y, points, count);
        if (!(height[k] > under))
            continue;
        most = fmax(most, height[k] - under);
        if (cuts)
            height[k] = under;
    }
    return most;
}

/* taken[b] by bit b of a move, `size` points and the next one; the move is `count` points, of which one alone is a bit, too. */
void surface_taken(const struct tool *tool, const double *xy, double *height, long needles, const double *points, long count, long size, int cuts,
                   double *taken)
{
    long first = 0;

    do {
        long left = count - first;
        *taken++ = take(tool, xy, height, needles, points + 3 * first, left < size + 1 ? left : size + 1, cuts);
        first += size;
    } while (first < count - 1);
}
