/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_squares.c - see depth_state.h: squares that are divided until they are proved [3]. */
#include <math.h>

#include "depth_state.h"

/* Whether the stock as it was first may be within `near` of a place. */
int chip_depth_in_stock(const struct chip_proof_stock *s, double x, double y, double near)
{
    double u = x - s->x, v = y - s->y, a = u * s->cosine + v * s->sine, b = v * s->cosine - u * s->sine;
    if (!s->shape) return fabs(a) <= s->half_x + near && fabs(b) <= s->half_y + near;
    return hypot(a / s->half_x, b / s->half_y) <= 1.0 + near / chip_min(s->half_x, s->half_y);
}

/* What a move leaves at most in a square, which a convex function has at a corner; CHIP_SWEPT_NEVER if it does not reach all of it. */
double chip_depth_left(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double half,
                       double distance)
{
    double high = -CHIP_SWEPT_NEVER;
    int i;
    if (m->dz == 0.0 && chip_tool_is_flat(tool) && distance + DIAGONAL * half <= tool->radius) return m->z;
    for (i = 0; i < 4; i++) {
        double here = chip_swept_height(m, tool, x + (i & 1 ? half : -half), y + (i & 2 ? half : -half));
        if (here >= 0.5 * CHIP_SWEPT_NEVER) return CHIP_SWEPT_NEVER;
        high = chip_max(high, here);
    }
    return high;
}

/* Depth of a witness over its move's limit. */
static double over_of(const struct proof *p, const struct chip_proof_found *w)
{
    struct chip_swept m = swept_of(p, (int32_t)w->move);
    return w->height - m.z - w->at * m.dz - p->table[tool_index(p, (int32_t)w->move)].limit;
}

/* Keeps a witness if it is the deepest of its segment [4]. */
static void keep(struct proof *p, const struct judged *m, double x, double y, double height, double t)
{
    const struct chip_swept *s = &m->swept;
    int right = (x - s->x) * s->dy > (y - s->y) * s->dx;
    struct chip_proof_found own = { x, y, height, t, m->number, 0 };
    long *slot;
    own.segment = 2 * (int64_t)floor((p->along + t * m->length) / CHIP_PROOF_SEGMENT) + right;
    p->hits++;
    slot = &p->recent[own.segment % RECENT];
    if (*slot < p->count && p->found[*slot].segment == own.segment) {
        if (over_of(p, &own) > over_of(p, &p->found[*slot])) p->found[*slot] = own;
    } else if (p->count < p->room) {
        *slot = p->count;
        p->found[p->count++] = own;
    }
}

/* Whether the judged move meets too high stock at a place; keeps the witness. high: the highest that it can be there: moves that have cut
 * the whole cell no lower than that are not in the list. Nor are those that cut no lower than any depth that is allowed: beside them the
 * depth may be said too large, but it is too large. */
static int is_witness(struct proof *p, const struct judged *m, double x, double y, const int32_t *list, long n,
                      double high)
{
    double first, last, height = chip_min(p->stock->z_max, high), floor = p->stock->z_min + CHIP_PROOF_SKIN, over, t;
    long i;
    if (!chip_depth_in_stock(p->stock, x, y, 0.0) || !chip_swept_within(&m->swept, x, y, m->reach, &first, &last))
        return 0;
    if (m->joined && first <= 0.0 && !m->nose) return 0;
    for (i = 0; i < n && height > floor; i++) {
        struct chip_swept other = swept_of(p, list[i]);
        height = chip_min(height, chip_swept_height(&other, tool_of(p, list[i]), x, y));
    }
    t = first;
    over = height - m->swept.z - t * m->swept.dz - m->limit;
    if (m->nose && height <= m->swept.z + t * m->swept.dz + m->tool->shoulder) { /* met below it, where it is nearest */
        double off2, near = chip_swept_nearest(&m->swept, x, y, &off2);
        t = chip_min(chip_max(near, first), last);
        if (height <= chip_swept_at(&m->swept, m->tool, x, y, t) + CHIP_PROOF_SKIN) return 0;
        over = height - m->swept.z - t * m->swept.dz - m->limit;
    }
    if (height <= floor || over <= 0.0) return 0;
    keep(p, m, x, y, height, t);
    return 1;
}

/* First and last share of the move at which the tool may come to a place of the square; 0 if it does not. */
static int entered(const struct judged *m, double x, double y, double round, double *first, double *last)
{
    double end, off2, near;
    if (!chip_swept_within(&m->swept, x, y, m->reach + round, first, &end)) return 0;
    *last = end;
    if (m->nose) return 1;
    if (m->joined && hypot(x - m->swept.x, y - m->swept.y) + round <= m->reach) return 0;
    if (chip_swept_within(&m->swept, x, y, m->reach - round, last, &end)) return 1;
    near = chip_swept_nearest(&m->swept, x, y, &off2);
    if (m->swept.length2 > CHIP_SWEPT_STILL) near += round / sqrt(m->swept.length2);
    *last = chip_max(*first, chip_min(near, 1.0));
    return 1;
}

void chip_depth_judge(struct proof *p, const struct judged *m, double x, double y, double half, int32_t *list, long n,
                      double high)
{
    double round = DIAGONAL * half, first, last, z, allowed, ever;
    long i, kept = 0;
    int k;
    if (*p->squares <= 0 || p->count >= p->room || p->hits >= m->most) return;
    --*p->squares;
    if (!entered(m, x, y, round, &first, &last)) return;
    z = m->swept.z + chip_min(first * m->swept.dz, last * m->swept.dz);
    allowed = z + m->limit;
    ever = m->highest + chip_max(m->limit, m->tool->shoulder);
    if (m->nose) {
        double off = chip_max(chip_swept_distance(&m->swept, x, y) - round, 0.0);
        allowed = chip_max(allowed, z + chip_tool_height(m->tool, chip_min(off, m->tool->radius)));
    }
    allowed = chip_max(allowed, p->stock->z_min + CHIP_PROOF_SKIN);
    if (high <= allowed || !chip_depth_in_stock(p->stock, x, y, round) || chip_depth_is_beside(p, m, first, last))
        return;
    for (i = 0; i < n; i++) {
        const struct chip_tool *tool = tool_of(p, list[i]);
        struct chip_swept other = swept_of(p, list[i]);
        double distance = chip_swept_distance(&other, x, y), left;
        if (distance - round > tool->radius || chip_min(other.z, other.z + other.dz) >= ever) continue;
        left = chip_depth_left(&other, tool, x, y, half, distance);
        if (left <= allowed) return;
        high = chip_min(high, left);
        list[n + kept++] = list[i];
    }
    if (half <= CHIP_PROOF_WITNESS && is_witness(p, m, x, y, list + n, kept, high)) return;
    for (k = 0; k < 4; k++) {
        double u = x + (k & 1 ? half : -half), v = y + (k & 2 ? half : -half);
        if (2.0 * round > CHIP_PROOF_LEAST)
            chip_depth_judge(p, m, 0.5 * (x + u), 0.5 * (y + v), 0.5 * half, list + n, kept, high);
        else if (is_witness(p, m, u, v, list + n, kept, high))
            return;
    }
}
