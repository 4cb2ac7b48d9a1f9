/* SPDX-License-Identifier: GPL-2.0-or-later */
/* cell.c - one cell of the stock map: what is in it, and what a cut takes off. See stock.h; the numbers in brackets
 * are those of its principle. */
#include "chip_math.h"
#include "stock.h"

/* Writes a rim cell. */
void chip_cell_set_rim(const struct chip_stock *stock, struct chip_cell *cell, const struct chip_levels *levels)
{
    double steps = (levels->top - levels->low) / (stock->z_max - stock->z_min) * CHIP_RIM_DROP + 0.5;
    unsigned drop = steps >= CHIP_RIM_DROP ? CHIP_RIM_DROP : steps > 0.0 ? (unsigned)steps : 0;
    unsigned cut = (unsigned)(levels->cut * CHIP_RIM_CUT + 0.5), gone;
    cell->top = (float)(cut >= CHIP_RIM_CUT ? levels->low : levels->top);
    if (cell->top <= (float)stock->z_min) { /* nothing is left of it */
        cell->drop = cell->cut = 0;
    } else if (cut == 0 || cut >= CHIP_RIM_CUT || drop == 0) {
        gone = (unsigned)chip_clamp(levels->gone * CHIP_FULL + 0.5, 1.0, CHIP_FULL - 1.0);
        cell->drop = CHIP_RIM;
        cell->cut = (uint16_t)gone;
    } else {
        gone = (unsigned)chip_clamp(levels->gone * CHIP_RIM_GONE + 0.5, 1.0, CHIP_RIM_GONE - 1.0);
        cell->drop = (uint16_t)(CHIP_RIM | CHIP_RIM_TWO | (cut & 15u) << 10 | drop);
        cell->cut = (uint16_t)(gone << 5 | cut >> 4);
    }
}

struct chip_levels chip_cell_levels(const struct chip_stock *stock, const struct chip_cell *cell)
{
    struct chip_levels levels = { cell->top, cell->top, 0.0, 0.0 };
    if (!cell->cut) return levels;
    if (!(cell->drop & CHIP_RIM)) {
        levels.low -= cell->drop * stock->drop_unit;
        levels.cut = cell->cut * (1.0 / CHIP_FULL);
        return levels;
    }
    if (!(cell->drop & CHIP_RIM_TWO)) {
        levels.gone = cell->cut * (1.0 / CHIP_FULL);
        return levels;
    }
    levels.low -= (cell->drop & CHIP_RIM_DROP) * (stock->z_max - stock->z_min) * (1.0 / CHIP_RIM_DROP);
    levels.cut = ((cell->drop >> 10 & 15u) | (cell->cut & 31u) << 4) * (1.0 / CHIP_RIM_CUT);
    levels.gone = (cell->cut >> 5) * (1.0 / CHIP_RIM_GONE);
    return levels;
}

double chip_rim_between(const struct chip_stock *stock, const struct chip_cell *cell, double low, double high)
{
    struct chip_levels levels = chip_cell_levels(stock, cell);
    double uncut = chip_clamp(levels.top, low, high) - low, rest = chip_clamp(levels.low, low, high) - low;
    CHIP_FAULT(RIM_WHOLE, levels.gone = 0.0);
    return (1.0 - levels.gone) * (uncut + levels.cut * (rest - uncut));
}

double chip_cell_covered(double outside, double nx, double ny)
{
    double a = fabs(nx), b = fabs(ny), half, t = -outside, rest;
    CHIP_FAULT(OUTLINE_WIDE, t = 0.2 - outside);
    if (a < b) {
        double s = a;
        a = b;
        b = s;
    }
    half = 0.5 * (a + b);
    if (t >= half) return 1.0;
    if (t <= -half) return 0.0;
    if (fabs(t) <= 0.5 * (a - b)) return 0.5 + t / a;
    rest = half - fabs(t);
    rest = rest * rest / (2.0 * a * b);
    return t > 0.0 ? 1.0 - rest : rest;
}

double chip_cell_wedge(double outside, double nx, double ny)
{
    double a = fabs(nx), b = fabs(ny), half, flat, t = -outside, rest;
    if (a < b) {
        double s = a;
        a = b;
        b = s;
    }
    half = 0.5 * (a + b);
    flat = 0.5 * (a - b);
    if (t <= -half) return 0.0;
    if (t >= half) return t;
    if (t < -flat) {
        rest = half + t;
        return rest * rest * rest / (6.0 * a * b);
    }
    if (t <= flat) return b * b / (24.0 * a) + 0.125 * a + 0.5 * t + 0.5 * t * t / a;
    rest = half - t;
    return t + rest * rest * rest / (6.0 * a * b);
}

/* Cosine between (ex, ey) and the outward normal of the side of the stock box nearest to a position. */
static double outward(const struct chip_stock *stock, double x, double y, double ex, double ey)
{
    double c = 1.0, s = 0.0, u, v;
    x -= 0.5 * (stock->x0 + stock->x_max);
    y -= 0.5 * (stock->y0 + stock->y_max);
    if (stock->shape == CHIP_SHAPE_CYLINDER) {
        u = x / (stock->half_x * stock->half_x);
        v = y / (stock->half_y * stock->half_y);
        return (u * ex + v * ey) / chip_max(chip_sqrt(u * u + v * v), 1e-30);
    }
    if (stock->turn != 0.0) {
        c = cos(stock->turn);
        s = sin(stock->turn);
    }
    u = c * x + s * y;
    v = c * y - s * x;
    if (fabs(u) - stock->half_x > fabs(v) - stock->half_y) return (u < 0.0 ? -1.0 : 1.0) * (c * ex + s * ey);
    return (v < 0.0 ? -1.0 : 1.0) * (c * ey - s * ex);
}

double chip_rim_covered(const struct chip_stock *stock, const struct chip_cell *cell, double x, double y, double k,
                        double ex, double ey)
{
    double gone = chip_cell_levels(stock, cell).gone, along = outward(stock, x, y, ex, ey), nested;
    if (!(gone > 0.0) || k >= 1.0) return k;
    nested = (along > 0.0 ? chip_min(k, 1.0 - gone) : chip_max(k - gone, 0.0)) / (1.0 - gone);
    return chip_clamp(k + fabs(along) * (nested - k), 0.0, 1.0);
}

/* Writes the cut part of a cell: share and height below the top, rounded to cell units.
 * A cell that is cut completely becomes a plain one again, with its exact height. */
static void set_plain(const struct chip_stock *stock, struct chip_cell *cell, const struct chip_levels *levels)
{
    double steps = (levels->top - levels->low) / stock->drop_unit + 0.5;
    uint16_t cut = (uint16_t)(chip_clamp(levels->cut, 0.0, 1.0) * CHIP_FULL + 0.5);
    cell->top = (float)levels->top;
    if (cut == CHIP_FULL) {
        cell->top = (float)levels->low;
        cell->cut = cell->drop = 0;
        return;
    }
    cell->drop = steps >= CHIP_DROP_FULL ? CHIP_DROP_FULL : (uint16_t)steps;
    cell->cut = cell->drop ? cut : 0;
    if (!cell->cut) cell->drop = 0;
}

/* The rule of [2], by cases; `near`: heights within it are equal. Returns 0 if nothing changes. */
static int merge(struct chip_levels *levels, double k, double z, double near)
{
    double c = levels->cut, low = levels->low;
    if (k >= 1.0 - 0.5 / CHIP_FULL) { /* the whole cell */
        if (c > 0.0 && z > low) {
            levels->top = z;
        } else {
            levels->low = z;
            levels->cut = 1.0;
        }
    } else if (c <= 0.0) { /* first cut of this cell */
        levels->cut = k;
        levels->low = z;
    } else if (z < low - near) { /* deeper: the wall goes to the nearer of the two */
        if (2.0 * k < c) return 0;
        levels->cut = chip_max(c, k);
        CHIP_FAULT(SHARES_ADDED, levels->cut = c + k);
        levels->low = z;
    } else if (k > c) { /* wider: the added part lies at z */
        levels->low = z <= low + near ? low : ((k - c) * z + c * low) / k;
        levels->cut = k;
    } else {
        return 0;
    }
    return 1;
}

double chip_cell_cut(const struct chip_stock *stock, struct chip_cell *cell, double k, double z)
{
    struct chip_levels levels;
    double before;
    int rim;
    if (z < stock->z_min) z = stock->z_min;
    if (z >= (double)cell->top || k < 0.5 / CHIP_FULL) return 0.0;
    before = chip_cell_above(stock, cell, stock->z_min);
    levels = chip_cell_levels(stock, cell);
    rim = levels.gone > 0.0;
    if (!merge(&levels, k, z, rim ? (stock->z_max - stock->z_min) / CHIP_RIM_DROP : stock->drop_unit)) return 0.0;
    if (rim)
        chip_cell_set_rim(stock, cell, &levels);
    else
        set_plain(stock, cell, &levels);
    return (before - chip_cell_above(stock, cell, stock->z_min)) * stock->cell * stock->cell;
}
