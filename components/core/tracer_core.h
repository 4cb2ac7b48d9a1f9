/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_core.h - profiling control and the master's part, for tracer.comp (why here: see stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/tracer_law.c"
#include "core/tracer_sensor.c"
#include "core/tracer_state.c"
#include "core/tracer.c"
#include "core/master.c"

typedef struct chip_tracer chip_tracer_t;
typedef struct chip_master chip_master_t;
