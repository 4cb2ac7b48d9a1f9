/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_ground.c - see depth_proof.h: memory of the map's cells and of the chains of moves at them. */
#include <stdlib.h>

#include "depth_state.h"

/* Notes that a node from before the mark is in use; 0 without memory. */
static int note(struct before *b, int32_t node)
{
    if (b->taken_count == b->taken_size) {
        int32_t size = b->taken_size + b->taken_size / 2 + 1024;
        int32_t *bigger = realloc(b->taken, sizeof *bigger * (size_t)size);
        if (!bigger) return 0;
        b->taken = bigger;
        b->taken_size = size;
    }
    b->taken[b->taken_count++] = node;
    return 1;
}

int32_t chip_depth_free_node(struct chip_proof *p)
{
    struct pool *pool = &p->pool;
    int32_t *head = pool->recycled != NOTHING ? &pool->recycled : &pool->free, own = *head;
    if (own == NOTHING || (p->before.is_set && head == &pool->free && !note(&p->before, own))) return NOTHING;
    *head = pool->node[own].next;
    return own;
}

void chip_depth_put(struct chip_proof *p, int32_t *head, int32_t move, double low)
{
    struct pool *pool = &p->pool;
    int32_t own = chip_depth_free_node(p);
    if (own == NOTHING) {
        if (pool->count == pool->size) {
            int32_t size = pool->size < INT32_MAX / 2 ? pool->size + pool->size / 4 : pool->size;
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

int chip_depth_cells_make(struct cells *cells, size_t n)
{
    cells->high = malloc(sizeof *cells->high * n);
    cells->partial = malloc(sizeof *cells->partial * n);
    cells->axes = malloc(sizeof *cells->axes * n);
    return cells->high && cells->partial && cells->axes;
}

void chip_depth_cells_free(struct cells *cells)
{
    free(cells->high);
    free(cells->partial);
    free(cells->axes);
}
