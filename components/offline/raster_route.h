/* SPDX-License-Identifier: GPL-2.0-or-later */
/* raster_route.h - the shortest route over the free places of a raster.
 *
 * Who calls it: remap/chipwise/geometry/pocket/shortest.py, through the shared library. Never in realtime.
 * Source: P. E. Hart, N. J. Nilsson and B. Raphael, IEEE Trans. SSC 4 (1968), 100-107. The same search as that module has for graphs:
 * of places with one estimate the one first in the raster goes on. */
#ifndef CHIPWISE_RASTER_ROUTE_H
#define CHIPWISE_RASTER_ROUTE_H

#include <stdint.h>

#define CHIP_RASTER_NEIGHBOURS 8 /* of a place at most */

/* A raster and the steps from a place to those beside it. */
struct chip_raster {
    int64_t columns, rows;
    const uint8_t *free;  /* (columns, rows): 1 or 0 */
    int64_t count;        /* of steps, at most CHIP_RASTER_NEIGHBOURS */
    const int64_t *step;  /* (count, 2): columns, rows */
    const double *length; /* (count) */
};

/* The numbers (column * rows + row) of the places of the shortest route between two, from the last to the first; room for all places
 * of the raster. Returns how many; 0: there is none; -1: no memory. */
long chip_raster_route(const struct chip_raster *raster, long first, long last, int64_t *route);

#endif
