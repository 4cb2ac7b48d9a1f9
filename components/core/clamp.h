/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clamp.h - clamps, vices and fixtures: how far a tool is from one, and whether it must stop before one.
 *
 * Who calls it: tracker.c, once per servo period; chipwise-monitor fills the table in shared memory (stock/clamp_table.py).
 * Source: none. The distance is that of remap/chipwise/clamps/distance.py, which `chipwise check` uses.
 *
 * Principle:
 *  1. A clamp is a box, turned about Z, or a cylinder along Z, as large down to the table as it is at its top. The distance is the
 *     least d for which the clamp, larger by d at its sides and at its top, touches a body of the tool: the cutter with the
 *     shank, and the holder, which begins higher. A body lies within the lines r = a + b h of its outline (an arc within
 *     CHIP_CLAMP_TANGENTS of them, so that it counts as larger by 0.002 of its radius at most), and then
 *         d = max(begins + z - top, (across - a - b (top - z)) / (1 + b) of each line).
 *  2. d is convex along a line, and changes by no more than the tool travels. So a place whose d is 3 mm above what is allowed
 *     is free for 3 mm all round; where that is not enough the least d of a line is found by the golden section.
 *  3. In each period the path that the tool travels if it has to stop now is looked at: the programmed path (path.h) up to where it can
 *     be at rest, arcs as chords. If that comes nearer to a clamp than the clearance, it has to stop. Nothing is carried over from the
 *     period before. Behind the end of the programmed path the tool stops anyway.
 *  4. A parabolic blend leaves the path inside of the corner, by a parabola of which the speed decides the size: that is looked at too. In it the
 *     tool is on both segments at once, each with a speed of its own, so that where they turn back it seems to rest.
 *  5. If the path is unknown the line that the tool is on is looked at, up to the distance to go.
 *  6. A tool that is nearer than the clearance when it sets out may go away: it has to stay as far as it was, and as far as it has been
 *     meanwhile. What it sets out from is where it was before motion began.
 *  7. The work of a period is bounded by CHIP_CLAMP_WORK distances. If they do not suffice the tool has to stop.
 *  8. The table is in shared memory. It is copied when its generation has changed, is even and stays the same meanwhile, and used if every
 *     number in it can be one of a clamp; otherwise the clamps before stay in force.
 */
#ifndef CHIPWISE_CLAMP_H
#define CHIPWISE_CLAMP_H

#include <stdint.h>

#include "path.h"
#include "tool.h"

#define CHIP_CLAMPS 100               /* in a table at most */
#define CHIP_CLAMP_TANGENTS 24        /* of an arc [1] */
#define CHIP_CLAMP_LINES 26           /* of an outline: tangents, cone, cylinder */
#define CHIP_CLAMP_BODIES 2           /* cutter with shank, holder */
#define CHIP_CLAMP_WORK 1200          /* distances in a period at most [7] */
#define CHIP_CLAMP_MOST_CLEARANCE 1e3 /* mm */
#define CHIP_CLAMP_UNSET (-1e20)
#define CHIP_CLAMP_MOST_COORDINATE 1e6 /* mm, beyond it nothing is a position */

struct chip_clamp {
    double x, y;           /* mm, its middle */
    double half_x, half_y; /* mm, of a box along its own axes; of a cylinder its radius, both */
    double cosine, sine;   /* of the turn of a box, counter-clockwise */
    double top;            /* mm */
    uint64_t is_round;     /* 1: a cylinder */
};

struct chip_clamp_table {         /* in shared memory, behind the path done [8] */
    volatile uint64_t generation; /* odd while it is written */
    uint64_t count;
    double clearance; /* mm */
    struct chip_clamp clamp[CHIP_CLAMPS];
};

/* A body of the tool: its outline is the lines r = a + b h, h mm above the tip [1]. */
struct chip_clamp_body {
    double begins; /* mm above the tip */
    double radius; /* mm, the largest */
    int lines;
    double a[CHIP_CLAMP_LINES], b[CHIP_CLAMP_LINES], share[CHIP_CLAMP_LINES]; /* share: 1 / (1 + b) */
};

struct chip_clamp_in {
    double from[3], to[3]; /* mm, tips of the last period and this one */
    double period_s;
    double acceleration_mm_s2; /* the least in any direction; not positive: unknown */
    double
        current_vel_mm_s;  /* of the planner: in a blend the sum of those on both segments [4]; not positive: unknown */
    double max_jerk_mm_s3; /* of a jerk-limited planner; not positive: not limited */
    double distance_to_go_mm;     /* to the end of the segment; not positive: unknown */
    const struct chip_path *path; /* null: unknown [5] */
};

struct chip_clamps {
    struct chip_clamp_table table; /* private copy of the one in force */
    struct chip_clamp_table next;  /* of the one that is looked at [8] */
    uint64_t seen;                 /* generation that was looked at last */
    int refused;                   /* that one was not taken over [8] */
    int bodies;                    /* of the tool; 0: not built */
    struct chip_clamp_body body[CHIP_CLAMP_BODIES];
    double built[6]; /* mm, the numbers they were built from */
    double allowed[CHIP_CLAMPS]
                  [CHIP_CLAMP_BODIES]; /* mm, distances to be kept; below CHIP_CLAMP_UNSET: not known yet [6] */
    double window;                     /* mm looked at in the last period */
    double distance;                   /* mm of travel to where a clamp is met; 0: none is, or it is met already */
    int number, part;                  /* the clamp that is met, from 1; 0: none. Body that meets it, from 0 */
    long work;                         /* distances computed in this period */
};

/* Takes over another table; 1 if there are clamps. `table` null: none. */
int chip_clamps_take(struct chip_clamps *clamps, const struct chip_clamp_table *table);

/* The bodies of a tool; a holder of diameter 0 is not known. `tool` null: only its axis is known. */
void chip_clamps_build(struct chip_clamps *clamps, const struct chip_tool *tool, double stick_out,
                       double holder_diameter);

/* Distance of a body from a clamp, tip in mm [1]. */
double chip_clamp_distance(const struct chip_clamp *clamp, const struct chip_clamp_body *body, const double tip[3]);

/* The tool sets out anew [6]. */
void chip_clamps_begin(struct chip_clamps *clamps);

/* 1 if the tool has to stop now [3]. */
int chip_clamps_check(struct chip_clamps *clamps, const struct chip_clamp_in *in);

#endif
