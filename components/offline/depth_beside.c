/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_beside.c - see depth_state.h: which parts of a move run beside earlier ones [3]. */
#include <math.h>
#include <stdlib.h>

#include "depth_state.h"

/* The part of the judged move within `near` mm of another one's axis: a line in a capsule. */
static int beside(const struct chip_swept *m, const struct chip_swept *other, double near, struct span *span)
{
    double first, last, length = sqrt(other->length2);
    int i, any = 0;
    span->first = 2.0;
    span->last = -1.0;
    for (i = 0; i < 2; i++)
        if (chip_swept_within(m, other->x + i * other->dx, other->y + i * other->dy, near, &first, &last)) {
            span->first = chip_min(span->first, first);
            span->last = chip_max(span->last, last);
            any = 1;
        }
    if (length > 1e-9) { /* the strip between its ends */
        double low = 0.0, high = 1.0, at[2], by[2], to[2], from[2];
        at[0] = ((m->x - other->x) * other->dx + (m->y - other->y) * other->dy) / length;
        by[0] = (m->dx * other->dx + m->dy * other->dy) / length;
        at[1] = ((m->y - other->y) * other->dx - (m->x - other->x) * other->dy) / length;
        by[1] = (m->dy * other->dx - m->dx * other->dy) / length;
        from[0] = 0.0;
        to[0] = length;
        from[1] = -near;
        to[1] = near;
        for (i = 0; i < 2; i++) {
            if (fabs(by[i]) < 1e-12) {
                if (at[i] < from[i] || at[i] > to[i]) high = -1.0;
                continue;
            }
            low = chip_max(low, chip_min((from[i] - at[i]) / by[i], (to[i] - at[i]) / by[i]));
            high = chip_min(high, chip_max((from[i] - at[i]) / by[i], (to[i] - at[i]) / by[i]));
        }
        if (low <= high) {
            span->first = chip_min(span->first, low);
            span->last = chip_max(span->last, high);
            any = 1;
        }
    }
    return any;
}

/* Z of a move where it is nearest to the place of a share of the judged one. */
static double z_beside(const struct chip_swept *m, double t, const struct chip_swept *other)
{
    double off2, s = chip_swept_nearest(other, m->x + t * m->dx, m->y + t * m->dy, &off2);
    if (other->length2 <= CHIP_SWEPT_STILL) return chip_min(other->z, other->z + other->dz);
    return other->z + chip_min(chip_max(s, 0.0), 1.0) * other->dz;
}

static void add_span(struct chip_proof *p, const struct judged *m, int32_t k)
{
    const struct chip_tool *tool = tool_of(p, k);
    struct chip_swept other = swept_of(p, k);
    struct span span;
    double near = chip_tool_is_flat(tool) ? CHIP_PROOF_BESIDE : CHIP_PROOF_BESIDE_ROUND, slack, room;
    if (tool->radius < m->tool->radius || p->span_count == SPANS_MOST || !beside(&m->swept, &other, near, &span))
        return;
    slack = other.length2 > CHIP_SWEPT_STILL ? CHIP_PROOF_SKIN * fabs(other.dz) / sqrt(other.length2) : 0.0;
    room = m->limit - chip_tool_height(tool, chip_min(m->reach + near, tool->radius)) - slack;
    if (z_beside(&m->swept, span.first, &other) > m->swept.z + span.first * m->swept.dz + room) return;
    if (z_beside(&m->swept, span.last, &other) > m->swept.z + span.last * m->swept.dz + room) return;
    p->spans[p->span_count++] = span;
}

static int by_first(const void *a, const void *b)
{
    double d = ((const struct span *)a)->first - ((const struct span *)b)->first;
    return d < 0.0 ? -1 : d > 0.0;
}

long chip_depth_axis_places(const struct chip_proof *p, const struct chip_swept *m)
{
    return (long)chip_min(ceil(sqrt(m->length2) / (0.5 * p->cell)), 1e7);
}

static int on_map(const struct chip_proof *p, double x, double y)
{
    return x >= p->x0 && y >= p->y0 && x < p->x0 + p->nx * p->cell && y < p->y0 + p->ny * p->cell;
}

static void find_spans(struct chip_proof *p, const struct judged *m)
{
    long places = chip_depth_axis_places(p, &m->swept), i;
    int k, kept = 0;
    p->span_count = 0;
    p->spans_known = 1;
    p->asked++;
    for (i = 0; i <= places; i++) {
        double t = places ? (double)i / places : 0.0, x = m->swept.x + t * m->swept.dx,
               y = m->swept.y + t * m->swept.dy;
        int32_t column = index_of(x, p->x0, p->cell, p->nx), row = index_of(y, p->y0, p->cell, p->ny), a, b, own;
        if (!on_map(p, x, y)) continue;
        for (b = row > 0 ? row - 1 : 0; b <= row + 1 && b < p->ny; b++)
            for (a = column > 0 ? column - 1 : 0; a <= column + 1 && a < p->nx; a++)
                for (own = p->cells.axes[(long)b * p->nx + a]; own != NOTHING; own = p->pool.node[own].next) {
                    int32_t other = p->pool.node[own].move;
                    if (p->seen[other] == p->asked) continue;
                    p->seen[other] = p->asked;
                    add_span(p, m, other);
                }
    }
    if (!p->span_count) return;
    qsort(p->spans, (size_t)p->span_count, sizeof *p->spans, by_first);
    for (k = 1; k < p->span_count; k++) {
        if (p->spans[k].first <= p->spans[kept].last)
            p->spans[kept].last = chip_max(p->spans[kept].last, p->spans[k].last);
        else
            p->spans[++kept] = p->spans[k];
    }
    p->span_count = kept + 1;
}

int chip_depth_is_beside(struct chip_proof *p, const struct judged *m, double first, double last)
{
    int low = 0, high;
    CHIP_FAULT(BESIDE_ALL, return 1)
    if (m->nose) return 0;
    if (!p->spans_known) find_spans(p, m);
    high = p->span_count - 1;
    while (low <= high) {
        int middle = (low + high) / 2;
        if (p->spans[middle].first > first)
            high = middle - 1;
        else if (p->spans[middle].last < last)
            low = middle + 1;
        else
            return 1;
    }
    return 0;
}

void chip_depth_enter_axis(struct chip_proof *p, const struct chip_swept *m, int32_t number)
{
    long places = chip_depth_axis_places(p, m), i, before = -1;
    for (i = 0; i <= places; i++) {
        double t = places ? (double)i / places : 0.0, x = m->x + t * m->dx, y = m->y + t * m->dy;
        int32_t row = index_of(y, p->y0, p->cell, p->ny);
        long cell = (long)row * p->nx + index_of(x, p->x0, p->cell, p->nx);
        if (!on_map(p, x, y) || cell == before) continue;
        chip_depth_keep_row(p, row);
        chip_depth_put(p, &p->cells.axes[cell], number, 0.0);
        before = cell;
    }
}
