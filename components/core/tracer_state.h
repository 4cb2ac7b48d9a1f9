/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_state.h - what each state of profiling control asks for. Internal to the core: tracer.c calls it. */
#ifndef CHIPWISE_TRACER_STATE_H
#define CHIPWISE_TRACER_STATE_H

#include "tracer.h"

#define CHIP_TRACER_LANDED 0.5    /* share of eps0 from which the approach has ended */
#define CHIP_TRACER_END_GAIN 30.0 /* 1/s: how a velocity falls towards the end of a line */

/* From IDLE: the approach, wherever the head is. */
void chip_tracer_begin(struct chip_tracer *tracer, const struct chip_tracer_in *in);

/* One period of the state: the velocity it asks for, and what limits it; -> a fault (chip_tracer_fault) or 0. */
int chip_tracer_run(struct chip_tracer *tracer, const struct chip_tracer_in *in, double eps, double period_s,
                    double wanted[3], struct chip_tracer_out *out);

#endif
