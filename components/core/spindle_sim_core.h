/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_sim_core.h - the simulated spindle, for spindle_sim.comp (why here: see stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/spindle_sim.c"

typedef struct chip_spindle_sim chip_spindle_sim_t;
