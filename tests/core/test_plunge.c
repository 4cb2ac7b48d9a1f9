/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A traverse straight down (components/core/guard.h, [1]): where the tool has been before, with its path blended at a corner, it is
 * let through; over a wall it is stopped, however deep it goes.
 */
#include <math.h>

#include "one_tracker.h"

#define PERIOD 0.001
#define ACCEL 500.0 /* mm/s2 */

static const double CORNER[2] = { 31.37, 22.13 };

/* A feed move in a straight line, mm; the feed in mm/s. */
static void feed(double x, double y, double z, double speed)
{
    double from[3], to[3] = { x, y, z }, length;
    int i, j, count;
    memcpy(from, in.pos_mu, sizeof from);
    length = sqrt(pow(x - from[0], 2) + pow(y - from[1], 2) + pow(z - from[2], 2));
    count = (int)ceil(length / speed / PERIOD);
    in.motion = 2;
    for (j = 1; j <= count; j++) {
        for (i = 0; i < 3; i++) in.pos_mu[i] = from[i] + (to[i] - from[i]) * j / count;
        periods(1);
    }
}

/* A traverse straight down to z, mm; returns whether the guard stops it, and where in *at. */
static int traverse_down(double z, double *at)
{
    double speed = 0.0, left = in.pos_mu[2] - z;
    in.motion = 1;
    while (left > 1e-6) {
        speed = fmin(speed + ACCEL * PERIOD, sqrt(2.0 * ACCEL * left));
        left -= fmin(left, speed * PERIOD);
        in.pos_mu[2] = z + left;
        in.distance_to_go_mu = left;
        periods(1);
        if (out.has_rapid_contact) {
            *at = in.pos_mu[2];
            return 1;
        }
    }
    return 0;
}

static void new_box(double cell, double diameter, double corner, double bottom)
{
    const double size[3] = { 60.0, 45.0, -bottom };
    const double at[3] = { -10.0, CORNER[1], 5.0 };
    int i;
    define(cell, size, diameter, at);
    in.tool_corner_radius_mu = corner;
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = ACCEL;
    in.acceleration_mu_s2 = ACCEL;
}

/* Two lines at 100 degrees, `deviation` mm off the corner between them, at the depth z; then up. */
static void cut_a_blended_corner(double z, double deviation)
{
    const double turn = 100.0 * M_PI / 180.0, u[2] = { cos(turn), sin(turn) };
    double before = 2.0 * deviation / sin(0.5 * turn);
    int i;
    feed(in.pos_mu[0], in.pos_mu[1], z, 100.0);
    feed(CORNER[0] - before, CORNER[1], z, 40.0);
    for (i = 1; i <= 10; i++) { /* a parabola with both lines as its tangents */
        double t = i / 10.0, a = (1.0 - t) * (1.0 - t), b = t * t;
        feed(CORNER[0] - a * before + b * before * u[0], CORNER[1] + b * before * u[1], z, 10.0);
    }
    feed(CORNER[0] + 12.0 * u[0], CORNER[1] + 12.0 * u[1], z, 40.0);
    feed(in.pos_mu[0], in.pos_mu[1], 5.0, 100.0);
    feed(CORNER[0], CORNER[1], 5.0, 100.0);
}

static void back_in_a_corner(double cell, double diameter, double corner, double z)
{
    char what[120];
    double at = 0.0;
    new_box(cell, diameter, corner, z - 3.0);
    cut_a_blended_corner(z, 0.012);
    snprintf(what, sizeof what, "down to Z%g where D%g R%g has been, cells of %g", z, diameter, corner, cell);
    expect(!traverse_down(z + 0.3, &at), what);
}

static void beside_a_wall(double cell, double diameter, double z, double overlap)
{
    char what[120];
    double at = 0.0;
    new_box(cell, diameter, 0.0, z - 3.0);
    cut_a_blended_corner(z, 0.012);
    feed(CORNER[0] - 6.0, CORNER[1] - overlap, 5.0, 100.0);
    periods(50); /* the map is up to date */
    snprintf(what, sizeof what, "down to Z%g, %g mm over a wall, D%g, cells of %g: goes through", z, overlap, diameter,
             cell);
    expect(traverse_down(z + 0.3, &at), what);
    expect(at >= -0.02, "and it stops above the wall");
}

int main(void)
{
    static const double cells[] = { 0.1, 0.137, 0.25 }, diameters[] = { 3.0, 10.0, 16.0 },
                        depths[] = { -0.7, -3.45, -19.0 };
    int i, j, k;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) {
                back_in_a_corner(cells[i], diameters[j], 0.0, depths[k]);
                back_in_a_corner(cells[i], diameters[j], 0.37 * diameters[j], depths[k]);
                back_in_a_corner(cells[i], diameters[j], 0.5 * diameters[j], depths[k]);
                beside_a_wall(cells[i], diameters[j], depths[k], 0.3);
            }
    if (!failures) printf("plunge: every case as it must be\n");
    free(stock);
    return failures != 0;
}
