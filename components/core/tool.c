/* tool.c - see tool.h */
#include "cw_math.h"
#include "tool.h"

#define CW_TOOL_TIP_RINGS 4     /* of the arc at the tip of a cone, which is small */
#define CW_STEEPEST 1e6         /* slope given for a vertical tangent; keeps products finite */

static double arc_height(const struct cw_tool *tool, double r)
{
    double d = r - tool->r_flat;
    double under = tool->corner * tool->corner - d * d;
    return tool->corner - (under > 0.0 ? cw_sqrt(under) : 0.0);
}

/* Mean radius over the height of the arc's piece between the angles u and v (rad, from its
 * lowest point): the band then has the arc's own area seen from the front. */
static double arc_radius(const struct cw_tool *tool, double u, double v)
{
    double segment = 0.5 * (v - u) - 0.25 * (sin(2.0 * v) - sin(2.0 * u));
    return tool->r_flat + tool->corner * segment / (cos(u) - cos(v));
}

/* Bands of equal angle on the arc, equal width on flat and cone: together at most CW_TOOL_RINGS. */
static void build_rings(struct cw_tool *tool)
{
    const double edge[4] = { 0.0, tool->r_flat, tool->r_arc, tool->radius };
    const int share[3] = { 3, 9, 3 }, alone[3] = { 6, CW_TOOL_RINGS, CW_TOOL_RINGS };
    int parts = (tool->r_flat > 0.0) + (tool->r_arc > tool->r_flat) + (tool->r_arc < tool->radius);
    int part, i, n;

    tool->rings = 0;
    for (part = 0; part < 3; part++) {
        double r0 = edge[part];
        double span = edge[part + 1] - r0;
        if (span <= 1e-9 * tool->radius) continue;
        n = parts > 1 ? share[part] : alone[part];
        if (part > 0 && tool->r_arc < tool->radius && tool->r_arc > 0.0) n = part == 1 ? CW_TOOL_TIP_RINGS : CW_TOOL_RINGS - CW_TOOL_TIP_RINGS;
        for (i = 0; i < n; i++) {
            struct cw_tool_ring *ring = &tool->ring[tool->rings++];
            double a = r0 + span * i / n, b = r0 + span * (i + 1) / n;
            ring->radius = 0.5 * (a + b);
            if (part == 1) {
                double top = asin(cw_clamp(span / tool->corner, 0.0, 1.0));
                a = r0 + tool->corner * sin(top * i / n);
                b = r0 + tool->corner * sin(top * (i + 1) / n);
                ring->radius = arc_radius(tool, top * i / n, top * (i + 1) / n);
            }
            ring->inner = a;
            ring->outer = b;
            ring->straight = part == 2;
            ring->run = 0.5 * (b * b - a * a) / ring->radius;
            ring->rise = cw_tool_height(tool, b) - cw_tool_height(tool, a);
            ring->height = 0.5 * (cw_tool_height(tool, b) + cw_tool_height(tool, a));
        }
    }
}

int cw_tool_init(struct cw_tool *tool, double diameter, double corner_radius,
                 double tip_angle, double flute_length)
{
    double radius = 0.5 * diameter;

    tool->radius = 0.0;
    tool->rings = 0;
    if (!(diameter >= CHIP_LEAST_TOOL && diameter <= CHIP_MOST_TOOL)) return CW_TOOL_DIAMETER;
    if (!cw_finite(corner_radius) || corner_radius < 0.0 || corner_radius > radius * (1.0 + 1e-9))
        return CW_TOOL_CORNER;
    if (tip_angle != 0.0 && !(tip_angle >= CHIP_LEAST_TIP && tip_angle < 180.0)) return CW_TOOL_ANGLE;
    if (!(flute_length >= 0.0 && flute_length <= CHIP_LONGEST_FLUTE)) return CW_TOOL_FLUTE;

    tool->corner = corner_radius > radius ? radius : corner_radius;
    tool->flute = flute_length;
    if (tip_angle > 0.0) {
        double half = 0.5 * tip_angle * CW_PI / 180.0;
        tool->slope = cos(half) / sin(half);
        tool->r_flat = 0.0;
        tool->r_arc = tool->corner * cos(half);
        tool->arc_top = tool->corner * (1.0 - sin(half));
    } else {
        tool->slope = 0.0;
        tool->r_flat = radius - tool->corner;
        tool->r_arc = radius;
        tool->arc_top = tool->corner;
    }
    tool->radius = radius;
    tool->shoulder = tool->arc_top + tool->slope * (radius - tool->r_arc);
    build_rings(tool);
    return CW_TOOL_OK;
}

double cw_tool_height(const struct cw_tool *tool, double r)
{
    if (r <= tool->r_flat) return 0.0;
    if (r <= tool->r_arc) return arc_height(tool, r);
    return tool->arc_top + tool->slope * (r - tool->r_arc);
}

double cw_tool_slope(const struct cw_tool *tool, double r)
{
    double d, rest;
    if (r <= tool->r_flat) return 0.0;
    if (r > tool->r_arc) return tool->slope;
    d = r - tool->r_flat;
    rest = tool->corner - arc_height(tool, r);
    return rest * CW_STEEPEST > d ? d / rest : CW_STEEPEST;
}

double cw_tool_reach(const struct cw_tool *tool, double height)
{
    double rest;
    if (height <= 0.0) return 0.0;
    if (height >= tool->shoulder) return tool->radius;
    if (height > tool->arc_top) return tool->r_arc + (height - tool->arc_top) / tool->slope;
    rest = tool->corner - height;
    return tool->r_flat + sqrt(tool->corner * tool->corner - rest * rest);
}

int cw_tool_is_flat(const struct cw_tool *tool)
{
    return tool->r_flat >= tool->radius;
}

void cw_tool_piece(const struct cw_tool *tool, const struct cw_tool_ring *whole, double inner, double outer,
                   struct cw_tool_ring *piece)
{
    double low = cw_tool_height(tool, inner), high = cw_tool_height(tool, outer), sum = inner + outer;
    piece->inner = inner;
    piece->outer = outer;
    piece->straight = whole->straight;
    piece->rise = high - low;
    piece->height = 0.5 * (low + high);
    piece->radius = whole->straight || !(sum > 0.0) ? 0.5 * sum : (inner * inner + inner * outer + outer * outer) / (1.5 * sum);
    piece->run = piece->radius > 0.0 ? 0.5 * (outer - inner) * sum / piece->radius : 0.0;
}
