/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section.h - the section area dV/ds: the volume a tool meets per mm of travel.
 *
 * Who calls it: lookahead.c for every point the tool is about to reach; the shared library.
 * Source: JP3131045 [0008], F = UQ x LC / VC; VC / LC for LC -> 0 is the section area.
 *
 * Principle:
 *  1. A surface element dS of the tool with outward normal n, moving along the unit
 *     direction d, sweeps (n . d)+ dS of volume per mm where it touches stock. The sum of
 *     that over the tool is dV/ds; back-facing elements sweep nothing.
 *  2. The tool is a stack of bands (tool.h) and a cylinder. On a band a column of stock
 *     counts with the height by which it overlaps the band, so that nothing jumps when
 *     a surface passes from one band to the next.
 *  3. Counting the cells a step removes gives the volume but not the load: the front moves
 *     over the cells in jumps. The integral along the front reads heights interpolated
 *     from cells that know how much of them is left.
 *  4. The cells along the tool's own outline are partly cut already. Stock that a point of
 *     the front will meet is therefore read farther along the same path, where the tool has
 *     not been: at the same distance beside the path, 1.5 cells outside the circle in which the tool is now.
 *     Beside the tool that is up to sqrt(2 R * 1.5 cells) ahead of the true position, which shows
 *     where the stock ends. Each point is moved only as far as that takes: most of the front of a tool that is still
 *     some cells away is read where it is, and all of it sqrt(2 R * 1.5 cells) before the tool gets there.
 *     In front of a wall of the tool the larger of both readings counts, if the point is clear of the cut by half a cell: the detour
 *     may lead across a wall of the stock that is thinner.
 *  5. A falling tool has cut down to its own surface already. If nothing can be read in
 *     front (below the tool and behind its axis) a band is read a cell outside its edge, where
 *     the stock that touches it is as high as the band; a flat end looks a fifth of a
 *     cell lower.
 *  6. If stock touches only the lower part of a band, that part's own mean radius counts: on an
 *     arc the radius squared, on a cone the radius, is assumed linear in the height. Farther
 *     out that holds under a level top only; if columns differ, the stock slopes.
 *  7. A tool that moves level, and the wall of any tool, need no surface elements: the section is the area between the
 *     tool's outline and the stock's top, seen along the path, band by band, each read where its own circle is. Below
 *     the inner edge of a band it is computed by trapezia across the path, farther out by a few Gauss points. If the
 *     stock ends within the band, the band ends there too.
 *  8. At a wall, or a band as steep, only the area the tool is going to cover counts: a cell outside does not; a cell
 *     on the edge counts with the part that lies inside (what has been cut from it lies on the same side, stock.h, 2).
 *     A wall of
 *     the tool's own slot then does not count, at any depth.
 *     Beside a path that bends, so does that edge.
 *  9. A band ends where the tool comes out of the top of the whole stock. If few bands are below it (a fine groove cut
 *     with a large vee) they are read in parts: a wider band would count stock that lies beside the tool.
 *     Neighbouring bands of a tool that moves level are read as one if they lie within a cell: the cells know no more.
 * 10. A wall of the stock that runs through a cell is read where it is, and not interpolated between the cells: its direction comes
 *     from the cells around it, its place from the share of the cell that is cut. It is spread evenly to both sides, by half a cell
 *     at most and never beyond the tool's edge. Interpolated, it would lie up to 0.1 cells beside its place where the circle of the
 *     tool crosses it at an angle and it crosses rows of cells. A point whose cells know of more than two heights, and one that is
 *     read clear of the tool [4], is interpolated.
 */
#ifndef CHIPWISE_SECTION_H
#define CHIPWISE_SECTION_H

#include "stock.h"
#include "tool.h"

struct chip_section {
    double area;  /* mm2 = mm3 per mm of travel */
    double depth; /* mm, highest stock above the tip met by the tool's surface */
    int nodes;    /* points at which the stock was read */
    /* of a tool with limits (tooth.h), 0 without: */
    double chip;       /* largest chip over the feed per tooth, 0..1 */
    double power_area; /* mm2, A_mc */
    double side_force; /* mm, the largest vector sum of all edges over a turn (tooth.h, 9) */
    double mean_force; /* mm, its mean */
};

/* Section area of `tool` with its tip at `tip` (mm) when it moves along the unit vector
 * `dir`. `in_front`, mm: how far along the path `tip` is in front of the tool, whose cut is in the map up to there [4];
 * chip_section_reach() or more: nothing has been cut near it. The path bends by `curvature` (rad/mm, counter-clockwise
 * positive). */
struct chip_section chip_section_at(const struct chip_stock *stock, const struct chip_tool *tool, const double tip[3],
                                    const double dir[3], double in_front, double curvature);

/* A_mc of a tool with stock all round, mm2 (tooth.h): a full slot of this depth and a full plunge. */
double chip_tooth_full_area(const struct chip_tool *tool, const double dir[3], double depth);

/* `side_force` of a tool with stock all round, mm: as a full slot of this depth and a plunge into stock on one side. */
double chip_force_full(const struct chip_tool *tool, const double dir[3], double depth);

/* Distance, mm, beyond which a point ahead is untouched by the tool's cut. */
double chip_section_reach(const struct chip_stock *stock, const struct chip_tool *tool);

#endif
