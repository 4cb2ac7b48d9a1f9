/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_state.h - what the files of depth_proof.h share while they prove one program.
 *
 * Who calls it: depth_proof.c; below it depth_squares.c, depth_settled.c; below both depth_beside.c, depth_undo.c and depth_ground.c.
 */
#ifndef CHIPWISE_DEPTH_STATE_H
#define CHIPWISE_DEPTH_STATE_H

#include <stddef.h>

#include "core/chip_math.h"
#include "core/fault.h"
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
    int32_t count, size;
    int32_t free, recycled; /* chains of nodes that are free: from before the mark, since the mark */
    int32_t last_recycled;  /* the last one of its chain */
};

struct span {
    double first, last; /* shares of a move */
};

struct cells {               /* of the map */
    float *high;             /* [2] */
    int32_t *partial, *axes; /* chains: moves that cut a part, moves whose axis is there */
};

/* What chip_proof_back() puts back: depth_undo.c. */
struct before {
    char *is_kept; /* of each row of the map: whether its cells are kept here */
    int32_t *kept; /* the rows that are, in any order */
    int32_t rows;
    struct cells cells; /* of those rows, as at the mark */
    int32_t n, count;   /* moves, nodes of the pool */
    int32_t *taken;     /* free nodes that are in use since, in their order */
    int32_t taken_count, taken_size;
    double along;
    int is_set;
};

struct recent { /* of a segment: index in `found`, witnesses with those that do not count [4] */
    long found, hits;
};

struct chip_proof {
    struct chip_proof_stock stock;
    const double *start, *to; /* of the moves so far, as of chip_proof_path */
    const int32_t *tool;
    int32_t n;
    double *own_to; /* the same, where they are kept here */
    int32_t *own_tool, size;
    double own_start[3];
    struct chip_proof_tool *table;
    struct chip_tool *tools; /* of the table */
    struct chip_tool *wide;  /* the same, wider by the clearance of a traverse [8] */
    double x0, y0, cell, most_radius;
    int32_t nx, ny;
    struct cells cells;
    float *settled; /* mm, of each cell: up to where its stock is low enough for all moves to come [7]; 0: not known */
    int32_t *seen, asked; /* of each move: the number of the last move that has asked, of those that have */
    int32_t seen_size;
    struct pool pool;
    int32_t *list; /* chains on the path from a cell to a square */
    long list_size;
    struct span spans[SPANS_MOST];
    int span_count, spans_known;
    int64_t *squares;
    struct chip_proof_found *found;
    long count, room;
    struct recent recent[RECENT]; /* by number of the segment */
    int32_t clearing;             /* the last move that has cut all of a square: the next is often cut by it, too */
    long hits;                    /* witnesses of this move, with those that do not count [4] */
    double along;                 /* mm of path before this move */
    struct before before;
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
    int nose;        /* the flutes are shorter than the tool's nose: contacts below its shoulder count */
    int is_traverse; /* it is judged by its clearance [8] and cuts nothing yet: `tool` is wider, `reach` its radius */
};


/* Where a move begins. */
static inline const double *place_before(const struct chip_proof *p, int32_t k)
{
    return k > 0 ? p->to + 3 * (long)(k - 1) : p->start;
}

static inline struct chip_swept swept_of(const struct chip_proof *p, int32_t k)
{
    return chip_swept_of(place_before(p, k), p->to + 3 * (long)k);
}

/* Index of a move's tool, CHIP_PROOF_ELSEWHERE without one. */
static inline int32_t tool_index(const struct chip_proof *p, int32_t k)
{
    int32_t own = p->tool[k];
    return own < 0 && own != CHIP_PROOF_ELSEWHERE ? ~own : own;
}

static inline const struct chip_tool *tool_of(const struct chip_proof *p, int32_t k)
{
    return &p->tools[tool_index(p, k)];
}

/* Column or row of a place, within the map. */
static inline int32_t index_of(double v, double from, double cell, int32_t count)
{
    return (int32_t)chip_max(0.0, chip_min(floor((v - from) / cell), count - 1.0));
}

/* Room for n cells; 0 without memory: what there is has to be freed all the same. */
int chip_depth_cells_make(struct cells *cells, size_t n);
void chip_depth_cells_free(struct cells *cells);

/* A free node, NOTHING without one. */
int32_t chip_depth_free_node(struct chip_proof *p);

/* Puts a move into the chain of a cell. */
void chip_depth_put(struct chip_proof *p, int32_t *head, int32_t move, double low);

/* Keeps the cells of a row before they change. */
void chip_depth_keep_row(struct chip_proof *p, int32_t row);

/* Takes the moves out of a cell's chain that cut nothing below `high`, but those from before the mark. */
void chip_depth_prune(struct chip_proof *p, int32_t *head, float high);

/* Frees what the mark has kept. */
void chip_depth_forget(struct chip_proof *p);

/* Moves that cut nothing of a cell below this need not be kept, mm. */
static inline float chip_depth_kept_below(const struct chip_proof *p, long cell)
{
    float high = p->cells.high[cell];
    return p->settled && high <= p->settled[cell] ? (float)-CHIP_SWEPT_NEVER : high;
}

/* Whether the judged move from share `first` to `last` runs beside earlier moves that have cut what it meets [3]. */
int chip_depth_is_beside(struct chip_proof *p, const struct judged *m, double first, double last);

/* Number of places, half a cell from each other, by which a move's axis is entered into the cells. */
long chip_depth_axis_places(const struct chip_proof *p, const struct chip_swept *m);

/* Enters a move's axis into the cells it goes through. */
void chip_depth_enter_axis(struct chip_proof *p, const struct chip_swept *m, int32_t number);

/* Whether the stock as it was first may be within `near` of a place. */
int chip_depth_in_stock(const struct chip_proof_stock *s, double x, double y, double near);

/* What a move cannot cut below within `round` of a place; CHIP_SWEPT_NEVER if it does not come there. distance: of the place from it. */
double chip_depth_lowest(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double round,
                         double distance);

/* What a move leaves at most in a square, which a convex function has at a corner, or some height from `enough` on if it is not less;
 * CHIP_SWEPT_NEVER if the move does not reach all of it. distance: of its middle from the move. */
double chip_depth_left(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double half,
                       double distance, double enough);

/* Whether a square may have stock that is too high for the judged move, before the moves that have cut parts of it are looked at [3];
 * *allowed: mm, up to which it may be. high: mm, the highest that its stock can be. */
int chip_depth_is_open(struct chip_proof *p, const struct judged *m, double x, double y, double half, double high,
                       double *allowed);

/* Divides an open square until the judged move is known to keep its limit there, or witnesses are found [3]. list: the n moves that have
 * cut parts of it, with room behind for one list more for each division. */
void chip_depth_divide(struct chip_proof *p, const struct judged *m, double x, double y, double half, double allowed,
                       int32_t *list, long n, double high);

#endif
