/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stock.h - the stock as a height map whose cells know how much of them is left.
 *
 * Who calls it: sweep.c cuts it, section.c reads it, stock_tracker.comp owns it in
 * realtime, remap/chipwise/stock/ and the tests through the shared library.
 * Source: JP3131045 [0006]..[0009] ("material shape data WK", updated after every move).
 * Departs from the source: the patent leaves the representation open.
 *
 * Principle:
 *  1. The plane is divided into square cells. A cell holds the height of its uncut
 *     part (`top`), how much lower its cut part lies (`drop`) and what share of the
 *     cell that part is (`cut`). `cut` locates a wall that crosses a cell to
 *     1/65535 of a cell, not just to half a cell.
 *  2. A cut of share k to height z replaces the old one and is never added: parts cut from the
 *     same side are nested, so the same cut twice changes nothing (chip_cell_cut).
 *     A cell on the outline of the stock box is never whole: it also holds the share of it that is
 *     outside the stock (`gone`); `top`, `drop` and `cut` then refer to the rest. It
 *     has CHIP_RIM in `drop` and coarser steps (chip_cell_levels).
 *  3. Volume is the exact sum over the cells; a cut removes the difference.
 *  4. A ring of empty cells round the map lets readers interpolate without tests.
 *  5. All lengths are mm in machine coordinates; the map has no other units.
 *  6. The box may be turned about its middle; the map is the upright box around it.
 *  7. The memory is for the largest stock in cells of the side `coarsest`. A smaller stock has smaller cells, down to
 *     `finest`: as small as the memory allows. Slivers and walls are read to a share of a cell.
 *
 * Memory: 8 bytes a cell plus the ring and the head. It holds no pointers: different
 * processes may map the block at different addresses. stock_tracker.comp has the path done behind the cells (path_done.h).
 */
#ifndef CHIPWISE_STOCK_H
#define CHIPWISE_STOCK_H

#include <stdint.h>

#include "cell.h"
#include "fault.h"

#define CHIP_STOCK_MAGIC 0x43575354u /* "CWST" */
#define CHIP_STOCK_VERSION 5u
#define CHIP_MAX_CELLS (1u << 28) /* of a map: 2 GiB */
#define CHIP_MIN_CELL 1e-3        /* mm; smaller ones overflow the index of a position far from the map */
#define CHIP_MAX_CELL 100.0       /* mm */
#define CHIP_MIN_SIZE 1e-3        /* mm, of a stock box in X, Y and Z */
#define CHIP_MAX_COORDINATE 1e6   /* mm, of a stock box's corner from machine zero */

enum chip_stock_error {
    CHIP_STOCK_OK = 0,
    CHIP_STOCK_NOT_FINITE = 1, /* a corner of the box is NaN or farther than CHIP_MAX_COORDINATE */
    CHIP_STOCK_EMPTY = 2,      /* max is not CHIP_MIN_SIZE greater than min in some axis */
    CHIP_STOCK_TOO_LARGE = 3,  /* the box needs more cells than the map has */
    CHIP_STOCK_UNSOUND = 4     /* another program has written something that cannot be a map */
};

enum chip_stock_shape {
    CHIP_SHAPE_BOX = 0,
    CHIP_SHAPE_CYLINDER = 1 /* along Z, inscribed in the box: an ellipse if the box is not square */
};

struct chip_stock {
    uint32_t magic, version;
    volatile uint32_t generation; /* odd while a cell or the head is being written */
    uint32_t capacity;            /* cells behind this head, ring included */
    double coarsest, finest;      /* mm, side of a cell at most and at least [7] */
    double cell;                  /* mm, side of a cell of this stock */
    double x0, y0;                /* mm, machine coordinates of the map's corner (inside the ring) [6] */
    double z_min, z_max;          /* mm, bottom and top of the stock box */
    double x_max, y_max;          /* mm, far corner of the map [6] */
    double drop_unit;             /* mm per step of chip_cell.drop */
    int32_t nx, ny;               /* cells in use, ring not counted */
    int32_t filled;               /* rows filled so far, ring included; ny + 2 when ready */
    int32_t shape;                /* chip_stock_shape */
    double removed;               /* mm3 cut since the map was defined */
    double half_x, half_y;        /* mm, half the sides of the stock box */
    double turn;                  /* rad it is turned by, counter-clockwise [6] */
    uint64_t definitions;         /* counts stocks, defined or restored; it rises too when one is given up */
    struct chip_cell cells[];     /* (ny + 2) rows of (nx + 2) */
};

/* Cells, ring included, that a map of size_x by size_y mm needs; 0 if an argument is
 * not a positive number, the cell is not CHIP_MIN_CELL .. CHIP_MAX_CELL, or the count exceeds 2^28. */
uint32_t chip_stock_cells(double cell, double size_x, double size_y);

/* Bytes of a block with `cells` cells. */
uint64_t chip_stock_bytes(uint32_t cells);

/* Makes an empty map (no stock) in a block of chip_stock_bytes(capacity) bytes; all its cells have the side `cell`. */
void chip_stock_init(struct chip_stock *stock, double cell, uint32_t capacity);

/* The same; a stock smaller than the map has smaller cells, at least `finest` mm [7]. A number that cannot be that
 * means `cell`. */
void chip_stock_init_finer(struct chip_stock *stock, double cell, double finest, uint32_t capacity);

/* Side of the cells, mm, of an upright stock of size_x by size_y mm on this map [7]. */
double chip_stock_cell_for(const struct chip_stock *stock, double size_x, double size_y);

/* Starts a new stock box, mm in machine coordinates. Returns a chip_stock_error; on an
 * error the old stock stays as it is. The map is ready when chip_stock_fill says so. */
int chip_stock_define(struct chip_stock *stock, const double min[3], const double max[3]);

/* The same with a shape in the box; an unknown shape means the box. */
int chip_stock_define_shape(struct chip_stock *stock, const double min[3], const double max[3], int shape);

/* The same; the box min..max is turned about its middle by `turn` (rad, counter-clockwise). A cylinder is not
 * turned. */
int chip_stock_define_turned(struct chip_stock *stock, const double min[3], const double max[3], int shape,
                             double turn);

/* Fills at most max_cells cells of a defined map (at least one row); returns 1 when done. */
int chip_stock_fill(struct chip_stock *stock, int max_cells);

/* 1 if the head, as another program has left it, can be that of a map that was made with these numbers; a map without a
 * stock is sound too. The cells may have any side with which they fit. */
int chip_stock_sound(const struct chip_stock *stock, double coarsest, double finest, uint32_t capacity);

/* 1 if a box is defined and filled. */
int chip_stock_ready(const struct chip_stock *stock);

/* Volume left, mm3: the sum over all cells (offline use, visits the whole map). */
double chip_stock_volume(const struct chip_stock *stock);

/* Mean height of a cell above `floor` (mm, parts below it count 0). */
static inline double chip_cell_above(const struct chip_stock *stock, const struct chip_cell *cell, double floor)
{
    double high = (double)cell->top - floor, low;
    if (high <= 0.0) return 0.0;
    if (!cell->cut) return high;
    if (cell->drop & CHIP_RIM) return chip_rim_between(stock, cell, floor, 1e301);
    low = high - cell->drop * stock->drop_unit;
    CHIP_FAULT(CUT_VOLUME_FORGOTTEN, low = high);
    return high + (cell->cut * (1.0 / CHIP_FULL)) * ((low > 0.0 ? low : 0.0) - high);
}

/* Between these two, cells and head may be written; a reader that finds the generation odd, or
 * changed, has to read again. */
static inline void chip_stock_begin_write(struct chip_stock *stock)
{
    stock->generation++;
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
}

static inline void chip_stock_end_write(struct chip_stock *stock)
{
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    stock->generation++;
}

/* Cell (ix, iy), -1 <= ix <= nx and -1 <= iy <= ny (the ring included). */
static inline struct chip_cell *chip_stock_cell(const struct chip_stock *stock, int ix, int iy)
{
    return (struct chip_cell *)stock->cells + (long)(iy + 1) * (stock->nx + 2) + (ix + 1);
}

/* Stock above `floor` at a point, mm, interpolated between the four cells around it. */
double chip_stock_above(const struct chip_stock *stock, double x, double y, double floor);

#endif
