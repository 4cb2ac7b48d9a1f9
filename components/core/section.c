/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section.c - see section.h; the numbers in brackets are those of its principle. */
#include "section_parts.h"

/* cells that keep a reading clear of the stock already cut [4]; smaller reads low beside the cut */
#define CHIP_CLEAR 1.5
#define CHIP_BESIDE_CUT 0.5       /* cells from the cut where stock is read as well where it is [4] */
#define CHIP_SINK 0.2             /* cells below itself at which a falling flat end looks for stock [5] */
#define CHIP_BEYOND 1.0           /* cells outside a falling band at which its stock is read [5] */
#define CHIP_LEVEL_DIRECTION 1e-6 /* vertical part of the direction up to which the tool moves level [7] */
#define CHIP_STEEP 2.0            /* a band this much higher than wide has an edge like a wall's [8] */
/* width of a band's part, in cells: narrower ones read no more than the cells know [9] */
#define CHIP_PART_CELLS 1.5
/* width, in cells, of bands that are read together [9]: less takes more time, more reads less */
#define CHIP_TOGETHER 1.0

/* [9] Largest number of parts of a band: if few bands are below the stock's top, `reach` mm from the axis, each gets
 * more. */
static int max_parts(const struct chip_tool *tool, double reach)
{
    int i, met = 0;
    for (i = 0; i < tool->rings; i++) met += tool->ring[i].inner < reach;
    return met ? CHIP_TOOL_RINGS / met : 1;
}

/* [9] Number of parts in which a band is read, out to `reach`. */
static int band_parts(const struct chip_stock *stock, const struct chip_tool_ring *ring, double reach, int max)
{
    double width = chip_min(ring->outer, reach) - ring->inner;
    if (ring->rise <= CHIP_MIN_CONTACT) return 1;
    return (int)chip_clamp(ceil(width / (CHIP_PART_CELLS * stock->cell)), 1.0, (double)max);
}

/* Part k of n of a band. */
static struct chip_tool_ring band_part(const struct chip_tool *tool, const struct chip_tool_ring *ring, double reach,
                                       int n, int k)
{
    double outer = chip_max(ring->inner, chip_min(ring->outer, reach)), width = (outer - ring->inner) / n;
    struct chip_tool_ring part = *ring;
    if (n > 1 || outer < ring->outer)
        chip_tool_profile_part(tool, ring, ring->inner + k * width, k + 1 < n ? ring->inner + (k + 1) * width : outer,
                               &part);
    return part;
}

static int is_steep(const struct chip_tool_ring *ring) { return ring->rise > CHIP_STEEP * (ring->outer - ring->inner); }

/* [9] Whether the next band is read together with this one: both are within a cell. */
static int joins(const struct chip_stock *stock, const struct chip_tool *tool, const struct chip_tool_ring *ring,
                 int next, double reach)
{
    const struct chip_tool_ring *other = &tool->ring[next];
    return next < tool->rings && other->inner < reach && other->outer - ring->inner <= CHIP_TOGETHER * stock->cell
        && other->straight == ring->straight && is_steep(other) == is_steep(ring)
        && chip_min(ring->rise, other->rise) > CHIP_MIN_CONTACT;
}

/* [7] The tool moves level: the area between its outline and the stock's top, seen along the path. */
static void level_section(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                          double tip, double clear, struct chip_section *section)
{
    double reach = chip_tool_reach(tool, stock->z_max - tip);
    int max = max_parts(tool, reach), i, k, n;
    for (i = 0; i < tool->rings && tool->ring[i].inner < reach; i++) {
        struct chip_tool_ring whole = tool->ring[i];
        while (joins(stock, tool, &whole, i + 1, reach))
            chip_tool_profile_part(tool, &whole, whole.inner, tool->ring[++i].outer, &whole);
        n = band_parts(stock, &whole, reach, max);
        for (k = 0; k < n; k++) {
            struct chip_tool_ring ring = band_part(tool, &whole, reach, n, k);
            double low = tip + ring.height - 0.5 * ring.rise;
            struct chip_strip strip = { ring.inner, ring.outer, ring.radius,     low, low + ring.rise,
                                        clear,      ring.outer, is_steep(&ring), 0,   0 };
            if (ring.rise > CHIP_MIN_CONTACT) chip_strip_add(stock, at, tool, tip, &strip, section);
        }
    }
    chip_strip_add_wall(stock, at, tool, tip, clear, section);
}

/* The pose of a tool at `tip` (mm) that moves along the unit vector `dir`, `in_front` mm in front of where it is. */
static struct chip_pose pose_of(const struct chip_stock *stock, const double tip[3], const double dir[3],
                                double in_front, double curvature)
{
    struct chip_pose at;
    at.level = chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]);
    at.hx = at.level > 1e-9 ? dir[0] / at.level : 1.0;
    at.hy = at.level > 1e-9 ? dir[1] / at.level : 0.0;
    at.in_front = in_front * at.level;
    at.beside_cut = CHIP_BESIDE_CUT * stock->cell;
    at.half_curvature = 0.5 * curvature;
    at.per_cell = 1.0 / stock->cell;
    at.edge = CHIP_EDGE_CELLS / at.per_cell;
    at.x = tip[0];
    at.y = tip[1];
    return at;
}

/* How far a reading keeps outside the tool's present outline [4], mm. */
static double clear_of_cut(const struct chip_stock *stock)
{
    CHIP_FAULT(READ_IN_CUT, return 0.1 * stock->cell);
    return CHIP_CLEAR * stock->cell;
}

double chip_section_reach(const struct chip_stock *stock, const struct chip_tool *tool)
{
    double clear = clear_of_cut(stock);
    return chip_sqrt((2.0 * tool->radius + clear) * clear);
}

/* [1] [5] A flat band of a tool that falls, at the height `end`. */
static void flat_end(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool_ring *ring,
                     double end, double fall, struct chip_section *result)
{
    double sink = fall * CHIP_SINK * stock->cell, slab = chip_max(CHIP_MIN_CONTACT, 0.5 * sink), area;
    if (!(end > stock->z_min)) return;
    area = chip_band_flat_area(stock, at, ring, chip_max(end - sink, stock->z_min), fall, slab, &result->nodes);
    result->area += area;
    if (at->tooth) chip_tooth_end(at, area / fall, fall, result);
}

/* The section of a tool that falls or rises. */
static void sloping_section(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                            const double tip[3], const double dir[3], double clear, struct chip_section *result)
{
    double z = tip[2], fall = chip_max(0.0, -dir[2]), reach;
    struct chip_band band;
    int max, i, k, n;

    reach = chip_tool_reach(tool, stock->z_max - z);
    max = max_parts(tool, reach);
    for (i = 0; i < tool->rings; i++) {
        const struct chip_tool_ring *ring = &tool->ring[i];
        if (ring->rise <= CHIP_MIN_CONTACT) {
            if (fall > 0.0) flat_end(stock, at, ring, z + ring->height, fall, result);
            continue;
        }
        if (ring->inner >= reach) break; /* bands rise outwards */
        n = band_parts(stock, ring, reach, max);
        for (k = 0; k < n; k++) {
            struct chip_tool_ring part = band_part(tool, ring, reach, n, k);
            if (part.rise <= CHIP_MIN_CONTACT) continue;
            band.ring = &part;
            band.radius = part.radius;
            band.outer = part.radius + (clear > 0.0 ? 0.5 * part.run + CHIP_BEYOND * stock->cell : 0.0);
            band.margin = clear > 0.0 ? at->level * (clear + 0.5 * part.run) : 0.0;
            band.low = z + part.height - 0.5 * part.rise;
            band.high = band.low + part.rise;
            if (band.high <= stock->z_min) continue;
            band.fall = -dir[2] * part.run / part.rise;
            if (at->tooth) chip_tooth_band(tool, &part, -dir[2], &band);
            if (band.low < stock->z_min) chip_band_raise_bottom(&band, stock->z_min);
            chip_band_add(stock, at, &band, tip[2], result);
        }
    }
    if (tip[2] + tool->shoulder < stock->z_max && at->level > 1e-9)
        chip_strip_add_wall(stock, at, tool, z, at->level * clear, result);
}

struct chip_section chip_section_at(const struct chip_stock *stock, const struct chip_tool *tool, const double tip[3],
                                    const double dir[3], double in_front, double curvature)
{
    struct chip_section result = { 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0 };
    double clear = in_front < chip_section_reach(stock, tool) ? clear_of_cut(stock) : 0.0;
    double z = tip[2];
    struct chip_pose at;

    if (tip[2] >= stock->z_max || tool->radius <= 0.0) return result;
    at = pose_of(stock, tip, dir, clear > 0.0 ? chip_max(0.0, in_front) : 0.0, curvature);
    at.tooth = chip_tooth_limits(tool->tooth) ? tool->tooth : 0;
    if (at.tooth && at.tooth->force_weight > 0.0) chip_force_begin(at.tooth);
    if (fabs(dir[2]) <= CHIP_LEVEL_DIRECTION)
        level_section(stock, &at, tool, z, clear, &result);
    else
        sloping_section(stock, &at, tool, tip, dir, clear, &result);
    if (at.tooth && at.tooth->force_weight > 0.0) chip_force_end(at.tooth, &result);
    return result;
}
