/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_sensor.h - whether the deflection that is read can be that of the stylus: principle [8] of tracer.h. Internal to
 * the core: tracer.c and tracer_state.c call it. */
#ifndef CHIPWISE_TRACER_SENSOR_H
#define CHIPWISE_TRACER_SENSOR_H

#include "tracer.h"

#define CHIP_TRACER_CONTACT 0.1 /* share of eps0 below which there is no contact */

/* Once per period, after position and deflection were kept in `tracer`; `before` is the deflection of the period before.
 * -> a fault (chip_tracer_fault) or 0. */
int chip_tracer_sensor(struct chip_tracer *tracer, const double before[3], double eps, double period_s);

/* Position of the head when the deflection of now was measured, mm. */
const double *chip_tracer_late(const struct chip_tracer *tracer, double period_s);

/* The deflection has fallen by more than the head can have let it. */
int chip_tracer_fell(const struct chip_tracer *tracer, const double e[3], const double before[3], double period_s);

/* Added to the deflection asked for, mm, and to the normal velocity, mm/s, so that the reading has to change. */
double chip_tracer_swing(const struct chip_tracer *tracer);
double chip_tracer_lift(const struct chip_tracer *tracer);

#endif
