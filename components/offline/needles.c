/* SPDX-License-Identifier: GPL-2.0-or-later */
/* needles.c - see needles.h. */
#include <math.h>

#include "core/chip_math.h"
#include "needles.h"
#include "swept.h"

int32_t chip_needles_from(const struct chip_height_map *map, int32_t strip, double x)
{
    int32_t low = map->strip[strip], high = map->strip[strip + 1];
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        if (map->needle_x[middle] < x)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

int32_t chip_needles_strip(const struct chip_height_map *map, double y)
{
    return (int32_t)chip_max(-1.0, chip_min(floor((y - map->strip_y) / map->strip_width), map->strips));
}

/* Depth (mm) at which a move meets a needle, 0 if it does not [1]; *at: the share of the move. */
static double depth_of(const struct chip_swept *m, const struct chip_tool *tool, double skin, double x, double y,
                       double height, double *at)
{
    double last, off2, z;
    if (!chip_swept_within(m, x, y, tool->radius - skin, at, &last)) return 0.0;
    z = m->z + *at * m->dz;
    if (height > z + tool->shoulder + CHIP_HEIGHT_SKIN) return height - z;
    if (m->length2 <= CHIP_SWEPT_STILL) return 0.0;
    z = chip_swept_nearest(m, x, y, &off2);
    *at = z < *at ? *at : z > last ? last : z;
    return height > chip_swept_at(m, tool, x, y, *at) + CHIP_HEIGHT_SKIN ? height - m->z - *at * m->dz : 0.0;
}

/* What a move meets and leaves of one needle. */
static void cut_needle(const struct chip_height_map *map, const struct chip_swept *m, const struct chip_tool *tool,
                       int32_t i, struct chip_height_met *met)
{
    double x = map->needle_x[i], y = map->needle_y[i], height = (double)map->needle_height[i], depth, left, at;
    depth = depth_of(m, tool, map->needle_skin, x, y, height, &at);
    if (depth > (double)met->depth) {
        met->depth = (float)depth;
        met->at = (float)at;
    }
    left = chip_swept_height(m, tool, x, y);
    if (left >= height) return;
    left = left > map->z_min ? left : map->z_min;
    met->volume += (float)((height - left) * map->needle_area);
    map->needle_height[i] = (float)left;
}

void chip_needles_cut(const struct chip_height_map *map, const struct chip_tool *tool, const double a[3],
                      const double b[3], struct chip_height_met *met)
{
    struct chip_swept m = chip_swept_of(a, b);
    double end = (a[0] > b[0] ? a[0] : b[0]) + tool->radius, low = (a[1] < b[1] ? a[1] : b[1]) - tool->radius;
    double high = (a[1] > b[1] ? a[1] : b[1]) + tool->radius, bottom = a[2] < b[2] ? a[2] : b[2];
    int32_t strip = chip_needles_strip(map, low), last = chip_needles_strip(map, high), i;
    bottom = chip_max(bottom, map->z_min + CHIP_HEIGHT_SKIN);
    for (strip = strip > 0 ? strip : 0; strip <= last && strip < map->strips; strip++)
        for (i = chip_needles_from(map, strip, (a[0] < b[0] ? a[0] : b[0]) - tool->radius);
             i < map->strip[strip + 1] && map->needle_x[i] <= end; i++)
            if (map->needle_y[i] >= low && map->needle_y[i] <= high && (double)map->needle_height[i] > bottom)
                cut_needle(map, &m, tool, i, met);
}
