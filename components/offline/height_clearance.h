/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_clearance.h - how near a traverse comes to stock at its side, in a height map.
 *
 * Who calls it: height_sweep.c for a program that is judged, remap/chipwise/clib/height_map.py for one that is written. Never in realtime.
 *
 * Principle:
 *  1. The tool is made wider by the clearance (swept.h). A needle that reaches above its profile by more than CHIP_CLEAR_LEVEL is
 *     nearer than that. Its distance is the one between the needle and the tool at the needle's height, seen from above.
 *  2. Straight up nothing is near: the tool goes out as it came in.
 *  3. By the rule for every traverse (CHIP_CLEAR_ALL) any needle counts on all of the move; straight down, where it ends.
 *  4. By the rule for a program (CHIP_CLEAR_AHEAD) a level or rising move only counts needles that are ahead of the tool's axis: it may leave
 *     a wall.
 *  5. By that rule a rise of CHIP_CLEAR_STEEP or more that begins beside stock is free: it leaves a wall along it. As needles are a cell apart,
 *     it may begin a cell further away.
 */
#ifndef CHIPWISE_HEIGHT_CLEARANCE_H
#define CHIPWISE_HEIGHT_CLEARANCE_H

#include "core/tool.h"
#include "height_sweep.h"

#define CHIP_CLEAR_NONE 1e30   /* mm: no stock is nearer than the clearance */
#define CHIP_CLEAR_LEVEL 0.01  /* mm: what is no higher above the tip is stock that the tool goes over */
#define CHIP_CLEAR_ACROSS 1e-4 /* mm: a shorter move, seen from above, goes straight up or down */
#define CHIP_CLEAR_STEEP 1.0   /* mm per mm: 45 degrees [5] */

enum chip_clear_rule { CHIP_CLEAR_ALL = 0, CHIP_CLEAR_AHEAD = 1 };

/* The least distance (mm) of stock from the side of a tool on a traverse from a to b, 0 if they touch, CHIP_CLEAR_NONE if it is not less
 * than `clearance` (mm); *at: the share of the move. */
double chip_clearance_of(const struct chip_height_map *map, const struct chip_tool *tool, double clearance,
                         const double a[3], const double b[3], int rule, double *at);

/* The same by CHIP_CLEAR_ALL, for a tool as chip_height_sweep() has it. */
double chip_traverse_clearance(const struct chip_height_map *map, const struct chip_height_tool *tool, double clearance,
                               const double a[3], const double b[3]);

#endif
