/* guard.h - will this traverse meet stock, and does the shank meet it already?
 *
 * Who calls it: tracker.c, once per servo period, after the tool has cut its step.
 * Source: none. LinuxCNC's braking as read in 2.9.5: a straight move accelerates as the slowest of
 * its axes lets it (task/emccanon.cc, getStraightAcceleration); one that blends with its
 * neighbour by a parabola with half of that (tp/tc.c). A traverse is blended with traverses only: between
 * one and a feed the planner stops (tp/tp.c, handleModeChange).
 *
 * Principle:
 *  1. A traverse is a straight line. A probe runs ahead of the tool on it and cuts copies of the
 *     cells, as the sweep would (cw_sweep_meets). What the tool has cut itself is nested in what
 *     it would cut again and so is no stock: walls of its own slot are seen exactly, not as
 *     interpolated heights. A strip narrower than CW_GUARD_STRIP cells is none (over a step of the probe:
 *     nor is the edge of a block touched by little more than a cell), nor is so thin
 *     a layer at the end of the segment: a blend has left it there.
 *  2. The probe keeps ahead by the braking distance, with a bound on its work.
 *  3. Stock before the end of the segment is certain to be met: the traverse has to be stopped
 *     from the braking distance at half the acceleration on. The tool then stands before it.
 *  4. Behind the end of the segment the program may stop or turn before. There the traverse is
 *     stopped only when it should be braking and is not, or brakes too little. How much it brakes is
 *     known when that has stopped growing: the planner begins amid a period, and a step tells the mean of two
 *     velocities, so two periods show less. Where the way to go is not known it is stopped when it is at the
 *     braking distance and not braking.
 *  5. In a blend the way bends, or the way to go falls by something else than the step, because it is that
 *     of one segment of the two: no line is seen. What is ahead is then known from the planner only:
 *     a. An arc between two traverses, and what follows it without a stop, is probed along the program's
 *        way (way.h). What stands in a traverse of it is certain to be met [3].
 *     b. A parabola is the line of the next traverse with an offset that vanishes (struct cw_guard_bend); only
 *        what is gone on that line is still to be stopped, at half the acceleration. The first segment brakes anyway.
 *     Where the planner cannot be read a blend is not judged; the line after it is.
 *     c. A tool that has gone on past the place where stock was met (the operator let it) is probed for anew from where it
 *        is: in the stock that is met again at once, behind it the next one counts.
 *  6. The shank is a cylinder that begins where the flutes end. It must meet nothing on a feed.
 */
#ifndef CHIPWISE_GUARD_H
#define CHIPWISE_GUARD_H

#include "sweep.h"
#include "way.h"

#define CW_GUARD_STRIP 0.5      /* cells, width of a strip of stock that is taken for none */

struct cw_guard_in {
    double from[3], to[3];      /* mm, tips of the last period and this one */
    double period;              /* s */
    double accel;               /* mm/s2, the least in any direction; not above 0: unknown */
    double axis_accel[3];       /* mm/s2 of X, Y, Z; not above 0: only `accel` is known */
    double jerk;                /* mm/s3 of a planner that bounds it; not above 0: it does not */
    double to_go;               /* mm to the end of the segment, not above 0: unknown */
    int trail;                  /* the tool has cut all over at `to`; 0: the map lags behind the tool */
    const struct cw_way *way;   /* the program's own way ahead; null: not known */
};

/* What a probe has found; mm on its line or way. */
struct cw_guard_probe {
    double clear;               /* free up to here */
    double hit_near, hit_far;   /* between these stock begins; hit_far < hit_near: none found */
};

/* A parabolic blend into the line [5b], as it was at one moment. */
struct cw_guard_bend {
    int on;
    double from, end;           /* mm on the line, then and at the end of the blend */
    double off[3];              /* mm, the tool beside its place on the line, then */
    double speed, rise, time;   /* mm/s on the line, then; mm/s it rises by in the time (s) of the blend left */
};

struct cw_guard {
    double origin[3], dir[3];   /* mm, the line the tool is on */
    double gone;                /* mm travelled on it */
    struct cw_guard_probe line; /* on it */
    struct cw_guard_bend bend;
    struct cw_guard_probe course;       /* on the program's way [5a] */
    double place;               /* mm, of the tool on that way in the last period */
    int periods;                /* on this line */
    double to_go;               /* mm, of the last period */
    double speed, slowing, slowing_before;      /* mm/s; mm/s2 of the last two periods */
    double distance;            /* mm to the stock a traverse will meet; 0: none found */
    struct cw_tool shank;
    int excess;                 /* the last verdict of cw_guard_shank */
};

void cw_guard_reset(struct cw_guard *guard);

/* Forgets the line only: the tool is on no traverse. */
void cw_guard_reset_line(struct cw_guard *guard);

/* 1 when the traverse on which the tool is has to be stopped. The probe goes on until `*work`, which
 * it increases (cw_sweep_run), reaches `bound`. */
int cw_guard_traverse(struct cw_guard *guard, const struct cw_stock *stock,
                      const struct cw_tool *tool, const struct cw_guard_in *in, long bound, long *work);

/* 1 when the step cuts stock above the flutes. Call it before the step is cut; `trail`: the tool
 * has cut all over at `from`; `*work` is increased. */
int cw_guard_shank(struct cw_guard *guard, const struct cw_stock *stock,
                   const struct cw_tool *tool, const double from[3], const double to[3], int trail,
                   long *work);

#endif
