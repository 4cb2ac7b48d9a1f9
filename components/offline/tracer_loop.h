/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_loop.h - the tracer and the model of its stylus, period after period. Offline only.
 *
 * Who calls it: the tests and the bench, through the shared library. */
#ifndef CHIPWISE_TRACER_LOOP_H
#define CHIPWISE_TRACER_LOOP_H

#include "core/stylus.h"
#include "core/tracer.h"

/* One period as it was. */
struct chip_tracer_row {
    double position_mm[3];
    double ball_mm[3];
    double deflection_mm[3]; /* as it was, without delay and noise */
    double velocity_mm_s[3];
    double seen_ball_mm[3]; /* as the tracer sees it, with delay and noise */
    double normal[3];       /* as the tracer sees it */
    double measured_mm;     /* eps as measured */
    double velocity_limit_mm_s, tangential_vel_mm_s, friction_share, gain_hz;
    int state, fault, limited_by, lines;
};

/* `count` periods from position p, which the velocities move; a row each into `rows`. */
void chip_tracer_loop(struct chip_tracer *tracer, const struct chip_tracer_settings *settings,
                      struct chip_stylus *stylus, const struct chip_stylus_settings *model, double p[3],
                      double period_s, int is_enabled, double feed_share, long count, struct chip_tracer_row *rows);

#endif
