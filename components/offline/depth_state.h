/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_state.h - what the files of depth_proof.h share while they prove one program.
 *
 * Who calls it: depth_proof.c, depth_squares.c, depth_beside.c.
 */
#ifndef CHIPWISE_DEPTH_STATE_H
#define CHIPWISE_DEPTH_STATE_H

#include "core/chip_math.h"
#include "depth_proof.h"
#include "swept.h"

#define DIAGONAL 1.4142135623730951
#define SPANS_MOST 4096 /* parts of a move beside earlier ones [3] */
#define NOTHING (-1)
#define RECENT 4096 /* segments whose witness is known [4]; of those before, another one may be kept */

struct node { /* of a chain of moves at a cell */
    int32_t move, next;
    float low; /* mm, nothing in the cell is cut lower by it */
};

struct pool {
    struct node *node;
    int32_t count, size, free;
};

struct span {
    double first, last; /* shares of a move */
};

struct proof {
    const struct chip_proof_stock *stock;
    const struct chip_proof_path *path;
    const struct chip_proof_tool *table;
    struct chip_tool *tools; /* of the table */
    double x0, y0, cell, most_radius;
    int32_t nx, ny;
    float *high;             /* of each cell [2] */
    int32_t *partial, *axes; /* chains: moves that cut a part, moves whose axis is there */
    int32_t *seen;           /* of each move: the last move that has asked */
    struct pool pool;
    int32_t *list; /* chains on the path from a cell to a square */
    long list_size;
    struct span spans[SPANS_MOST];
    int span_count, spans_known;
    int64_t *squares;
    struct chip_proof_found *found;
    long count, room;
    long recent[RECENT]; /* index in found, by number of the segment */
    long hits;           /* witnesses of this move, with those that do not count [4] */
    double along;        /* mm of path before this move */
    int failed;
};

/* The move that is judged. */
struct judged {
    struct chip_swept swept;
    const struct chip_tool *tool;
    int32_t number;
    double limit, reach, lowest, highest; /* mm: limit, radius less the skin, Z of the ends */
    double length;                        /* mm */
    long most;                            /* witnesses that are looked for */
    int joined;                           /* the move before, with the same tool, ends where it begins */
    int nose; /* the flutes are shorter than the tool's nose: contacts below its shoulder count */
};


/* Where a move begins. */
static inline const double *place_before(const struct proof *p, int32_t k)
{
    return k > 0 ? p->path->to + 3 * (long)(k - 1) : p->path->start;
}

static inline struct chip_swept swept_of(const struct proof *p, int32_t k)
{
    return chip_swept_of(place_before(p, k), p->path->to + 3 * (long)k);
}

/* Index of a move's tool, CHIP_PROOF_ELSEWHERE without one. */
static inline int32_t tool_index(const struct proof *p, int32_t k)
{
    int32_t own = p->path->tool[k];
    return own < 0 && own != CHIP_PROOF_ELSEWHERE ? ~own : own;
}

static inline const struct chip_tool *tool_of(const struct proof *p, int32_t k) { return &p->tools[tool_index(p, k)]; }

/* Column or row of a place, within the map. */
static inline int32_t index_of(double v, double from, double cell, int32_t count)
{
    return (int32_t)chip_max(0.0, chip_min(floor((v - from) / cell), count - 1.0));
}

/* Puts a move into the chain of a cell. */
void chip_depth_put(struct proof *p, int32_t *head, int32_t move, double low);

/* Whether the judged move from share `first` to `last` runs beside earlier moves that have cut what it meets [3]. */
int chip_depth_is_beside(struct proof *p, const struct judged *m, double first, double last);

/* Enters a move's axis into the cells it goes through. */
void chip_depth_enter_axis(struct proof *p, const struct chip_swept *m, int32_t number);

/* Whether the stock as it was first may be within `near` of a place. */
int chip_depth_in_stock(const struct chip_proof_stock *s, double x, double y, double near);

/* What a move leaves at most in a square, which a convex function has at a corner; CHIP_SWEPT_NEVER if it does not reach
 * all of it. distance: of its middle from the move. */
double chip_depth_left(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double half,
                       double distance);

/* Divides a square until the judged move is known to keep its limit there, or witnesses are found [3]. list: the n moves that have
 * cut parts of it, with room behind for one list more for each division; high: mm, the highest that its stock can be. */
void chip_depth_judge(struct proof *p, const struct judged *m, double x, double y, double half, int32_t *list, long n,
                      double high);

#endif
