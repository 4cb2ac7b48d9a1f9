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

double chip_depth_lowest(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double round,
                         double distance)
{
    double first, last;
    if (distance - round > tool->radius || !chip_swept_within(m, x, y, tool->radius + round, &first, &last))
        return CHIP_SWEPT_NEVER;
    return m->z + chip_min(first * m->dz, last * m->dz)
         + chip_tool_height(tool, chip_min(chip_max(distance - round, 0.0), tool->radius));
}

double chip_depth_left(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double half,
                       double distance, double enough)
{
    double high = -CHIP_SWEPT_NEVER, off2, t;
    int far, i;
    if (m->dz == 0.0 && chip_tool_is_flat(tool) && distance + DIAGONAL * half <= tool->radius) return m->z;
    t = chip_min(chip_max(chip_swept_nearest(m, x, y, &off2), 0.0), 1.0);
    far = (x - m->x - t * m->dx > 0.0)
        | (y - m->y - t * m->dy > 0.0) << 1; /* the corner that is most likely the highest */
    for (i = 0; i < 4; i++) {
        int corner = far ^ i;
        double here = chip_swept_height(m, tool, x + (corner & 1 ? half : -half), y + (corner & 2 ? half : -half));
        if (here >= 0.5 * CHIP_SWEPT_NEVER) return CHIP_SWEPT_NEVER;
        high = chip_max(high, here);
        if (high >= enough) break;
    }
    return high;
}

/* Depth of a witness over its move's limit. */
static double over_of(const struct chip_proof *p, const struct chip_proof_found *w)
{
    struct chip_swept m = swept_of(p, (int32_t)w->move);
    return w->height - m.z - w->at * m.dz - p->table[tool_index(p, (int32_t)w->move)].limit;
}

/* Number of the segment of the path, and of its side, at a place that the judged move comes to at share t [4]. */
static int64_t segment_of(const struct chip_proof *p, const struct judged *m, double x, double y, double t)
{
    int right = (x - m->swept.x) * m->swept.dy > (y - m->swept.y) * m->swept.dx;
    return 2 * (int64_t)floor((p->along + t * m->length) / CHIP_PROOF_SEGMENT) + right;
}

/* The witness that a segment has, 0 without one. */
static struct chip_proof_found *found_of(const struct chip_proof *p, int64_t segment)
{
    long slot = p->recent[segment % RECENT].found;
    return slot < p->count && p->found[slot].segment == segment ? &p->found[slot] : 0;
}

/* Keeps a witness if it is the deepest of its segment [4]. */
static void keep(struct chip_proof *p, const struct judged *m, double x, double y, double height, double t)
{
    struct chip_proof_found own = { x, y, height, t, m->number, segment_of(p, m, x, y, t) };
    struct chip_proof_found *other = found_of(p, own.segment);
    struct recent *recent = &p->recent[own.segment % RECENT];
    p->hits++;
    if (other) {
        recent->hits++;
        if (over_of(p, &own) > over_of(p, other) && !CHIP_FAULTY(FIRST_WITNESS_KEPT)) *other = own;
    } else if (p->count < p->room) {
        recent->hits = 1;
        recent->found = p->count;
        p->found[p->count++] = own;
    }
}

/* Whether so many witnesses have been found at a square's segment that more of them would tell nothing new. */
static int has_enough(const struct chip_proof *p, const struct judged *m, double x, double y, double t)
{
    int64_t segment = segment_of(p, m, x, y, t);
    return p->recent[segment % RECENT].hits >= CHIP_PROOF_ENOUGH && found_of(p, segment);
}

/* The height of a place, or less than `high`: what all moves with a part in its cell have left of it. */
static double lowered(const struct chip_proof *p, double x, double y, double high)
{
    long cell = (long)index_of(y, p->y0, p->cell, p->ny) * p->nx + index_of(x, p->x0, p->cell, p->nx);
    int32_t own;
    CHIP_FAULT(CUTS_ABOVE_LEFT, return high)
    for (own = p->cells.partial[cell]; own != NOTHING; own = p->pool.node[own].next) {
        const struct node *node = &p->pool.node[own];
        struct chip_swept other;
        if ((double)node->low >= high) continue;
        other = swept_of(p, node->move);
        high = chip_min(high, chip_swept_height(&other, tool_of(p, node->move), x, y));
    }
    return high;
}

/* Whether the judged move meets too high stock at a place; keeps the witness. high: the highest that it can be there: moves that have cut
 * the whole cell no lower than that are not in the list. Nor are those that cut no lower than any depth that is allowed: with them the
 * stock is lower, but still too high. */
static int is_witness(struct chip_proof *p, const struct judged *m, double x, double y, const int32_t *list, long n,
                      double high)
{
    double first, last, height = chip_min(p->stock.z_max, high), floor = p->stock.z_min + CHIP_PROOF_SKIN, over, t;
    long i;
    if (!chip_depth_in_stock(&p->stock, x, y, 0.0) || !chip_swept_within(&m->swept, x, y, m->reach, &first, &last))
        return 0;
    if (m->joined && first <= 0.0 && !m->nose) return 0;
    for (i = 0; i < n && height > floor; i++) {
        struct chip_swept other = swept_of(p, list[i]);
        height = chip_min(height, chip_swept_height(&other, tool_of(p, list[i]), x, y));
    }
    t = first;
    over = height - m->swept.z - t * m->swept.dz - m->limit;
    if (m->is_traverse) { /* at its lowest over the place; a descent is judged where it ends */
        over = height - chip_swept_height(&m->swept, m->tool, x, y) - m->limit;
        t = m->swept.length2 > CHIP_SWEPT_STILL ? t : 1.0;
    } else if (m->nose
               && height <= m->swept.z + t * m->swept.dz + m->tool->shoulder) { /* met below it, where it is nearest */
        double off2, near = chip_swept_nearest(&m->swept, x, y, &off2);
        t = chip_min(chip_max(near, first), last);
        if (height <= chip_swept_at(&m->swept, m->tool, x, y, t) + CHIP_PROOF_SKIN) return 0;
        over = height - m->swept.z - t * m->swept.dz - m->limit;
    }
    if (height <= floor || over <= 0.0) return 0;
    keep(p, m, x, y, chip_max(lowered(p, x, y, height), m->swept.z + t * m->swept.dz + m->limit), t);
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

/* What an earlier move leaves at most of a square, or some height from `high` on. */
static double left_by(const struct chip_proof *p, int32_t move, double x, double y, double half, double high)
{
    struct chip_swept other;
    if (tool_index(p, move) == CHIP_PROOF_ELSEWHERE) return CHIP_SWEPT_NEVER;
    other = swept_of(p, move);
    return chip_depth_left(&other, tool_of(p, move), x, y, half, chip_swept_distance(&other, x, y), high);
}

int chip_depth_is_open(struct chip_proof *p, const struct judged *m, double x, double y, double half, double high,
                       double *allowed)
{
    double round = DIAGONAL * half, first, last, z;
    if (*p->squares <= 0 || p->count >= p->room || p->hits >= m->most) return 0;
    --*p->squares;
    if (!entered(m, x, y, round, &first, &last)) return 0;
    if (half <= CHIP_PROOF_WITNESS && has_enough(p, m, x, y, 0.5 * (first + last))) return 0;
    z = m->swept.z + chip_min(first * m->swept.dz, last * m->swept.dz);
    *allowed = z + m->limit;
    if (m->nose) {
        double off = chip_max(chip_swept_distance(&m->swept, x, y) - round, 0.0);
        *allowed = chip_max(*allowed, z + chip_tool_height(m->tool, chip_min(off, m->tool->radius)));
    }
    *allowed = chip_max(*allowed, p->stock.z_min + CHIP_PROOF_SKIN);
    if (high <= *allowed || !chip_depth_in_stock(&p->stock, x, y, round) || chip_depth_is_beside(p, m, first, last))
        return 0;
    return p->clearing >= m->number || left_by(p, p->clearing, x, y, half, high) > *allowed;
}

/* Those of the n moves of a list that may cut a square lower than `high`, which becomes less, behind the list -> their number; -1 if one
 * of them has cut all of it low enough. */
static long of_square(struct chip_proof *p, const struct judged *m, double x, double y, double half, double allowed,
                      int32_t *list, long n, double *high)
{
    double ever = m->highest + chip_max(m->limit, m->tool->shoulder);
    long i, kept = 0;
    for (i = 0; i < n; i++) {
        const struct chip_tool *tool = tool_of(p, list[i]);
        struct chip_swept other = swept_of(p, list[i]);
        double distance = chip_swept_distance(&other, x, y), left;
        if (chip_min(other.z, other.z + other.dz) >= ever
            || chip_depth_lowest(&other, tool, x, y, DIAGONAL * half, distance) >= *high)
            continue;
        left = chip_depth_left(&other, tool, x, y, half, distance, *high);
        if (left <= allowed) {
            p->clearing = list[i];
            return -1;
        }
        *high = chip_min(*high, left);
        list[n + kept++] = list[i];
    }
    return kept;
}

void chip_depth_divide(struct chip_proof *p, const struct judged *m, double x, double y, double half, double allowed,
                       int32_t *list, long n, double high)
{
    long kept = of_square(p, m, x, y, half, allowed, list, n, &high);
    int k;
    if (kept < 0 || (half <= CHIP_PROOF_WITNESS && is_witness(p, m, x, y, list + n, kept, high))) return;
    for (k = 0; k < 4; k++) {
        double u = x + (k & 1 ? half : -half), v = y + (k & 2 ? half : -half);
        if (2.0 * DIAGONAL * half <= CHIP_PROOF_LEAST) {
            if (is_witness(p, m, u, v, list + n, kept, high)) return;
        } else if (chip_depth_is_open(p, m, 0.5 * (x + u), 0.5 * (y + v), 0.5 * half, high, &allowed)) {
            chip_depth_divide(p, m, 0.5 * (x + u), 0.5 * (y + v), 0.5 * half, allowed, list + n, kept, high);
        }
    }
}
