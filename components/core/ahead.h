/* ahead.h - the section area along the way the tool is about to go.
 *
 * Who calls it: stock_tracker.comp, once per servo period.
 * Source: JP3131045 looks at one whole block at a time; inside the controller the feed
 * must fall before the load rises, because a drop of the override brakes at the planner's
 * acceleration and not at once.
 *
 * Principle:
 *  1. The way ahead is the program's own (way.h), or else the course (course.h). Samples of
 *     the section area are taken along it before the tool cuts there.
 *  2. As long as the tool keeps to it only new samples at the far end are needed.
 *     On a new course the samples of the old one that lie on it are carried over; those
 *     that lie near it stand in until they are taken again, nearest first, a few per
 *     period; the rest is dropped. On the program's way those behind a turn are taken again when
 *     the tool is round it: what it has cut on the way there is gone then. They are read clear of what the tool has cut
 *     up to where it is, and no further on than that needs: what is read further on may be the stock's end.
 *  3. When the tool arrives at a sample, the load at the tool is known already.
 *  4. A controller wants few numbers: the places where the area rises above all before
 *     them, at most CW_AHEAD_LEVELS of them. What lies behind the last sample is taken as
 *     the worst this tool can meet, so that it can always still brake; behind the end of
 *     the program's way it stops anyway.
 *  5. On the program's way samples stand closer where the load jumps, and at a corner there are two, one for
 *     either direction: nothing is interpolated over a corner.
 *  6. Between samples the load is linear, and a bound is the line through what the samples may be too low by:
 *     their own bend (a smooth load leaves the line by less). Heights are interpolated, so that a
 *     jump (the edge of the stock, a wall) may lie CW_LATE_RISE or CW_LATE_FALL cells beside the place it is
 *     read at: between two samples it counts with the larger one, and so far beyond. A flat end that goes straight down
 *     meets no such place, and on a slope the less the steeper it is.
 *  7. Where the way turns between two samples the area is sublinear in the direction: at most their larger
 *     one over the cosine of half the turn is met.
 */
#ifndef CHIPWISE_AHEAD_H
#define CHIPWISE_AHEAD_H

#include "course.h"
#include "section.h"

#define CW_AHEAD_SAMPLES 192
#define CW_AHEAD_LEVELS 8

struct cw_ahead {
    struct cw_way way;          /* the program's own, where it is known */
    struct cw_course course;    /* predicted, where not */
    int on_way;                 /* which of the two the samples lie on */
    double at;                  /* mm, place of the tool on it */
    double lead;                /* mm the tool goes until what is told now takes effect */
    double build_up;            /* mm the tool goes while a planner that bounds the jerk builds up its braking; 0: it does not */
    double gaining;             /* mm/s it may be faster by then */
    double gap;                 /* mm between samples at most; 0: not begun */
    double step;                /* mm to the next sample [5] */
    double origin;              /* mm, place of the tool when the course began */
    double held;                /* mm2, load at the tool then */
    int first, count;           /* samples in use: numbers first .. first + count - 1 */
    int stale;                  /* number of the first one to be taken again */
    double s[CW_AHEAD_SAMPLES];         /* mm, place of sample i at index i % CW_AHEAD_SAMPLES */
    float area[CW_AHEAD_SAMPLES];       /* mm2 */
    float most[CW_AHEAD_SAMPLES];       /* mm2, all that can be met there at that depth */
    float depth[CW_AHEAD_SAMPLES];      /* mm above the tip */
    float smear[CW_AHEAD_SAMPLES];      /* cells the cells may shift it by along the way [6] */
    float turn[CW_AHEAD_SAMPLES];       /* rad the way turns by since the sample before */
    double bend[CW_AHEAD_SAMPLES];      /* rad, the sum of those at corners [2] */
    unsigned char corner[CW_AHEAD_SAMPLES];     /* at the same spot as the sample before [5] */
    unsigned char near[CW_AHEAD_SAMPLES];       /* read clear of what the tool has cut, so further on */
};

struct cw_ahead_level {
    double distance;            /* mm of travel until the area applies; 0: now */
    double area;                /* mm2 */
    double accel;               /* mm/s2, mean the planner may brake with until there; 0: not known */
};

struct cw_ahead_view {
    double area, depth;         /* mm2, mm: at the tool now, the best estimate */
    int levels;                 /* entries in use */
    struct cw_ahead_level level[CW_AHEAD_LEVELS];       /* distance and area both rise; the
                                   first is at the tool now, never too low */
};

/* Distance between samples for a tool, mm. */
double cw_ahead_gap(const struct cw_stock *stock, const struct cw_tool *tool);

/* Forgets course and samples (tool change, new stock, jump). */
void cw_ahead_reset(struct cw_ahead *ahead);

/* The tool went from `from` to `to` (tips, mm) in `period` s; `way` follows it already. Takes samples up
 * to `horizon` mm ahead until `budget` nodes (cw_section.nodes, about) are read. */
void cw_ahead_step(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                   const double from[3], const double to[3], double period,
                   double horizon, int budget);

/* What is known for the next `horizon` mm. */
void cw_ahead_look(const struct cw_ahead *ahead, const struct cw_stock *stock,
                   const struct cw_tool *tool, double horizon, struct cw_ahead_view *view);

#endif
