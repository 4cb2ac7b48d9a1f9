/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_segment.h - one segment of a sweep, and its rows.
 *
 * Internal: sweep.c makes the segments of a path, sweep_row.c cuts their rows, sweep_level.c most cells of a round end, both by
 * sweep_curved.c, and sweep_lowest.c says how high a segment leaves a point. The numbers in brackets are those of the
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
    int round_not_up;         /* the end is not flat, and the segment does not rise */
    int back_is_cut;          /* a round end falls, and has cut at the start what it now moves away from [4] */
    int skip_disc, skip_back; /* `at` has cut the disc, what lies behind [4] */
    /* mm2: all of a cell whose middle is that far from the axis is below the arc, or the cone, and within the rim */
    double arc_from2, arc_to2, cone_from2, cone_to2;
    long *work; /* counted against a period's bound [2] */
};

struct chip_span {
    int first, last;
};

#define CHIP_INLINE inline __attribute__((always_inline)) /* executed for every cell */

#define CHIP_WORK_ROW 35      /* work of a row, in cells of a flat end: about a dozen instructions each [2] */
#define CHIP_WORK_CURVED 14   /* work of a cell below an end that is not flat [2] */
#define CHIP_WORK_EDGE 20     /* of a cell on the outline [2] */
#define CHIP_GAUSS_REACH 0.41 /* cells from a cell's middle to the points it is read at */
#define CHIP_GAUSS_STEP 0.28867513459481287 /* of it in X and in Y: 1 / (2 sqrt 3) */

/* Distance^2 of a point (relative to the segment's start) from the tool's axis at t. */
static CHIP_INLINE double axis_distance2(const struct chip_sweep_segment *segment, double px, double py, double t)
{
    double ex = px - t * segment->dx, ey = py - t * segment->dy;
    return ex * ex + ey * ey;
}

/* Profile of the tool at the distance^2 r2 from its axis; constant beyond its rim. */
static CHIP_INLINE double profile(const struct chip_tool *tool, double r2)
{
    double r = 0.0, rest;
    if (r2 >= tool->radius * tool->radius) return tool->shoulder;
    if (r2 > tool->r_arc * tool->r_arc) return tool->arc_top + tool->slope * (chip_sqrt(r2) - tool->r_arc);
    if (tool->r_flat > 0.0) {
        if (r2 <= tool->r_flat * tool->r_flat) return 0.0;
        r = chip_sqrt(r2) - tool->r_flat;
        r2 = r * r;
    }
    rest = tool->corner * tool->corner - r2;
    return rest > 0.0 ? tool->corner - chip_sqrt(rest) : tool->corner;
}

/* Whether a cell whose stock is at most `top` high has been cut as a whole: it is a slope itself then. */
static CHIP_INLINE int is_slope(const struct chip_cell *cell, float top)
{
    return cell->top < top && !CHIP_FAULTY(ROUND_END_AGAIN);
}

/* Share of the segment at which it is nearest to a point. */
static CHIP_INLINE double nearest_on(const struct chip_sweep_segment *segment, double px, double py)
{
    double t = (px * segment->dx + py * segment->dy) * segment->per_length2;
    CHIP_FAULT(PLUNGE_OUTLINE_MISSED, if (segment->length2 <= 0.0) return 0.0);
    if (segment->length2 <= 0.0) return segment->dz < 0.0 ? 1.0 : 0.0; /* the lower end of a plunge */
    return t < segment->earliest ? segment->earliest : (t > 1.0 ? 1.0 : t);
}

/* Lowest tool surface over a point along the segment, mm; nearest: nearest_on() of it. */
double chip_sweep_lowest(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double px, double py,
                         double nearest);

#pragma GCC visibility push(hidden)

/* Cuts one row of a segment, or copies of its cells (`dry`), from a column on; returns the volume in mm3.
 * `*column` is where to continue: CHIP_ROW_DONE if the row is done, otherwise the bound on the work was reached [2]. */
double chip_sweep_row(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                      const struct chip_tool *tool, int iy, int dry, int *column, long bound);

/* Cuts a cell below a curved end, which is `z` above its four points; returns the volume in mm3. */
double chip_sweep_curved(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                         struct chip_cell *cell, const double z[4]);

/* Cuts the cells ix .. last of a row of a segment that does not rise, as long as they lie well inside below a curved end,
 * beyond the segment's end if it falls, and the bound on the work is not reached; adds the volume to *removed, mm3. (x0, y): middle of the row's cell 0 from the
 * segment's start. Returns the column of the first cell not cut. */
int chip_sweep_level(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                     const struct chip_tool *tool, struct chip_cell *cells, int ix, int last, double x0, double y,
                     long bound, double *removed);

#pragma GCC visibility pop

#endif
