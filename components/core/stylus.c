/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stylus.c - see stylus.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "stylus.h"

#define CHIP_STYLUS_SLIDES 24  /* steps of the slide; each leaves less than a third of what is left */
#define CHIP_STYLUS_PROJECTS 6 /* steps onto the surface: 2 for a corner, more for a height map */

static double longest(double x, double y, double z) { return chip_sqrt(x * x + y * y + z * z); }

static void along(double normal[3], double x, double y, double z)
{
    normal[0] = x;
    normal[1] = y;
    normal[2] = z;
}

/* Outside a quadrant that fills x < 0, y < 0; the normal in *nx, *ny. */
static double quadrant(double x, double y, double *nx, double *ny)
{
    double size;
    if (x > 0.0 && y > 0.0) {
        size = chip_sqrt(x * x + y * y);
        *nx = x / size;
        *ny = y / size;
        return size;
    }
    *nx = x > y;
    *ny = !(x > y);
    return chip_max(x, y);
}

/* Bilinear height; outside of the grid that of its edge. */
static double grid(const struct chip_stylus_settings *s, const double d[3], double normal[3])
{
    double x = chip_clamp(d[0] / s->cell_mm, 0.0, s->nx - 1.001), y = chip_clamp(d[1] / s->cell_mm, 0.0, s->ny - 1.001);
    int i = (int)x, j = (int)y;
    const float *low = s->height_mm + (long)j * s->nx + i, *high = low + s->nx;
    double u = x - i, v = y - j, size;
    double dx = ((1.0 - v) * (low[1] - low[0]) + v * (high[1] - high[0])) / s->cell_mm;
    double dy = ((1.0 - u) * (high[0] - low[0]) + u * (high[1] - low[1])) / s->cell_mm;
    double z = (1.0 - v) * ((1.0 - u) * low[0] + u * low[1]) + v * ((1.0 - u) * high[0] + u * high[1]);
    size = longest(dx, dy, 1.0);
    along(normal, -dx / size, -dy / size, 1.0 / size);
    return (d[2] - z) / size;
}

/* The square: outside rounded by the ball, inside the nearest side. */
static double box(double x, double y, double half, double normal[3])
{
    double nx, ny, size = quadrant((x < 0.0 ? -x : x) - half, (y < 0.0 ? -y : y) - half, &nx, &ny);
    along(normal, x < 0.0 ? -nx : nx, y < 0.0 ? -ny : ny, 0.0);
    return size;
}

double chip_stylus_distance(const struct chip_stylus_settings *s, const double c[3], double normal[3])
{
    double d[3] = { c[0] - s->at_mm[0], c[1] - s->at_mm[1], c[2] - s->at_mm[2] }, size, x, y, turn;
    switch (s->surface_number) {
    case CHIP_STYLUS_BALL:
    case CHIP_STYLUS_BOWL:
        size = chip_max(longest(d[0], d[1], d[2]), 1e-9);
        x = s->surface_number == CHIP_STYLUS_BALL ? 1.0 : -1.0;
        along(normal, x * d[0] / size, x * d[1] / size, x * d[2] / size);
        return x * (size - s->size_mm) - s->ball_mm;
    case CHIP_STYLUS_STEP:
        size = quadrant(d[0], d[2], &x, &y);
        along(normal, x, 0.0, y);
        if (d[2] + s->size_mm < size) {
            along(normal, 0.0, 0.0, 1.0);
            size = d[2] + s->size_mm;
        }
        return size - s->ball_mm;
    case CHIP_STYLUS_CORNER:
        turn = s->angle_deg * CHIP_PI / 180.0;
        x = -sin(turn), y = cos(turn);
        size = x * d[0] + y * d[2];
        along(normal, x, 0.0, y);
        if (d[2] < size) {
            along(normal, 0.0, 0.0, 1.0);
            size = d[2];
        }
        return size - s->ball_mm;
    case CHIP_STYLUS_CYLINDER:
        size = chip_max(longest(d[0], d[1], 0.0), 1e-9);
        along(normal, d[0] / size, d[1] / size, 0.0);
        return size - s->size_mm - s->ball_mm;
    case CHIP_STYLUS_BOX: return box(d[0], d[1], s->size_mm, normal) - s->ball_mm;
    case CHIP_STYLUS_GRID:
        if (s->height_mm && s->nx > 1 && s->ny > 1 && s->cell_mm > 0.0) return grid(s, d, normal);
        break;
    default: break;
    }
    along(normal, s->normal[0], s->normal[1], s->normal[2]);
    return d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2] - s->ball_mm;
}

/* The ball onto the surface. */
static void project(const struct chip_stylus_settings *s, double c[3], double normal[3])
{
    int i, k;
    for (k = 0; k < CHIP_STYLUS_PROJECTS; k++) {
        double off = chip_stylus_distance(s, c, normal);
        if (off < 1e-12 && off > -1e-12) return;
        for (i = 0; i < 3; i++) c[i] -= off * normal[i];
    }
}

/* The ball against the model with the head at p [2]. */
static void slide(struct chip_stylus *stylus, const struct chip_stylus_settings *s, const double p[3])
{
    double *c = stylus->ball_mm, normal[3], e[3], q, size;
    int i, k;
    if (!stylus->is_touching)
        for (i = 0; i < 3; i++) c[i] = p[i];
    for (k = 0; k < CHIP_STYLUS_SLIDES; k++) {
        project(s, c, normal);
        for (i = 0; i < 3; i++) e[i] = c[i] - p[i];
        q = chip_max(0.0, e[0] * normal[0] + e[1] * normal[1] + e[2] * normal[2]);
        for (i = 0; i < 3; i++) e[i] -= q * normal[i];
        size = longest(e[0], e[1], e[2]);
        if (size <= s->friction_share * q + 1e-12) return;
        for (i = 0; i < 3; i++) c[i] -= (1.0 - s->friction_share * q / size) * e[i];
    }
    project(s, c, normal);
}

/* A number of about normal distribution, standard deviation 1. */
static double noise(struct chip_stylus *stylus)
{
    double sum = -6.0;
    int i;
    for (i = 0; i < 12; i++) {
        stylus->random = stylus->random * 6364136223846793005ul + 1442695040888963407ul;
        sum += (double)(stylus->random >> 11) / 9007199254740992.0;
    }
    return sum;
}

void chip_stylus_step(struct chip_stylus *stylus, const struct chip_stylus_settings *settings, const double p[3],
                      double measured[3], double now[3])
{
    double normal[3];
    int delay = settings->delay_periods < 0                     ? 0
              : settings->delay_periods > CHIP_STYLUS_DELAY - 1 ? CHIP_STYLUS_DELAY - 1
                                                                : settings->delay_periods;
    int i, late;
    if (chip_stylus_distance(settings, p, normal) >= 0.0) {
        stylus->is_touching = 0;
        for (i = 0; i < 3; i++) stylus->ball_mm[i] = p[i];
    } else {
        slide(stylus, settings, p);
        stylus->is_touching = 1;
    }
    stylus->newest = (stylus->newest + 1) % CHIP_STYLUS_DELAY;
    late = (stylus->newest + CHIP_STYLUS_DELAY - delay) % CHIP_STYLUS_DELAY;
    for (i = 0; i < 3; i++) now[i] = stylus->deflection_mm[stylus->newest][i] = stylus->ball_mm[i] - p[i];
    for (i = 0; i < 3; i++)
        measured[i] =
            stylus->deflection_mm[late][i] + (settings->noise_mm > 0.0 ? settings->noise_mm * noise(stylus) : 0.0);
}
