/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_model_core.h - the model of a stylus, for tracer_model.comp (why here: see stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/stylus.c"

typedef struct chip_stylus chip_stylus_t;
