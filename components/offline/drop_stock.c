/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_stock.c - the stock along level segments; see drop_cutter.h. */

#include "drop_parts.h"

#define HALF_DIAGONAL 0.70711 /* of a cell */

/* The columns of row `y` within reach of the path: low and high, from the left edge of the map. */
static int columns_of(const struct chip_drop_path *p, const struct chip_height_map *map, double y, double reach,
                      double *low, double *high)
{
    double a = 0.0, b = 1.0, s;
    if (fabs(p->uy) > 1e-12) {
        a = (y - reach - p->y) / p->uy;
        b = (y + reach - p->y) / p->uy;
        if (a > b) {
            s = a;
            a = b;
            b = s;
        }
        a = chip_max(a, 0.0);
        b = chip_min(b, 1.0);
    } else if (fabs(y - p->y) > reach) {
        return 0;
    }
    if (a > b) return 0;
    *low = chip_min(p->x + a * p->ux, p->x + b * p->ux) - reach - map->x0;
    *high = chip_max(p->x + a * p->ux, p->x + b * p->ux) + reach - map->x0;
    return *high >= 0.0 && *low <= map->nx * map->cell;
}

/* Whether a cell is behind a line through ahead[0], [1], across the unit vector ahead[2], [3], wherever in it its needle is. */
static int behind(const struct chip_height_map *map, const double ahead[4], int32_t i, double y)
{
    double x = map->x0 + (i + 0.5) * map->cell;
    return (x - ahead[0]) * ahead[2] + (y - ahead[1]) * ahead[3] < -HALF_DIAGONAL * map->cell;
}

double chip_drop_over_stock(const struct chip_height_map *map, const struct chip_drop_tool *tool, const double from[2],
                            const double to[2], const double *ahead, double clearance)
{
    struct chip_tool profile;
    struct chip_drop_path p = { &profile, from[0], from[1], 0.0, to[0] - from[0], to[1] - from[1], 0.0 };
    double margin =
        chip_max(1.5 * map->cell, clearance + HALF_DIAGONAL * map->cell); /* a needle is anywhere in its cell */
    double reach, best = CHIP_DROP_NOTHING, low, high;
    int32_t i, j, i1, j1;
    chip_drop_profile_of(&profile, tool);
    reach = profile.radius + margin;
    j1 = chip_drop_bin_of(chip_max(p.y, p.y + p.uy) + reach - map->y0, map->cell, map->ny);
    for (j = chip_drop_bin_of(chip_min(p.y, p.y + p.uy) - reach - map->y0, map->cell, map->ny); j <= j1; j++) {
        double y = map->y0 + (j + 0.5) * map->cell;
        if (!columns_of(&p, map, y, reach, &low, &high)) continue;
        i1 = chip_drop_bin_of(high, map->cell, map->nx);
        for (i = chip_drop_bin_of(low, map->cell, map->nx); i <= i1; i++) {
            double z = map->height[(int64_t)j * map->nx + i], d;
            if (z <= best || z <= map->z_min) continue;
            d = chip_drop_off_path(&p, map->x0 + (i + 0.5) * map->cell, y);
            if (d > reach || (ahead && behind(map, ahead, i, y))) continue;
            best = chip_max(best, z - chip_tool_height(&profile, chip_drop_clamped(d - margin, 0.0, profile.radius)));
        }
    }
    return best;
}
