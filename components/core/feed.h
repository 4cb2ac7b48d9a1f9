/* feed.h - the feed law: how fast may the tool go, given what it meets.
 *
 * Who calls it: volumetric_feed.comp, once per servo period.
 * Source: JP3131045 [0008], F = UQ x LC / VC, here F = Q / A with the section area A = VC / LC;
 * [0013]: a range UQ1..UQ2 instead of one value (mode 3).
 *
 * Principle:
 *  1. At the tool: v <= Q / A.
 *  2. Ahead: v^2 <= (Q / A_i)^2 + 2 a d_i for every area A_i at the distance d_i, so that
 *     braking ends where the load begins. `a` is half the planner's acceleration, because
 *     LinuxCNC gives a segment that blends only that half; d_i is shortened by the way
 *     gone before the override takes effect.
 *  3. The mode chooses between what the program asked for and what 1 and 2 allow.
 *  4. The result is a factor on the requested velocity in [0, 1], finite whatever comes in;
 *     whatever cannot be judged leaves the programmed feed.
 */
#ifndef CHIPWISE_FEED_H
#define CHIPWISE_FEED_H

enum cw_feed_mode { CW_FEED_OFF = 0, CW_FEED_LIMIT = 1, CW_FEED_CONSTANT = 2, CW_FEED_WINDOW = 3 };

enum cw_limited_by {
    CW_BY_NOTHING = 0, CW_BY_STOCK_HERE = 1, CW_BY_STOCK_AHEAD = 2, CW_BY_FLOOR = 3,
    CW_BY_CEILING = 4, CW_BY_FALLBACK = 5
};

#define CW_MOTION_FEED 2        /* motion.motion-type */
#define CW_MOTION_ARC 3
#define CW_FEED_LEVELS 8        /* places ahead */

struct cw_feed_in {
    int kind;                   /* cw_feed_mode; anything else is off */
    double target, lower;       /* mm3/s */
    double programmed;          /* mm/s, F of the program; not positive: the same as requested */
    double requested;           /* mm/s, what the override is a factor of */
    int motion;                 /* motion.motion-type */
    double accel;               /* mm/s2, of the planner */
    double floor;               /* mm/s, never slower than this for the stock's sake */
    double dt;                  /* s */
    int trusted;                /* the areas can be trusted */
    double area;                /* mm2, at the tool */
    double next_distance[CW_FEED_LEVELS], next_area[CW_FEED_LEVELS];    /* mm, mm2; area <= 0: none */
};

struct cw_feed_out {
    double scale;               /* of the requested velocity, [0, 1] */
    int by;                     /* cw_limited_by */
};

/* `last_scale`: the scale given in the period before. */
struct cw_feed_out cw_feed(const struct cw_feed_in *in, double last_scale);

#endif
