/* SPDX-License-Identifier: GPL-2.0-or-later */
/* linuxcnc_planner.h - reads the programmed path from LinuxCNC's motion planner.
 *
 * Who calls it: stock_tracker.comp, once per servo period, before the core.
 * Source: LinuxCNC src/emc/motion/motion.h, src/emc/tp/{tp_types,tc_types,tcq}.h, read in
 * 2.9.0~pre1, 2.9.4, 2.9.5, 2.9.10 and master (2026-08): the planner's state is the last member of the
 * block of shared memory that motion makes; its queue lies in the memory of rtapi_app, the process of
 * this component.
 *
 * These structures are not a public interface. They come from the headers
 * of the LinuxCNC this was compiled against. Therefore:
 *  1. They are only read, never written. The block is attached read-only, and only if motion has it: it belongs to us,
 *     nobody else may write it, and this process has mapped it for writing already. A block left behind by a killed
 *     LinuxCNC, or
 *     made by another program, holds addresses that are meaningless here.
 *  2. Nothing is used before it has been checked: motion-controller has run since the last period (its heartbeat;
 *     if motion has been unloaded its queue is gone), the queue's size, its counts, the planner's cycle
 *     time, and the planner's position, which must be the axes' to 0.001 units.
 *  3. If a check fails, the path is unknown in this period and the core predicts it.
 *  4. A block is ours if its owner and its creator are root or the user of this LinuxCNC and nobody else has rights.
 *     The rtapi_app of Debian's package is setuid root: it makes the user the saved uid, itself root, creates blocks as root
 *     and gives them to the user (2.9: uspace_common.h, uspace_rtapi_app.cc; read to master of 2026-08). Without setuid, and for
 *     blocks that milltask makes (2.10), the creator is the user.
 *  5. In a parabolic blend motion.current-vel is the sum of the velocities on two segments, each of which keeps to the
 *     override (tp/tp.c, tpUpdateBlend, tpDoParabolicBlending). So the smaller one of the two, and the weaker braking of
 *     the two segments, are read for the watchdog.
 */
#ifndef CHIPWISE_LINUXCNC_PLANNER_H
#define CHIPWISE_LINUXCNC_PLANNER_H

#include <stdint.h>

struct chip_path;
struct chip_tracker_in;
struct emcmot_internal_t;
struct shmid_ds;

struct chip_planner {
    const struct emcmot_internal_t *motion; /* null: not attached */
    int item, part;                         /* slot of the queue and part of it to be read next */
    int tentative;                          /* parts at the path's end that are read again in every period */
    int looked, runs;                       /* a heartbeat of motion is known; it has changed since the last period */
    uint64_t last_beat;
    double
        blend_vel_mu_s;   /* velocity on the slower segment of a parabolic blend; 0: none, or the path is unknown [5] */
    double braking_mu_s2; /* least acceleration the planner brakes with now, machine units/s2; 0: the path is unknown */
    int last_command;     /* number of the last command that motion has carried out */
};

/* Whether a block of shared memory is ours alone: owner, creator, rights [4]. */
int chip_planner_ours(const struct shmid_ds *about);

/* Attaches motion's memory [1]; called while loading, not in realtime. */
void chip_planner_attach(struct chip_planner *planner);

/* Whether motion got the command to abort (stop, E-stop, error of a program) since the last call, once a servo period: motion
 * carries out one command per period and says which. */
int chip_planner_aborted(struct chip_planner *planner);

/* Follows the planner's queue up to `horizon` mm ahead: `path` is known afterwards, or not [3]; reads the pace [5]. */
void chip_planner_follow(struct chip_planner *planner, const struct chip_tracker_in *in, double horizon,
                         struct chip_path *path);

#endif
