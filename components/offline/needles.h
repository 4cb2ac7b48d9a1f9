/* SPDX-License-Identifier: GPL-2.0-or-later */
/* needles.h - single needles beside those of a height map, met and cut exactly: where a coarser map has missed something.
 *
 * Who calls it: height_sweep.c.
 *
 *  1. A needle is met when the tool, CHIP_NEEDLE_SKIN smaller in radius, comes over it; its depth is its height above the tip then.
 *     Below the tool's shoulder it is met where the move is nearest. The skin is less than that of depth_proof.h: a path that
 *     is written a micrometre beside still meets the needles that the proof has found at the tool's side.
 *  2. Then it is as high as the move leaves it (swept.h).
 *  3. It counts with CHIP_NEEDLE_AREA of a cell, so that volume shows that something has been cut.
 */
#ifndef CHIPWISE_NEEDLES_H
#define CHIPWISE_NEEDLES_H

#include "core/tool.h"
#include "height_sweep.h"

#define CHIP_NEEDLE_SKIN 0.002 /* mm [1] */
#define CHIP_NEEDLE_AREA 1e-3  /* cells [3] */

/* One straight move a to b; adds to what it has met. */
void chip_needles_cut(const struct chip_height_map *map, const struct chip_tool *tool, const double a[3],
                      const double b[3], struct chip_height_met *met);

#endif
