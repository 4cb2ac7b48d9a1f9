/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_triangle.c - the tool on one triangle: [1] of drop_cutter.h. Compiled without infinities: CHIP_DROP_NOTHING takes their place. */

#include "drop_parts.h"

#define SLIVER 1e-7      /* mm: a facet seen from above that is narrower is its edges */
#define LEVEL 1e-9       /* slope of a facet that is level */
#define ROOT_STEPS 60    /* of the contact on an edge by a torus */
#define ROOT_ENOUGH 1e-9 /* mm, bracket of it */

/* How fast m s - g falls short of rising at s along an edge that is d away from the axis: > 0 before its maximum. */
static double rise(const struct chip_tool *tool, double d2, double m, double s)
{
    double r = sqrt(d2 + s * s);
    return r > 0.0 ? m - chip_tool_slope(tool, chip_min(r, tool->radius)) * s / r : m;
}

/* The s between low and high at which m s - g(r) is largest; m > 0, rise(low) > 0 > rise(high). */
static double edge_contact(const struct chip_tool *tool, double d2, double m, double low, double high)
{
    double arc2 = tool->corner * tool->corner - d2, s, f, f_low, f_high;
    int k, side = 0;
    if (tool->r_flat <= 0.0) {
        if (arc2 > 0.0) {
            s = m * sqrt(arc2 / (1.0 + m * m));
            if (d2 + s * s <= tool->r_arc * tool->r_arc) return chip_drop_clamped(s, low, high);
        }
        if (tool->slope > m) {
            s = m * sqrt(d2 / (tool->slope * tool->slope - m * m));
            return chip_drop_clamped(s, low, high);
        }
        return high;
    }
    f_low = rise(tool, d2, m, low);
    f_high = rise(tool, d2, m, high);
    s = low;
    for (k = 0; k < ROOT_STEPS && high - low > ROOT_ENOUGH; k++) {
        s = k & 1 ? 0.5 * (low + high) : (low * f_high - high * f_low) / (f_high - f_low);
        f = rise(tool, d2, m, s);
        if (f > 0.0) {
            low = s;
            f_low = f;
            if (side == 1) f_high *= 0.5;
            side = 1;
        } else {
            high = s;
            f_high = f;
            if (side == -1) f_low *= 0.5;
            side = -1;
        }
    }
    return s;
}

/* The tip over an edge; a and b relative to the axis. */
static double over_edge(const struct chip_tool *tool, const double a[3], const double b[3])
{
    double ux = b[0] - a[0], uy = b[1] - a[1], length = sqrt(ux * ux + uy * uy);
    double s0, d2, m, reach2, low, high, s, swap, z;
    if (length < 1e-12) {
        d2 = a[0] * a[0] + a[1] * a[1];
        if (d2 > (tool->radius + CHIP_DROP_RIM) * (tool->radius + CHIP_DROP_RIM)) return CHIP_DROP_NOTHING;
        return chip_max(a[2], b[2]) - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius));
    }
    ux /= length;
    uy /= length;
    s0 = a[0] * ux + a[1] * uy;
    d2 = a[0] * uy - a[1] * ux;
    d2 *= d2;
    reach2 = (tool->radius + CHIP_DROP_RIM) * (tool->radius + CHIP_DROP_RIM) - d2;
    if (reach2 < 0.0) return CHIP_DROP_NOTHING;
    m = (b[2] - a[2]) / length;
    high = sqrt(reach2);
    low = chip_max(s0, -high);
    high = chip_min(s0 + length, high);
    if (low > high) return CHIP_DROP_NOTHING;
    z = a[2] - m * s0;
    if (m < 0.0) {
        m = -m;
        swap = low;
        low = -high;
        high = -swap;
    }
    if (m == 0.0)
        s = chip_drop_clamped(0.0, low, high);
    else if (tool->r_flat <= 0.0)
        s = edge_contact(tool, d2, m, low, high); /* a closed form, and chip_drop_clamped */
    else if (low >= 0.0 && rise(tool, d2, m, low) <= 0.0)
        s = low;
    else if (high <= 0.0 || rise(tool, d2, m, high) >= 0.0)
        s = high;
    else
        s = edge_contact(tool, d2, m, chip_max(low, 0.0), high);
    return z + m * s - chip_tool_height(tool, chip_min(sqrt(d2 + s * s), tool->radius));
}

/* Distance from the axis at which the profile has a slope. */
static double radius_of_slope(const struct chip_tool *tool, double slope)
{
    if (slope < LEVEL) return 0.0;
    if (tool->slope > 0.0 && slope > tool->slope) return tool->radius;
    return chip_min(tool->r_flat + tool->corner * slope / sqrt(1.0 + slope * slope), tool->radius);
}

/* The tip over the inside of a triangle; CHIP_DROP_NOTHING if the facet's plane is met outside of it, or it has none. *beyond:
 * bit k if that is beyond the edge from vertex k, so that the highest tip of the triangle may be on that edge: from any other
 * one a straight line to the plane's contact leads through the triangle, and upwards [1]. */
static double over_facet(const struct chip_tool *tool, double p[3][3], int *beyond)
{
    double ax = p[1][0] - p[0][0], ay = p[1][1] - p[0][1], az = p[1][2] - p[0][2];
    double bx = p[2][0] - p[0][0], by = p[2][1] - p[0][1], bz = p[2][2] - p[0][2];
    double area = ax * by - ay * bx, gx, gy, slope, r, x = 0.0, y = 0.0;
    int k;
    *beyond = 7;
    if (fabs(area) <= SLIVER * (fabs(ax) + fabs(ay) + fabs(bx) + fabs(by))) return CHIP_DROP_NOTHING;
    gx = (az * by - bz * ay) / area;
    gy = (ax * bz - bx * az) / area;
    slope = sqrt(gx * gx + gy * gy);
    r = radius_of_slope(tool, slope);
    CHIP_FAULT(FACET_AT_AXIS, r = 0.0)
    if (r > 0.0) {
        x = r * gx / slope;
        y = r * gy / slope;
    }
    *beyond = 0;
    for (k = 0; k < 3; k++) {
        const double *u = p[k], *v = p[(k + 1) % 3];
        double side = (v[0] - u[0]) * (y - u[1]) - (v[1] - u[1]) * (x - u[0]);
        if (area > 0.0 ? side < 0.0 : side > 0.0) *beyond |= 1 << k;
    }
    if (*beyond) return CHIP_DROP_NOTHING;
    return p[0][2] + gx * (x - p[0][0]) + gy * (y - p[0][1]) - chip_tool_height(tool, r);
}

/* How far a range is from 0. */
static double gap(double a, double b, double c)
{
    double low = chip_min(a, chip_min(b, c)), high = chip_max(a, chip_max(b, c));
    return low > 0.0 ? low : high < 0.0 ? -high : 0.0;
}

double chip_drop_over_triangle(const struct chip_tool *tool, const float *t, double x, double y, double z)
{
    double p[3][3], d2, gx, gy, top;
    int k, beyond;
    for (k = 0; k < 3; k++) {
        p[k][0] = t[3 * k] - x;
        p[k][1] = t[3 * k + 1] - y;
        p[k][2] = t[3 * k + 2];
    }
    gx = gap(p[0][0], p[1][0], p[2][0]);
    gy = gap(p[0][1], p[1][1], p[2][1]);
    d2 = gx * gx + gy * gy;
    if (d2 > (tool->radius + CHIP_DROP_RIM) * (tool->radius + CHIP_DROP_RIM)) return CHIP_DROP_NOTHING;
    top = chip_max(p[0][2], chip_max(p[1][2], p[2][2]));
    if (top - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius)) <= z) return CHIP_DROP_NOTHING;
    top = over_facet(tool, p, &beyond);
    CHIP_FAULT(EDGES_NOT_MET, beyond = 0)
    for (k = 0; k < 3; k++)
        if (beyond & 1 << k) top = chip_max(top, over_edge(tool, p[k], p[(k + 1) % 3]));
    return top;
}
