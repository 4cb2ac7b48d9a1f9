/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_proof.c - see depth_proof.h: the cells of the map, and the moves one after the other. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "depth_state.h"

#define MOST_SEGMENTS 1e6 /* of a move that are looked at */
#define LEVELS 24         /* of squares in squares: a cell has less */

/* ---- memory ---------------------------------------------------------------------------------------------------- */

void chip_depth_put(struct proof *p, int32_t *head, int32_t move, double low)
{
    struct pool *pool = &p->pool;
    int32_t own = pool->free;
    if (own != NOTHING) {
        pool->free = pool->node[own].next;
    } else {
        if (pool->count == pool->size) {
            int32_t size = pool->size < INT32_MAX / 2 ? 2 * pool->size : pool->size;
            struct node *bigger = size > pool->size ? realloc(pool->node, sizeof *bigger * (size_t)size) : 0;
            if (!bigger) {
                p->failed = 1;
                return;
            }
            pool->node = bigger;
            pool->size = size;
        }
        own = pool->count++;
    }
    pool->node[own] = (struct node){ move, *head, (float)low };
    *head = own;
}

/* Takes the moves out of a cell's chain that cut nothing below `high`. */
static void prune(struct proof *p, int32_t *head, float high)
{
    struct pool *pool = &p->pool;
    while (*head != NOTHING) {
        struct node *own = &pool->node[*head];
        int32_t gone = *head;
        if (own->low < high) {
            head = &own->next;
            continue;
        }
        *head = own->next;
        own->next = pool->free;
        pool->free = gone;
    }
}

static int list_for(struct proof *p, long count)
{
    long size = count * LEVELS;
    int32_t *bigger;
    if (size <= p->list_size) return 1;
    bigger = realloc(p->list, sizeof *bigger * (size_t)size);
    if (!bigger) {
        p->failed = 1;
        return 0;
    }
    p->list = bigger;
    p->list_size = size;
    return 1;
}

/* ---- cells [2] --------------------------------------------------------------------------------------------------- */

static void judge_cell(struct proof *p, const struct judged *m, double x, double y, long cell)
{
    long n = 0;
    int32_t own;
    for (own = p->partial[cell]; own != NOTHING; own = p->pool.node[own].next) n++;
    if (!list_for(p, n + 1)) return;
    n = 0;
    for (own = p->partial[cell]; own != NOTHING; own = p->pool.node[own].next) p->list[n++] = p->pool.node[own].move;
    chip_depth_judge(p, m, x, y, 0.5 * p->cell, p->list, n, p->high[cell]);
}

/* What the move leaves of a cell. */
static void cut_cell(struct proof *p, const struct judged *m, double x, double y, long cell)
{
    double half = 0.5 * p->cell, round = DIAGONAL * half, distance = chip_swept_distance(&m->swept, x, y), left, low,
           first, last;
    if (distance - round > m->tool->radius
        || !chip_swept_within(&m->swept, x, y, m->tool->radius + round, &first, &last))
        return;
    low = m->swept.z + chip_min(first * m->swept.dz, last * m->swept.dz);
    low += chip_tool_height(m->tool, chip_min(chip_max(distance - round, 0.0), m->tool->radius));
    if (low >= p->high[cell]) return;
    left = chip_depth_left(&m->swept, m->tool, x, y, half, distance);
    if (left < p->high[cell]) {
        p->high[cell] = (float)chip_max(left, p->stock->z_min);
        prune(p, &p->partial[cell], p->high[cell]);
    }
    if (low < p->high[cell] - 1e-5) chip_depth_put(p, &p->partial[cell], m->number, low);
}

/* All cells that a move may reach. */
static void take_move(struct proof *p, const struct judged *m)
{
    const struct chip_swept *s = &m->swept;
    double reach = m->tool->radius + DIAGONAL * p->cell, low_y = chip_min(s->y, s->y + s->dy),
           high_y = chip_max(s->y, s->y + s->dy);
    int32_t row = index_of(low_y - reach, p->y0, p->cell, p->ny), end = index_of(high_y + reach, p->y0, p->cell, p->ny),
            column, last;
    int judge = m->limit < 0.5 * CHIP_SWEPT_NEVER;
    for (; row <= end; row++) {
        double y = p->y0 + (row + 0.5) * p->cell, a = 0.0, b = 1.0, xa, xb;
        if (fabs(s->dy) > 1e-12) { /* the part of the move that is near the row */
            a = chip_min((y - reach - s->y) / s->dy, (y + reach - s->y) / s->dy);
            b = chip_max((y - reach - s->y) / s->dy, (y + reach - s->y) / s->dy);
            a = chip_min(chip_max(a, 0.0), 1.0);
            b = chip_min(chip_max(b, 0.0), 1.0);
        }
        xa = s->x + a * s->dx;
        xb = s->x + b * s->dx;
        column = index_of(chip_min(xa, xb) - reach, p->x0, p->cell, p->nx);
        last = index_of(chip_max(xa, xb) + reach, p->x0, p->cell, p->nx);
        for (; column <= last; column++) {
            long cell = (long)row * p->nx + column;
            double x = p->x0 + (column + 0.5) * p->cell;
            if (p->high[cell] <= m->lowest) continue;
            if (judge && p->high[cell] > m->lowest + m->limit) judge_cell(p, m, x, y, cell);
            cut_cell(p, m, x, y, cell);
        }
    }
    chip_depth_enter_axis(p, s, m->number);
}

static struct judged judged_of(const struct proof *p, int32_t k)
{
    int32_t own = tool_index(p, k);
    double end = p->path->to[3 * (long)k + 2];
    struct judged m;
    m.swept = swept_of(p, k);
    m.tool = &p->tools[own];
    m.number = k;
    m.limit = p->path->tool[k] < 0 ? CHIP_SWEPT_NEVER : p->table[own].limit;
    m.reach = m.tool->radius - CHIP_PROOF_SKIN;
    m.lowest = chip_min(m.swept.z, end);
    m.highest = chip_max(m.swept.z, end);
    m.joined = k > 0 && tool_index(p, k - 1) == own;
    m.length = sqrt(m.swept.length2 + m.swept.dz * m.swept.dz);
    m.most = CHIP_PROOF_MOST + (long)(CHIP_PROOF_MOST_MORE * chip_min(m.length / CHIP_PROOF_SEGMENT, MOST_SEGMENTS));
    m.nose = m.limit < m.tool->shoulder;
    return m;
}

static int make_map(struct proof *p, long n)
{
    double wide =
        fabs(p->stock->half_x * p->stock->cosine) + fabs(p->stock->half_y * p->stock->sine) + p->most_radius + p->cell;
    double deep =
        fabs(p->stock->half_x * p->stock->sine) + fabs(p->stock->half_y * p->stock->cosine) + p->most_radius + p->cell;
    long cells, i;
    p->x0 = p->stock->x - wide;
    p->y0 = p->stock->y - deep;
    p->nx = (int32_t)ceil(2.0 * wide / p->cell);
    p->ny = (int32_t)ceil(2.0 * deep / p->cell);
    cells = (long)p->nx * p->ny;
    p->high = malloc(sizeof *p->high * (size_t)cells);
    p->partial = malloc(sizeof *p->partial * (size_t)cells);
    p->axes = malloc(sizeof *p->axes * (size_t)cells);
    p->seen = malloc(sizeof *p->seen * (size_t)(n + 1));
    p->pool.size = 1 << 16;
    p->pool.free = NOTHING;
    p->pool.node = malloc(sizeof *p->pool.node * (size_t)p->pool.size);
    if (!p->high || !p->partial || !p->axes || !p->seen || !p->pool.node) return 0;
    for (i = 0; i < cells; i++) {
        double x = p->x0 + (double)(i % p->nx + 0.5) * p->cell, y = p->y0 + (double)(i / p->nx + 0.5) * p->cell;
        p->high[i] =
            (float)(chip_depth_in_stock(p->stock, x, y, DIAGONAL * 0.5 * p->cell) ? p->stock->z_max : p->stock->z_min);
        p->partial[i] = p->axes[i] = NOTHING;
    }
    for (i = 0; i < n; i++) p->seen[i] = NOTHING;
    return 1;
}

long chip_prove_depths(const struct chip_proof_stock *stock, const struct chip_proof_tool *tools, long tool_count,
                       const struct chip_proof_path *path, double cell, int64_t *squares,
                       struct chip_proof_found *found, long room)
{
    struct proof *p = calloc(1, sizeof *p);
    long k, n = path->n, count = -1;
    if (!p) return -1;
    p->stock = stock;
    p->path = path;
    p->table = tools;
    p->cell = cell;
    p->squares = squares;
    p->found = found;
    p->room = room;
    p->tools = malloc(sizeof *p->tools * (size_t)(tool_count + 1));
    for (k = 0; p->tools && k < tool_count; k++) {
        chip_tool_set_profile(&p->tools[k], tools[k].radius, tools[k].corner, tools[k].half_angle);
        p->most_radius = chip_max(p->most_radius, tools[k].radius);
    }
    if (p->tools && n < INT32_MAX && make_map(p, n)) {
        for (k = 0; k < n && !p->failed && p->count<room && * squares> 0; k++) {
            struct judged m;
            if (path->tool[k] == CHIP_PROOF_ELSEWHERE) continue;
            m = judged_of(p, (int32_t)k);
            p->spans_known = 0;
            p->hits = 0;
            take_move(p, &m);
            p->along += m.length;
        }
        if (!p->failed) count = p->count;
    }
    free(p->tools);
    free(p->high);
    free(p->partial);
    free(p->axes);
    free(p->seen);
    free(p->pool.node);
    free(p->list);
    free(p);
    return count;
}
