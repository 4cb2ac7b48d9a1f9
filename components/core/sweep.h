/* sweep.h - cutting the stock along the straight way between tool positions.
 *
 * Who calls it: stock_tracker.comp (a few cells of work per servo period) and, through
 * the shared library, remap/chipwise/stock/ (a whole move at once).
 * Source: JP3131045 [0007]: the envelope of the tool moved along the path (ENV) is taken
 * from the material (WK) and its volume is VC.
 *
 * Principle:
 *  1. The way of the tool is a chain of points; each leg sweeps a capsule in XY.
 *  2. A leg is cut row by row. The work can stop after any cell and go on in the next
 *     period, so a period's cost has a bound; points that wait are kept in a short queue,
 *     and when it is full the newest point replaces the last one that waits. Work is counted
 *     in cells of a flat end, about a dozen instructions each.
 *  3. A cell well inside the capsule is cut to the lowest height any tool position of
 *     the leg has over it; a cell on the outline is cut in that share of its area that
 *     lies inside.
 *  4. What the leg before has cut already (what lies behind a tool that does not descend, and
 *     the disc below its flat part) is skipped, so the cost grows with the cells newly swept.
 *     Where the tool came straight and level to the leg's start, a cell below a round end is cut by
 *     that way too: each of its points by the tool position nearest to it, in whatever leg that was.
 *  5. Legs that wait and go on straight are made one: a falling tool sweeps its whole disc in every
 *     leg, and where that is more than a period's bound it has fewer legs, not a longer queue.
 */
#ifndef CHIPWISE_SWEEP_H
#define CHIPWISE_SWEEP_H

#include "stock.h"
#include "tool.h"

#define CW_SWEEP_QUEUE 16       /* positions that may wait for their turn */

struct cw_sweep {
    double at[3];               /* mm, tip: everything up to here is cut */
    double queue[CW_SWEEP_QUEUE][3];    /* mm, tips still to go to, oldest first */
    int waiting;                /* entries in use */
    int known;                  /* `at` is a position of the tool */
    int trail;                  /* the tool, as it is now, has cut all over at `at` */
    int row, row_end;           /* rows of the leg to queue[0] still to be cut; row < 0: not begun */
    int column;                 /* of that row the first column still to be cut */
    double run[2];              /* unit vector, heading of the last leg, */
    double straight;            /* mm it went level and straight, as far as a round end needs it [4] */
    double stray;               /* mm, what the newest leg leaves out by [5] */
};

/* Puts the tool at a place without cutting (start, tool change, after a jump). */
void cw_sweep_place(struct cw_sweep *sweep, const double tip[3]);

/* Queues a straight leg to `tip` (mm); a tip that is no finite position is passed over. */
void cw_sweep_to(struct cw_sweep *sweep, const double tip[3]);

/* Works on the queue until it is empty or the work reaches `bound`; returns the volume removed, mm3.
 * `*spent`, when not null, is increased by the work. */
double cw_sweep_run(struct cw_sweep *sweep, struct cw_stock *stock, const struct cw_tool *tool,
                    long bound, long *spent);

/* Volume (mm3) the straight way between two tips would remove; nothing is cut. `trail`: the tool
 * has cut all over at `from`. Stops after a row when `enough` mm3 are found. */
double cw_sweep_meets(const struct cw_stock *stock, const struct cw_tool *tool,
                      const double from[3], const double to[3], int trail, double enough,
                      long *spent);

#endif
