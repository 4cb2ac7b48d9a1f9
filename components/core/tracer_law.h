/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_law.h - the law of tracer.h in the trace plane, and its limits. Internal to the core: tracer.c calls it. */
#ifndef CHIPWISE_TRACER_LAW_H
#define CHIPWISE_TRACER_LAW_H

#include "tracer.h"

/* What the law makes of a period. */
struct chip_tracer_heading {
    double normal[3];     /* n in the plane */
    double tangent[3];    /* t, turned ahead by the dead time */
    double steepness;     /* part of n in the plane, 0..1 */
    double bend_vel_mm_s; /* along n, for e that turns [4] */
};

/* A plane with unit vectors a and b, perpendicular to each other; what is known of friction is kept. */
void chip_tracer_plane(struct chip_tracer_law *law, const double a[3], const double b[3], double sense);

/* The stylus comes from the air: without a force of friction. */
void chip_tracer_land(struct chip_tracer_law *law);

/* One period: deflection e, ball at c. */
void chip_tracer_heading(struct chip_tracer_law *law, const double e[3], const double c[3], double dead_time_s,
                         double period_s, struct chip_tracer_heading *heading);

/* Gain in force, 1/s [5]. */
double chip_tracer_gain(const struct chip_tracer_settings *settings, double period_s);

/* Velocity from which the head stops within its range after the dead time and a period, mm/s [5]. */
double chip_tracer_stop_vel(const struct chip_tracer_settings *settings, double period_s);

/* Velocity from which it stops within its range although no reading has changed for some periods, mm/s [8]. */
double chip_tracer_blind_vel(const struct chip_tracer_settings *settings, int blind_periods, double period_s);

/* Normal velocity for a deflection error; at most what A can end at eps0, mm/s. */
double chip_tracer_normal_vel(const struct chip_tracer_settings *settings, double error_mm, double gain_hz);

/* Feed asked for, and what limits it (chip_tracer_limit). */
double chip_tracer_feed(const struct chip_tracer_settings *settings, const struct chip_tracer_law *law, double share,
                        double eps, double period_s, int *limited_by);

#endif
