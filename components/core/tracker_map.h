/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_map.h - what the tracker does with the map: a new stock, a map that another program has, a head that is not what it was
 * (tracker_map.c); what it cuts in a period (tracker_cut.c); what it does not touch (tracker_clamps.c).
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

/* [6] The part of a bound that a period of this computer does. */
static inline long chip_tracker_bound(const struct chip_tracker *tracker, long bound)
{
    return bound * tracker->work_percent / 100;
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

/* [4] Queues and cuts the segment since the last period; returns its work. */
long chip_tracker_cut(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                      const double tip[3]);

/* [4] Cutting is off: finishes the queued segments, then forgets the position; returns its work. */
long chip_tracker_flush(struct chip_tracker *tracker, struct chip_stock *stock);

/* [5] Whether all feeds before a traverse are in the map. Steps of the traverse itself may wait: what they leave is met. */
int chip_tracker_feeds_are_cut(const struct chip_tracker *tracker);

/* Whether the machine moved in this period while it might have cut. */
int chip_tracker_has_moved(const struct chip_tracker *tracker, const struct chip_tracker_in *in);

/* [1] [3] Cutting is off. The length of another tool, its numbers and the word that it is the described one come in any order:
 * it still begins where it appeared, unless it has moved at feed meanwhile. */
void chip_tracker_keep_start(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3]);

/* [2] 1 while another program has the map. */
int chip_tracker_serve_hold(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in);

/* [5] Whether the tool has to stop before a clamp; `bad`: fault of the position. */
void chip_tracker_watch_clamps(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3],
                               int bad, struct chip_tracker_out *out);

#pragma GCC visibility pop

#endif
