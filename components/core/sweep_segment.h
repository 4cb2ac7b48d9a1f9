/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_segment.h - one segment of a sweep, and its rows.
 *
 * Internal: sweep.c makes the segments of a path, sweep_row.c cuts their rows. The numbers in brackets are those of the
 * principle in sweep.h. */
#ifndef CHIPWISE_SWEEP_SEGMENT_H
#define CHIPWISE_SWEEP_SEGMENT_H

#include "chip_math.h"
#include "sweep.h"

#define CHIP_ROW_DONE 0x7fffffff /* a column beyond all rows */

struct chip_sweep_segment { /* a segment with what all its cells share; mm */
    double x, y, z;         /* start of the tip */
    double dx, dy, dz;      /* to the end */
    double length, length2; /* of the XY part; squared */
    double per_length2;     /* 1 / length2; 0 for a plunge */
    double earliest;        /* share of the segment, not above 0: the tool was on its line from there on [4] */
    double reach;           /* radius in which the tool can be below the stock's top */
    double margin;          /* half the diagonal of a cell */
    double inner2, outer2;  /* mm2: nearer to the axis a cell is inside, beyond it outside; -1: none is inside */
    /* mm2: nearer to the axis a cell lies below the flat part of the end; -1: there is none */
    double floor2;
    double cell_area;         /* mm2 */
    float bottom;             /* lowest tip: nothing is cut below */
    int flat_end;             /* the tool's end is flat */
    int flat;                 /* and the height is constant along the segment */
    int skip_disc, skip_back; /* `at` has cut the disc, what lies behind [4] */
    long *work;               /* counted against a period's bound [2] */
};

struct chip_span {
    int first, last;
};

/* Cuts one row of a segment, or copies of its cells (`dry`), from a column on; returns the volume in mm3.
 * `*column` is where to continue: CHIP_ROW_DONE if the row is done, otherwise the bound on the work was reached [2]. */
__attribute__((visibility("hidden"))) double chip_sweep_row(const struct chip_sweep_segment *segment,
                                                            const struct chip_stock *stock,
                                                            const struct chip_tool *tool, int iy, int dry, int *column,
                                                            long bound);

#endif
