/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep.h - cutting the stock along the straight path between tool positions.
 *
 * Who calls it: tracker.c (a few cells of work per servo period) and, through
 * the shared library, remap/chipwise/stock/ (a whole move at once).
 * Source: JP3131045 [0007]: the envelope of the tool moved along the path (ENV) is taken
 * from the material (WK) and its volume is VC.
 *
 * Principle:
 *  1. The tool's path is a chain of points; each segment sweeps a capsule in XY.
 *  2. A segment is cut row by row. The work can stop after any cell and continue in the next
 *     period, so a period's cost is bounded. Points that wait are kept in a short queue;
 *     when it is full, the one of them that can be left out with the least deviation is. Work is counted
 *     in cells of a flat end, about a dozen instructions each.
 *  3. A cell well inside the capsule is cut to the lowest height any tool position of
 *     the segment has over it; a cell on the outline is cut in that share of its area that
 *     lies inside. Below a round end the lowest height is that at the end of the segment if it falls towards the cell,
 *     otherwise a search in what is convex finds it (sweep_lowest.c).
 *  4. What the segment before has cut already (behind a tool that does not descend, and
 *     the disc below its flat part) is skipped, so the cost grows with the newly swept cells.
 *     If the tool came straight to the segment's start, level or sloping, a cell below a round end is cut by
 *     that path too: each of its points by the lowest tool position, in whatever segment that was.
 *  5. Segments that wait and continue straight are merged: a falling tool sweeps its whole disc in every
 *     segment, and if that exceeds a period's bound there are fewer segments, not a longer queue. The more wait the more
 *     may a merged one deviate.
 */
#ifndef CHIPWISE_SWEEP_H
#define CHIPWISE_SWEEP_H

#include "stock.h"
#include "tool.h"

#define CHIP_SWEEP_QUEUE 16 /* positions that may wait */

struct chip_sweep {
    double at[3];                       /* mm, tip: everything up to here is cut */
    double queue[CHIP_SWEEP_QUEUE][3];  /* mm, tips still to go to, oldest first */
    int waiting;                        /* entries in use */
    int known;                          /* `at` is a position of the tool */
    int start_is_cut;                   /* the tool, as it is now, has cut all round at `at` */
    int row, row_end;                   /* rows of the segment to queue[0] still to be cut; row < 0: not begun */
    uint32_t finished;                  /* segments that have been cut, since the beginning; it wraps */
    int column;                         /* the first column of that row still to be cut */
    double heading[2];                  /* unit vector of the last segment in XY, */
    double rise;                        /* mm per mm of XY it rose by, */
    double straight;                    /* mm of XY it went straight, as far as a round end needs it [4] */
    double deviation[CHIP_SWEEP_QUEUE]; /* mm the segment to each tip deviates by at most because it was merged [5] */
};

/* Puts the tool at a position without cutting (start, tool change, after a jump). */
void chip_sweep_start(struct chip_sweep *sweep, const double tip[3]);

/* Queues a straight segment to `tip` (mm); a tip that is not a finite position is ignored. */
void chip_sweep_to(struct chip_sweep *sweep, const double tip[3]);

/* Work of a level step of the tool, its end being in stock all round. */
long chip_sweep_level_work(const struct chip_stock *stock, const struct chip_tool *tool);

/* Works on the queue until it is empty or the work reaches `bound`; returns the volume removed, mm3.
 * `*spent`, if not null, is increased by the work. */
double chip_sweep_run(struct chip_sweep *sweep, struct chip_stock *stock, const struct chip_tool *tool, long bound,
                      long *spent);

/* Volume (mm3) the straight path between two tips would remove; nothing is cut. `start_is_cut`: the tool
 * has cut all round at `from`. Stops after a row when `enough` mm3 are found. */
double chip_sweep_meets(const struct chip_stock *stock, const struct chip_tool *tool, const double from[3],
                        const double to[3], int start_is_cut, double enough, long *spent);

#endif
