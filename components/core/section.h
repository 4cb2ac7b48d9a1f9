/* section.h - the section area dV/ds: the volume a tool meets per mm of travel.
 *
 * Who calls it: ahead.c for every place the tool is about to reach; the shared library.
 * Source: JP3131045 [0008], F = UQ x LC / VC; VC / LC for LC -> 0 is the section area.
 *
 * Principle:
 *  1. A surface element dS of the tool with outward normal n, moving along the unit
 *     direction d, sweeps (n . d)+ dS of volume per mm where it touches stock. The sum of
 *     that over the tool is dV/ds; back-facing elements sweep nothing.
 *  2. The tool is a stack of bands (tool.h) and a cylinder. On a band a column of stock
 *     counts with the height by which it overlaps the band, so that nothing jumps when
 *     a surface passes from one band to the next.
 *  3. Counting the cells a step removes gives the volume but no load: the front moves
 *     over the cells in jumps. The integral along the front reads heights interpolated
 *     from cells that know how much of them is left.
 *  4. The cells along the tool's own outline are partly cut already. Stock that a point of
 *     the front will meet is therefore read further along the same way, where the tool has
 *     not been: at the same distance beside the path, 1.5 cells outside the circle.
 *     That is up to sqrt(2 R * 1.5 cells) ahead of the truth beside the tool, which shows
 *     where the stock ends. A place read that far before the tool gets there needs no such
 *     detour; ahead.c reads its places in time.
 *  5. A falling tool has cut down to its own surface already. Where nothing can be read in
 *     front (below the tool and behind its axis) a band is read a cell outside its edge, where
 *     the stock that touches it stands as high as the band; a flat end looks a fifth of a
 *     cell lower.
 *  6. Where stock touches only the lower part of a band, that part's own mean radius counts: on an
 *     arc the radius squared, on a cone the radius, is taken as linear in the height. Further
 *     out that is so under a level top only; where columns differ, what is met slopes.
 *  7. A tool that goes level, and the wall of any tool, need no surface elements: what is met is the area between the
 *     tool's outline and the stock's top, seen along the way, band by band, each read where its own circle is. Below the
 *     inner edge of a band that is trapezia across the path, further out a few Gauss points, and where the stock ends
 *     within the band, the band ends there too.
 *  8. At a wall, or a band as steep, only what the tool is to cover counts: a cell outside does not, of one on the edge
 *     that part which lies inside (what has been cut from it lies on the same side, stock.h, 2). A wall of the tool's
 *     own slot is then none, at any depth.
 *  9. A band ends where the tool comes out of the top of the whole stock, and where few bands are below it (a fine groove cut
 *     with a large vee) they are read in pieces: a band wider than that takes stock for met that lies beside the tool.
 */
#ifndef CHIPWISE_SECTION_H
#define CHIPWISE_SECTION_H

#include "stock.h"
#include "tool.h"

struct cw_section {
    double area;                /* mm2 = mm3 per mm of travel */
    double depth;               /* mm, highest stock above the tip met by the tool's surface */
    int nodes;                  /* places at which the stock was read */
};

/* Section area of `tool` with its tip at `tip` (mm) when it moves along the unit vector
 * `dir`. `clear`, mm: 0 where the stock is read before the tool is near (cw_section_reach);
 * cw_section_clear() where it may already be cut by this very position [4]; the way then bends
 * by `curvature` (rad/mm, counter-clockwise positive) to where the stock is read. */
struct cw_section cw_section_at(const struct cw_stock *stock, const struct cw_tool *tool,
                                const double tip[3], const double dir[3], double clear,
                                double curvature);

/* `clear` for a tool that has cut all around it, mm. */
double cw_section_clear(const struct cw_stock *stock);

/* Distance, mm, from which on a place ahead is untouched by what the tool has cut. */
double cw_section_reach(const struct cw_stock *stock, const struct cw_tool *tool);

#endif
