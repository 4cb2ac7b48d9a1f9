/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tool.c - see tool.h */
#include "chip_math.h"
#include "tool.h"

#define CHIP_TOOL_TIP_RINGS 4 /* of the arc at the tip of a cone, which is small */
#define CHIP_STEEPEST 1e6     /* slope given for a vertical tangent; keeps products finite */

static double arc_height(const struct chip_tool *tool, double r)
{
    double d = r - tool->r_flat;
    double under = tool->corner * tool->corner - d * d;
    return tool->corner - (under > 0.0 ? chip_sqrt(under) : 0.0);
}

/* Mean radius over the height of the arc between the angles u and v (rad, from its
 * lowest point): the band then has the arc's own area seen from the front. */
static double arc_radius(const struct chip_tool *tool, double u, double v)
{
    double segment = 0.5 * (v - u) - 0.25 * (sin(2.0 * v) - sin(2.0 * u));
    return tool->r_flat + tool->corner * segment / (cos(u) - cos(v));
}

/* Bands of equal angle on the arc, equal width on flat and cone: together at most CHIP_TOOL_RINGS. */
static void build_rings(struct chip_tool *tool)
{
    const double edge[4] = { 0.0, tool->r_flat, tool->r_arc, tool->radius };
    const int share[3] = { 3, 9, 3 }, alone[3] = { 6, CHIP_TOOL_RINGS, CHIP_TOOL_RINGS };
    int parts = (tool->r_flat > 0.0) + (tool->r_arc > tool->r_flat) + (tool->r_arc < tool->radius);
    int part, i, n;

    tool->rings = 0;
    for (part = 0; part < 3; part++) {
        double r0 = edge[part];
        double span = edge[part + 1] - r0;
        if (span <= 1e-9 * tool->radius) continue;
        n = parts > 1 ? share[part] : alone[part];
        if (part > 0 && tool->r_arc < tool->radius && tool->r_arc > 0.0)
            n = part == 1 ? CHIP_TOOL_TIP_RINGS : CHIP_TOOL_RINGS - CHIP_TOOL_TIP_RINGS;
        for (i = 0; i < n; i++) {
            struct chip_tool_ring *ring = &tool->ring[tool->rings++];
            double a = r0 + span * i / n, b = r0 + span * (i + 1) / n;
            ring->radius = 0.5 * (a + b);
            if (part == 1) {
                double top = asin(chip_clamp(span / tool->corner, 0.0, 1.0));
                a = r0 + tool->corner * sin(top * i / n);
                b = r0 + tool->corner * sin(top * (i + 1) / n);
                ring->radius = arc_radius(tool, top * i / n, top * (i + 1) / n);
            }
            ring->inner = a;
            ring->outer = b;
            ring->straight = part == 2;
            ring->run = 0.5 * (b * b - a * a) / ring->radius;
            CHIP_FAULT(BANDS_WIDE, ring->run *= 1.2);
            ring->rise = chip_tool_height(tool, b) - chip_tool_height(tool, a);
            ring->height = 0.5 * (chip_tool_height(tool, b) + chip_tool_height(tool, a));
        }
    }
}

void chip_tool_set_profile(struct chip_tool *tool, double radius, double corner, double half_angle)
{
    tool->corner = corner;
    if (half_angle > 0.0) {
        tool->slope = cos(half_angle) / sin(half_angle);
        tool->r_flat = 0.0;
        tool->r_arc = tool->corner * cos(half_angle);
        tool->arc_top = tool->corner * (1.0 - sin(half_angle));
    } else {
        tool->slope = 0.0;
        tool->r_flat = radius - tool->corner;
        tool->r_arc = radius;
        tool->arc_top = tool->corner;
    }
    tool->radius = radius;
    tool->shoulder = tool->arc_top + tool->slope * (radius - tool->r_arc);
}

int chip_tool_init(struct chip_tool *tool, double diameter, double corner_radius, double tip_angle, double flute_length)
{
    double radius = 0.5 * diameter;

    tool->radius = 0.0;
    tool->rings = 0;
    tool->tooth = 0;
    if (!(diameter >= CHIP_MIN_TOOL_DIAMETER && diameter <= CHIP_MAX_TOOL_DIAMETER)) return CHIP_TOOL_DIAMETER;
    if (!chip_finite(corner_radius) || corner_radius < 0.0 || corner_radius > radius * (1.0 + 1e-9))
        return CHIP_TOOL_CORNER;
    if (tip_angle != 0.0 && !(tip_angle >= CHIP_MIN_TIP_ANGLE && tip_angle < 180.0)) return CHIP_TOOL_ANGLE;
    if (!(flute_length >= 0.0 && flute_length <= CHIP_MAX_FLUTE_LENGTH)) return CHIP_TOOL_FLUTE;

    tool->flute = flute_length;
    chip_tool_set_profile(tool, radius, corner_radius > radius ? radius : corner_radius,
                          0.5 * tip_angle * CHIP_PI / 180.0);
    build_rings(tool);
    return CHIP_TOOL_OK;
}

double chip_tool_height(const struct chip_tool *tool, double r)
{
    if (r <= tool->r_flat) return 0.0;
    if (r <= tool->r_arc) return arc_height(tool, r);
    return tool->arc_top + tool->slope * (r - tool->r_arc);
}

double chip_tool_slope(const struct chip_tool *tool, double r)
{
    double d, rest;
    if (r <= tool->r_flat) return 0.0;
    if (r > tool->r_arc) return tool->slope;
    d = r - tool->r_flat;
    rest = tool->corner - arc_height(tool, r);
    return rest * CHIP_STEEPEST > d ? d / rest : CHIP_STEEPEST;
}

double chip_tool_as_steep(const struct chip_tool *tool, double aside, double slope)
{
    double steep2 = slope * slope, aside2 = aside * aside, r = chip_max(aside, tool->r_flat), along2;
    int i;
    if (!(tool->r_flat > 0.0)) {
        along2 = steep2 * (tool->corner * tool->corner - aside2) / (1.0 + steep2);
        if (along2 + aside2 > tool->r_arc * tool->r_arc)
            along2 = steep2 * aside2 / chip_max(tool->slope * tool->slope - steep2, 1e-9);
        return chip_sqrt(chip_max(along2, 0.0));
    }
    for (i = 0; i < 2; i++) { /* the arc is as steep as the line, seen along it, if its point is so far out */
        double along = chip_sqrt(chip_max(r * r - aside2, 0.0)), steep;
        if (!(along > 0.0)) return slope * aside / chip_max(chip_tool_slope(tool, aside), 1e-9);
        steep = slope * r / along;
        r = tool->r_flat + tool->corner * steep / chip_sqrt(1.0 + steep * steep);
    }
    return chip_sqrt(chip_max(r * r - aside2, 0.0));
}

double chip_tool_reach(const struct chip_tool *tool, double height)
{
    double rest;
    if (height <= 0.0) return 0.0;
    if (height >= tool->shoulder) return tool->radius;
    if (height > tool->arc_top) return tool->r_arc + (height - tool->arc_top) / tool->slope;
    rest = tool->corner - height;
    return tool->r_flat + sqrt(tool->corner * tool->corner - rest * rest);
}

int chip_tool_is_flat(const struct chip_tool *tool) { return tool->r_flat >= tool->radius; }

void chip_tool_profile_part(const struct chip_tool *tool, const struct chip_tool_ring *whole, double inner,
                            double outer, struct chip_tool_ring *part)
{
    double low = chip_tool_height(tool, inner), high = chip_tool_height(tool, outer), sum = inner + outer;
    part->inner = inner;
    part->outer = outer;
    part->straight = whole->straight;
    part->rise = high - low;
    part->height = 0.5 * (low + high);
    part->radius =
        whole->straight || !(sum > 0.0) ? 0.5 * sum : (inner * inner + inner * outer + outer * outer) / (1.5 * sum);
    part->run = part->radius > 0.0 ? 0.5 * (outer - inner) * sum / part->radius : 0.0;
}
