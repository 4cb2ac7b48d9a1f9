/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_patches.c - see engage.h: places of a raster that hang together. */
#include "engage.h"

/* Labels the neighbours of a place that are wanted and have no number, and lets them wait. */
static long spread(const long size[2], const uint8_t *wanted, int32_t *label, int32_t *waiting, long count)
{
    long at = waiting[--count], i = at / size[1], j = at % size[1], di, dj;
    for (di = -1; di <= 1; di++)
        for (dj = -1; dj <= 1; dj++) {
            long near = at + di * size[1] + dj;
            if (i + di < 0 || i + di >= size[0] || j + dj < 0 || j + dj >= size[1]) continue;
            if (!wanted[near] || label[near]) continue;
            label[near] = label[at];
            waiting[count++] = (int32_t)near;
        }
    return count;
}

long chip_engage_patches(long columns, long rows, const uint8_t *wanted, int32_t *label, int32_t *waiting)
{
    long size[2] = { columns, rows }, found = 0, k, count;
    for (k = 0; k < columns * rows; k++) label[k] = 0;
    for (k = 0; k < columns * rows; k++) {
        if (!wanted[k] || label[k]) continue;
        label[k] = (int32_t)++found;
        waiting[0] = (int32_t)k;
        for (count = 1; count > 0;) count = spread(size, wanted, label, waiting, count);
    }
    return found;
}
