/* SPDX-License-Identifier: GPL-2.0-or-later */
/* raster_route.c - see raster_route.h. */
#include <math.h>
#include <stdlib.h>

#include "raster_route.h"

/* A place that waits, and how long a route over it is at least. */
struct waiting {
    double least;
    long place;
};

struct search {
    const struct chip_raster *raster;
    long last;
    double *cost;         /* of each place, so far */
    int64_t *before;      /* the place from which it was reached; -1: it was not */
    uint8_t *done;        /* its cost is final */
    struct waiting *heap; /* the least first; each place may enter it from each of its neighbours */
    long count;
};

static int sooner(const struct waiting *a, const struct waiting *b)
{
    return a->least < b->least || (a->least == b->least && a->place < b->place);
}

static void push(struct search *s, struct waiting one)
{
    long k = s->count++;
    for (; k > 0 && sooner(&one, &s->heap[(k - 1) / 2]); k = (k - 1) / 2) s->heap[k] = s->heap[(k - 1) / 2];
    s->heap[k] = one;
}

static long pop(struct search *s)
{
    long first = s->heap[0].place, k = 0, child;
    struct waiting one = s->heap[--s->count];
    for (; (child = 2 * k + 1) < s->count; k = child) {
        if (child + 1 < s->count && sooner(&s->heap[child + 1], &s->heap[child])) child++;
        if (!sooner(&s->heap[child], &one)) break;
        s->heap[k] = s->heap[child];
    }
    s->heap[k] = one;
    return first;
}

/* From a place on to those beside it. */
static void spread(struct search *s, long at)
{
    const struct chip_raster *r = s->raster;
    int64_t k, i = at / r->rows, j = at % r->rows;
    for (k = 0; k < r->count; k++) {
        int64_t column = i + r->step[2 * k], row = j + r->step[2 * k + 1], near = column * r->rows + row;
        double far = s->cost[at] + r->length[k], over, along;
        if (column < 0 || column >= r->columns || row < 0 || row >= r->rows || !r->free[near]) continue;
        if (s->done[near] || (s->before[near] >= 0 && !(far < s->cost[near]))) continue;
        s->cost[near] = far;
        s->before[near] = at;
        over = (double)(column - s->last / r->rows);
        along = (double)(row - s->last % r->rows);
        push(s, (struct waiting){ far + sqrt(over * over + along * along), (long)near });
    }
}

static long found(const struct search *s, long first, int64_t *route)
{
    long count = 0, at = s->last;
    if (!s->done[at]) return 0;
    for (; at != first; at = (long)s->before[at]) route[count++] = at;
    route[count++] = first;
    return count;
}

long chip_raster_route(const struct chip_raster *raster, long first, long last, int64_t *route)
{
    size_t places = (size_t)(raster->columns * raster->rows), k;
    struct search s = { raster,
                        last,
                        malloc(places * sizeof *s.cost),
                        malloc(places * sizeof *s.before),
                        calloc(places, 1),
                        malloc((places * CHIP_RASTER_NEIGHBOURS + 1) * sizeof *s.heap),
                        0 };
    long count = -1;
    if (s.cost && s.before && s.done && s.heap) {
        for (k = 0; k < places; k++) s.before[k] = -1;
        s.cost[first] = 0.0;
        s.before[first] = first;
        push(&s, (struct waiting){ 0.0, first });
        while (s.count && !s.done[last]) {
            long at = pop(&s);
            if (s.done[at]) continue;
            s.done[at] = 1;
            if (at != last) spread(&s, at);
        }
        count = found(&s, first, route);
    }
    free(s.cost);
    free(s.before);
    free(s.done);
    free(s.heap);
    return count;
}
