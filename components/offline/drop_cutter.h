/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_cutter.h - the lowest tip of a tool that does not enter a model of triangles: at points, and along segments.
 *
 * Who calls it: remap/chipwise/clib/drop_cutter.py, through the shared library. Never in realtime.
 * Source: the drop-cutter problem (K. Chuang, C. Chen, Z. Yan, Int. J. Adv. Manuf. Technol. 20, 2002: cutter location from
 * facet, edge and vertex contact); the pick-feed abstract needs its Pe and Ps.
 *
 * Principle:
 *  1. The tool is the profile g(r) of tool.h, convex and rising. Its tip may be at z if z + g(|p - axis|) >= p.z for every
 *     point p of the model within its radius. So the lowest tip is the maximum of p.z - g(|p - axis|), which over one
 *     triangle is concave: it is where the facet has the profile's slope, else on an edge, else at a vertex.
 *  2. Which side of a triangle is outside plays no part, and a triangle without area is its edges.
 *  3. The triangles are sorted by their highest point, falling; bins of a uniform grid list them in that order. A bin, or
 *     the rest of its list, is left out once nothing in it can be above what has been found.
 *  4. Along a segment on which the tip moves evenly the same maximum over one triangle is concave in the station, because
 *     p.z - g is concave in point and station together. So a bracket that shrinks finds the largest excess of the model
 *     over the path between two points, not only at points.
 */
#ifndef CHIPWISE_DROP_CUTTER_H
#define CHIPWISE_DROP_CUTTER_H

#include <stdint.h>

#include "offline/height_sweep.h"

#define CHIP_DROP_NOTHING -1e30 /* mm: the tool meets nothing there */

struct chip_drop_mesh {
    double bin;            /* mm, side of a bin; bin (0, 0) begins at the origin of the triangles' coordinates */
    int32_t nx, ny;        /* bins */
    int32_t n;             /* triangles */
    uint32_t stamp;        /* of the last search */
    const float *triangle; /* n x 9: x y z of three vertices, mm; highest triangle first [3] */
    const float *top;      /* n, mm: the highest point of each */
    int32_t *first;        /* nx ny + 1: where each bin's part of `member` begins */
    int32_t *member;       /* triangles of the bins */
    float *bin_top;        /* nx ny, mm: the highest triangle of each */
    uint32_t *seen;        /* n: stamp of the last search that met the triangle */
};

/* A tool as in tool.h. */
struct chip_drop_tool {
    double radius, corner; /* mm */
    double half_angle;     /* rad, of the cone; 0: none */
};

/* How many entries the bins' lists have together. */
int64_t chip_drop_entries(const struct chip_drop_mesh *mesh);

/* Fills first, member (as long as chip_drop_entries said) and bin_top. */
void chip_drop_fill(struct chip_drop_mesh *mesh);

/* Lowest tip (mm) at each of n points; what z holds is the floor it does not go below. */
void chip_drop_points(struct chip_drop_mesh *mesh, const struct chip_drop_tool *tool, long n, const double (*xy)[2],
                      double *z);

/* How far (mm) the model rises above each of n segments, from[k] to to[k], on which the tip moves evenly: the largest
 * lowest tip minus tip [4], and its share of the segment. What excess holds is the least that is looked for. */
void chip_drop_excess(struct chip_drop_mesh *mesh, const struct chip_drop_tool *tool, long n, const double (*from)[3],
                      const double (*to)[3], double *excess, double *share);

/* The lowest height (mm) of the tip on a level segment that keeps the tool off the stock of a height map (height_sweep.h), by
 * the width of a cell, and its side by `clearance` (mm); CHIP_DROP_NOTHING where there is no stock. ahead, if it is not 0: a point and a unit vector; only stock
 * that is ahead of the point counts: of the other stock a tool that has cut at the point goes away. */
double chip_drop_over_stock(const struct chip_height_map *map, const struct chip_drop_tool *tool, const double from[2],
                            const double to[2], const double *ahead, double clearance);

#endif
