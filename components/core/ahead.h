/* ahead.h - the section area along the way the tool is about to go.
 *
 * Who calls it: stock_tracker.comp, once per servo period.
 * Source: JP3131045 looks at one whole block at a time; inside the controller the feed
 * must fall before the load rises, because a drop of the override brakes at the planner's
 * acceleration and not at once.
 *
 * Principle:
 *  1. The way ahead is the program's own (way.h), or else the course (course.h). Samples of
 *     the section area are taken along it, evenly, before the tool cuts there.
 *  2. As long as the tool keeps to it only new samples at the far end are needed.
 *     On a new course the samples of the old one that lie on it are carried over; those
 *     that lie near it stand in until they are taken again, nearest first, a few per
 *     period; the rest is dropped.
 *  3. When the tool arrives at a sample, the load at the tool is known already.
 *  4. A controller wants few numbers: the places where the area rises above all before
 *     them, at most CW_AHEAD_LEVELS of them. What lies behind the last sample is taken as
 *     the worst this tool can meet, so that it can always still brake; behind the end of
 *     the program's way it stops anyway.
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
    double gap;                 /* mm between samples; 0: not begun */
    double held;                /* mm2, load at the tool when the course began */
    int first, count;           /* samples in use: numbers first .. first + count - 1 */
    int stale;                  /* number of the first one to be taken again */
    float area[CW_AHEAD_SAMPLES];       /* mm2, sample i at index i % CW_AHEAD_SAMPLES */
    float most[CW_AHEAD_SAMPLES];       /* mm2, all that can be met there at that depth */
    float depth[CW_AHEAD_SAMPLES];      /* mm above the tip */
    float peak[CW_AHEAD_SAMPLES];       /* mm2, most that is met on the way from the sample before where it turns
                                           up or down; 0: it does not */
    unsigned char turned[CW_AHEAD_SAMPLES];     /* the way turns between the sample before and this */
    double last_dir[3];         /* direction at the sample taken last */
    int last;                   /* number of that sample */
};

struct cw_ahead_level {
    double distance;            /* mm of travel until the area applies; 0: now */
    double area;                /* mm2 */
    double accel;               /* mm/s2, mean the planner may brake with until there; 0: not known */
    double base;                /* mm2, of the first place given as this level */
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
