/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_path.c - the model along segments: [4] of drop_cutter.h. */

#include "drop_parts.h"

#define SHRINKS 90 /* of a bracket along a segment [4]; the golden section's 0.618^90 is 1e-19 */
#define FOUND 1e-7 /* mm: a bracket is left when it can hold no more than that */
#define GOLDEN 0.6180339887498949

static double excess_at(const struct chip_drop_path *p, const float *t, double s)
{
    double z = chip_drop_over_triangle(p->tool, t, p->x + s * p->ux, p->y + s * p->uy, CHIP_DROP_NOTHING);
    return z > CHIP_DROP_NOTHING ? z - p->z - s * p->uz : CHIP_DROP_NOTHING;
}

/* Widens [*low, *high] by the shares of the path within the tool's radius of the edge a b. */
static void near_edge(const struct chip_drop_path *p, const float *a, const float *b, double *low, double *high)
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
static int shares_over(const struct chip_drop_path *p, const float *t, double *low, double *high)
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
static void shrink(const struct chip_drop_path *p, const float *t, struct bracket *b)
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
static double triangle_excess(const struct chip_drop_path *p, const float *t, double best, double *share)
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
    for (k = 0; k < SHRINKS && !CHIP_FAULTY(ENDS_ONLY); k++) {
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

static double along_bin(struct chip_drop_mesh *mesh, const struct chip_drop_path *p, int64_t b, double best,
                        double *share)
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
        if (d > radius + CHIP_DROP_RIM
            || mesh->top[k] - bottom - chip_tool_height(p->tool, chip_min(d, radius)) <= best)
            continue;
        best = triangle_excess(p, t, best, share);
    }
    return best;
}

/* What a bin can hold above the lower end of the path, or CHIP_DROP_NOTHING where the tool does not come. */
static double bin_excess(const struct chip_drop_mesh *mesh, const struct chip_drop_path *p, int32_t i, int32_t j)
{
    double top = mesh->bin_top[(int64_t)j * mesh->nx + i], half = mesh->bin * 0.70711, d;
    if (top <= CHIP_DROP_NOTHING) return CHIP_DROP_NOTHING;
    d = chip_drop_off_path(p, (i + 0.5) * mesh->bin, (j + 0.5) * mesh->bin) - half;
    if (d > p->tool->radius + CHIP_DROP_RIM) return CHIP_DROP_NOTHING;
    return top - chip_min(p->z, p->z + p->uz) - chip_tool_height(p->tool, chip_drop_clamped(d, 0.0, p->tool->radius));
}

static double path_excess(struct chip_drop_mesh *mesh, const struct chip_drop_path *p, double best, double *share)
{
    double reach = p->tool->radius + CHIP_DROP_RIM, top = best, can;
    int32_t i0 = chip_drop_bin_of(chip_min(p->x, p->x + p->ux) - reach, mesh->bin, mesh->nx);
    int32_t i1 = chip_drop_bin_of(chip_max(p->x, p->x + p->ux) + reach, mesh->bin, mesh->nx);
    int32_t j0 = chip_drop_bin_of(chip_min(p->y, p->y + p->uy) - reach, mesh->bin, mesh->ny);
    int32_t j1 = chip_drop_bin_of(chip_max(p->y, p->y + p->uy) + reach, mesh->bin, mesh->ny);
    int32_t i, j;
    int64_t highest = -1;
    chip_drop_new_stamp(mesh);
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
    struct chip_drop_path p;
    long k;
    chip_drop_profile_of(&profile, tool);
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
