/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_sweep.h - a whole program's cuts in a height map, offline: thousands of moves a call.
 *
 * Who calls it: remap/chipwise/clib/height_map.py, through the shared library. Never in realtime: sweep.c is what the
 * stock tracker runs.
 * Source: CN105492980 [0045] (the material's shape as the path leaves it); JP3131045 [0007].
 *
 * Principle:
 *  1. The stock is one height per cell, at a needle: a point of the cell. Needles are not in the middle of their
 *     cells: row j is shifted in X by shift_x[j], column i in Y by shift_y[i], shares of a cell that fill it evenly. So
 *     a wall that is n cells long meets needles in steps of about 1/n cell across it, whatever its direction: a strip
 *     of stock far narrower than a cell is seen.
 *  2. A move is a chain of stamps of the whole tool, so close that no ridge between two is higher than
 *     CHIP_HEIGHT_RIDGE, and no step in Z more than a fifth of a cell.
 *  3. The tool cuts with its own shape and probes with one that is CHIP_HEIGHT_SKIN smaller all over. So
 *     it does not meet again what it has cut before: a wall that it follows a second time, or the ridges of [2].
 *     Stamps that are nearer to each other than LAG in XY (steep moves, moves of a few micrometres) would have cut all
 *     stock before they probe it: they cut with the smaller shape, too, and the whole tool follows LAG behind. A call whose
 *     first move is longer than LAG in XY, or along the axis, goes on where the call before has ended.
 *  4. Depth: the highest needle that a stamp meets, above the lowest position of the tip within a fifth of a cell, plus
 *     the difference from that needle to those beside it, at most 0.6 cells: between needles the stock may be
 *     that much higher. Beside walls and on level stock nothing is added.
 *  5. Straight along the axis a lower stamp meets whatever a higher one does. So the first contact of a plunge is found by halving, and a
 *     retract is over when its first stamp is: in air neither takes the time of its length. No result differs by it.
 *  6. A traverse cuts like a feed move; the caller decides by volume and depth. Before it cuts, its distance from stock is measured
 *     (height_clearance.h) if it is one of those to be judged.
 */
#ifndef CHIPWISE_HEIGHT_SWEEP_H
#define CHIPWISE_HEIGHT_SWEEP_H

#include <stdint.h>

#define CHIP_HEIGHT_RIDGE 0.002 /* mm [2] */
#define CHIP_HEIGHT_SKIN 0.004  /* mm [3] */
#define CHIP_HEIGHT_LAG 0.05    /* mm in XY: stamps that are nearer to each other spare the tool's skin [3] */
#define CHIP_HEIGHT_STILL 1e-6  /* mm in XY: a move along the axis */
#define CHIP_NEEDLE_SKIN 0.002  /* mm: of needles at places where a path has been too deep, see needles.h */
#define CHIP_NEEDLE_AREA 1e-3   /* cells: of the same ones */

struct chip_height_map {
    double x0, y0;        /* mm, corner of the map */
    double cell;          /* mm */
    double z_min, z_max;  /* mm, bottom and top of the stock; a needle at z_min has none */
    int32_t nx, ny;       /* cells */
    float *height;        /* ny rows of nx, mm */
    const float *x;       /* nx, mm from x0: i * cell */
    const float *shift_x; /* ny, mm: shift of row j in X, 0 .. cell [1] */
    const float *shift_y; /* nx, mm: shift of column i in Y */
    const double *needle_x,
        *needle_y;               /* mm, single needles besides, strip by strip of Y, in each X rising; see needles.h */
    float *needle_height;        /* mm */
    const int32_t *strip;        /* strips + 1: the first needle of each, and their number */
    double strip_y, strip_width; /* mm, where the first begins, and how wide each is */
    double needle_skin;          /* mm by which the tool that meets them is smaller in radius */
    double needle_area;          /* mm2 that each counts with in a volume */
    int32_t needles, strips;
};

/* A tool as in tool.h; the holder is a cylinder above it. */
struct chip_height_tool {
    double radius, corner, slope;    /* mm, mm, 1/tan(half the tip angle) or 0 */
    double holder_radius, stick_out; /* mm; holder_radius 0: unknown */
};

/* Result of one move. */
struct chip_height_met {
    float volume; /* mm3 removed */
    float depth;  /* mm [4]; 0: nothing met */
    float at;     /* share of the move at that depth; without a depth, the holder's */
    float holder; /* mm of stock above the lower end of the holder, within its radius */
    float
        beside; /* mm of a traverse from stock at its side, if that is less than the clearance; below 0: it is not [6] */
    float beside_at; /* share of the move there */
};

/* Which of n moves are traverses to be judged, and the clearance (mm) that they keep [6]. */
struct chip_height_traverses {
    const uint8_t *judged;
    double clearance;
};

/* Cuts n straight moves from `from` to the points `to`, one after the other; traverses: may be NULL. Returns the mm3 removed. */
double chip_height_sweep(const struct chip_height_map *map, const struct chip_height_tool *tool, const double from[3],
                         const double (*to)[3], long n, struct chip_height_met *met,
                         const struct chip_height_traverses *traverses);

/* The time (s) of each of n moves with a trapezoidal speed profile: length (mm), maximum speed (mm/s) and acceleration
 * (mm/s2) of each, and the maximum speed at its end. *speed: at the beginning of the first, then at the end of the
 * last.
 * A length of 0 takes no time. Returns the sum. */
double chip_height_times(long n, const double *length, const double *most, const double *accel, const double *corner,
                         double *end_speed, double *speed, double *seconds);

#define CHIP_TRAVERSE_POINTS 256

/* The time (s) of straight traverses between n points (mm; CHIP_TRAVERSE_POINTS are looked at), at rest at both ends. Each axis
 * has a speed (mm/s) and an acceleration (mm/s2); corners are rounded by `blend` (mm) as LinuxCNC's planner does it
 * (blendmath.c): by an arc that takes at most half of each side. */
double chip_traverse_seconds(long n, const double (*points)[3], double speed, double accel, double blend);

#define CHIP_ROUTE_POINTS 24
#define CHIP_ROUTE_SAME 1e-6 /* mm */
#define CHIP_ROUTE_BAD 1e9   /* s */

/* What a route from one place to another may do. A route is points of distance (mm, seen from above, from 0 to `length`) and height
 * (mm); it goes over three places, with a corner at one of them, or with `corner` 0 over the last two. Neither its straight sides may
 * be below `limit`, nor the arcs in its corners below `lower`: lines over points of distance and height, from 0 to `length`. Only
 * straight up at the beginning and straight down at the end it may. */
struct chip_lane {
    double place[6];             /* mm, X and Y of three places */
    double corner, length;       /* mm */
    double top;                  /* mm; no point is higher */
    double blend, speed, accel;  /* as chip_traverse_seconds() */
    const double *limit, *lower; /* pairs of mm */
    int64_t limits, lowers;
};

/* The time (s) of a route of n points, at most CHIP_ROUTE_POINTS, or CHIP_ROUTE_BAD if it may not be. With `search` its points are
 * moved first, but for both ends, as long as that saves time; it then still may be. */
double chip_traverse_improve(const struct chip_lane *lane, long n, double (*route)[2], int search);

#endif
