/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_curved.c - a cell below a curved end, whose heights at four points are known: see sweep_segment.h and sweep.h. */
#include "sweep_segment.h"

/* In the stock's original top the four points give a plane,
 * and where that leaves the top gives the share that is cut. A cell cut before is a slope itself, so only the
 * mean of all four may be compared with it (otherwise each pass would take a bit more). */
double chip_sweep_curved(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                         struct chip_cell *cell, const double z[4])
{
    double mean = 0.25 * (z[0] + z[1] + z[2] + z[3]), gx, gy, slope, over, share, below;
    if (is_slope(cell, (float)stock->z_max)) return chip_cell_cut(stock, cell, 1.0, mean);
    gx = 0.8660254037844386 * (z[1] + z[3] - z[0] - z[2]); /* rise of the plane over the cell */
    gy = 0.8660254037844386 * (z[2] + z[3] - z[0] - z[1]);
    over = mean - (double)cell->top;
    if (over <= -0.5 * (fabs(gx) + fabs(gy))) return chip_cell_cut(stock, cell, 1.0, mean);
    slope = chip_sqrt(gx * gx + gy * gy);
    if (!(slope > 0.0)) return 0.0;
    *segment->work += CHIP_WORK_EDGE;
    share = chip_cell_covered(over / slope, gx / slope, gy / slope);
    below = slope * chip_cell_wedge(over / slope, gx / slope, gy / slope);
    return share > 0.0 ? chip_cell_cut(stock, cell, share, (double)cell->top - below / share) : 0.0;
}
