/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_cutter.c - see drop_cutter.h. Compiled without infinities: CHIP_DROP_NOTHING takes their place. */

#include "core/chip_math.h"
#include "core/tool.h"
#include "drop_cutter.h"

#define RIM 1e-9         /* mm: a point at the tool's radius is met */
#define SLIVER 1e-7      /* mm: a facet seen from above that is narrower is its edges */
#define LEVEL 1e-9       /* slope of a facet that is level */
#define ROOT_STEPS 60    /* of the contact on an edge by a torus */
#define ROOT_ENOUGH 1e-9 /* mm, bracket of it */
#define SHRINKS 90       /* of a bracket along a segment [4]; the golden section's 0.618^90 is 1e-19 */
#define FOUND 1e-7       /* mm: a bracket is left when it can hold no more than that */
#define GOLDEN 0.6180339887498949

static double clamped(double v, double low, double high) { return chip_max(low, chip_min(v, high)); }

/* ---- one triangle [1] -------------------------------------------------------------------------------------------- */

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
            if (d2 + s * s <= tool->r_arc * tool->r_arc) return clamped(s, low, high);
        }
        if (tool->slope > m) {
            s = m * sqrt(d2 / (tool->slope * tool->slope - m * m));
            return clamped(s, low, high);
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
        if (d2 > (tool->radius + RIM) * (tool->radius + RIM)) return CHIP_DROP_NOTHING;
        return chip_max(a[2], b[2]) - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius));
    }
    ux /= length;
    uy /= length;
    s0 = a[0] * ux + a[1] * uy;
    d2 = a[0] * uy - a[1] * ux;
    d2 *= d2;
    reach2 = (tool->radius + RIM) * (tool->radius + RIM) - d2;
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
        s = clamped(0.0, low, high);
    else if (tool->r_flat <= 0.0)
        s = edge_contact(tool, d2, m, low, high); /* a closed form, and clamped */
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

/* The tip over a triangle with the axis at (x, y), if it can be above `z`; else something up to z. */
static double over_triangle(const struct chip_tool *tool, const float *t, double x, double y, double z)
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
    if (d2 > (tool->radius + RIM) * (tool->radius + RIM)) return CHIP_DROP_NOTHING;
    top = chip_max(p[0][2], chip_max(p[1][2], p[2][2]));
    if (top - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius)) <= z) return CHIP_DROP_NOTHING;
    top = over_facet(tool, p, &beyond);
    for (k = 0; k < 3; k++)
        if (beyond & 1 << k) top = chip_max(top, over_edge(tool, p[k], p[(k + 1) % 3]));
    return top;
}

/* ---- bins [3] ---------------------------------------------------------------------------------------------------- */

static int32_t bin_of(double v, double bin, int32_t count)
{
    return (int32_t)clamped(floor(v / bin), 0.0, count - 1.0);
}

/* The bins that a triangle's box touches: low x, high x, low y, high y. */
static void bins_of(const struct chip_drop_mesh *mesh, const float *t, int32_t range[4])
{
    range[0] = bin_of(chip_min(t[0], chip_min(t[3], t[6])), mesh->bin, mesh->nx);
    range[1] = bin_of(chip_max(t[0], chip_max(t[3], t[6])), mesh->bin, mesh->nx);
    range[2] = bin_of(chip_min(t[1], chip_min(t[4], t[7])), mesh->bin, mesh->ny);
    range[3] = bin_of(chip_max(t[1], chip_max(t[4], t[7])), mesh->bin, mesh->ny);
}

int64_t chip_drop_entries(const struct chip_drop_mesh *mesh)
{
    int64_t sum = 0;
    int32_t k, r[4];
    for (k = 0; k < mesh->n; k++) {
        bins_of(mesh, mesh->triangle + 9 * (int64_t)k, r);
        sum += (int64_t)(r[1] - r[0] + 1) * (r[3] - r[2] + 1);
    }
    return sum;
}

void chip_drop_fill(struct chip_drop_mesh *mesh)
{
    int64_t bins = (int64_t)mesh->nx * mesh->ny, b;
    int32_t k, i, j, r[4], pass;
    for (b = 0; b <= bins; b++) mesh->first[b] = 0;
    for (pass = 0; pass < 2; pass++) {
        for (k = 0; k < mesh->n; k++) {
            bins_of(mesh, mesh->triangle + 9 * (int64_t)k, r);
            for (j = r[2]; j <= r[3]; j++)
                for (i = r[0]; i <= r[1]; i++) {
                    b = (int64_t)j * mesh->nx + i;
                    if (pass)
                        mesh->member[mesh->first[b]++] = k;
                    else
                        mesh->first[b + 1]++;
                }
        }
        if (!pass)
            for (b = 0; b < bins; b++) mesh->first[b + 1] += mesh->first[b];
    }
    for (b = bins; b > 0; b--) mesh->first[b] = mesh->first[b - 1]; /* filling moved each to its end */
    mesh->first[0] = 0;
    for (b = 0; b < bins; b++)
        mesh->bin_top[b] =
            mesh->first[b] < mesh->first[b + 1] ? mesh->top[mesh->member[mesh->first[b]]] : (float)CHIP_DROP_NOTHING;
}

/* How far v is from bin k. */
static double off_bin(double v, int32_t k, double bin)
{
    return chip_max(0.0, chip_max(k * bin - v, v - (k + 1) * bin));
}

static void profile_of(struct chip_tool *profile, const struct chip_drop_tool *tool)
{
    chip_tool_set_profile(profile, tool->radius, tool->corner, tool->half_angle);
}

static uint32_t new_stamp(struct chip_drop_mesh *mesh)
{
    int32_t k;
    if (++mesh->stamp == 0) {
        for (k = 0; k < mesh->n; k++) mesh->seen[k] = 0;
        mesh->stamp = 1;
    }
    return mesh->stamp;
}

/* ---- at points --------------------------------------------------------------------------------------------------- */

static double in_bin(struct chip_drop_mesh *mesh, const struct chip_tool *tool, int32_t i, int32_t j, double x,
                     double y, double z, int32_t *touched)
{
    int64_t b = (int64_t)j * mesh->nx + i;
    double dx, dy, d2, found;
    int32_t m;
    if (mesh->bin_top[b] <= z) return z;
    dx = off_bin(x, i, mesh->bin);
    dy = off_bin(y, j, mesh->bin);
    d2 = dx * dx + dy * dy;
    if (d2 > (tool->radius + RIM) * (tool->radius + RIM)) return z;
    if (mesh->bin_top[b] - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius)) <= z) return z;
    for (m = mesh->first[b]; m < mesh->first[b + 1]; m++) {
        int32_t k = mesh->member[m];
        if (mesh->top[k] <= z) break;
        if (mesh->seen[k] == mesh->stamp) continue;
        mesh->seen[k] = mesh->stamp;
        found = over_triangle(tool, mesh->triangle + 9 * (int64_t)k, x, y, z);
        if (found > z) {
            z = found;
            *touched = k;
        }
    }
    return z;
}

void chip_drop_points(struct chip_drop_mesh *mesh, const struct chip_drop_tool *tool, long n, const double (*xy)[2],
                      double *z)
{
    struct chip_tool profile;
    int32_t i, j, at_i, at_j, i0, i1, j0, j1, touched = 0;
    long k;
    profile_of(&profile, tool);
    for (k = 0; k < n; k++) {
        double x = xy[k][0], y = xy[k][1], found = z[k];
        new_stamp(mesh);
        if (mesh->n > 0) /* the one that was touched last, as points are mostly neighbours */
            found = chip_max(found, over_triangle(&profile, mesh->triangle + 9 * (int64_t)touched, x, y, found));
        at_i = bin_of(x, mesh->bin, mesh->nx);
        at_j = bin_of(y, mesh->bin, mesh->ny);
        i0 = bin_of(x - profile.radius - RIM, mesh->bin, mesh->nx);
        i1 = bin_of(x + profile.radius + RIM, mesh->bin, mesh->nx);
        j0 = bin_of(y - profile.radius - RIM, mesh->bin, mesh->ny);
        j1 = bin_of(y + profile.radius + RIM, mesh->bin, mesh->ny);
        found = in_bin(mesh, &profile, at_i, at_j, x, y, found, &touched); /* most often the contact is near */
        for (j = j0; j <= j1; j++)
            for (i = i0; i <= i1; i++) found = in_bin(mesh, &profile, i, j, x, y, found, &touched);
        z[k] = found;
    }
}

/* ---- along segments [4] ------------------------------------------------------------------------------------------ */

struct path {
    const struct chip_tool *tool;
    double x, y, z, ux, uy, uz; /* from, and the vector to the end */
};

static double excess_at(const struct path *p, const float *t, double s)
{
    double z = over_triangle(p->tool, t, p->x + s * p->ux, p->y + s * p->uy, CHIP_DROP_NOTHING);
    return z > CHIP_DROP_NOTHING ? z - p->z - s * p->uz : CHIP_DROP_NOTHING;
}

/* Widens [*low, *high] by the shares of the path within the tool's radius of the edge a b. */
static void near_edge(const struct path *p, const float *a, const float *b, double *low, double *high)
{
    double radius = p->tool->radius, ex = b[0] - a[0], ey = b[1] - a[1], length = sqrt(ex * ex + ey * ey);
    double uu = p->ux * p->ux + p->uy * p->uy, at[4];
    int n = 0, k;
    const float *ends[2] = { a, b };
    for (k = 0; k < 2; k++) { /* the discs about its ends */
        double wx = p->x - ends[k][0], wy = p->y - ends[k][1], half = wx * p->ux + wy * p->uy;
        double under = half * half - uu * (wx * wx + wy * wy - radius * radius);
        if (under < 0.0) continue;
        under = sqrt(under);
        *low = chip_min(*low, (-half - under) / uu);
        *high = chip_max(*high, (-half + under) / uu);
    }
    if (length > 1e-12) { /* the strip between them */
        double nx = -ey / length, ny = ex / length, vx = ex / length, vy = ey / length;
        double across = (p->x - a[0]) * nx + (p->y - a[1]) * ny, speed = p->ux * nx + p->uy * ny;
        double along = (p->x - a[0]) * vx + (p->y - a[1]) * vy, run = p->ux * vx + p->uy * vy;
        if (fabs(speed) > 1e-15)
            for (k = -1; k <= 1; k += 2) at[n++] = (k * radius - across) / speed;
        for (k = 0; k < n; k++) {
            double s = at[k], w = along + s * run;
            if (w >= 0.0 && w <= length) {
                *low = chip_min(*low, s);
                *high = chip_max(*high, s);
            }
        }
    }
}

/* The shares of the path at which the tool is over a triangle; 0 if there are none. */
static int shares_over(const struct path *p, const float *t, double *low, double *high)
{
    *low = 1e30;
    *high = CHIP_DROP_NOTHING;
    near_edge(p, t, t + 3, low, high);
    near_edge(p, t + 3, t + 6, low, high);
    near_edge(p, t + 6, t, low, high);
    *low = chip_max(*low, 0.0);
    *high = chip_min(*high, 1.0);
    return *low <= *high;
}

/* A concave function between low and high, known at both and at s1 < s2 between. */
struct bracket {
    double low, s1, s2, high;
    double f_low, f1, f2, f_high;
};

/* What it cannot exceed between them: beyond a line through two of its points it is below that line. */
static double bound_of(const struct bracket *b)
{
    double width = b->s2 - b->s1, left = b->s1 - b->low, right = b->high - b->s2, outside, inside;
    if (width <= 0.0 || left <= 0.0 || right <= 0.0) return chip_max(b->f1, b->f2);
    if (b->f1 > b->f2) {
        outside = b->f1 + (b->f1 - b->f2) / width * left;
        inside = b->f1 + (b->f1 - b->f_low) / left * width;
    } else {
        outside = b->f2 + (b->f2 - b->f1) / width * right;
        inside = b->f2 + (b->f2 - b->f_high) / right * width;
    }
    return chip_max(chip_max(outside, inside), chip_max(b->f1, b->f2));
}

/* Leaves out the end that cannot hold the maximum. */
static void shrink(const struct path *p, const float *t, struct bracket *b)
{
    if (b->f1 > b->f2) {
        b->high = b->s2;
        b->f_high = b->f2;
        b->s2 = b->s1;
        b->f2 = b->f1;
        b->s1 = b->high - GOLDEN * (b->high - b->low);
        b->f1 = excess_at(p, t, b->s1);
    } else {
        b->low = b->s1;
        b->f_low = b->f1;
        b->s1 = b->s2;
        b->f1 = b->f2;
        b->s2 = b->low + GOLDEN * (b->high - b->low);
        b->f2 = excess_at(p, t, b->s2);
    }
}

static void keep_best(double f, double s, double *best, double *share)
{
    if (f <= *best) return;
    *best = f;
    *share = s;
}

/* The largest excess of one triangle, if it is above `best`. */
static double triangle_excess(const struct path *p, const float *t, double best, double *share)
{
    struct bracket b;
    int k;
    b.low = 0.0;
    b.high = 1.0;
    b.f_low = excess_at(p, t, b.low);
    b.f_high = excess_at(p, t, b.high);
    if (b.f_low <= CHIP_DROP_NOTHING || b.f_high <= CHIP_DROP_NOTHING) { /* else it is met all along: convex */
        if (!shares_over(p, t, &b.low, &b.high)) return best;
        b.f_low = excess_at(p, t, b.low);
        b.f_high = excess_at(p, t, b.high);
    }
    b.s1 = b.high - GOLDEN * (b.high - b.low);
    b.s2 = b.low + GOLDEN * (b.high - b.low);
    b.f1 = excess_at(p, t, b.s1);
    b.f2 = excess_at(p, t, b.s2);
    keep_best(b.f_low, b.low, &best, share);
    keep_best(b.f_high, b.high, &best, share);
    for (k = 0; k < SHRINKS; k++) {
        keep_best(b.f1, b.s1, &best, share);
        keep_best(b.f2, b.s2, &best, share);
        if (bound_of(&b) <= best + FOUND) break;
        shrink(p, t, &b);
    }
    return best;
}

/* Distance of a triangle's box from the path's, in X or Y. */
static double box_gap(double a, double b, double c, double from, double to)
{
    double low = chip_min(a, chip_min(b, c)) - chip_max(from, to),
           high = chip_min(from, to) - chip_max(a, chip_max(b, c));
    return chip_max(0.0, chip_max(low, high));
}

static double along_bin(struct chip_drop_mesh *mesh, const struct path *p, int64_t b, double best, double *share)
{
    double bottom = chip_min(p->z, p->z + p->uz), radius = p->tool->radius;
    int32_t m;
    for (m = mesh->first[b]; m < mesh->first[b + 1]; m++) {
        int32_t k = mesh->member[m];
        const float *t = mesh->triangle + 9 * (int64_t)k;
        double gx, gy, d;
        if (mesh->top[k] - bottom <= best) break;
        if (mesh->seen[k] == mesh->stamp) continue;
        mesh->seen[k] = mesh->stamp;
        gx = box_gap(t[0], t[3], t[6], p->x, p->x + p->ux);
        gy = box_gap(t[1], t[4], t[7], p->y, p->y + p->uy);
        d = sqrt(gx * gx + gy * gy);
        if (d > radius + RIM || mesh->top[k] - bottom - chip_tool_height(p->tool, chip_min(d, radius)) <= best)
            continue;
        best = triangle_excess(p, t, best, share);
    }
    return best;
}

/* How far the middle of a bin is from the path. */
static double off_path(const struct path *p, double x, double y)
{
    double uu = p->ux * p->ux + p->uy * p->uy, s;
    x -= p->x;
    y -= p->y;
    s = uu > 0.0 ? clamped((x * p->ux + y * p->uy) / uu, 0.0, 1.0) : 0.0;
    x -= s * p->ux;
    y -= s * p->uy;
    return sqrt(x * x + y * y);
}

/* What a bin can hold above the lower end of the path, or CHIP_DROP_NOTHING where the tool does not come. */
static double bin_excess(const struct chip_drop_mesh *mesh, const struct path *p, int32_t i, int32_t j)
{
    double top = mesh->bin_top[(int64_t)j * mesh->nx + i], half = mesh->bin * 0.70711, d;
    if (top <= CHIP_DROP_NOTHING) return CHIP_DROP_NOTHING;
    d = off_path(p, (i + 0.5) * mesh->bin, (j + 0.5) * mesh->bin) - half;
    if (d > p->tool->radius + RIM) return CHIP_DROP_NOTHING;
    return top - chip_min(p->z, p->z + p->uz) - chip_tool_height(p->tool, clamped(d, 0.0, p->tool->radius));
}

static double path_excess(struct chip_drop_mesh *mesh, const struct path *p, double best, double *share)
{
    double reach = p->tool->radius + RIM, top = best, can;
    int32_t i0 = bin_of(chip_min(p->x, p->x + p->ux) - reach, mesh->bin, mesh->nx);
    int32_t i1 = bin_of(chip_max(p->x, p->x + p->ux) + reach, mesh->bin, mesh->nx);
    int32_t j0 = bin_of(chip_min(p->y, p->y + p->uy) - reach, mesh->bin, mesh->ny);
    int32_t j1 = bin_of(chip_max(p->y, p->y + p->uy) + reach, mesh->bin, mesh->ny);
    int32_t i, j;
    int64_t highest = -1;
    new_stamp(mesh);
    for (j = j0; j <= j1; j++)
        for (i = i0; i <= i1; i++) {
            can = bin_excess(mesh, p, i, j);
            if (can <= top) continue;
            top = can;
            highest = (int64_t)j * mesh->nx + i;
        }
    if (highest < 0) return best;
    best = along_bin(mesh, p, highest, best, share); /* the others have less to add then */
    for (j = j0; j <= j1; j++)
        for (i = i0; i <= i1; i++)
            if (bin_excess(mesh, p, i, j) > best) best = along_bin(mesh, p, (int64_t)j * mesh->nx + i, best, share);
    return best;
}

void chip_drop_excess(struct chip_drop_mesh *mesh, const struct chip_drop_tool *tool, long n, const double (*from)[3],
                      const double (*to)[3], double *excess, double *share)
{
    struct chip_tool profile;
    struct path p;
    long k;
    profile_of(&profile, tool);
    p.tool = &profile;
    for (k = 0; k < n; k++) {
        double ux = to[k][0] - from[k][0], uy = to[k][1] - from[k][1];
        share[k] = 0.0;
        if (ux * ux + uy * uy < 1e-18) { /* straight up or down: the lower end decides */
            double z = CHIP_DROP_NOTHING, low = chip_min(from[k][2], to[k][2]);
            chip_drop_points(mesh, tool, 1, (const double(*)[2])from[k], &z);
            share[k] = from[k][2] <= to[k][2] ? 0.0 : 1.0;
            excess[k] = chip_max(excess[k], z > CHIP_DROP_NOTHING ? z - low : CHIP_DROP_NOTHING);
            continue;
        }
        p.x = from[k][0];
        p.y = from[k][1];
        p.z = from[k][2];
        p.ux = ux;
        p.uy = uy;
        p.uz = to[k][2] - from[k][2];
        excess[k] = path_excess(mesh, &p, excess[k], &share[k]);
    }
}

/* ---- stock ------------------------------------------------------------------------------------------------------- */

/* The columns of row `y` within reach of the path: low and high, from the left edge of the map. */
static int columns_of(const struct path *p, const struct chip_height_map *map, double y, double reach, double *low,
                      double *high)
{
    double a = 0.0, b = 1.0, s;
    if (fabs(p->uy) > 1e-12) {
        a = (y - reach - p->y) / p->uy;
        b = (y + reach - p->y) / p->uy;
        if (a > b) {
            s = a;
            a = b;
            b = s;
        }
        a = chip_max(a, 0.0);
        b = chip_min(b, 1.0);
    } else if (fabs(y - p->y) > reach) {
        return 0;
    }
    if (a > b) return 0;
    *low = chip_min(p->x + a * p->ux, p->x + b * p->ux) - reach - map->x0;
    *high = chip_max(p->x + a * p->ux, p->x + b * p->ux) + reach - map->x0;
    return *high >= 0.0 && *low <= map->nx * map->cell;
}

/* Whether a cell is behind a line through ahead[0], [1], across the unit vector ahead[2], [3], wherever in it its needle is. */
static int behind(const struct chip_height_map *map, const double ahead[4], int32_t i, double y)
{
    double x = map->x0 + (i + 0.5) * map->cell;
    return (x - ahead[0]) * ahead[2] + (y - ahead[1]) * ahead[3] < -0.70711 * map->cell;
}

double chip_drop_over_stock(const struct chip_height_map *map, const struct chip_drop_tool *tool, const double from[2],
                            const double to[2], const double *ahead)
{
    struct chip_tool profile;
    struct path p = { &profile, from[0], from[1], 0.0, to[0] - from[0], to[1] - from[1], 0.0 };
    double margin = 1.5 * map->cell, reach, best = CHIP_DROP_NOTHING, low, high; /* a needle is anywhere in its cell */
    int32_t i, j, i1, j1;
    profile_of(&profile, tool);
    reach = profile.radius + margin;
    j1 = bin_of(chip_max(p.y, p.y + p.uy) + reach - map->y0, map->cell, map->ny);
    for (j = bin_of(chip_min(p.y, p.y + p.uy) - reach - map->y0, map->cell, map->ny); j <= j1; j++) {
        double y = map->y0 + (j + 0.5) * map->cell;
        if (!columns_of(&p, map, y, reach, &low, &high)) continue;
        i1 = bin_of(high, map->cell, map->nx);
        for (i = bin_of(low, map->cell, map->nx); i <= i1; i++) {
            double z = map->height[(int64_t)j * map->nx + i], d;
            if (z <= best || z <= map->z_min) continue;
            d = off_path(&p, map->x0 + (i + 0.5) * map->cell, y);
            if (d > reach || (ahead && behind(map, ahead, i, y))) continue;
            best = chip_max(best, z - chip_tool_height(&profile, clamped(d - margin, 0.0, profile.radius)));
        }
    }
    return best;
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

static int paeth(int a, int b, int c)
{
    int p = a + b - c, pa = p > a ? p - a : a - p, pb = p > b ? p - b : b - p, pc = p > c ? p - c : c - p;
    return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
}

int chip_png_unfilter(unsigned char *data, long rows, long bytes, int step)
{
    long row, k;
    for (row = 0; row < rows; row++) {
        unsigned char *line = data + row * (bytes + 1) + 1, *before = row ? line - bytes - 1 : 0;
        int filter = line[-1];
        if (filter > 4) return 0;
        for (k = 0; k < bytes; k++) {
            int a = k >= step ? line[k - step] : 0, b = before ? before[k] : 0;
            int c = before && k >= step ? before[k - step] : 0;
            int add = filter == 1 ? a : filter == 2 ? b : filter == 3 ? (a + b) / 2 : filter == 4 ? paeth(a, b, c) : 0;
            line[k] = (unsigned char)(line[k] + add);
        }
    }
    return 1;
}
