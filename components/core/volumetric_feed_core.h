/* SPDX-License-Identifier: GPL-2.0-or-later */
/* volumetric_feed_core.h - the feed law and its watch, for volumetric_feed.comp (why here: see
 * stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/tooth_law.c"
#include "core/feed.c"
#include "core/feed_ease.c"
#include "core/feed_hold.c"
#include "core/watchdog.c"
#include "core/run_sums.c"
#include "core/spindle_load.c"
#include "core/spindle_teach.c"
#include "core/spindle_alarm.c"

typedef struct chip_feed_easing chip_feed_easing_t;
typedef struct chip_tooth_out chip_tooth_out_t;
typedef struct chip_feed_hold chip_feed_hold_t;
typedef struct chip_run_sums chip_run_sums_t;
typedef struct chip_spindle_load chip_spindle_load_t;
typedef struct chip_watchdog chip_watchdog_t;
