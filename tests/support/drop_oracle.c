/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lowest tip of a tool over triangles by brute force: the inner loops of drop_oracle.py, which describes it and calls it.
 *
 * The tip over a triangle is the largest z - g(r) of its points.  It is sought
 *
 *  1. on grids of points of the triangle that shrink around the best one,
 *  2. at points of its edges, closer and closer around the best: the grids hardly follow a ridge,
 *  3. at the axis, where a pointed tool has its tip,
 *  4. on the tool's radius: where the edges cross it, and at angles that zoom in.
 *
 * A triangle, or what the grids have come to, is left when no height of it can be above what is found already.
 *
 * Nothing of the product is in it.  Units: mm, rad.  Numbers in brackets in the code are the ones above.
 */
#include "tool_profile.h"

#define GRID 24
#define ZOOMS 130           /* each 0.88 times as large as the one before: 6e-8 of the triangle in the end */
#define SHRINK 0.12
#define STEEP 2.0           /* how fast a point outside of the tool's radius falls in rank, times what the triangle may rise there */
#define STEEPEST 1000.0     /* mm per mm in XY */
#define EDGE_POINTS 101     /* of each of EDGE_ZOOMS */
#define EDGE_ZOOMS 10
#define ANGLES 2001         /* of each of ANGLE_ZOOMS */
#define ANGLE_ZOOMS 5
#define LEVEL 1e-12         /* mm2, twice the area in XY of a triangle that is an edge from above */

struct axis {
    const struct tool *tool;
    double x, y;
};

static double from_axis(const struct axis *a, const double p[3])
{
    double x = p[0] - a->x, y = p[1] - a->y;

    return sqrt(x * x + y * y);
}

static double lesser(double a, double b)
{
    return a < b ? a : b;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

/* The tip on a point, and -infinity if the point is beside the tool. */
static double tip_on(const struct axis *a, const double p[3])
{
    double r = from_axis(a, p);

    return r <= a->tool->radius ? p[2] - above_tip(a->tool, r) : -INFINITY;
}

/* No tip over the triangle is higher: its highest corner at the place of its rectangle in XY that is nearest to the axis. */
static double no_higher(const struct axis *a, double t[3][3])
{
    double gap[2], r, at[2] = {a->x, a->y};

    for (int k = 0; k < 2; k++) {
        double low = lesser(lesser(t[0][k], t[1][k]), t[2][k]), high = larger(larger(t[0][k], t[1][k]), t[2][k]);
        gap[k] = larger(0.0, larger(low - at[k], at[k] - high));
    }
    r = hypot(gap[0], gap[1]);
    return r > a->tool->radius * (1.0 + 1e-12) ? -INFINITY : larger(larger(t[0][2], t[1][2]), t[2][2]) - above_tip(a->tool, lesser(r, a->tool->radius));
}

/* Largest rise of a triangle per mm in XY, at most STEEPEST. */
static double steepest(double t[3][3])
{
    double u[3], v[3];

    for (int k = 0; k < 3; k++) {
        u[k] = t[1][k] - t[0][k];
        v[k] = t[2][k] - t[0][k];
    }
    return lesser(hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2]) / larger(fabs(u[0] * v[1] - u[1] * v[0]), LEVEL), STEEPEST);
}

/* [1] One grid: the highest tip of it, or `found` if that is higher; best: its point of the highest rank. */
static double on_grid(const struct axis *a, double t[3][3], double fall, double found, double best[3])
{
    double first = -INFINITY, radius = a->tool->radius;

    for (int j = 0; j <= GRID; j++)
        for (int i = 0; i + j <= GRID; i++) {
            double p[3], r, tip, rank;
            for (int k = 0; k < 3; k++)
                p[k] = (i * t[0][k] + j * t[1][k] + (GRID - i - j) * t[2][k]) / GRID;
            r = from_axis(a, p);
            tip = p[2] - above_tip(a->tool, lesser(r, radius));
            rank = tip - fall * larger(r - radius, 0.0);
            if (r <= radius && tip > found)
                found = tip;
            if (rank > first) {
                first = rank;
                for (int k = 0; k < 3; k++)
                    best[k] = p[k];
            }
        }
    return found;
}

/* [1] */
static double on_area(const struct axis *a, double t[3][3], double found)
{
    double part[3][3], best[3] = {0}, fall = STEEP * (1.0 + steepest(t));

    for (int k = 0; k < 9; k++)
        part[k / 3][k % 3] = t[k / 3][k % 3];
    for (int zoom = 0; zoom < ZOOMS && no_higher(a, part) > found; zoom++) {
        found = on_grid(a, part, fall, found, best);
        for (int k = 0; k < 9; k++)
            part[k / 3][k % 3] += SHRINK * (best[k % 3] - part[k / 3][k % 3]);
    }
    return found;
}

/* [2] */
static double on_edge(const struct axis *a, const double from[3], const double to[3], double found)
{
    double middle = 0.5, width = 0.5;

    for (int zoom = 0; zoom < EDGE_ZOOMS; zoom++, width /= 20.0) {
        double first = -INFINITY, best = middle;
        for (int i = 0; i < EDGE_POINTS; i++) {
            double share = fmin(fmax(middle + width * (2.0 * i / (EDGE_POINTS - 1) - 1.0), 0.0), 1.0), p[3], tip, rank;
            for (int k = 0; k < 3; k++)
                p[k] = from[k] + share * (to[k] - from[k]);
            tip = tip_on(a, p);
            rank = tip > -INFINITY ? tip : -1e9 - from_axis(a, p);      /* none met: the nearest */
            found = larger(found, tip);
            if (rank > first) {
                first = rank;
                best = share;
            }
        }
        middle = best;
    }
    return found;
}

/* Height of a triangle at a place, -infinity beside it; area: twice its area in XY, with its sign. */
static double height_at(double t[3][3], double area, double x, double y)
{
    double u = ((x - t[0][0]) * (t[2][1] - t[0][1]) - (y - t[0][1]) * (t[2][0] - t[0][0])) / area;
    double v = ((t[1][0] - t[0][0]) * (y - t[0][1]) - (t[1][1] - t[0][1]) * (x - t[0][0])) / area;

    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 ? t[0][2] + u * (t[1][2] - t[0][2]) + v * (t[2][2] - t[0][2]) : -INFINITY;
}

/* [4] Highest point of an edge on the tool's radius. */
static double crossing(const struct axis *a, const double from[3], const double to[3], double found)
{
    double px = from[0] - a->x, py = from[1] - a->y, dx = to[0] - from[0], dy = to[1] - from[1];
    double along = px * dx + py * dy, square = fmax(dx * dx + dy * dy, 1e-300);
    double root = along * along - square * (px * px + py * py - a->tool->radius * a->tool->radius);

    for (int sign = -1; sign <= 1 && root >= 0.0; sign += 2) {
        double share = (-along + sign * sqrt(root)) / square;
        if (share >= 0.0 && share <= 1.0)
            found = larger(found, from[2] + share * (to[2] - from[2]));
    }
    return found;
}

/* [4] Highest point of a triangle on the tool's radius; -infinity without. */
static double on_rim(const struct axis *a, double t[3][3], double area)
{
    double found = -INFINITY, angle = 0.0, width = M_PI;

    for (int k = 0; k < 3; k++)
        found = crossing(a, t[k], t[(k + 1) % 3], found);
    for (int zoom = 0; zoom < ANGLE_ZOOMS && fabs(area) >= LEVEL; zoom++, width /= 200.0) {
        double highest = -INFINITY, best = angle;
        for (int i = 0; i < ANGLES; i++) {
            double at = angle + width * (2.0 * i / (ANGLES - 1) - 1.0);
            double z = height_at(t, area, a->x + a->tool->radius * cos(at), a->y + a->tool->radius * sin(at));
            if (z > highest) {
                highest = z;
                best = at;
            }
        }
        if (highest == -INFINITY)
            break;
        found = larger(found, highest);
        angle = best;
    }
    return found;
}

/* The lowest tip over one triangle, or `found` if that is higher. */
static double over(const struct axis *a, double t[3][3], double found)
{
    double area = (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[2][0] - t[0][0]) * (t[1][1] - t[0][1]);
    double at_radius = above_tip(a->tool, a->tool->radius), top = larger(larger(t[0][2], t[1][2]), t[2][2]);

    found = on_area(a, t, found);
    for (int k = 0; k < 3; k++)
        found = on_edge(a, t[k], t[(k + 1) % 3], found);
    if (fabs(area) > LEVEL)
        found = larger(found, height_at(t, area, a->x, a->y));      /* [3] */
    return top - at_radius > found ? larger(found, on_rim(a, t, area) - at_radius) : found;
}

/* tips[i]: the lowest tip over all triangles with the axis at axes[i], or the floor; triangles: 3 corners of x y z each. */
void drop_lowest(const struct tool *tool, double triangles[][3][3], long count, const double axes[][2], long places, double floor, double *tips)
{
    for (long i = 0; i < places; i++) {
        struct axis a = {tool, axes[i][0], axes[i][1]};
        tips[i] = floor;
        for (long k = 0; k < count; k++)            /* at a corner: so that few triangles can be above that */
            for (int corner = 0; corner < 3; corner++)
                tips[i] = larger(tips[i], tip_on(&a, triangles[k][corner]));
        for (long k = 0; k < count; k++)
            if (no_higher(&a, triangles[k]) > tips[i])
                tips[i] = over(&a, triangles[k], tips[i]);
    }
}
