/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_pace.h - where the path comes down to the stock, and how fast the tool may be there.
 *
 * Who calls it: tracker.c, once per servo period, if a set-up lets feeds above the stock be as fast as the axes.
 * Source: none.
 *
 * Principle:
 *  1. A feed whose tip is at `clear_z` or above meets nothing, whatever the tool cuts below: it may be as fast as the axes. `clear_z` is the top of
 *     the stock's box and a clearance. No reading of the stock is needed for that, so a finishing pass along a wall that the map has as cut
 *     already keeps its feed.
 *  2. Below, a move that falls has its own F, and another one `ceiling` times its own F. A segment that crosses `clear_z` counts from there on.
 *     One that goes straight up is free, too: what is above the tool it has cut already.
 *  3. Each such place at the distance d asks for v^2 <= v_i^2 + 2 a d. The one that asks for the least now is the answer. What is travelled
 *     until an override takes effect is taken off d, as the feed law does (feed.h, 2), and the operator's override k makes v_i k times as fast.
 *  4. If less of the path is known than the tool may need to brake, what lies behind is treated as going down at the last F.
 *  5. A segment without F of its own (G93, G95, no ceiling in force) is as fast as the planner says, and the planner brakes to it.
 */
#ifndef CHIPWISE_PATH_PACE_H
#define CHIPWISE_PATH_PACE_H

#include "path.h"

struct chip_pace {
    double
        distance; /* mm of travel until `vel` applies; CHIP_PACE_NONE: there is no such place in sight; CHIP_PACE_UNKNOWN: the path is unknown */
    double vel;   /* mm/s, without the operator's override */
    double accel; /* mm/s2, mean the planner may brake with until there; 0: unknown */
};

#define CHIP_PACE_NONE (-1.0)
#define CHIP_PACE_UNKNOWN (-2.0)

/* What the path is asked for. */
struct chip_pace_in {
    double clear_z;  /* mm, machine coordinates */
    double ceiling;  /* times F, of moves that do not fall */
    double late;     /* mm travelled until an override takes effect */
    double override; /* the operator's, 1 = 100 % */
    double horizon;  /* mm, the longest braking distance */
};

/* The place that limits the tool now. */
struct chip_pace chip_path_pace(const struct chip_path *path, const struct chip_pace_in *in);

#endif
