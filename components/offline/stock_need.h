/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stock_need.h - which parts of a path a stock needs: those that lower it, and no others.
 *
 * Who calls it: remap/chipwise/clib/height_map.py, through the shared library. Never in realtime.
 * Source: CN105492980 [0045] (the material's shape as the path leaves it decides where a pass is wanted).
 *
 * Principle:
 *  1. A path is a chain of short segments. Every needle of the map (height_sweep.h) has a lowest height that the tool leaves
 *     of it on the whole path, and the first segment that brings it there, but for CHIP_NEED_SAME.
 *  2. A needle counts if the path lowers it by more than `least`. The segments of the needles that count are needed. When
 *     they alone are cut, in their order, no needle is left higher than the whole path leaves it, but for `least`.
 *  3. A tool comes near a needle long before it brings it to its lowest. Segments that only come near are not needed: the
 *     needed one cuts what they would have cut.
 */
#ifndef CHIPWISE_STOCK_NEED_H
#define CHIPWISE_STOCK_NEED_H

#include <stdint.h>

#include "offline/drop_cutter.h"

#define CHIP_NEED_SAME 1e-4 /* mm: a later segment that leaves a needle lower by less is not needed for it [1] */
#define CHIP_NEED_NONE 1e30 /* mm: what `lowest` holds before and after a call */

/* Marks the needed ones of n segments, from[k] to to[k] (mm), 1 in needed[k] [2]. lowest and owner: nx ny each, room to work
 * in; lowest holds CHIP_NEED_NONE before and after. Returns the number of needed segments. */
long chip_stock_need(const struct chip_height_map *map, const struct chip_drop_tool *tool, long n,
                     const double (*from)[3], const double (*to)[3], double least, float *lowest, int32_t *owner,
                     unsigned char *needed);

#endif
