/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_brink.c - the side force with an edge right at a step of the stock: see tooth.h; the numbers in brackets are those of its principle.
 *
 * Who calls it: tooth_force.c. */
#include "section_parts.h"

#define CHIP_MOST_BRINKS 3 /* strongest steps at which an edge is looked at, on each side */

void chip_brink_note(struct chip_tooth *tooth, int left, double at, double height, const struct chip_face *face)
{
    struct chip_brink_force *brink;
    if (tooth->brinks[left] >= CHIP_FORCE_BRINKS || !(at < 1.0)) return;
    brink = &tooth->brink[left][tooth->brinks[left]++];
    brink->at = (float)at;
    brink->unit = (float)(face->unit * height);
    brink->scale = (float)face->scale;
    brink->off = (float)face->off;
    brink->ahead = (float)(face->ahead * height);
}

/* f at an angle, in steps from behind, of what is kept at the angles, mm. */
static double kept_at(const float f[CHIP_FORCE_NODES], double u)
{
    int k;
    if (u >= CHIP_FORCE_NODES) u -= CHIP_FORCE_NODES;
    k = (int)u;
    if (k < 0 || k >= CHIP_FORCE_NODES) return 0.0;
    return f[k] + (u - k) * (f[k + 1 < CHIP_FORCE_NODES ? k + 1 : 0] - f[k]);
}

/* f right beside a brink, on the side where it is more: all steps up to there, each with its own face. */
static double at_brink(const struct chip_tooth *tooth, int left, double q, double c)
{
    double root = in_table(tooth->root, c), f = 0.0;
    int i;
    for (i = 0; i < tooth->brinks[left]; i++) {
        const struct chip_brink_force *brink = &tooth->brink[left][i];
        if (brink->at > q || (brink->at == q && !(brink->unit > 0.0f))) continue;
        f += brink->unit
           * (brink->scale == 1.0f && brink->off == 0.0f ? root : face_at(tooth, brink->scale, brink->off, c));
    }
    return f;
}

/* [10] The vector sum, squared, with one edge at a brink. */
static double sum_at_brink(const struct chip_tooth *tooth, int left, int number)
{
    double q = tooth->brink[left][number].at, c = chip_sqrt(1.0 - q * q), f = at_brink(tooth, left, q, c), x, y, angle;
    int i;
    angle = CHIP_FORCE_AHEAD + (left ? 1.0 : -1.0) * asin(q) * 180.0 / (CHIP_PI * CHIP_FORCE_STEP);
    if (tooth->has_end) f += kept_at(tooth->end, angle);
    x = f * c;
    y = left ? f * q : -f * q;
    for (i = 1; i < tooth->edges; i++) {
        double u = angle + (double)i * CHIP_FORCE_NODES / tooth->edges, g, phi;
        if (u >= CHIP_FORCE_NODES) u -= CHIP_FORCE_NODES;
        if (!tooth->is_round && !(u > CHIP_FORCE_FIRST && u < CHIP_FORCE_LAST)) continue; /* kept of a section before */
        g = kept_at(tooth->force, u);
        if (!(g > 0.0)) continue;
        phi = (u - CHIP_FORCE_AHEAD) * CHIP_FORCE_STEP * CHIP_PI / 180.0;
        x += g * cos(phi);
        y += g * sin(phi);
    }
    return x * x + y * y;
}

/* [10] The brink whose next angle outwards has the largest f of all, the outermost of some: there the small steps of many bands add up.
 * -1: none. */
static int highest_brink(const struct chip_tooth *tooth, int left)
{
    double most = 0.0, at = 0.0;
    int i, best = -1;
    for (i = 0; i < tooth->brinks[left]; i++) {
        const struct chip_brink_force *brink = &tooth->brink[left][i];
        int k = chip_force_node_from(tooth, brink->at);
        double f = brink->unit > 0.0f ? tooth->force[left ? CHIP_FORCE_AHEAD + k : CHIP_FORCE_AHEAD - k] : 0.0;
        if (f < most || (f == most && brink->at <= at)) continue;
        most = f;
        at = brink->at;
        best = i;
    }
    return best;
}

/* [10] The largest one with an edge at a brink of one side; the CHIP_MOST_BRINKS strongest are looked at, and the
 * highest if the tool falls or rises. */
static double largest_on(const struct chip_tooth *tooth, int left)
{
    double most = 0.0, bound = 1e300;
    int i, k = tooth->is_round ? highest_brink(tooth, left) : -1;
    if (k >= 0) most = sum_at_brink(tooth, left, k);
    for (k = 0; k < CHIP_MOST_BRINKS; k++) {
        double next = 0.0;
        int best = -1;
        for (i = 0; i < tooth->brinks[left]; i++) {
            const struct chip_brink_force *brink = &tooth->brink[left][i];
            double f = brink->at > 0.0f ? brink->ahead * (1.0 - brink->at) : 0.0;
            if (f > next && f < bound) {
                next = f;
                best = i;
            }
        }
        if (best < 0) break;
        bound = next;
        most = chip_max(most, sum_at_brink(tooth, left, best));
    }
    return most;
}

double chip_brink_largest(const struct chip_tooth *tooth)
{
    return chip_max(largest_on(tooth, 0), largest_on(tooth, 1));
}
