/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_map.h - whose the map is: a new stock, a map that another program has, a head that is not what it was.
 *
 * Internal: called by tracker.c. The numbers in brackets are those of the principle in tracker.h. */
#ifndef CHIPWISE_TRACKER_MAP_H
#define CHIPWISE_TRACKER_MAP_H

#include "tracker.h"

/* Clears the programmed path and what the look-ahead knows of it. */
static inline void forget_path(struct chip_tracker *tracker)
{
    chip_path_reset(&tracker->path);
    chip_lookahead_reset(&tracker->lookahead);
}

/* Forgets where the tool was: the next position is a new start. Queued segments are still cut [4]. */
static inline void lose_position(struct chip_tracker *tracker)
{
    tracker->tip_known = 0;
    if (tracker->state == CHIP_TRACKER_CUTTING) tracker->state = CHIP_TRACKER_FLUSHING;
    tracker->has_start = 0;
    forget_path(tracker);
    chip_guard_reset(&tracker->guard);
}

/* Functions of the core's own; nothing outside calls them. */
#pragma GCC visibility push(hidden)

/* [2] Starts a new stock on a rising edge; an impossible box leaves the old one. */
void chip_tracker_serve_request(struct chip_tracker *tracker, struct chip_stock *stock,
                                const struct chip_tracker_in *in);

/* [2] The stock is unknown: an empty map of the cell and the capacity it was made with. */
void chip_tracker_give_up_map(struct chip_tracker *tracker, struct chip_stock *stock);

/* [2] Checks that the head is as the tracker has left it: every index is computed from its numbers. */
void chip_tracker_check_head(struct chip_tracker *tracker, struct chip_stock *stock);

/* [2] 1 while another program has the map. */
int chip_tracker_serve_hold(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in);

#pragma GCC visibility pop

#endif
