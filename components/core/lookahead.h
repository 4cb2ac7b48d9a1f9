/* SPDX-License-Identifier: GPL-2.0-or-later */
/* lookahead.h - the section area along the path the tool is about to take.
 *
 * Who calls it: tracker.c, once per servo period.
 * Source: JP3131045 looks at one whole block at a time. Inside the controller the feed
 * must fall before the load rises, because a drop of the override brakes at the planner's
 * acceleration and not at once.
 *
 * Principle:
 *  1. The path ahead is the programmed path (path.h) or, if that is unknown, the predicted path (predicted_path.h).
 *     Samples of the section area are taken along it before the tool cuts there.
 *  2. As long as the tool stays on the path only new samples at the far end are needed.
 *     On a new predicted path the samples of the old one that lie on it are carried over; those
 *     that lie near it are used until they are taken again, nearest first, a few per
 *     period; the others are dropped. On the programmed path samples behind a turn are taken again after
 *     the tool has passed it: the cut made until there is in the map then. They are read clear of the
 *     stock cut so far, and no farther on than that requires: a reading farther on may lie beyond the stock.
 *  3. When the tool arrives at a sample, the load at the tool is known already.
 *  4. A controller wants few numbers, the load profile: the positions where the area rises above all before
 *     them, at most CHIP_LOAD_STEPS. Behind the last sample the profile assumes
 *     the worst this tool can meet, so that it can always still brake; behind the end of
 *     the programmed path the tool stops anyway.
 *  5. On the programmed path samples are closer where the load jumps, and a corner has two, one for
 *     each direction: nothing is interpolated across a corner.
 *  6. Between samples the load is linear, and a bound is the line through the samples, each raised by its possible
 *     error: the load's own curvature (a smooth load leaves the line by less). Where a rise bends to level the cells
 *     spread the bend over the samples on both sides, and twice as much is added. Heights are interpolated, so that a
 *     jump (the edge of the stock, a wall) may lie CHIP_LATE_RISE or CHIP_LATE_FALL cells from the position it is
 *     read at: between two samples the larger one counts, and so far beyond. A flat end that goes straight down
 *     has no such position error; on a slope the error is smaller the steeper it is.
 *     What lies between two samples is computed when one of those it depends on changes, and kept.
 *  7. Where the path turns between two samples the area is sublinear in the direction: at most their larger
 *     one over the cosine of half the turn is met.
 *  8. In a parabolic blend LinuxCNC takes the tool off one segment with that one's acceleration a and puts it on the next with
 *     its own b, each up to the velocity commanded; no override lowers the sum to it (tp/tp.c, tpUpdateBlend and tpUpdateCycle;
 *     measured on 2.9.0~pre1). If b is larger the two add up to 2 - a / b times the velocity at the blend's beginning,
 *     and always to b times a period more; never to more than twice. Only at its end is the velocity the one commanded.
 *     So the largest load in a blend, from v^2 / 2a before the corner to its end behind it, counts as that much higher, and
 *     from its beginning on. It ends v^2 / 2b behind the corner or, if a is smaller, v^2 / a - v^2 / 2b: the second segment
 *     is at v long before the first one has ended.
 */
#ifndef CHIPWISE_LOOKAHEAD_H
#define CHIPWISE_LOOKAHEAD_H

#include "predicted_path.h"
#include "section.h"

#define CHIP_LOOKAHEAD_SAMPLES 192 /* in use at most */
#define CHIP_SAMPLE_RING 256       /* places for them: a power of two, as a division takes longer than a reading */
#define CHIP_LOAD_STEPS 8

/* The load between a sample and the one before it [6] [7]. */
struct chip_load_interval {
    double from, to; /* mm, where it applies */
    double a, b;     /* mm2 at its ends; linear between them, or the larger one throughout */
    double bound;    /* mm2, area of the sample, never too low */
    int jump;        /* 1: up, -1: down */
};

struct chip_lookahead {
    struct chip_predicted_path predicted; /* the path if the programmed one is unknown */
    int on_path;                          /* the samples lie on the programmed path */
    double at_s;                          /* mm, position of the tool on the path the samples lie on */
    double period;                        /* s, of the last step */
    double latency_travel;                /* mm the tool travels until a command given now takes effect */
    /* mm the tool travels while a jerk-limited planner builds up its braking; 0: not limited */
    double jerk_travel;
    double jerk_gain;                           /* mm/s it may gain meanwhile */
    double spacing;                             /* mm between samples at most; 0: not begun */
    double next_spacing;                        /* mm to the next sample [5] */
    double begin_s;                             /* mm, position of the tool when the samples began */
    double begin_area;                          /* mm2, load at the tool then */
    int first, count;                           /* samples in use: numbers first .. first + count - 1 */
    int stale;                                  /* number of the first sample to be taken again */
    double s[CHIP_SAMPLE_RING];                 /* mm, position of sample i at index i % CHIP_SAMPLE_RING */
    float area[CHIP_SAMPLE_RING];               /* mm2 */
    float full_area[CHIP_SAMPLE_RING];          /* mm2, the largest possible area there at that depth */
    float depth[CHIP_SAMPLE_RING];              /* mm above the tip */
    float position_error[CHIP_SAMPLE_RING];     /* cells along the path by which a reading may be displaced [6] */
    float turn[CHIP_SAMPLE_RING];               /* rad the path turns by since the sample before */
    double corner_turn[CHIP_SAMPLE_RING];       /* rad, the sum of the turns at corners [2] */
    unsigned char corner[CHIP_SAMPLE_RING];     /* same position as the sample before [5] */
    unsigned char read_clear[CHIP_SAMPLE_RING]; /* read clear of the cut stock, so farther on */
    unsigned char completed[CHIP_SAMPLE_RING];  /* its interval is known */
    struct chip_load_interval interval[CHIP_SAMPLE_RING];
    /* the limits of the tooth (tooth.h); all weights 0: none, and what follows is not used */
    double chip_weight, power_weight, force_weight,
        power_root;                                 /* 1/mm; 1/mm per unit of `power` and `force`; 1 / (1 - mc) */
    struct chip_tooth_load begin_tooth;             /* when the samples began */
    struct chip_tooth_load tooth[CHIP_SAMPLE_RING]; /* of the samples */
    struct chip_tooth_load
        between[CHIP_SAMPLE_RING];            /* the largest between a sample and the one before it (tooth.h, 7) */
    float chip[CHIP_SAMPLE_RING];             /* largest chip over the feed per tooth */
    float power[CHIP_SAMPLE_RING];            /* A_mc^(1 / (1 - mc)) */
    float force[CHIP_SAMPLE_RING];            /* side force^(1 / (1 - mc)), */
    float force_mean[CHIP_SAMPLE_RING];       /* and its mean over the largest one */
    float carried[3][CHIP_LOOKAHEAD_SAMPLES]; /* all, while they go over to a new predicted path */
};

struct chip_load_step {
    double distance; /* mm of travel until the area applies; 0: now */
    double area;     /* mm2 */
    double accel;    /* mm/s2, mean the planner may brake with until there; 0: unknown */
    int limit;       /* of a tooth load: chip_tooth_limit, which limit has made it */
};

struct chip_load_profile {
    double area, depth;                          /* mm2, mm: at the tool now, the best estimate */
    int steps;                                   /* entries in use */
    struct chip_load_step step[CHIP_LOAD_STEPS]; /* distance and area both rise; the first one is at the tool
                                                     * now and never too low */
    /* the same of the tooth load, 1/mm, in `area`; none without limits of the tooth */
    int tooth_steps;
    struct chip_load_step tooth_step[CHIP_LOAD_STEPS];
    double chip, power;       /* at the tool now: chip over the feed per tooth, and A_mc^(1 / (1 - mc)) */
    double force, force_mean; /* side force^(1 / (1 - mc)), and the mean over the largest one */
};

/* Distance between samples for a tool, mm. */
double chip_lookahead_spacing(const struct chip_stock *stock, const struct chip_tool *tool);

/* Clears predicted path and samples (tool change, new stock, jump). */
void chip_lookahead_reset(struct chip_lookahead *lookahead);

/* The tool went from `from` to `to` (tips, mm) in `period` s; `path`, the programmed path, follows it already (null:
 * unknown). Takes samples up to `horizon` mm ahead until about `budget` nodes (chip_section.nodes) are read. */
void chip_lookahead_step(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock,
                         const struct chip_tool *tool, const double from[3], const double to[3], double period,
                         double horizon, int budget);

/* Uses the limits of `tooth` from now on (tooth.h); samples have been read for all of them, or there are none. */
void chip_tooth_follow(struct chip_lookahead *lookahead, const struct chip_tooth *tooth);

/* The load profile of the next `horizon` mm; `path` as in the last step. */
void chip_lookahead_profile(const struct chip_lookahead *lookahead, const struct chip_path *path,
                            const struct chip_stock *stock, const struct chip_tool *tool, double horizon,
                            struct chip_load_profile *profile);

#endif
