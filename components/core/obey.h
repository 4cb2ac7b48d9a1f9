/* obey.h - does the machine obey the override? With M52 P0 LinuxCNC ignores motion.adaptive-feed,
 * and while F is replaced by a ceiling it would run at the ceiling into the stock.
 *
 * Who calls it: volumetric_feed.comp, once per servo period, after the feed law.
 * Source: LinuxCNC 2.9.0~pre1, motion/control.c process_inputs() (which overrides act),
 * tp/tp.c tpGetFeedScale() (none in moves synchronised with the spindle's position). HAL has no
 * pin that tells whether adaptive feed is enabled, so the velocity is judged.
 *
 * Principle:
 *  1. Judged are feed moves, arcs and probing while the requested velocity is a ceiling above F.
 *  2. Explained are the override times the requested velocity, or F, times the largest feed
 *     override the operator may set; what the machine did before, falling at a quarter of the
 *     planner's acceleration (braking is never that slow: feed.h, 2); and CW_OBEY_SLACK. Where the planner
 *     bounds the jerk to J, it falls by that only from a / J on, in which time braking has built up, and a
 *     machine that was still speeding up may gain a^2 / 2J.
 *  3. A velocity that is not explained for CW_OBEY_PERIODS periods is disobedience. So is being
 *     told by somebody who has read it from LinuxCNC's status.
 *  4. It is kept until nothing moves any more (motion type 0: the program was aborted) or the
 *     feed is switched off. The inhibit that follows from it stops the machine, and letting go
 *     then would start it again.
 *  5. From the wait for the spindle's index on a move follows the spindle (G33, G33.1, G76) and is
 *     not judged, until another kind of move or CW_OBEY_REST at rest.
 */
#ifndef CHIPWISE_OBEY_H
#define CHIPWISE_OBEY_H

struct cw_obey_in {
    int kind;                   /* cw_feed_mode */
    int motion;                 /* motion.motion-type */
    double programmed;          /* mm/s, F; not positive: no ceiling is in force */
    double requested;           /* mm/s */
    double scale;               /* the override given in this period */
    double actual;              /* mm/s, motion.current-vel */
    double accel;               /* mm/s2, of the planner */
    double most_override;       /* largest feed override of the operator; below 1: 1 */
    double dt;                  /* s */
    double jerk;                /* mm/s3 of the planner; 0: not bounded [2] */
    int index;                  /* a move waits for the spindle's index */
    int told;                   /* adaptive feed is known to be disabled */
};

struct cw_obey {
    double explained;           /* mm/s */
    double at_rest;             /* s */
    int above;                  /* periods the velocity has not been explained */
    double faster;              /* s the machine has been faster than the override lets it */
    int synchronised;           /* the move follows the spindle */
    int disobeyed;
};

/* One period; -> disobeyed. */
int cw_obey_step(struct cw_obey *obey, const struct cw_obey_in *in);

#endif
