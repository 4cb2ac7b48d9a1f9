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
 *  2. Nothing is used before it has been checked in the same period: the heartbeat and the pins [7], the queue's place
 *     and size, its counts, the planner's cycle time, the planner's position, which must be the axes' to 0.001 units, and
 *     the segments [8].
 *  3. If a check fails, the path is unknown in this period and the core predicts it. `refusal` names the check.
 *  4. A block is ours if its owner and its creator are root or the user of this LinuxCNC and nobody else has rights.
 *     The rtapi_app of Debian's package is setuid root: it makes the user the saved uid, itself root, creates blocks as root
 *     and gives them to the user (2.9: uspace_common.h, uspace_rtapi_app.cc; read to master of 2026-08). Without setuid, and for
 *     blocks that milltask makes (2.10), the creator is the user.
 *  5. In a parabolic blend motion.current-vel is the sum of the velocities on two segments, each of which keeps to the
 *     override (tp/tp.c, tpUpdateBlend, tpDoParabolicBlending). So the smaller one of the two, and the weaker braking of
 *     the two segments, are read for the watchdog.
 *  6. The queue has to lie in memory that this process may write, all of it, and stays where it was while loading: no address
 *     that is read in a period leads anywhere else, whatever it says.
 *  7. Another version's structures have other members, and then everything lies elsewhere. The status is found from the end
 *     of the block, as the planner is. Its heartbeat has to count one a period (if motion has been unloaded, its queue is
 *     gone), and its kind of motion and distance to go have to be those of motion's pins.
 *  8. The first segment at its own progress leads through the planner's position to 0.001 units, every segment begins
 *     where the one before ends, and all that is read of it is plausible: so the segments' size and members fit as well.
 *  9. While a ceiling is in the place of F, the program's F goes out on an analog output that changes with a segment (M67). The segments in the queue
 *     hold what they will set, so F is known along the path ahead; at its beginning it is what the output shows.
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
    const void *queue;                      /* where its queue lies [6] */
    int refused, refusal;                   /* chip_path_refusal while loading, and of the last period */
    int item, part;                         /* slot of the queue and part of it to be read next */
    int tentative;                          /* parts at the path's end that are read again in every period */
    int looked, runs;                       /* a heartbeat of motion is known; it has changed since the last period */
    uint64_t last_beat;
    int last_kind;              /* of motion, in the last period */
    int last_canon, last_start; /* kind and slot of the queue's first segment in the last period */
    double last_to_go;          /* machine units, of motion in the last period */
    double end_mu[3];           /* machine units, where the last segment that has been read for good ends */
    double feed_mu_s;           /* machine units/s, F of the program there; 0: not replaced, or unknown [9] */
    double
        blend_vel_mu_s;   /* velocity on the slower segment of a parabolic blend; 0: none, or the path is unknown [5] */
    double braking_mu_s2; /* least acceleration the planner brakes with now, machine units/s2; 0: the path is unknown */
    int last_command;     /* number of the last command that motion has carried out */
};

/* Whether a block of shared memory is ours alone: owner, creator, rights [4]. */
int chip_planner_ours(const struct shmid_ds *about);

/* Attaches motion's memory [1]; called while loading, not in realtime. */
void chip_planner_attach(struct chip_planner *planner);

/* Whether motion got the command to abort (stop, E-stop, error of a program) since the last call, once a servo period and before
 * chip_planner_follow: motion carries out one command per period and says which. Looks at the heartbeat [7]. */
int chip_planner_aborted(struct chip_planner *planner);

/* The path is not to be read in this period. */
void chip_planner_unread(struct chip_planner *planner, struct chip_path *path);

/* Follows the planner's queue up to `horizon` mm ahead: `path` is known afterwards, or not [3]; reads the pace [5]. */
void chip_planner_follow(struct chip_planner *planner, const struct chip_tracker_in *in, double horizon,
                         struct chip_path *path);

#endif
