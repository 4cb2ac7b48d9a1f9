/* stock.c - see stock.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "cw_math.h"
#include "stock.h"

#define CW_MOST_CELLS (1u << 28)        /* 2 GiB of map */

uint32_t cw_stock_cells(double cell, double size_x, double size_y)
{
    double nx, ny;
    if (!cw_finite(cell) || !cw_finite(size_x) || !cw_finite(size_y)) return 0;
    if (!(cell > 0.0) || !(size_x > 0.0) || !(size_y > 0.0)) return 0;
    nx = ceil(size_x / cell - 1e-9) + 2.0;
    ny = ceil(size_y / cell - 1e-9) + 2.0;
    if (nx * ny > (double)CW_MOST_CELLS) return 0;
    return (uint32_t)nx * (uint32_t)ny;
}

uint64_t cw_stock_bytes(uint32_t cells)
{
    return sizeof(struct cw_stock) + (uint64_t)cells * sizeof(struct cw_cell);
}

void cw_stock_init(struct cw_stock *stock, double cell, uint32_t capacity)
{
    stock->magic = CW_STOCK_MAGIC;
    stock->version = CW_STOCK_VERSION;
    stock->generation = 0;
    stock->capacity = capacity;
    stock->cell = cell;
    stock->x0 = stock->y0 = stock->x_max = stock->y_max = 0.0;
    stock->z_min = stock->z_max = 0.0;
    stock->drop_unit = 0.0;
    stock->nx = stock->ny = 0;
    stock->filled = 0;
    stock->shape = CW_SHAPE_BOX;
    stock->removed = 0.0;
}

static int check_box(const struct cw_stock *stock, const double min[3], const double max[3])
{
    uint32_t cells;
    int i;
    for (i = 0; i < 3; i++)
        if (!cw_finite(min[i]) || !cw_finite(max[i])) return CW_STOCK_NOT_FINITE;
    for (i = 0; i < 3; i++)
        if (!(max[i] > min[i])) return CW_STOCK_EMPTY;
    cells = cw_stock_cells(stock->cell, max[0] - min[0], max[1] - min[1]);
    if (cells == 0 || cells > stock->capacity) return CW_STOCK_TOO_LARGE;
    return CW_STOCK_OK;
}

static double unit_of_drop(double low, double high) { return (high - low) / CW_FULL; }

static int32_t cells_along(double cell, double low, double high)
{
    return (int32_t)ceil((high - low) / cell - 1e-9);
}

int cw_stock_define(struct cw_stock *stock, const double min[3], const double max[3])
{
    return cw_stock_define_shape(stock, min, max, CW_SHAPE_BOX);
}

int cw_stock_define_shape(struct cw_stock *stock, const double min[3], const double max[3],
                          int shape)
{
    int error = check_box(stock, min, max);
    if (error) return error;
    cw_stock_begin_write(stock);
    stock->x0 = min[0];
    stock->y0 = min[1];
    stock->z_min = min[2];
    stock->x_max = max[0];
    stock->y_max = max[1];
    stock->z_max = max[2];
    stock->nx = cells_along(stock->cell, min[0], max[0]);
    stock->ny = cells_along(stock->cell, min[1], max[1]);
    stock->drop_unit = unit_of_drop(min[2], max[2]);
    stock->shape = shape == CW_SHAPE_CYLINDER ? CW_SHAPE_CYLINDER : CW_SHAPE_BOX;
    stock->filled = 0;
    stock->removed = 0.0;
    cw_stock_end_write(stock);
    return CW_STOCK_OK;
}

int cw_stock_sound(const struct cw_stock *stock, double cell, uint32_t capacity)
{
    double min[3] = { stock->x0, stock->y0, stock->z_min };
    double max[3] = { stock->x_max, stock->y_max, stock->z_max };
    if (stock->magic != CW_STOCK_MAGIC || stock->version != CW_STOCK_VERSION) return 0;
    if (stock->cell != cell || stock->capacity != capacity) return 0;
    if (stock->nx == 0) return 1;
    if (check_box(stock, min, max)) return 0;
    return stock->nx == cells_along(cell, min[0], max[0])
        && stock->ny == cells_along(cell, min[1], max[1])
        && stock->filled >= 0 && stock->filled <= stock->ny + 2
        && stock->drop_unit == unit_of_drop(min[2], max[2])
        && cw_finite(stock->removed) && stock->removed >= 0.0;
}

/* Share of the i-th cell along an axis that lies in a box `length` mm long. */
static double inside(const struct cw_stock *stock, int i, double length)
{
    return cw_clamp(length / stock->cell - i, 0.0, 1.0);
}

/* Integral of sqrt(1 - u^2) from 0 to u. */
static double half_segment(double u) { return 0.5 * (u * sqrt(1.0 - u * u) + asin(u)); }

/* Area of the unit disc to the left of x and below y. */
static double disc_quadrant(double x, double y)
{
    double row;
    x = cw_clamp(x, -1.0, 1.0);
    y = cw_clamp(y, -1.0, 1.0);
    if (x * x + y * y >= 1.0) {         /* the corner is outside: segments, or all but segments */
        double left = 2.0 * half_segment(x) + 0.5 * CW_PI;
        double below = 2.0 * half_segment(y) + 0.5 * CW_PI;
        if (x < 0.0 && y < 0.0) return 0.0;
        if (x < 0.0) return left;
        if (y < 0.0) return below;
        return left + below - CW_PI;
    }
    row = sqrt(1.0 - y * y);            /* the disc spans -row .. row at y */
    return y * (x + row) + half_segment(x) + half_segment(row)
        + (y >= 0.0 ? 0.5 * CW_PI - 2.0 * half_segment(row) : 0.0);
}

/* Share of a cell inside the ellipse inscribed in the box, exact. */
static double in_cylinder(const struct cw_stock *stock, int ix, int iy)
{
    double a = 0.5 * (stock->x_max - stock->x0), b = 0.5 * (stock->y_max - stock->y0);
    double w = stock->cell / a, h = stock->cell / b;
    double x = ix * w - 1.0, y = iy * h - 1.0;          /* corner, in radii from the centre */
    double near_x = cw_clamp(0.0, x, x + w), near_y = cw_clamp(0.0, y, y + h);
    double far_x = cw_max(fabs(x), fabs(x + w)), far_y = cw_max(fabs(y), fabs(y + h));
    if (near_x * near_x + near_y * near_y >= 1.0) return 0.0;
    if (far_x * far_x + far_y * far_y <= 1.0) return 1.0;
    return cw_clamp((disc_quadrant(x + w, y + h) - disc_quadrant(x, y + h)
                     - disc_quadrant(x + w, y) + disc_quadrant(x, y)) / (w * h), 0.0, 1.0);
}

/* One row of the fresh stock; iy == -1 and iy == ny are the empty ring [4]. Rows inside a
 * box are all alike: they are copied from the first one. */
static void fill_row(struct cw_stock *stock, int iy)
{
    struct cw_cell *cell = cw_stock_cell(stock, -1, iy);
    double row = iy < 0 || iy >= stock->ny ? 0.0 : inside(stock, iy, stock->y_max - stock->y0);
    int ix;
    if (iy > 0 && row == 1.0 && stock->shape == CW_SHAPE_BOX) {
        memcpy(cell, cw_stock_cell(stock, -1, 0), (stock->nx + 2) * sizeof *cell);
        return;
    }
    for (ix = -1; ix <= stock->nx; ix++, cell++) {
        double share = ix < 0 || ix >= stock->nx
            ? 0.0 : row * inside(stock, ix, stock->x_max - stock->x0);
        if (share > 0.0 && stock->shape == CW_SHAPE_CYLINDER) share = in_cylinder(stock, ix, iy);
        if (share < 0.5 / CW_FULL) share = 0.0;
        cell->top = (float)(share > 0.0 ? stock->z_max : stock->z_min);
        cell->cut = share > 0.0 ? (uint16_t)((1.0 - share) * CW_FULL + 0.5) : 0;
        cell->drop = cell->cut ? CW_FULL : 0;
    }
}

int cw_stock_fill(struct cw_stock *stock, int max_cells)
{
    int rows = stock->ny + 2;
    if (stock->nx <= 0) return 0;
    if (stock->filled >= rows) return 1;
    cw_stock_begin_write(stock);
    do {
        fill_row(stock, stock->filled - 1);
        stock->filled++;
        max_cells -= stock->nx + 2;
    } while (stock->filled < rows && max_cells > 0);
    cw_stock_end_write(stock);
    return stock->filled >= rows;
}

int cw_stock_ready(const struct cw_stock *stock)
{
    return stock->nx > 0 && stock->filled >= stock->ny + 2;
}

double cw_stock_volume(const struct cw_stock *stock)
{
    double sum = 0.0;
    int ix, iy;
    for (iy = 0; iy < stock->ny; iy++)
        for (ix = 0; ix < stock->nx; ix++)
            sum += cw_cell_above(stock, cw_stock_cell(stock, ix, iy), stock->z_min);
    return sum * stock->cell * stock->cell;
}

/* Writes the cut part of a cell: share and height below the top, rounded to cell units.
 * A cell that is cut all over becomes a plain one again, with its height exact. */
static void set_cut(const struct cw_stock *stock, struct cw_cell *cell, double share, double low)
{
    double steps = ((double)cell->top - low) / stock->drop_unit + 0.5;
    uint16_t cut = (uint16_t)(cw_clamp(share, 0.0, 1.0) * CW_FULL + 0.5);
    if (cut == CW_FULL) {
        cell->top = (float)low;
        cell->cut = cell->drop = 0;
        return;
    }
    cell->drop = steps >= CW_FULL ? CW_FULL : (uint16_t)steps;
    cell->cut = cell->drop ? cut : 0;
    if (!cell->cut) cell->drop = 0;
}

/* The rule of [2], by cases; `low` is the height of the part cut so far, c its share. */
static void merge(const struct cw_stock *stock, struct cw_cell *cell, double k, double z)
{
    double top = cell->top;
    double c = cell->cut * (1.0 / CW_FULL);
    double low = top - cell->drop * stock->drop_unit;
    double near = stock->drop_unit;

    if (!cell->cut) {                           /* first cut of this cell */
        set_cut(stock, cell, k, z);
    } else if (k >= 1.0 - 0.5 / CW_FULL) {      /* the whole cell */
        if (z <= low) set_cut(stock, cell, 1.0, z);
        else { cell->top = (float)z; set_cut(stock, cell, c, low); }
    } else if (z < low - near) {                /* deeper: the wall goes to the nearer of the two */
        if (2.0 * k >= c) set_cut(stock, cell, cw_max(c, k), z);
    } else if (k > c) {                         /* wider: the added part lies at z */
        set_cut(stock, cell, k, z <= low + near ? low : ((k - c) * z + c * low) / k);
    }
}

double cw_cell_cut(const struct cw_stock *stock, struct cw_cell *cell, double k, double z)
{
    double before;
    if (z < stock->z_min) z = stock->z_min;
    if (z >= (double)cell->top || k < 0.5 / CW_FULL) return 0.0;
    before = cw_cell_above(stock, cell, stock->z_min);
    merge(stock, cell, k, z);
    return (before - cw_cell_above(stock, cell, stock->z_min)) * stock->cell * stock->cell;
}

double cw_stock_above(const struct cw_stock *stock, double x, double y, double floor)
{
    double fx = (x - stock->x0) / stock->cell + 0.5;    /* in cells; the ring's cell is number 0 */
    double fy = (y - stock->y0) / stock->cell + 0.5;
    const struct cw_cell *a, *b;
    int ix, iy;
    double h0, h1;
    if (!(fx >= 0.0 && fy >= 0.0 && fx < stock->nx + 1.0 && fy < stock->ny + 1.0)) return 0.0;
    ix = (int)fx;
    iy = (int)fy;
    fx -= ix;
    fy -= iy;
    a = stock->cells + (long)iy * (stock->nx + 2) + ix;
    b = a + stock->nx + 2;
    h0 = cw_cell_above(stock, a, floor);
    h0 += fx * (cw_cell_above(stock, a + 1, floor) - h0);
    h1 = cw_cell_above(stock, b, floor);
    h1 += fx * (cw_cell_above(stock, b + 1, floor) - h1);
    return h0 + fy * (h1 - h0);
}
