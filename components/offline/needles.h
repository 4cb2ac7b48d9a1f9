/* SPDX-License-Identifier: GPL-2.0-or-later */
/* needles.h - single needles beside those of a height map, met and cut exactly: where a coarser map has missed something.
 *
 * Who calls it: height_sweep.c, height_clearance.c.
 *
 *  1. A needle is met when the tool, a skin smaller in radius, comes over it; its depth is its height above the tip then.
 *     Below the tool's shoulder it is met where the move is nearest. The map has the skin: CHIP_HEIGHT_SKIN where a program is judged, less where
 *     needles stand at places that depth_proof.h has found at the tool's side, so that a path that is written a micrometre beside still meets them.
 *  2. Then it is as high as the move leaves it (swept.h).
 *  3. Where a program is judged it adds nothing to the volume: thousands of needles may be in one cell, whose own needle has all of it.
 *     At places that depth_proof.h has found it counts with CHIP_NEEDLE_AREA of a cell, so that volume shows that something has been cut.
 */
#ifndef CHIPWISE_NEEDLES_H
#define CHIPWISE_NEEDLES_H

#include "core/tool.h"
#include "height_sweep.h"

/* One straight move a to b; adds to what it has met. */
void chip_needles_cut(const struct chip_height_map *map, const struct chip_tool *tool, const double a[3],
                      const double b[3], struct chip_height_met *met);

/* The strip of a place, -1 or `strips` beside all. */
int32_t chip_needles_strip(const struct chip_height_map *map, double y);

/* The first needle of a strip whose X is not below x. */
int32_t chip_needles_from(const struct chip_height_map *map, int32_t strip, double x);

#endif
