/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_proof.c - see depth_proof.h: the cells of the map, and the moves one after the other. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "depth_state.h"

#define MOST_SEGMENTS 1e6 /* of a move that are looked at */
#define LEVELS 24         /* of squares in squares: a cell has less */
#define ACROSS 1e-4       /* mm: a shorter traverse, seen from above, goes straight up or down */

/* ---- memory ---------------------------------------------------------------------------------------------------- */

static int list_for(struct chip_proof *p, long count)
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

static void judge_cell(struct chip_proof *p, const struct judged *m, double x, double y, long cell)
{
    double allowed;
    long n = 0;
    int32_t own;
    if (!chip_depth_is_open(p, m, x, y, 0.5 * p->cell, p->cells.high[cell], &allowed)) return;
    for (own = p->cells.partial[cell]; own != NOTHING; own = p->pool.node[own].next) n++;
    if (!list_for(p, n + 1)) return;
    n = 0;
    for (own = p->cells.partial[cell]; own != NOTHING; own = p->pool.node[own].next)
        p->list[n++] = p->pool.node[own].move;
    chip_depth_divide(p, m, x, y, 0.5 * p->cell, allowed, p->list, n, p->cells.high[cell]);
}

/* What the move leaves of a cell. */
static void cut_cell(struct chip_proof *p, const struct judged *m, double x, double y, long cell)
{
    double half = 0.5 * p->cell, distance = chip_swept_distance(&m->swept, x, y), left;
    double low = chip_depth_lowest(&m->swept, m->tool, x, y, DIAGONAL * half, distance);
    CHIP_FAULT(PARTS_NOT_CUT, return )
    if (low >= p->cells.high[cell]) return;
    left = chip_depth_left(&m->swept, m->tool, x, y, half, distance, p->cells.high[cell]);
    if (left < p->cells.high[cell]) {
        p->cells.high[cell] = (float)chip_max(left, p->stock.z_min);
        chip_depth_prune(p, &p->cells.partial[cell], chip_depth_kept_below(p, cell));
    }
    if (low < chip_depth_kept_below(p, cell) - 1e-5) chip_depth_put(p, &p->cells.partial[cell], m->number, low);
}

/* All cells that a move may reach. */
static void take_move(struct chip_proof *p, const struct judged *m)
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
        chip_depth_keep_row(p, row);
        column = index_of(chip_min(xa, xb) - reach, p->x0, p->cell, p->nx);
        last = index_of(chip_max(xa, xb) + reach, p->x0, p->cell, p->nx);
        for (; column <= last; column++) {
            long cell = (long)row * p->nx + column;
            double x = p->x0 + (column + 0.5) * p->cell;
            if (p->cells.high[cell] <= m->lowest) continue;
            if (judge && p->cells.high[cell] > m->lowest + m->limit) judge_cell(p, m, x, y, cell);
            if (!m->is_traverse) cut_cell(p, m, x, y, cell);
        }
    }
    if (!m->is_traverse) chip_depth_enter_axis(p, s, m->number);
}

static int same_tool(const struct chip_proof_tool *a, const struct chip_proof_tool *b)
{
    return a->radius == b->radius && a->corner == b->corner && a->half_angle == b->half_angle;
}

static struct judged judged_of(const struct chip_proof *p, int32_t k)
{
    int32_t own = tool_index(p, k);
    double end = p->to[3 * (long)k + 2];
    struct judged m;
    m.swept = swept_of(p, k);
    m.tool = &p->tools[own];
    m.number = k;
    m.limit = p->tool[k] < 0 || p->table[own].clearance >= 0.0 ? CHIP_SWEPT_NEVER : p->table[own].limit;
    m.reach = m.tool->radius - CHIP_PROOF_SKIN;
    m.lowest = chip_min(m.swept.z, end);
    m.highest = chip_max(m.swept.z, end);
    m.joined = k > 0 && tool_index(p, k - 1) != CHIP_PROOF_ELSEWHERE
            && same_tool(&p->table[tool_index(p, k - 1)], &p->table[own]);
    m.length = sqrt(m.swept.length2 + m.swept.dz * m.swept.dz);
    m.most = CHIP_PROOF_MOST + (long)(CHIP_PROOF_MOST_MORE * chip_min(m.length / CHIP_PROOF_SEGMENT, MOST_SEGMENTS));
    m.nose = m.limit < m.tool->shoulder;
    m.is_traverse = 0;
    return m;
}

/* Looks for stock beside a traverse [8]. */
static void judge_traverse(struct chip_proof *p, struct judged m)
{
    m.tool = &p->wide[p->tool[m.number]];
    m.limit = p->table[p->tool[m.number]].limit;
    m.reach = m.tool->radius;
    m.nose = m.is_traverse = 1;
    if (m.swept.length2 <= ACROSS * ACROSS) {
        if (m.swept.dz >= 0.0) return;
        m.swept.z += m.swept.dz;
        m.swept.dx = m.swept.dy = m.swept.dz = m.swept.length2 = 0.0;
        m.highest = m.lowest;
    }
    take_move(p, &m);
}

static int make_map(struct chip_proof *p)
{
    const struct chip_proof_stock *s = &p->stock;
    double wide = fabs(s->half_x * s->cosine) + fabs(s->half_y * s->sine) + p->most_radius + p->cell;
    double deep = fabs(s->half_x * s->sine) + fabs(s->half_y * s->cosine) + p->most_radius + p->cell;
    long cells, i;
    p->x0 = s->x - wide;
    p->y0 = s->y - deep;
    p->nx = (int32_t)ceil(2.0 * wide / p->cell);
    p->ny = (int32_t)ceil(2.0 * deep / p->cell);
    cells = (long)p->nx * p->ny;
    p->pool.size = 1 << 16;
    p->pool.free = p->pool.recycled = NOTHING;
    p->pool.node = malloc(sizeof *p->pool.node * (size_t)p->pool.size);
    if (!chip_depth_cells_make(&p->cells, (size_t)cells) || !p->pool.node) return 0;
    for (i = 0; i < cells; i++) {
        double x = p->x0 + (double)(i % p->nx + 0.5) * p->cell, y = p->y0 + (double)(i / p->nx + 0.5) * p->cell;
        p->cells.high[i] = (float)(chip_depth_in_stock(s, x, y, DIAGONAL * 0.5 * p->cell) ? s->z_max : s->z_min);
        p->cells.partial[i] = p->cells.axes[i] = NOTHING;
    }
    return 1;
}

void chip_proof_close(struct chip_proof *p)
{
    if (!p) return;
    chip_depth_forget(p);
    free(p->own_to);
    free(p->own_tool);
    free(p->table);
    free(p->tools);
    free(p->wide);
    chip_depth_cells_free(&p->cells);
    free(p->settled);
    free(p->seen);
    free(p->pool.node);
    free(p->list);
    free(p);
}

struct chip_proof *chip_proof_open(const struct chip_proof_stock *stock, const struct chip_proof_tool *tools,
                                   long tool_count, double cell)
{
    struct chip_proof *p = calloc(1, sizeof *p);
    long k;
    if (!p) return 0;
    p->stock = *stock;
    p->cell = cell;
    p->table = malloc(sizeof *p->table * (size_t)(tool_count + 1));
    p->tools = malloc(sizeof *p->tools * (size_t)(tool_count + 1));
    p->wide = malloc(sizeof *p->wide * (size_t)(tool_count + 1));
    for (k = 0; p->table && p->tools && p->wide && k < tool_count; k++) {
        p->table[k] = tools[k];
        chip_tool_set_profile(&p->tools[k], tools[k].radius, tools[k].corner, tools[k].half_angle);
        p->wide[k] = p->tools[k];
        if (tools[k].clearance >= 0.0) chip_swept_widen(&p->wide[k], tools[k].clearance - CHIP_PROOF_SIDE);
        p->most_radius = chip_max(p->most_radius, chip_max(p->tools[k].radius, p->wide[k].radius));
    }
    if (p->table && p->tools && p->wide && make_map(p)) return p;
    chip_proof_close(p);
    return 0;
}

static int room_to_ask(struct chip_proof *p, long n)
{
    int32_t *seen = p->seen;
    long i;
    if (n <= p->seen_size) return 1;
    seen = realloc(seen, sizeof *seen * (size_t)n);
    if (!seen) return 0;
    for (i = p->seen_size; i < n; i++) seen[i] = 0;
    p->seen = seen;
    p->seen_size = (int32_t)n;
    return 1;
}

/* The moves from number `first` on. */
static long prove(struct chip_proof *p, int32_t first, int64_t *squares, struct chip_proof_found *found, long room)
{
    int32_t k;
    p->squares = squares;
    p->found = found;
    p->room = room;
    p->count = 0;
    for (k = first; k < p->n && !p->failed && p->count<room && * squares> 0; k++) {
        struct judged m;
        if (p->tool[k] == CHIP_PROOF_ELSEWHERE) continue;
        m = judged_of(p, k);
        p->spans_known = 0;
        p->hits = 0;
        if (p->tool[k] >= 0 && p->table[p->tool[k]].clearance >= 0.0) judge_traverse(p, m);
        take_move(p, &m);
        p->along += m.length;
    }
    return p->failed ? -1 : p->count;
}

/* Room for so many moves more that are kept here. */
static int room_for(struct chip_proof *p, long n)
{
    long size = p->n + n;
    double *to = p->own_to;
    int32_t *tool = p->own_tool;
    if (size > p->size) {
        size += size / 8;
        if (size >= INT32_MAX) return 0;
        to = realloc(to, sizeof *to * 3 * (size_t)size);
        if (to) p->own_to = to;
        tool = realloc(tool, sizeof *tool * (size_t)size);
        if (tool) p->own_tool = tool;
        if (!to || !tool) return 0;
        p->size = (int32_t)size;
    }
    return room_to_ask(p, p->size);
}

static void append(struct chip_proof *p, const double *place, int32_t tool)
{
    memcpy(p->own_to + 3 * (long)p->n, place, 3 * sizeof *place);
    p->own_tool[p->n++] = tool;
}

long chip_proof_add(struct chip_proof *p, const struct chip_proof_path *path, int64_t *squares,
                    struct chip_proof_found *found, long room)
{
    int32_t first = p->n;
    long k, count;
    if (p->failed || !room_for(p, path->n + 1)) return -1;
    p->to = p->own_to;
    p->tool = p->own_tool;
    p->start = p->own_start;
    if (!p->n || memcmp(path->start, place_before(p, p->n), 3 * sizeof *path->start) != 0)
        append(p, path->start, CHIP_PROOF_ELSEWHERE);
    first = p->n;
    for (k = 0; k < path->n; k++) append(p, path->to + 3 * k, path->tool[k]);
    count = prove(p, first, squares, found, room);
    for (k = 0; k < count; k++) found[k].move -= first;
    return count;
}

long chip_prove_depths(const struct chip_proof_stock *stock, const struct chip_proof_tool *tools, long tool_count,
                       const struct chip_proof_path *path, double cell, int64_t *squares,
                       struct chip_proof_found *found, long room)
{
    struct chip_proof *p = path->n < INT32_MAX ? chip_proof_open(stock, tools, tool_count, cell) : 0;
    long count = -1;
    if (p && room_to_ask(p, path->n) && chip_proof_expect(p, path) == 0) {
        p->start = path->start;
        p->to = path->to;
        p->tool = path->tool;
        p->n = (int32_t)path->n;
        count = prove(p, 0, squares, found, room);
    }
    chip_proof_close(p);
    return count;
}
