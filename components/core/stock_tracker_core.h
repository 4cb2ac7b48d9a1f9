/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stock_tracker_core.h - the core as one unit, for stock_tracker.comp.
 *
 * halcompile turns pin names into macros; included here, before them, the core keeps its
 * names. The shared library and the C tests build the same files one by one. */
#define CHIPWISE_RTAPI
#include <stdlib.h>
#include "core/tool.c"
#include "core/cell.c"
#include "core/stock.c"
#include "core/sweep_curved.c"
#include "core/sweep_level.c"
#include "core/sweep_lowest.c"
#include "core/sweep_row.c"
#include "core/sweep.c"
#include "core/tooth.c"
#include "core/tooth_brink.c"
#include "core/tooth_force.c"
#include "core/section_band.c"
#include "core/section_strip.c"
#include "core/section_wall.c"
#include "core/section.c"
#include "core/path.c"
#include "core/path_done.c"
#include "core/path_pace.c"
#include "core/predicted_path.c"
#include "core/tooth_profile.c"
#include "core/load_bound.c"
#include "core/load_profile.c"
#include "core/lookahead.c"
#include "core/guard_probe.c"
#include "core/guard.c"
#include "core/clamp.c"
#include "core/clamp_guard.c"
#include "core/tracker_clamps.c"
#include "core/tracker_map.c"
#include "core/tracker_cut.c"
#include "core/tracker.c"
#include "core/tool_watch.c"
#include "core/load_watch.c"
#include "core/path_watch.c"

#include "linuxcnc_planner.c"

typedef struct chip_tracker chip_tracker_t;
typedef struct chip_planner chip_planner_t;
typedef struct chip_tool_watch chip_tool_watch_t;
typedef struct chip_load_watch chip_load_watch_t;
typedef struct chip_path_thinner chip_path_thinner_t;
typedef struct chip_path_watch chip_path_watch_t;

/* A decimal number as loadrt gives it; 0 (which no length may be) if it is not a number. */
static inline double chip_decimal(const char *text)
{
    char *end;
    double value = strtod(text, &end);
    return end == text || *end ? 0.0 : value;
}
