/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stock.c - see stock.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "chip_math.h"
#include "stock.h"

#define CHIP_CELL_STEP 1e-3 /* mm, the side of a cell is a multiple of it [7] */
#define CHIP_FILL_SHAPED 4  /* cells of an upright box that cost as much as one of another shape */

uint32_t chip_stock_cells(double cell, double size_x, double size_y)
{
    double nx, ny;
    if (!chip_finite(cell) || !chip_finite(size_x) || !chip_finite(size_y)) return 0;
    if (!(cell >= CHIP_MIN_CELL && cell <= CHIP_MAX_CELL) || !(size_x > 0.0) || !(size_y > 0.0)) return 0;
    nx = ceil(size_x / cell - 1e-9) + 2.0;
    ny = ceil(size_y / cell - 1e-9) + 2.0;
    if (nx * ny > (double)CHIP_MAX_CELLS) return 0;
    return (uint32_t)nx * (uint32_t)ny;
}

uint64_t chip_stock_bytes(uint32_t cells)
{
    return sizeof(struct chip_stock) + (uint64_t)cells * sizeof(struct chip_cell);
}

void chip_stock_init(struct chip_stock *stock, double cell, uint32_t capacity)
{
    chip_stock_init_finer(stock, cell, cell, capacity);
}

void chip_stock_init_finer(struct chip_stock *stock, double cell, double finest, uint32_t capacity)
{
    stock->magic = CHIP_STOCK_MAGIC;
    stock->version = CHIP_STOCK_VERSION;
    stock->generation = 0;
    stock->capacity = capacity;
    stock->coarsest = stock->cell = cell;
    stock->finest = finest >= CHIP_MIN_CELL && finest < cell ? finest : cell;
    stock->x0 = stock->y0 = stock->x_max = stock->y_max = 0.0;
    stock->z_min = stock->z_max = 0.0;
    stock->drop_unit = 0.0;
    stock->nx = stock->ny = 0;
    stock->filled = 0;
    stock->shape = CHIP_SHAPE_BOX;
    stock->removed = 0.0;
    stock->half_x = stock->half_y = stock->turn = 0.0;
    stock->definitions = 0;
}

double chip_stock_cell_for(const struct chip_stock *stock, double size_x, double size_y)
{
    /* (size_x / cell + 3) (size_y / cell + 3) cells, ring and broken ones included, fill the memory */
    double room = (double)stock->capacity - 9.0, edge = 3.0 * (size_x + size_y), side;
    if (!(stock->finest < stock->coarsest) || !(room > 0.0) || !chip_finite(edge) || !(size_x > 0.0) || !(size_y > 0.0))
        return stock->coarsest;
    side = (edge + chip_sqrt(edge * edge + 4.0 * room * size_x * size_y)) / (2.0 * room);
    side = ceil(side / CHIP_CELL_STEP) * CHIP_CELL_STEP;
    return chip_clamp(side, stock->finest, stock->coarsest);
}

static int check_box(const struct chip_stock *stock, double cell, const double min[3], const double max[3])
{
    uint32_t cells;
    int i;
    for (i = 0; i < 3; i++)
        if (!chip_finite(min[i]) || !chip_finite(max[i])) return CHIP_STOCK_NOT_FINITE;
    for (i = 0; i < 3; i++)
        if (!(max[i] - min[i] >= CHIP_MIN_SIZE)) return CHIP_STOCK_EMPTY;
    cells = chip_stock_cells(cell, max[0] - min[0], max[1] - min[1]);
    if (cells == 0 || cells > stock->capacity) return CHIP_STOCK_TOO_LARGE;
    for (i = 0; i < 3; i++)
        if (fabs(min[i]) > CHIP_MAX_COORDINATE || fabs(max[i]) > CHIP_MAX_COORDINATE) return CHIP_STOCK_NOT_FINITE;
    return CHIP_STOCK_OK;
}

static double unit_of_drop(double low, double high) { return (high - low) / CHIP_DROP_FULL; }

static int32_t cells_along(double cell, double low, double high) { return (int32_t)ceil((high - low) / cell - 1e-9); }

int chip_stock_define(struct chip_stock *stock, const double min[3], const double max[3])
{
    return chip_stock_define_turned(stock, min, max, CHIP_SHAPE_BOX, 0.0);
}

int chip_stock_define_shape(struct chip_stock *stock, const double min[3], const double max[3], int shape)
{
    return chip_stock_define_turned(stock, min, max, shape, 0.0);
}

/* Half the sides of the upright box round one with half the sides a, b, turned by `turn` [6]. */
static void hull(double a, double b, double turn, double half[2])
{
    double c = fabs(cos(turn)), s = fabs(sin(turn));
    half[0] = turn == 0.0 ? a : a * c + b * s;
    half[1] = turn == 0.0 ? b : a * s + b * c;
}

int chip_stock_define_turned(struct chip_stock *stock, const double min[3], const double max[3], int shape, double turn)
{
    double low[3] = { min[0], min[1], min[2] }, high[3] = { max[0], max[1], max[2] }, half[2];
    double a = 0.5 * (max[0] - min[0]), b = 0.5 * (max[1] - min[1]);
    double cell;
    int error, i;
    if (shape == CHIP_SHAPE_CYLINDER) turn = 0.0;
    if (!chip_finite(turn) || fabs(turn) > 1e6) return CHIP_STOCK_NOT_FINITE;
    for (i = 0; i < 2; i++)
        if (!(max[i] > min[i])) turn = 0.0; /* check_box refuses it with the right error */
    if (turn != 0.0) {
        hull(a, b, turn, half);
        for (i = 0; i < 2; i++) {
            low[i] = 0.5 * (min[i] + max[i]) - half[i];
            high[i] = 0.5 * (min[i] + max[i]) + half[i];
        }
    }
    cell = chip_stock_cell_for(stock, high[0] - low[0], high[1] - low[1]);
    error = check_box(stock, cell, low, high);
    if (error) return error;
    chip_stock_begin_write(stock);
    stock->cell = cell;
    stock->x0 = low[0];
    stock->y0 = low[1];
    stock->z_min = low[2];
    stock->x_max = high[0];
    stock->y_max = high[1];
    stock->z_max = high[2];
    stock->nx = cells_along(stock->cell, low[0], high[0]);
    stock->ny = cells_along(stock->cell, low[1], high[1]);
    stock->drop_unit = unit_of_drop(low[2], high[2]);
    stock->shape = shape == CHIP_SHAPE_CYLINDER ? CHIP_SHAPE_CYLINDER : CHIP_SHAPE_BOX;
    stock->half_x = a;
    stock->half_y = b;
    stock->turn = turn;
    stock->filled = 0;
    stock->removed = 0.0;
    stock->definitions++;
    chip_stock_end_write(stock);
    return CHIP_STOCK_OK;
}

/* 1 if half the sides and the turn are those of a box that fills the map. */
static int box_fits(const struct chip_stock *stock)
{
    double half[2], wide = 0.5 * (stock->x_max - stock->x0), deep = 0.5 * (stock->y_max - stock->y0);
    if (!(stock->half_x > 0.0) || !(stock->half_y > 0.0) || !(fabs(stock->turn) <= 1e6)) return 0;
    hull(stock->half_x, stock->half_y, stock->turn, half);
    return fabs(half[0] - wide) <= 1e-9 * (1.0 + wide) && fabs(half[1] - deep) <= 1e-9 * (1.0 + deep);
}

int chip_stock_sound(const struct chip_stock *stock, double coarsest, double finest, uint32_t capacity)
{
    double min[3] = { stock->x0, stock->y0, stock->z_min };
    double max[3] = { stock->x_max, stock->y_max, stock->z_max };
    if (stock->magic != CHIP_STOCK_MAGIC || stock->version != CHIP_STOCK_VERSION) return 0;
    if (stock->coarsest != coarsest || stock->finest != finest || stock->capacity != capacity) return 0;
    if (stock->nx == 0) return 1;
    if (check_box(stock, stock->cell, min, max)) return 0;
    return stock->nx == cells_along(stock->cell, min[0], max[0])
        && stock->ny == cells_along(stock->cell, min[1], max[1]) && stock->filled >= 0 && stock->filled <= stock->ny + 2
        && stock->drop_unit == unit_of_drop(min[2], max[2]) && box_fits(stock) && chip_finite(stock->removed)
        && stock->removed >= 0.0;
}

/* Integral of sqrt(1 - u^2) from 0 to u. */
static double half_segment(double u) { return 0.5 * (u * sqrt(1.0 - u * u) + asin(u)); }

/* Area of the unit disc to the left of x and below y. */
static double disc_quadrant(double x, double y)
{
    double row;
    x = chip_clamp(x, -1.0, 1.0);
    y = chip_clamp(y, -1.0, 1.0);
    if (x * x + y * y >= 1.0) { /* the corner is outside: segments, or the disc without segments */
        double left = 2.0 * half_segment(x) + 0.5 * CHIP_PI;
        double below = 2.0 * half_segment(y) + 0.5 * CHIP_PI;
        if (x < 0.0 && y < 0.0) return 0.0;
        if (x < 0.0) return left;
        if (y < 0.0) return below;
        return left + below - CHIP_PI;
    }
    row = sqrt(1.0 - y * y); /* the disc spans -row .. row at y */
    return y * (x + row) + half_segment(x) + half_segment(row)
         + (y >= 0.0 ? 0.5 * CHIP_PI - 2.0 * half_segment(row) : 0.0);
}

/* Share of a cell inside the ellipse inscribed in the box, exact. */
static double in_cylinder(const struct chip_stock *stock, int ix, int iy)
{
    double a = stock->half_x, b = stock->half_y;
    double w = stock->cell / a, h = stock->cell / b;
    double x = ix * w - 1.0, y = iy * h - 1.0; /* corner, in radii from the centre */
    double near_x = chip_clamp(0.0, x, x + w), near_y = chip_clamp(0.0, y, y + h);
    double far_x = chip_max(fabs(x), fabs(x + w)), far_y = chip_max(fabs(y), fabs(y + h));
    if (near_x * near_x + near_y * near_y >= 1.0) return 0.0;
    if (far_x * far_x + far_y * far_y <= 1.0) return 1.0;
    return chip_clamp(
        (disc_quadrant(x + w, y + h) - disc_quadrant(x, y + h) - disc_quadrant(x + w, y) + disc_quadrant(x, y))
            / (w * h),
        0.0, 1.0);
}

/* Keeps the part of a polygon of n corners where u * point[k] <= limit; returns its corners. */
static int clip(double (*point)[2], int n, int k, double u, double limit)
{
    double kept[12][2];
    int i, j, m = 0;
    for (i = 0; i < n; i++) {
        const double *p = point[i], *q = point[i + 1 < n ? i + 1 : 0];
        double over = u * p[k] - limit, next = u * q[k] - limit;
        if (over <= 0.0) {
            kept[m][0] = p[0];
            kept[m++][1] = p[1];
        }
        if ((over <= 0.0) != (next <= 0.0)) {
            double t = over / (over - next);
            kept[m][0] = p[0] + t * (q[0] - p[0]);
            kept[m++][1] = p[1] + t * (q[1] - p[1]);
        }
    }
    for (i = 0; i < m; i++)
        for (j = 0; j < 2; j++) point[i][j] = kept[i][j];
    return m;
}

/* Share of a cell inside the box whose turn has the cosine c and the sine s: the square clipped by
 * its four sides. */
static double in_box(const struct chip_stock *stock, int ix, int iy, double c, double s)
{
    double h = 0.5 * stock->cell, reach = h * (fabs(c) + fabs(s)) - 1e-9 * h, area = 0.0;
    double x = stock->x0 + (2 * ix + 1) * h - 0.5 * (stock->x0 + stock->x_max);
    double y = stock->y0 + (2 * iy + 1) * h - 0.5 * (stock->y0 + stock->y_max);
    double u = c * x + s * y, v = c * y - s * x, point[12][2];
    int i, n = 4;
    CHIP_FAULT(BOX_AS_HULL, v = 0.0);
    if (fabs(u) + reach <= stock->half_x && fabs(v) + reach <= stock->half_y) return 1.0;
    if (fabs(u) - reach >= stock->half_x || fabs(v) - reach >= stock->half_y) return 0.0;
    for (i = 0; i < 4; i++) {
        double a = i == 1 || i == 2 ? h : -h, b = i < 2 ? -h : h;
        point[i][0] = u + c * a + s * b;
        point[i][1] = v + c * b - s * a;
    }
    for (i = 0; i < 4; i++) n = clip(point, n, i / 2, i % 2 ? 1.0 : -1.0, i / 2 ? stock->half_y : stock->half_x);
    for (i = 0; i < n; i++) {
        const double *p = point[i], *q = point[i + 1 < n ? i + 1 : 0];
        area += 0.5 * (p[0] * q[1] - p[1] * q[0]);
    }
    return chip_clamp(area / (stock->cell * stock->cell), 0.0, 1.0);
}

/* One row of the new stock; iy == -1 and iy == ny are the empty ring [4]. Rows inside an
 * upright box are all alike: they are copied from the first one. */
static void fill_row(struct chip_stock *stock, int iy)
{
    struct chip_cell *cell = chip_stock_cell(stock, -1, iy);
    struct chip_levels levels = { stock->z_max, stock->z_max, 0.0, 0.0 };
    int plain = stock->shape == CHIP_SHAPE_BOX && stock->turn == 0.0, ix;
    double c = plain ? 1.0 : cos(stock->turn), s = plain ? 0.0 : sin(stock->turn);
    if (plain && iy > 0 && stock->y0 + (iy + 1) * stock->cell <= stock->y_max) {
        memcpy(cell, chip_stock_cell(stock, -1, 0), (stock->nx + 2) * sizeof *cell);
        return;
    }
    for (ix = -1; ix <= stock->nx; ix++, cell++) {
        double share = 0.0;
        if (ix >= 0 && ix < stock->nx && iy >= 0 && iy < stock->ny)
            share = stock->shape == CHIP_SHAPE_CYLINDER ? in_cylinder(stock, ix, iy) : in_box(stock, ix, iy, c, s);
        cell->drop = cell->cut = 0;
        cell->top = (float)(share * CHIP_FULL >= 0.5 ? stock->z_max : stock->z_min);
        levels.gone = 1.0 - share;
        if (share < 1.0 && share * CHIP_FULL >= 0.5) chip_cell_set_rim(stock, cell, &levels);
    }
}

int chip_stock_fill(struct chip_stock *stock, int max_cells)
{
    int rows = stock->ny + 2;
    if (stock->nx <= 0) return 0;
    if (stock->filled >= rows) return 1;
    chip_stock_begin_write(stock);
    do {
        fill_row(stock, stock->filled - 1);
        stock->filled++;
        max_cells -=
            (stock->nx + 2) * (stock->shape == CHIP_SHAPE_CYLINDER || stock->turn != 0.0 ? CHIP_FILL_SHAPED : 1);
    } while (stock->filled < rows && max_cells > 0);
    chip_stock_end_write(stock);
    return stock->filled >= rows;
}

int chip_stock_ready(const struct chip_stock *stock) { return stock->nx > 0 && stock->filled >= stock->ny + 2; }

double chip_stock_volume(const struct chip_stock *stock)
{
    double sum = 0.0;
    int ix, iy;
    for (iy = 0; iy < stock->ny; iy++)
        for (ix = 0; ix < stock->nx; ix++) sum += chip_cell_above(stock, chip_stock_cell(stock, ix, iy), stock->z_min);
    return sum * stock->cell * stock->cell;
}

double chip_stock_above(const struct chip_stock *stock, double x, double y, double floor)
{
    double fx = (x - stock->x0) / stock->cell + 0.5; /* in cells; the ring's cell is number 0 */
    double fy = (y - stock->y0) / stock->cell + 0.5;
    const struct chip_cell *a, *b;
    int ix, iy;
    double h0, h1;
    if (!(fx >= 0.0 && fy >= 0.0 && fx < stock->nx + 1.0 && fy < stock->ny + 1.0)) return 0.0;
    ix = (int)fx;
    iy = (int)fy;
    fx -= ix;
    fy -= iy;
    a = stock->cells + (long)iy * (stock->nx + 2) + ix;
    b = a + stock->nx + 2;
    h0 = chip_cell_above(stock, a, floor);
    h0 += fx * (chip_cell_above(stock, a + 1, floor) - h0);
    h1 = chip_cell_above(stock, b, floor);
    h1 += fx * (chip_cell_above(stock, b + 1, floor) - h1);
    return h0 + fy * (h1 - h0);
}
