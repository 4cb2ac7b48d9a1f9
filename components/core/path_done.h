/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_done.h - where the tip has been, thinned to the corners of a line through it.
 *
 * Who calls it: stock_tracker.comp in each period; remap/chipwise/stock/path_done.py reads the points from another
 * process, for the picture of the path done. A picture that looks at the position now and then makes a star of a circle.
 * Source: the strip of Reumann and Witkam (Optimizing curve segmentation in computer graphics, 1974).
 * Departs from the source: a strip ends too where the tip turns back in it.
 *
 * Principle:
 *  1. A strip begins at a point that is kept and has the direction in which the tip leaves it.
 *  2. While the tip stays within CHIP_PATH_DONE_STRIP of the strip's middle and goes on, nothing is kept.
 *  3. If it leaves the strip or turns back, the position before is kept, and the next strip begins there. So the tip
 *     was never farther than twice CHIP_PATH_DONE_STRIP from the line through the points; a quarter of it in an arc.
 *  4. The points are a ring in shared memory behind the cells of the map. `count` rises after a point is whole; a reader
 *     takes no point that may have been overwritten meanwhile. Indexes here come from the writer's own count: what
 *     another program writes into the memory moves nothing.
 */
#ifndef CHIPWISE_PATH_DONE_H
#define CHIPWISE_PATH_DONE_H

#include <stdint.h>

#include "fault.h"

#define CHIP_PATH_DONE_POINTS 8192 /* in the ring: 8 s at a point in each period of 1 ms */
#define CHIP_PATH_DONE_STRIP 0.05  /* mm, half the width of a strip: a fifth of the default cell [2] */
#define CHIP_PATH_DONE_LEAST 0.001 /* mm, of travel from which a direction is read [1] */

struct chip_path_done {                     /* in shared memory */
    volatile uint64_t count;                /* points that were ever kept [4] */
    double point[CHIP_PATH_DONE_POINTS][3]; /* mm, machine coordinates; number n is at n modulo the size */
};

struct chip_path_thinner {
    uint64_t count;                /* points kept, the writer's own [4] */
    int is_known, has_dir;         /* there is a strip; it has a direction */
    double from[3], dir[3], at[3]; /* mm: begin of the strip and its direction; the tip in the period before */
    double reach;                  /* mm along the strip so far */
};

/* A period with the tip there, mm in machine coordinates. */
void chip_path_done_step(struct chip_path_thinner *thinner, struct chip_path_done *done, const double tip[3]);

/* A period in which the position is not known: the next tip begins a strip. */
void chip_path_done_lose(struct chip_path_thinner *thinner);

#endif
