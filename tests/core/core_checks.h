/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A tool, a stock and the sweeps of that tool: what the tests of the stock share. */
#ifndef CHIPWISE_TESTS_CORE_CHECKS_H
#define CHIPWISE_TESTS_CORE_CHECKS_H

#include <stdlib.h>
#include <string.h>

#include "counted_checks.h"

#include "../../components/core/stock.h"
#include "../../components/core/sweep.h"
#include "../../components/core/tool.h"

#define ALL (1 << 30) /* cells of work: no bound */

static struct chip_tool tool_of(double diameter, double corner, double tip)
{
    struct chip_tool tool;
    CHECK(chip_tool_init(&tool, diameter, corner, tip, 0.0) == CHIP_TOOL_OK);
    return tool;
}

/* A filled box; the caller frees it. */
static struct chip_stock *stock_of(double cell, double x0, double y0, double z0, double x1, double y1, double z1)
{
    const double low[3] = { x0, y0, z0 }, high[3] = { x1, y1, z1 };
    uint32_t cells = chip_stock_cells(cell, x1 - x0, y1 - y0);
    struct chip_stock *stock = calloc(1, chip_stock_bytes(cells));
    chip_stock_init(stock, cell, cells);
    CHECK(chip_stock_define(stock, low, high) == CHIP_STOCK_OK);
    while (!chip_stock_fill(stock, ALL)) continue;
    CHECK(chip_stock_ready(stock));
    return stock;
}

static struct chip_sweep placed(double x, double y, double z)
{
    const double tip[3] = { x, y, z };
    struct chip_sweep sweep;
    memset(&sweep, 0, sizeof sweep);
    chip_sweep_start(&sweep, tip);
    return sweep;
}

static double cut_to(struct chip_sweep *sweep, struct chip_stock *stock, const struct chip_tool *tool, double x,
                     double y, double z)
{
    const double tip[3] = { x, y, z };
    chip_sweep_to(sweep, tip);
    return chip_sweep_run(sweep, stock, tool, ALL, NULL);
}

#endif
