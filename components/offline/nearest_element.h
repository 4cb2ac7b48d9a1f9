/* SPDX-License-Identifier: GPL-2.0-or-later */
/* nearest_element.h - how far points are from the nearest of many lines and arcs.
 *
 * Who calls it: remap/chipwise/geometry/base/search.py, through the shared library. Never in realtime.
 * Source: branch and bound on a tree of boxes (N. Roussopoulos, S. Kelley, F. Vincent, "Nearest neighbor queries", 1995).
 *
 * Principle:
 *  1. The tree is bottom-up: a box of level k + 1 holds the CHIP_TREE_FAN boxes of level k that follow one another.
 *  2. The search goes down depth first, into the nearest box first, and leaves out boxes that are further than the nearest
 *     element so far. It begins with the element that was nearest to the point before.
 *  3. Distances are those of remap/chipwise/geometry/base/elements.py, operation for operation: the same to the last bit. So
 *     this file is compiled without reordering of operations.
 */
#ifndef CHIPWISE_NEAREST_ELEMENT_H
#define CHIPWISE_NEAREST_ELEMENT_H

#include <stdint.h>

#define CHIP_TREE_FAN 4
#define CHIP_TREE_LEVELS 32

/* n elements, and the boxes of their tree, level by level from the leaves up. All lengths mm. */
struct chip_element_tree {
    int64_t n;
    int64_t levels;              /* at most CHIP_TREE_LEVELS */
    const int64_t *first;        /* (levels + 1): where each level begins in low and high */
    const double *low, *high;    /* (first[levels], 2): corners of the boxes */
    const double *start, *end;   /* (n, 2) */
    const double *centre;        /* (n, 2) */
    const double *radius;        /* (n) */
    const double *middle;        /* (n, 2): unit vector from the centre to the middle of an arc */
    const double *cos_half;      /* (n): cosine of half the sweep */
    const unsigned char *is_arc; /* (n) */
};

/* For each of m points (m, 2) mm the distance to the nearest element, mm: exact if it is below reach (m); else something not
 * below it, or infinite. */
void chip_nearest_gaps(const struct chip_element_tree *tree, long m, const double *point, const double *reach,
                       double *gap);

#endif
