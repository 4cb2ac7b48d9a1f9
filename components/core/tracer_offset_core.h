/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_offset_core.h - external offsets of axes, for tracer_offset.comp (why here: see stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/axis_offset.c"

typedef struct chip_axis_offset chip_axis_offset_t;
