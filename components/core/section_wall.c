/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section_wall.c - stock in front of a wall of the tool, read at a point: see section_parts.h and section.h; the numbers in
 * brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_EDGE_NODES 3 /* cost of a point there, in points elsewhere */
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

/* The four cells round a point, each number as in struct two_cells: of the two with the lower Y, and of the others. */
struct four_cells {
    pair top[2], rest[2], share[2], mean[2];
};

/* They are read once for all that follows. */
static void read_four(const struct chip_stock *stock, const struct chip_corners *corners, double low, double high,
                      struct four_cells *four)
{
    const struct chip_cell *cell = corners->cell;
    struct two_cells two = read_two(stock, cell, cell + 1, low, high);
    four->top[0] = two.top;
    four->rest[0] = two.rest;
    four->share[0] = two.share;
    four->mean[0] = two.mean;
    cell += stock->nx + 2;
    two = read_two(stock, cell, cell + 1, low, high);
    four->top[1] = two.top;
    four->rest[1] = two.rest;
    four->share[1] = two.share;
    four->mean[1] = two.mean;
}

/* Number i of four. */
static inline __attribute__((always_inline)) double of(const pair four[2], int i) { return ((const double *)four)[i]; }

/* [8] The part of cell i's stock that lies in the share k the tool is going to cover. */
static inline __attribute__((always_inline)) double inside(const struct chip_stock *stock,
                                                           const struct chip_corners *corners,
                                                           const struct four_cells *four, int i, double k)
{
    const struct chip_cell *cell = corners->cell + (i & 1) + (i & 2 ? (long)(stock->nx + 2) : 0);
    double share = of(four->share, i);
    if (!cell->cut || k >= 1.0) return of(four->mean, i);
    if (cell->drop & CHIP_RIM) return of(four->mean, i) / chip_max(1.0 - chip_cell_levels(stock, cell).gone, k);
    return k <= share ? of(four->rest, i) : of(four->top, i) + share / k * (of(four->rest, i) - of(four->top, i));
}

/* [8] The mean of the four cells' stock that is nearer to the path than the tool's edge; `outside`: distance of the point from
 * that edge, in cells. */
static double mean_inside(const struct chip_stock *stock, const struct chip_corners *corners,
                          const struct four_cells *four, const struct beside *beside, double outside)
{
    double sum = 0.0, weights = 0.0;
    int i;
    for (i = 0; i < 4; i++) {
        double dx = (i & 1) - corners->fx, dy = (i >> 1) - corners->fy;
        double k = chip_cell_covered(outside + dx * beside->nx + dy * beside->ny, beside->nx, beside->ny);
        double weight = (1.0 - fabs(dx)) * (1.0 - fabs(dy)) * chip_min(1.0, CHIP_PARTLY_COVERED * k);
        if (weight <= 0.0) continue;
        weights += weight;
        sum += weight * inside(stock, corners, four, i, k);
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

/* Notes cell i of the four if it has a wall, and its weight at the point is the most of those so far. */
static inline __attribute__((always_inline)) void note_wall(double share, double weight, int i, double *most, int *best)
{
    if (!(share > 0.0) || weight <= *most) return;
    *most = weight;
    *best = i;
}

/* [10] The one of the four cells that has a wall and is nearest to the point; -1: none. */
static int nearest_wall(const struct chip_corners *corners, const struct four_cells *four)
{
    double x = corners->fx, y = corners->fy, most = 0.0;
    int best = -1;
    note_wall(four->share[0][0], (1.0 - x) * (1.0 - y), 0, &most, &best);
    note_wall(four->share[0][1], x * (1.0 - y), 1, &most, &best);
    note_wall(four->share[1][0], (1.0 - x) * y, 2, &most, &best);
    note_wall(four->share[1][1], x * y, 3, &most, &best);
    return best;
}

/* [10] Whether the four cells know of no heights but those of the wall. */
static int has_two_levels(const struct wall *wall, const struct four_cells *four, int best)
{
    double near = CHIP_SAME_LEVEL * (wall->top - wall->rest);
    int i;
    for (i = 0; i < 4; i++) {
        double top = of(four->top, i), rest = of(four->rest, i);
        if (i == best) continue;
        if (fabs(top - wall->top) > near && fabs(top - wall->rest) > near) return 0;
        if (fabs(rest - wall->top) > near && fabs(rest - wall->rest) > near) return 0;
    }
    return 1;
}

/* [10] Direction of the wall through the cell `best` of the four, from its eight neighbours, to the higher side; 0: it is not clear. */
static int wall_direction(const struct chip_stock *stock, const struct chip_corners *corners,
                          const struct four_cells *four, int best, double low, double high, struct wall *wall)
{
    const long row = stock->nx + 2;
    const struct chip_cell *side = corners->cell + (best & 1 ? 2 : -1),
                           *line = corners->cell + (best & 2 ? 2 * row : -row);
    const struct chip_cell *far = side + (line - corners->cell);
    int x = best & 1, y = best >> 1;
    double v[9], *own = v + 4 - x - 3 * y, gx, gy, length;
    pair beside = mean_of_two(stock, side, side + row, low, high),
         other = mean_of_two(stock, line, line + 1, low, high);
    own[0] = four->mean[0][0];
    own[1] = four->mean[0][1];
    own[3] = four->mean[1][0];
    own[4] = four->mean[1][1];
    v[2 * x + 3 - 3 * y] = beside[0];
    v[2 * x + 6 - 3 * y] = beside[1];
    v[6 * y + 1 - x] = other[0];
    v[6 * y + 2 - x] = other[1];
    v[6 * y + 2 * x] = cell_between(stock, far, low, high);
    gx = v[2] + 2.0 * v[5] + v[8] - v[0] - 2.0 * v[3] - v[6];
    gy = v[6] + 2.0 * v[7] + v[8] - v[0] - 2.0 * v[1] - v[2];
    length = chip_sqrt(gx * gx + gy * gy);
    if (!(length > CHIP_CLEAR_WALL * (wall->top - wall->rest))) return 0;
    wall->nx = gx / length;
    wall->ny = gy / length;
    return 1;
}

/* [10] The wall near the point, if its four cells know of no more than two heights; 0: another case. */
static int find_wall(const struct chip_stock *stock, const struct chip_corners *corners, const struct four_cells *four,
                     double low, double high, struct wall *wall)
{
    int best = nearest_wall(corners, four), x, y;
    if (best < 0) return 0;
    x = best & 1;
    y = best >> 1;
    if (corners->ix + x < 1 || corners->iy + y < 1 || corners->ix + x > stock->nx || corners->iy + y > stock->ny)
        return 0;
    wall->top = of(four->top, best);
    wall->rest = of(four->rest, best);
    if (!(wall->top - wall->rest > CHIP_MIN_CONTACT) || !has_two_levels(wall, four, best)) return 0;
    if (!wall_direction(stock, corners, four, best, low, high, wall)) return 0;
    wall->off = (corners->fx - x) * wall->nx + (corners->fy - y) * wall->ny
              - wall_in_cell(of(four->share, best), wall->nx, wall->ny);
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

/* Whether one of the four cells is cut in part, or has stock in part; *rim: is on the rim of the stock. */
static inline __attribute__((always_inline)) int has_part(const struct chip_stock *stock,
                                                          const struct chip_corners *corners, int *rim)
{
    const struct chip_cell *a = corners->cell, *b = a + stock->nx + 2;
    *rim = (a[0].drop | a[1].drop | b[0].drop | b[1].drop) & CHIP_RIM;
    return (a[0].cut | a[1].cut | b[0].cut | b[1].cut) != 0;
}

double chip_wall_between(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_point *point,
                         struct chip_strip *strip, double low)
{
    struct chip_corners corners;
    struct four_cells four;
    struct wall wall;
    struct beside beside;
    int near_edge = fabs(point->side) > strip->ended - at->edge, walled, rim;
    double outside;
    strip->walled = 1;
    if (!find_corners(stock, at, point->x, point->y, &corners)) return 0.0;
    walled = has_part(stock, &corners, &rim);
    strip->walled = walled || corners.ix == 0 || corners.iy == 0 || corners.ix >= stock->nx || corners.iy >= stock->ny;
    if (!near_edge && !walled) return between_corners(stock, &corners, low, strip->high);
    read_four(stock, &corners, low, strip->high, &four);
    walled = walled && !rim && !(strip->margin > 0.0) && find_wall(stock, &corners, &four, low, strip->high, &wall);
    if (!near_edge && !walled) return interpolated(&corners, four.mean[0], four.mean[1]);
    beside = beside_path(at, point->front, point->side);
    outside = (beside.off - strip->ended) * at->per_cell;
    if (walled) {
        strip->nodes += CHIP_WALL_NODES - 1;
        return at_wall(&wall, &beside, outside);
    }
    strip->nodes += CHIP_EDGE_NODES - 1;
    return mean_inside(stock, &corners, &four, &beside, outside);
}
