/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage.h - a path of constant engagement through the level of a pocket.
 *
 * Who calls it: remap/chipwise/geometry/pocket/engage_ground.py, through the shared library. Never in realtime.
 *
 * Principle:
 *  1. Ground is cleared by a disc of the tool's radius that ran along segments: lines and arcs. Whether a place is cleared is
 *     asked of the segments themselves, by exact distance; a grid of squares only says which to ask. Of
 *     two segments that follow one another a square has one only, if that is nearer to all of it.
 *  2. The tool's engagement is the part of the front half of its circle that is not cleared: the ends of each part are found
 *     by halving.
 *  3. With the stock on the right, engagement stays at the angle a if the path heads for arg(q - p) + 90 degrees - a: p is
 *     the tool's centre, q the first place not cleared that the front half circle has, from the left. This equation is
 *     followed in short arcs.
 *  4. No step is made after which the tool could not turn away: an arc to the left of the least radius has to stay within the
 *     region, and its engagement little above a.
 *  5. If 3 does not keep to that, the path bends as far to the right as keeps to it. Along a wall the wall itself is
 *     followed.
 *  6. A path ends after a length in air or of thin chips, and where 4 cannot be any more.
 *
 * The region is one of tool centres; its contours have it on the left. Lengths mm, angles rad. */
#ifndef CHIPWISE_ENGAGE_H
#define CHIPWISE_ENGAGE_H

#include <stdint.h>

#define CHIP_ENGAGE_AIR 1     /* a trace ended in air or thin chips */
#define CHIP_ENGAGE_STUCK 2   /* it could not go on within the region */
#define CHIP_ENGAGE_LOADED 4  /* it could not go on without more engagement */
#define CHIP_ENGAGE_NO_ROOM 8 /* its array is full */

struct chip_engage;

/* Columns of an element of a path: start, end, centre, sweep (0 for a line). */
#define CHIP_ENGAGE_COLUMNS 7

/* A region of n elements for a tool of a radius, with squares of a size; next[k]: the element that follows k in its contour.
 * 0: no memory. */
struct chip_engage *chip_engage_open(long n, const double (*element)[CHIP_ENGAGE_COLUMNS], const int64_t *next,
                                     double radius, double size);
void chip_engage_close(struct chip_engage *e);

/* Whether memory was short at any time: what was computed since is wrong then. */
int chip_engage_failed(const struct chip_engage *e);

/* Distance of n points from the border of the region, positive within it [1]. */
void chip_engage_depth(struct chip_engage *e, long n, const double (*point)[2], double *depth);

/* Whether n elements stay within the region, but for `slack`: each is asked at its start, its end, and between them as far on as is
 * free about the place, by at least `stride`. */
int chip_engage_inside(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double slack,
                       double stride);

/* Clears along n elements. */
void chip_engage_clear(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS]);

/* For each of n points whether the tool there, less by `less` in radius, has its rim on cleared ground. */
void chip_engage_rim(struct chip_engage *e, long n, const double (*point)[2], double less, uint8_t *cleared);

/* Whether all that the tool, of a radius larger by `more`, sweeps along n elements is cleared; `fine`: the width of
 * a remainder that is not seen. */
int chip_engage_swept(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double more,
                      double fine);

/* Labels the places of a raster (columns, rows) that are wanted, 1: those that hang together, by a side or a corner, have one number
 * from 1 on, in the order of their first place; 0: not wanted. waiting: room for columns * rows. Returns how many there are. */
long chip_engage_patches(long columns, long rows, const uint8_t *wanted, int32_t *label, int32_t *waiting);

/* Engagement at n poses (x, y, heading) [2]. */
void chip_engage_at(struct chip_engage *e, long n, const double (*pose)[3], double *angle);

/* What the tool can reach and is not cleared: mm2, and a place of it. `fine`: the width of a remainder that is not seen. */
double chip_engage_left(struct chip_engage *e, double fine, double place[2]);

/* Clears along n elements, and before each part of at most `spacing` writes x, y, heading and engagement there [2]; returns the
 * number of rows. */
long chip_engage_along(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS], double spacing,
                       double (*out)[4], long room);

/* What a trace keeps to. */
struct chip_engage_rule {
    double angle;  /* rad: engagement to be kept */
    double escape; /* rad: more than that is not allowed while turning away */
    double rho;    /* mm: least radius of the path */
    double inset;  /* mm: kept from the border of the region */
    double step;   /* mm */
    double air;    /* mm in air after which it ends */
};

/* Follows [3] from a pose. Writes x, y, heading, engagement of each step; returns their number, and in why how it
 * ended. commit: the ground is cleared. */
long chip_engage_trace(struct chip_engage *e, const double pose[3], const struct chip_engage_rule *rule, int commit,
                       double (*out)[4], long room, int *why);

/* Elements as few as stay within `within` of n poses (x, y, heading), tangent to one another where the poses are;
 * returns their number, at most 2 (n - 1). */
long chip_engage_fit(long n, const double (*pose)[3], double within, double (*element)[CHIP_ENGAGE_COLUMNS]);

#endif
