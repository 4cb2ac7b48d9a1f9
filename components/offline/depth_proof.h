/* SPDX-License-Identifier: GPL-2.0-or-later */
/* depth_proof.h - whether moves cut deeper than their limits, proved: no contact is lost between needles.
 *
 * Who calls it: remap/chipwise/rewrite/depth_proof.py, through the shared library. Never in realtime.
 * Source: CN105492980 [0045] (the stock as the path leaves it); the division into squares is branch and bound.
 *
 * Principle:
 *  1. A place is met by a move when the tool, CHIP_PROOF_SKIN smaller in radius, first comes over it. Its stock is then as high as
 *     the lowest of the moves before have left it (swept.h, exactly). What the move cuts below the tip afterwards is already cut.
 *  2. Each cell of a map has the highest stock that can be anywhere in it, and the moves that have cut a part of it only, or that
 *     may have cut parts lower than that.
 *  3. A move meets cells that are too high. If its axis there runs within CHIP_PROOF_BESIDE of an earlier one's that is not too
 *     high, then what it meets has been cut: the next level along a wall. Otherwise the cell is divided into four, again and again,
 *     until each square is out of reach, or one earlier move has cut all of it low enough, or its middle is a witness: a place of
 *     stock that is too high.
 *  4. Of the first witnesses on one side of a segment of the path, CHIP_PROOF_SEGMENT long, the deepest counts: a path that is shifted there meets the
 *     others less, too. What it still meets is found when the new path is proved.
 *  5. Squares with a diagonal of CHIP_PROOF_LEAST that are neither, do not count: contacts smaller than that, and stock thinner than
 *     the skin at the tool's side. All others are found.
 *  6. A path that is still sought is added, looked at and taken back again (chip_proof_back).
 *  7. Of the moves to come it is known how low they will be at most (chip_proof_expect). Once a cell is low enough for all of them, it is settled:
 *     what has cut parts of it is forgotten. A long program would need 100 MB for it. A move that is lower after all may have a
 *     witness where it has none, never the other way round.
 *  8. A traverse is judged by another rule: no stock higher than its tip, but for CHIP_PROOF_LEVEL, is nearer to its side than
 *     `clearance`. So the judged tool is wider by that, whatever it has cut before counts no less, and nothing is thin enough not to count.
 *     Straight up it is free, straight down its lowest place counts.
 */
#ifndef CHIPWISE_DEPTH_PROOF_H
#define CHIPWISE_DEPTH_PROOF_H

#include <stdint.h>

#define CHIP_PROOF_ELSEWHERE INT32_MIN

#define CHIP_PROOF_SKIN 0.004   /* mm [1] */
#define CHIP_PROOF_BESIDE 0.003 /* mm [3]; less than the skin */
#define CHIP_PROOF_BESIDE_ROUND                                                                                        \
    0.0005 /* mm [3], of tools that are not flat: they leave much more at their radius than a little within */
#define CHIP_PROOF_LEAST 0.004  /* mm [5] */
#define CHIP_PROOF_SEGMENT 0.2  /* mm [4] */
#define CHIP_PROOF_WITNESS 0.1  /* mm: a square smaller than that has one witness */
#define CHIP_PROOF_MOST 60      /* witnesses of one move that are looked for, and */
#define CHIP_PROOF_MOST_MORE 30 /* so many more for each of its segments */
#define CHIP_PROOF_LOWER                                                                                               \
    0.01 /* mm by which a move may be lower than those that were expected: the rounding of its text [7] */
#define CHIP_PROOF_ENOUGH 4    /* witnesses beside a segment, of which one counts */
#define CHIP_PROOF_LEVEL 0.005 /* mm: stock that is no higher above the tip is what the tool goes over [8] */
#define CHIP_PROOF_SIDE 0.001  /* mm by which a traverse may be nearer: the rounding of its text [8] */

struct chip_proof_stock {
    double x, y;           /* mm, its middle */
    double half_x, half_y; /* mm, along its own axes */
    double cosine, sine;   /* of its turn */
    double z_min, z_max;   /* mm */
    int32_t shape;         /* 0 a box, 1 a cylinder (ellipse) */
    int32_t pad;
};

struct chip_proof_tool {
    double radius, corner, half_angle; /* mm, mm, rad (0: no cone) */
    double limit;                      /* mm, depth that is allowed; 1e30: is not judged */
    double clearance; /* mm that the side of a traverse keeps [8]; below 0: of feed moves, which have a limit */
};

/* n moves, one after the other. Long programs have millions: 28 bytes each. */
struct chip_proof_path {
    const double *start; /* mm, where the first begins */
    const double *to;    /* n times three mm, where they end */
    const int32_t
        *tool; /* n: index of the tool; below 0: of ~tool, and the move is not judged; CHIP_PROOF_ELSEWHERE: none, what
                          * follows begins there */
    int64_t n;
};

struct chip_proof; /* moves in a stock: depth_state.h */

struct chip_proof_found { /* a witness */
    double x, y;          /* mm */
    double height;        /* mm, Z of the stock there */
    double at;            /* share of the move where the tool comes there */
    int64_t move;
    int64_t segment; /* its number [4] */
};

/* Looks for places where the moves of a path cut deeper than their tools' limits: at most `room` witnesses in `found`.
 * cell (mm) of the map: a matter of time only. squares: at most so many are looked at; 0 afterwards: not all of them were.
 * Returns the number of witnesses, -1 without memory. */
long chip_prove_depths(const struct chip_proof_stock *stock, const struct chip_proof_tool *tools, long tool_count,
                       const struct chip_proof_path *path, double cell, int64_t *squares,
                       struct chip_proof_found *found, long room);

/* The same bit by bit, for a path that is still sought [6]. Returns NULL without memory. */
struct chip_proof *chip_proof_open(const struct chip_proof_stock *stock, const struct chip_proof_tool *tools,
                                   long tool_count, double cell);
void chip_proof_close(struct chip_proof *p);

/* Adds moves to those before, and looks for witnesses in them alone; their `move` counts from the first of these. The path is copied.
 * Returns as of chip_prove_depths; after -1 nothing more can be added. */
long chip_proof_add(struct chip_proof *p, const struct chip_proof_path *path, int64_t *squares,
                    struct chip_proof_found *found, long room);

/* No move that is judged will be lower than those of a path where it reaches [7]. Returns -1 without memory. */
int chip_proof_expect(struct chip_proof *p, const struct chip_proof_path *path);

/* Where chip_proof_back returns to; what came before stays. Returns -1 without memory. */
int chip_proof_mark(struct chip_proof *p);
void chip_proof_back(struct chip_proof *p);

#endif
