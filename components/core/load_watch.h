/* SPDX-License-Identifier: GPL-2.0-or-later */
/* load_watch.h - whether a load that was known is not known any more, and nobody has decided what holds instead.
 *
 * Who calls it: stock_tracker.comp, once per servo period, after the tracker.
 * Source: none.
 *
 * The feed law falls back to F while the tracker is not ready. F is the feed of a light cut on many programs: a tool in a
 * full slot would go twice as fast because a process has died.
 * Principle:
 *  1. A load that was known once and is not any more is lost, whatever the reason: volumetric_feed.comp lets the feed
 *     rise no further (feed_hold.h).
 *  2. It is found when the tracker is ready again.
 *  3. Not if nobody followed the tool meanwhile (no heartbeat, or another monitor has taken over) and tool or stock are
 *     not those of the moment in which it was lost: then it stays lost.
 *  4. A person's or a program's decision ends it: M251, M252, a program's start or abort, machine off.
 *  5. What was never known cannot be lost: M251 that finds no stock leaves F.
 */
#ifndef CHIPWISE_LOAD_WATCH_H
#define CHIPWISE_LOAD_WATCH_H

#define CHIP_LOAD_WATCH_SIZES 4 /* diameter, corner radius, tip angle, flute length */

/* Members carry the name of the pin they come from and their unit; mu: machine units. */
struct chip_load_watch_in {
    int is_ready;                          /* stock, tool and position are known */
    int is_unwatched;                      /* nobody follows the tool, or another monitor has begun to [3] */
    int stock_changes;                     /* the stock is defined or written anew */
    int is_decided;                        /* [4] */
    int tool_in_spindle_number;            /* by the machine itself */
    double tool_mu[CHIP_LOAD_WATCH_SIZES]; /* as it was described */
};

struct chip_load_watch {
    int is_known;      /* the load was known under the decision in force */
    int is_lost;       /* [1] */
    int was_unwatched; /* since it was lost [3] */
    int stock_changed; /* since it was lost [3] */
    int tool_number;   /* of the last period with a known load */
    double tool_mu[CHIP_LOAD_WATCH_SIZES];
};

/* One period; returns is_lost. */
int chip_load_watch_step(struct chip_load_watch *watch, const struct chip_load_watch_in *in);

#endif
