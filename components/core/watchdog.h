/* SPDX-License-Identifier: GPL-2.0-or-later */
/* watchdog.h - detects that the machine ignores the override. After M52 P0 LinuxCNC ignores motion.adaptive-feed;
 * while a ceiling replaces F the machine would run into the stock at the ceiling.
 *
 * Who calls it: volumetric_feed.comp, once per servo period, after the feed law.
 * Source: LinuxCNC 2.9.0~pre1, motion/control.c process_inputs() (which overrides act),
 * tp/tp.c tpGetFeedScale() (none in moves synchronised with the spindle's position). No HAL
 * pin says whether adaptive feed is enabled, so the watchdog checks the velocity.
 *
 * Principle:
 *  1. The watchdog checks feed moves, arcs and probing moves while the requested velocity is a ceiling above F.
 *  2. These velocities are explained: the override times the requested velocity, or F, times the largest feed
 *     override the operator may set; the velocity before, falling at a quarter of the
 *     planner's acceleration, or at what the planner brakes with on the segments the tool is on, if that is less (half of
 *     its acceleration in a parabolic blend, half of that on an arc, less what a bend in the path takes of it: tp/tc.c,
 *     tcGetTangentialMaxAccel); and CHIP_WATCHDOG_SLACK. If the planner
 *     limits the jerk to J, the velocity falls only after a / J, the time in which braking builds up, and a
 *     machine that was still accelerating may gain a^2 / 2J.
 *     In a parabolic blend the tool is on two segments at once, and the velocity is the sum of both
 *     (linuxcnc_planner.h, 5). Each of them keeps to the override, so the faster one is checked: the sum may be up to
 *     twice what the override allows.
 *  3. A velocity that stays unexplained for CHIP_WATCHDOG_PERIODS periods means that the override is ignored. So
 *     does the report of a program that has read LinuxCNC's status.
 *  4. The result is kept until nothing moves any more (motion type 0: the program was aborted) or the
 *     feed is switched off. The inhibit that follows from it stops the machine, and releasing it
 *     then would start the machine again.
 *  5. From the wait for the spindle's index on a move follows the spindle (G33, G33.1, G76). It is
 *     not checked until another kind of move begins or the machine rests for CHIP_WATCHDOG_REST_S.
 */
#ifndef CHIPWISE_WATCHDOG_H
#define CHIPWISE_WATCHDOG_H

/* Members carry the name of the pin they come from and their unit. */
struct chip_watchdog_in {
    int feed_mode;              /* chip_feed_mode */
    int motion;                 /* motion.motion-type */
    double programmed_vel_mm_s; /* F; not positive: no ceiling is in force */
    double requested_vel_mm_s;
    double override_share;     /* the override given in this period */
    double current_vel_mm_s;   /* motion.current-vel */
    double blend_vel_mm_s;     /* of it on the slower segment of a parabolic blend; 0: none, or unknown [2] */
    double braking_mm_s2;      /* least acceleration the planner brakes with now; 0: unknown [2] */
    double acceleration_mm_s2; /* of the planner */
    double max_override_share; /* largest feed override of the operator; below 1: 1 */
    double period_s;
    double max_jerk_mm_s3; /* of the planner; 0: not limited [2] */
    int is_index_enabled;  /* a move waits for the spindle's index */
    int is_adaptive_off;   /* LinuxCNC's status says that adaptive feed is disabled */
};

struct chip_watchdog {
    double explained_mm_s; /* [2] */
    double at_rest_s;      /* time at rest */
    int periods_above;     /* periods the velocity has been unexplained */
    double faster_s;       /* time the machine has been faster than the override allows */
    int is_synchronised;   /* the move follows the spindle */
    int override_ignored;  /* [3] [4] */
};

/* One period; returns override_ignored. */
int chip_watchdog_step(struct chip_watchdog *watchdog, const struct chip_watchdog_in *in);

#endif
