/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section_wall.c - stock in front of a wall of the tool, read at a point: see section_parts.h and section.h; the numbers in
 * brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_EDGE_CELLS 1.5 /* cells from a band's edge within which stock beyond it would be read [8] */
#define CHIP_EDGE_NODES 3   /* cost of a point there, in points elsewhere */
/* a cell of which the tool covers less than a quarter counts less, down to nothing [8] */
#define CHIP_PARTLY_COVERED 4.0
#define CHIP_WALL_NODES 3    /* cost of a point near a wall of the stock, in points elsewhere */
#define CHIP_SAME_LEVEL 0.02 /* of the height of a wall: heights this similar are the same [10] */
#define CHIP_WALL_HALF 0.5   /* cells on either side of a wall over which it is spread [10] */
/* of a wall's height, four times the change over two cells: less has no clear direction [10] */
#define CHIP_CLEAR_WALL 0.5
#define CHIP_ALONG 0.7 /* cosine between the wall's normal and that of the path, from which it runs along it */

/* [8] A point beside the path, which bends: how far beside it, mm, and the direction away from it. */
struct beside {
    double off;
    double nx, ny;
};

/* [8] Of a point of the tool's circle. The path's centre of curvature is 1 / curvature beside the axis. */
static struct beside beside_path(const struct chip_pose *at, double ahead, double side)
{
    double along = -2.0 * at->half_curvature * ahead, across = 1.0 - 2.0 * at->half_curvature * side, length;
    struct beside point = { side, -at->hy, at->hx };
    if (at->half_curvature != 0.0) {
        length = chip_max(chip_sqrt(along * along + across * across), 1e-9);
        point.off = 2.0 * (side - at->half_curvature * (ahead * ahead + side * side)) / (1.0 + length);
        point.nx = (along * at->hx - across * at->hy) / length;
        point.ny = (along * at->hy + across * at->hx) / length;
    }
    if (point.off < 0.0) {
        point.off = -point.off;
        point.nx = -point.nx;
        point.ny = -point.ny;
    }
    return point;
}

/* [8] The part of a cell's stock between two heights that lies in the share k the tool is going to cover. */
static double inside(const struct chip_stock *stock, const struct chip_cell *cell, double k, double low, double high)
{
    double cut = cell->cut * (1.0 / CHIP_FULL), top, rest;
    if (!cell->cut || k >= 1.0) return cell_between(stock, cell, low, high);
    if (cell->drop & CHIP_RIM)
        return cell_between(stock, cell, low, high) / chip_max(1.0 - chip_cell_levels(stock, cell).gone, k);
    top = chip_clamp(cell->top, low, high) - low;
    rest = chip_clamp(cell->top - cell->drop * stock->drop_unit, low, high) - low;
    return k <= cut ? rest : top + cut / k * (rest - top);
}

/* Cell i of the four. */
static inline const struct chip_cell *corner(const struct chip_stock *stock, const struct chip_corners *corners, int i)
{
    return corners->cell + (i & 1) + (i >> 1) * (long)(stock->nx + 2);
}

/* [8] The mean of the four cells' stock that is nearer to the path than the tool's edge; `outside`: distance of the point from
 * that edge, in cells. */
static double mean_inside(const struct chip_stock *stock, const struct chip_corners *corners,
                          const struct beside *beside, double outside, double low, double high)
{
    double sum = 0.0, weights = 0.0;
    int i;
    for (i = 0; i < 4; i++) {
        double dx = (i & 1) - corners->fx, dy = (i >> 1) - corners->fy;
        double k = chip_cell_covered(outside + dx * beside->nx + dy * beside->ny, beside->nx, beside->ny);
        double weight = (1.0 - fabs(dx)) * (1.0 - fabs(dy)) * chip_min(1.0, CHIP_PARTLY_COVERED * k);
        if (weight <= 0.0) continue;
        weights += weight;
        sum += weight * inside(stock, corner(stock, corners, i), k, low, high);
    }
    return weights > 1e-6 ? sum / weights : 0.0;
}

/* [10] A wall of the stock: its two heights above `low`, mm, the direction to the higher one, and how far a point lies on that
 * side of it, in cells. */
struct wall {
    double top, rest;
    double nx, ny;
    double off;
};

/* Distance of the wall from a cell's middle, in cells, towards its higher side: the share `cut` of the cell lies on the other. */
static double wall_in_cell(double cut, double nx, double ny)
{
    double a = fabs(nx), b = fabs(ny), rest;
    if (a < b) {
        double s = a;
        a = b;
        b = s;
    }
    if (fabs(cut - 0.5) * a <= 0.5 * (a - b)) return (cut - 0.5) * a;
    rest = 0.5 * (a + b) - chip_sqrt(2.0 * a * b * chip_min(cut, 1.0 - cut));
    return cut < 0.5 ? -rest : rest;
}

/* [10] The one of the four cells that has a wall and is nearest to the point; -1: none, or the rim of the stock. */
static int nearest_wall(const struct chip_stock *stock, const struct chip_corners *corners)
{
    double most = 0.0;
    int i, best = -1;
    for (i = 0; i < 4; i++) {
        const struct chip_cell *cell = corner(stock, corners, i);
        double share;
        if (!cell->cut) continue;
        if (cell->drop & CHIP_RIM) return -1;
        share = (i & 1 ? corners->fx : 1.0 - corners->fx) * (i >> 1 ? corners->fy : 1.0 - corners->fy);
        if (share <= most) continue;
        most = share;
        best = i;
    }
    return best;
}

/* [10] Whether a height above low is one of the wall's. */
static int is_level(const struct wall *wall, double height)
{
    double near = CHIP_SAME_LEVEL * (wall->top - wall->rest);
    return fabs(height - wall->top) <= near || fabs(height - wall->rest) <= near;
}

/* Height of a cell's cut part above low, mm. */
static double cut_height(const struct chip_stock *stock, const struct chip_cell *cell, double low, double high)
{
    return chip_clamp(cell->top - (cell->cut ? cell->drop : 0) * stock->drop_unit, low, high) - low;
}

/* [10] The wall near the point, if its four cells know of no more than two heights; 0: another case. */
static int find_wall(const struct chip_stock *stock, const struct chip_corners *corners, double low, double high,
                     struct wall *wall)
{
    int best = nearest_wall(stock, corners), x, y, i;
    const struct chip_cell *cell;
    double gx, gy, length, v[9];
    if (best < 0) return 0;
    x = best & 1;
    y = best >> 1;
    cell = corner(stock, corners, best);
    if (corners->ix + x < 1 || corners->iy + y < 1 || corners->ix + x > stock->nx || corners->iy + y > stock->ny)
        return 0;
    wall->top = chip_clamp(cell->top, low, high) - low;
    wall->rest = cut_height(stock, cell, low, high);
    if (!(wall->top - wall->rest > CHIP_MIN_CONTACT)) return 0;
    for (i = 0; i < 4; i++) {
        const struct chip_cell *other = corner(stock, corners, i);
        if (!is_level(wall, chip_clamp(other->top, low, high) - low)) return 0;
        if (other->cut && !is_level(wall, cut_height(stock, other, low, high))) return 0;
    }
    for (i = 0; i < 9; i++)
        v[i] = cell_between(stock, cell + (i % 3 - 1) + (i / 3 - 1) * (long)(stock->nx + 2), low, high);
    gx = v[2] + 2.0 * v[5] + v[8] - v[0] - 2.0 * v[3] - v[6];
    gy = v[6] + 2.0 * v[7] + v[8] - v[0] - 2.0 * v[1] - v[2];
    length = chip_sqrt(gx * gx + gy * gy);
    if (!(length > CHIP_CLEAR_WALL * (wall->top - wall->rest))) return 0;
    wall->nx = gx / length;
    wall->ny = gy / length;
    wall->off = (corners->fx - x) * wall->nx + (corners->fy - y) * wall->ny
              - wall_in_cell(cell->cut * (1.0 / CHIP_FULL), wall->nx, wall->ny);
    return 1;
}

/* [10] Height at a point near a wall: the wall is spread evenly to both sides, less where it is near the tool's edge, which is
 * `outside` cells away. */
static double at_wall(const struct wall *wall, const struct beside *beside, double outside)
{
    double half = CHIP_WALL_HALF, along = wall->nx * beside->nx + wall->ny * beside->ny, share;
    if (fabs(along) > CHIP_ALONG) {
        half = chip_min(half, (along > 0.0 ? wall->off : -wall->off) - outside);
        if (half <= 0.0) return along > 0.0 ? wall->rest : wall->top;
    }
    share = chip_clamp(0.5 + 0.5 * wall->off / half, 0.0, 1.0);
    return wall->rest + share * (wall->top - wall->rest);
}

/* Whether one of the four cells is cut in part, or has stock in part. */
static inline __attribute__((always_inline)) int has_part(const struct chip_stock *stock,
                                                          const struct chip_corners *corners)
{
    const struct chip_cell *a = corners->cell, *b = a + stock->nx + 2;
    return (a[0].cut | a[1].cut | b[0].cut | b[1].cut) != 0;
}

double chip_wall_between(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_point *point,
                         struct chip_strip *strip, double low)
{
    struct chip_corners corners;
    struct wall wall;
    struct beside beside;
    int near_edge = fabs(point->side) > strip->ended - CHIP_EDGE_CELLS / at->per_cell, walled;
    double outside;
    strip->walled = 1;
    if (!find_corners(stock, at, point->x, point->y, &corners)) return 0.0;
    strip->walled = has_part(stock, &corners) || corners.ix == 0 || corners.iy == 0 || corners.ix >= stock->nx
                 || corners.iy >= stock->ny;
    walled = strip->walled && !(strip->margin > 0.0) && find_wall(stock, &corners, low, strip->high, &wall);
    if (!near_edge && !walled) return between_corners(stock, &corners, low, strip->high);
    beside = beside_path(at, point->front, point->side);
    outside = (beside.off - strip->ended) * at->per_cell;
    if (walled) {
        strip->nodes += CHIP_WALL_NODES - 1;
        return at_wall(&wall, &beside, outside);
    }
    strip->nodes += CHIP_EDGE_NODES - 1;
    return mean_inside(stock, &corners, &beside, outside, low, strip->high);
}
