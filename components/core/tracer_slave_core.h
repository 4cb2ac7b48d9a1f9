/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_slave_core.h - the slave, for tracer_slave.comp (why here: see stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/slave.c"

typedef struct chip_slave chip_slave_t;
