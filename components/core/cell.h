/* SPDX-License-Identifier: GPL-2.0-or-later */
/* cell.h - a cell of the stock map: how its content is stored, and what a cut takes off it.
 *
 * Who calls it: stock.c, the sweep_*.c and the section_*.c. The numbers in brackets are those of the principle in stock.h.
 */
#ifndef CHIPWISE_CELL_H
#define CHIPWISE_CELL_H

#include <stdint.h>

#define CHIP_FULL 65535      /* a share of one, in cell units */
#define CHIP_DROP_FULL 32767 /* the whole height of the stock, in steps of `drop` */
#define CHIP_RIM 0x8000      /* in `drop`: a cell on the outline of the stock box */
#define CHIP_RIM_TWO 0x4000  /* and part of it is cut; then */
#define CHIP_RIM_DROP 1023   /* the whole height, */
#define CHIP_RIM_CUT 511     /* a share of one that is cut, */
#define CHIP_RIM_GONE 2047   /* and a share of one without stock have these steps */

struct chip_stock; /* stock.h: the map */

struct chip_cell {
    float top;     /* mm, machine Z of the uncut part */
    uint16_t drop; /* cut part lies drop * drop_unit below top */
    uint16_t cut;  /* share of the cell that is cut, 0..CHIP_FULL; 0: drop is 0 too */
}; /* with CHIP_RIM alone: cut is the share gone; with CHIP_RIM_TWO: drop has 4 low bits of the cut share and 10 of the
         * drop, cut 11 bits of the share gone and 5 high bits of the cut share */

struct chip_levels { /* content of a cell */
    double top, low; /* mm, machine Z of its uncut and its cut part */
    double cut;      /* share of its stock that is cut */
    double gone;     /* share of the cell that is outside the stock box */
};

/* Cuts share k (0..1) of a cell down to height z (mm); returns the volume removed, mm3. */
double chip_cell_cut(const struct chip_stock *stock, struct chip_cell *cell, double k, double z);

/* Content of a cell, rim or not. */
struct chip_levels chip_cell_levels(const struct chip_stock *stock, const struct chip_cell *cell);

/* Makes a rim cell of it; for the core's own use. */
__attribute__((visibility("hidden"))) void chip_cell_set_rim(const struct chip_stock *stock, struct chip_cell *cell,
                                                             const struct chip_levels *levels);

/* Mean height of a rim cell's stock between two heights, mm above the lower. */
double chip_rim_between(const struct chip_stock *stock, const struct chip_cell *cell, double low, double high);

/* Share of a cell inside a straight edge: `outside` is the distance of the cell's centre from the edge in cells
 * (negative inside), (nx, ny) the edge's unit normal. */
double chip_cell_covered(double outside, double nx, double ny);

/* Integral of that over `outside` from there on: the volume, in cells, of the wedge a plane rising by one cell per cell
 * along the normal leaves below it. */
double chip_cell_wedge(double outside, double nx, double ny);

/* Share of a rim cell's stock that the tool covers when it covers the share k of the cell, and its outline there has
 * the outward normal (ex, ey): the stock lies on one side of the cell, as the tool does. (x, y): the cell's middle,
 * mm. */
double chip_rim_covered(const struct chip_stock *stock, const struct chip_cell *cell, double x, double y, double k,
                        double ex, double ey);

#endif
