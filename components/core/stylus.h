/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stylus.h - model of a tracer head: a ball on a spring that is the same in all directions, against a surface, with
 * friction, noise and dead time. For simulation and tests; nothing of it is in a machine.
 *
 * Who calls it: tracer_model.comp, once per servo period; offline/tracer_loop.c.
 * Source: own; Coulomb friction on a spring is the play of a return mapping, as in plasticity.
 *
 * Principle:
 *  1. f(c) is the distance of the ball from the model, negative inside. Without contact the ball is at the head's
 *     position p, e = 0.
 *  2. In contact the ball is where f(c) = 0, and e = c - p has a part q along the normal n(c) and a part along the
 *     surface. The ball sticks to where it was while the second is at most friction_share x q, and slides to that otherwise.
 *  3. What is measured is e of `delay_periods` before, plus noise.
 */
#ifndef CHIPWISE_STYLUS_H
#define CHIPWISE_STYLUS_H

#include <stdint.h>

#define CHIP_STYLUS_DELAY 32 /* longest dead time, periods */

enum chip_stylus_surface {
    CHIP_STYLUS_PLANE = 0,    /* through `at`, with `normal` */
    CHIP_STYLUS_BALL = 1,     /* round `at` */
    CHIP_STYLUS_BOWL = 2,     /* hollow ball round `at` */
    CHIP_STYLUS_STEP = 3,     /* z of `at` up to x of `at`, then lower by `size` */
    CHIP_STYLUS_CORNER = 4,   /* floor at z of `at` and wall at x of `at`, which rises at `angle_deg` */
    CHIP_STYLUS_CYLINDER = 5, /* upright, round `at` */
    CHIP_STYLUS_BOX = 6,      /* upright square of half width `size` round `at` */
    CHIP_STYLUS_GRID = 7      /* heights; those of the ball's centre, so that ball_mm is not added */
};

struct chip_stylus_settings {
    int surface_number; /* chip_stylus_surface */
    double at_mm[3];
    double normal[3];      /* PLANE: of length 1 */
    double size_mm;        /* radius, half width, or height of a step */
    double angle_deg;      /* CORNER: of the wall to the floor */
    double ball_mm;        /* radius of the stylus */
    double friction_share; /* coefficient */
    double noise_mm;       /* standard deviation of each axis */
    int delay_periods;     /* periods from position to measured deflection */
    double cell_mm;        /* GRID */
    int nx, ny;
    const float *height_mm; /* GRID: ny rows of nx; `at` is the first one */
};

struct chip_stylus {
    double ball_mm[3]; /* c */
    int is_touching;
    uint64_t random;
    int newest;
    double deflection_mm[CHIP_STYLUS_DELAY][3];
};

/* Distance of the ball at c from the model, mm, and the model's unit normal there. */
double chip_stylus_distance(const struct chip_stylus_settings *settings, const double c[3], double normal[3]);

/* One period: the head is at p -> the deflection measured now, mm; `now` is the one that is, without delay and noise. */
void chip_stylus_step(struct chip_stylus *stylus, const struct chip_stylus_settings *settings, const double p[3],
                      double measured[3], double now[3]);

#endif
