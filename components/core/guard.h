/* SPDX-License-Identifier: GPL-2.0-or-later */
/* guard.h - will this traverse meet stock, and does the shank meet it already?
 *
 * Who calls it: tracker.c, once per servo period, after the tool has cut its step.
 * Source: none. LinuxCNC's braking as read in 2.9.5: a straight move accelerates as the slowest of
 * its axes permits (task/emccanon.cc, getStraightAcceleration); one that blends with its
 * neighbour by a parabola with half of that (tp/tc.c). A traverse is blended with traverses only: between
 * a traverse and a feed move the planner stops (tp/tp.c, handleModeChange).
 *
 * Principle:
 *  1. A traverse is a straight line. A probe runs ahead of the tool on it and cuts copies of the
 *     cells, as the sweep would (chip_sweep_meets). What the tool has cut itself is nested in what
 *     it would cut again and therefore does not count: walls of its own slot are seen exactly, not as
 *     interpolated heights. A strip narrower than CHIP_GUARD_STRIP cells or CHIP_GUARD_STRIP_MM is ignored (over a step of the probe:
 *     so is the edge of a block touched by little more than a cell), and so is as thin
 *     a layer at the end of the segment: a blend has left it there.
 *  2. The probe stays ahead by the braking distance, with a bound on its work.
 *  3. Stock before the end of the segment is certain to be met: the traverse must be stopped
 *     at the braking distance for half the acceleration. The tool then stops before the stock.
 *  4. Behind the end of the segment the program may stop or turn before the stock. There the traverse is
 *     stopped only if it should be braking and is not, or brakes too little. The deceleration is
 *     known when it has stopped growing: the planner begins within a period, and a step gives the mean of two
 *     velocities, so two periods show less. If the distance to go is unknown the traverse is stopped at the
 *     braking distance unless it is braking.
 *     Under a jerk limit braking grows slowly and says little about where it ends: the traverse is stopped where
 *     the planner cannot stop any more.
 *  5. In a blend the path bends, or the distance to go does not fall by the step, because it belongs to
 *     one of the two segments: no line is seen. Only the planner then knows what is ahead:
 *     a. An arc between two traverses, and what follows it without a stop, is probed along the programmed
 *        path (path.h). Stock in a traverse of it is certain to be met [3].
 *     b. A parabola is the line of the next traverse with an offset that vanishes (struct chip_guard_blend); only
 *        the travel on that line still has to be stopped, at half the acceleration. The first segment brakes anyway.
 *     If the planner cannot be read a blend is not checked; the line after it is.
 *     c. A tool that has gone on past the point where stock was met (the operator released it) is probed for anew from
 *        its position: inside the stock that is met again at once, behind it the next stock counts.
 *  6. The shank is a cylinder that begins where the flutes end. It must not meet stock on a feed move.
 */
#ifndef CHIPWISE_GUARD_H
#define CHIPWISE_GUARD_H

#include "sweep.h"
#include "path.h"

/* cells, width of a strip of stock that is ignored; smaller stops at what a blend has left of
 * the stock, larger lets the traverse into thin walls. */
#define CHIP_GUARD_STRIP 0.5
#define CHIP_GUARD_STRIP_MM 0.125 /* mm, its width at least, whatever the cells: a blend leaves as much */

/* Members carry the name of the pin they come from and their unit. */
struct chip_guard_in {
    double from[3], to[3]; /* mm, tips of the last period and this one */
    double period_s;
    double acceleration_mm_s2;         /* the least in any direction; not positive: unknown */
    double axis_acceleration_mm_s2[3]; /* of X, Y, Z; not positive: only acceleration_mm_s2 is known */
    double max_jerk_mm_s3;             /* of a jerk-limited planner; not positive: not limited */
    double distance_to_go_mm;          /* to the end of the segment; not positive: unknown */
    int start_is_cut;                  /* the map has all that feeds have cut; 0: it lags behind the tool */
    const struct chip_path *path;      /* the programmed path ahead; null: unknown */
};

/* Result of a probe; mm on its line or path. */
struct chip_guard_probe {
    double clear;             /* free up to here */
    double hit_near, hit_far; /* between these stock begins; hit_far < hit_near: none found */
};

/* A parabolic blend into the line [5b], as it was at one moment. */
struct chip_guard_blend {
    int active;
    double from, end;         /* mm on the line, then and at the end of the blend */
    double offset[3];         /* mm, the tool's offset from its point on the line, then */
    double speed, rise, time; /* mm/s on the line, then; mm/s it rises by in the time (s) left of the blend */
};

struct chip_guard {
    double origin[3], dir[3]; /* mm, the line the tool is on; unit vector */
    double travelled;         /* mm travelled on it */
    struct chip_guard_probe on_line;
    struct chip_guard_blend blend;
    struct chip_guard_probe on_path;       /* on the programmed path [5a] */
    double path_s;                         /* mm, position of the tool on that path in the last period */
    int periods;                           /* on this line */
    double distance_to_go;                 /* mm, of the last period */
    double speed, slowing, slowing_before; /* mm/s; mm/s2 of the last two periods */
    double distance;                       /* mm to the stock a traverse will meet; 0: none found */
    struct chip_tool shank;
    int excess; /* the last result of chip_guard_shank */
};

void chip_guard_reset(struct chip_guard *guard);

/* Clears the line only: the tool is not on a traverse. */
void chip_guard_reset_line(struct chip_guard *guard);

/* 1 if the tool's traverse has to be stopped. The probe goes on until `*work`, which
 * it increases (chip_sweep_run), reaches `bound`. */
int chip_guard_traverse(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                        const struct chip_guard_in *in, long bound, long *work);

/* 1 if the step cuts stock above the flutes. Call it before the step is cut; `start_is_cut`: the tool
 * has cut all round at `from`; `*work` is increased. */
int chip_guard_shank(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                     const double from[3], const double to[3], int start_is_cut, long *work);

#endif
