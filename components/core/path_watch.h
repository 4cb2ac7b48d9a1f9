/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_watch.h - what keeps the path ahead unknown, and when that is worth saying.
 *
 * Who calls it: stock_tracker.comp, once per servo period; linuxcnc_planner.c names the check that failed.
 * Source: none.
 *
 * Without the path ahead the load is predicted from the path behind, and the removal rate can pass its target at corners
 * and arcs.
 * Principle:
 *  1. What was refused while the component was loaded stays so until LinuxCNC is started again: it counts at once.
 *  2. What fails in a period counts once it has failed for CHIP_PATH_PATIENCE_S of cutting. Periods in which the path
 *     is known take away as much, so a path that is unknown more than half of the time counts as well.
 *  3. It counts until the path has been known for as long, or the caller clears `unknown_s` because M251 begins: what is
 *     said while a program starts would take the place of the command that starts it.
 */
#ifndef CHIPWISE_PATH_WATCH_H
#define CHIPWISE_PATH_WATCH_H

#define CHIP_PATH_PATIENCE_S 1.0

enum chip_path_refusal {
    CHIP_REFUSAL_NONE = 0, /* the path is known, or nothing is to be known */
    /* while loading [1]: */
    CHIP_REFUSAL_NO_BLOCK = 1,   /* motion's shared memory is not there */
    CHIP_REFUSAL_TOO_SMALL = 2,  /* it is smaller than motion's structures */
    CHIP_REFUSAL_NOT_OURS = 3,   /* it is another user's, or other users may write it */
    CHIP_REFUSAL_NOT_MAPPED = 4, /* motion in this process has not mapped it */
    CHIP_REFUSAL_NO_QUEUE = 5,   /* motion's queue is not in memory where the structures say */
    /* in a period [2]: */
    CHIP_REFUSAL_HEARTBEAT = 6, /* motion's counter does not count one a period */
    CHIP_REFUSAL_PINS = 7,      /* motion's pins say something else */
    CHIP_REFUSAL_COUNTS = 8,    /* the queue's size and counts, or the cycle time */
    CHIP_REFUSAL_REVERSED = 9,  /* the program runs backwards */
    CHIP_REFUSAL_POSITION = 10, /* the planner is not where the axes are */
    CHIP_REFUSAL_SEGMENT = 11,  /* no segment looks like that */
    CHIP_REFUSAL_STATION = 12,  /* the first segment does not lead through the planner's position */
    CHIP_REFUSAL_CHAIN = 13,    /* a segment does not begin where the one before ends */
    CHIP_REFUSAL_EMPTY = 14     /* the queue is empty while the machine cuts */
};

struct chip_path_watch {
    double unknown_s; /* of cutting, less the time the path has been known [2] */
    int code;         /* chip_path_refusal */
};

/* One period: `refusal` of this period; -> what is to be said, a chip_path_refusal. */
int chip_path_watch_step(struct chip_path_watch *watch, int refusal, int is_cutting, double period_s);

#endif
