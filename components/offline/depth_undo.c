/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_undo.c - see depth_proof.h: back to a mark [6].
 *
 * Rows of the map are copied before they change. Nodes of chains from before the mark are neither changed nor freed, so the chains are
 * as they were once their heads are. Which of the free nodes have been used since is noted.
 */
#include <stdlib.h>
#include <string.h>

#include "depth_state.h"

static int make_room(struct chip_proof *p)
{
    struct before *b = &p->before;
    size_t cells = (size_t)p->nx * (size_t)p->ny;
    if (b->is_kept) return 1;
    b->is_kept = calloc((size_t)p->ny, 1);
    b->kept = malloc(sizeof *b->kept * (size_t)p->ny);
    if (chip_depth_cells_make(&b->cells, cells) && b->is_kept && b->kept) return 1;
    chip_depth_forget(p);
    return 0;
}

void chip_depth_forget(struct chip_proof *p)
{
    struct before *b = &p->before;
    free(b->is_kept);
    free(b->kept);
    chip_depth_cells_free(&b->cells);
    free(b->taken);
    memset(b, 0, sizeof *b);
}

/* Copies row number `row` of the map. */
static void copy_row(const struct chip_proof *p, int32_t row, struct cells *to, const struct cells *from)
{
    size_t at = (size_t)row * (size_t)p->nx, n = (size_t)p->nx;
    memcpy(to->high + at, from->high + at, sizeof *to->high * n);
    memcpy(to->partial + at, from->partial + at, sizeof *to->partial * n);
    memcpy(to->axes + at, from->axes + at, sizeof *to->axes * n);
}

void chip_depth_keep_row(struct chip_proof *p, int32_t row)
{
    struct before *b = &p->before;
    if (!b->is_set || b->is_kept[row]) return;
    copy_row(p, row, &b->cells, &p->cells);
    b->is_kept[row] = 1;
    b->kept[b->rows++] = row;
}

void chip_depth_prune(struct chip_proof *p, int32_t *head, float high)
{
    struct pool *pool = &p->pool;
    int32_t oldest = p->before.is_set ? p->before.n : 0; /* moves from before the mark come last in a chain */
    while (*head != NOTHING && pool->node[*head].move >= oldest) {
        struct node *own = &pool->node[*head];
        int32_t gone = *head;
        if (own->low < high) {
            head = &own->next;
            continue;
        }
        *head = own->next;
        own->next = pool->recycled;
        if (pool->recycled == NOTHING) pool->last_recycled = gone;
        pool->recycled = gone;
    }
}

/* What has been added since the mark stays. */
static void keep_all(struct chip_proof *p)
{
    struct before *b = &p->before;
    int32_t k, i;
    b->is_set = 0;
    for (k = 0; k < b->rows; k++) {
        long at = (long)b->kept[k] * p->nx;
        for (i = 0; i < p->nx; i++)
            if (p->cells.high[at + i] < b->cells.high[at + i])
                chip_depth_prune(p, &p->cells.partial[at + i], chip_depth_kept_below(p, at + i));
        b->is_kept[b->kept[k]] = 0;
    }
    b->rows = 0;
}

int chip_proof_mark(struct chip_proof *p)
{
    struct before *b = &p->before;
    struct pool *pool = &p->pool;
    if (!make_room(p)) return -1;
    if (b->is_set) keep_all(p);
    if (pool->recycled != NOTHING) {
        pool->node[pool->last_recycled].next = pool->free;
        pool->free = pool->recycled;
        pool->recycled = NOTHING;
    }
    b->n = p->n;
    b->along = p->along;
    b->count = pool->count;
    b->taken_count = 0;
    b->is_set = 1;
    return 0;
}

void chip_proof_back(struct chip_proof *p)
{
    struct before *b = &p->before;
    struct pool *pool = &p->pool;
    int32_t k;
    if (!b->is_set || CHIP_FAULTY(MOVES_STAY)) return;
    for (k = 0; k < b->rows; k++) {
        copy_row(p, b->kept[k], &p->cells, &b->cells);
        b->is_kept[b->kept[k]] = 0;
    }
    b->rows = 0;
    while (b->taken_count > 0) {
        int32_t own = b->taken[--b->taken_count];
        pool->node[own].next = pool->free;
        pool->free = own;
    }
    p->n = b->n;
    p->along = b->along;
    pool->count = b->count;
    pool->recycled = NOTHING;
}
