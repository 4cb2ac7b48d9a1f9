/* feed.h - the feed law: how fast may the tool go, given what it meets.
 *
 * Who calls it: volumetric_feed.comp, once per servo period.
 * Source: JP3131045 [0008], F = UQ x LC / VC, here F = Q / A with the section area A = VC / LC;
 * [0013]: a range UQ1..UQ2 instead of one value (mode 3). A rate of its own for each tool is ours.
 * Chip thickness: h(phi) = fz sin phi over the arc of engagement (M. E. Martellotti, An Analysis of
 * the Milling Process, Trans. ASME 63, 1941; Y. Altintas, Manufacturing Automation, 2nd ed. 2012,
 * ch. 2, has the mean over the arc); tool makers write its limit for light cuts, fz sqrt(ae / D).
 *
 * Principle:
 *  1. At the tool: v <= Q / A. Q is the smaller of what the program sets and the tool stands.
 *  2. Ahead: v^2 <= (Q / A_i)^2 + 2 a d_i for every area A_i at the distance d_i, so that
 *     braking ends where the load begins. `a` is what the planner can brake with until there
 *     (on an arc that blends only a quarter of its acceleration), where the tracker knows
 *     it; else half the acceleration, which is what a line that blends gets. d_i is
 *     shortened by the way gone before the override takes effect.
 *  3. The mode chooses between what the program asked for and what 1 and 2 allow.
 *  4. The result is a factor on the requested velocity in [0, 1], finite whatever comes in;
 *     whatever cannot be judged leaves the programmed feed.
 *  5. While cutting, v stays between a lowest and a highest velocity, both also as a share of F;
 *     its downward part below a plunge velocity. In air (modes 2, 3) v is a velocity of its own.
 *     Where a limit of the cut holds ahead, 2 brakes to it.
 *  6. Mean chip thickness, where a bound is set: with the engagement e = A / (depth x D) the arc is
 *     phi = acos(1 - 2 e) and h = fz 2 e / phi, fz = v / (n z); so v <= h n z phi / (2 e). Departs
 *     from the source: e comes from area and depth, so a stepped stock reads as a lighter cut than
 *     its deepest part; an unknown e counts as the one with the thickest mean chip.
 *  7. Easing: a drop passes at once; a rise is held back until it is more than the deadband, and
 *     climbs at a bounded acceleration. What comes out is never above what the law allows.
 *  9. The operator's override k is a factor on all of it, as on any feed: the target is k Q, the velocity k times
 *     what is told. Only braking does not grow with it: 2 is (k v)^2 <= (k Q / A_i)^2 + 2 a d_i.
 * 10. A planner that bounds the jerk to J needs more: from v1 down to v2 a way of (v1^2 - v2^2) / 2a
 *     + (v1 + v2) a / 2J, or, where that is less than a^2 / J of velocity, (v1 + v2) sqrt((v1 - v2) / J). A tool that speeds up
 *     by g gains g^2 / 2J more in the time g / J until it can begin to brake.
 *  8. A probing move must go at F, not at the ceiling in its place: it gets an override of its own.
 *  9. The feed may end (E-stop, abort) while LinuxCNC still has the ceiling in the place of F, and a program without
 *     an F word would go on with it: as long as the requested velocity is above F, the machine is given F over the requested velocity.
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
#define CW_MOTION_PROBING 5
#define CW_FEED_LEVELS 8        /* places ahead */

/* Numbers that switch a limit off are 0; a setting that is no number counts as 0. */
struct cw_feed_in {
    int kind;                   /* cw_feed_mode; anything else is off */
    double target, lower;       /* mm3/s */
    double programmed;          /* mm/s, F of the program; not positive: the same as requested */
    double requested;           /* mm/s, what the override is a factor of */
    int motion;                 /* motion.motion-type */
    double accel;               /* mm/s2, of the planner */
    double floor;               /* mm/s, never slower than this for the stock's sake, F at most */
    double dt;                  /* s */
    int trusted;                /* the areas can be trusted */
    double area;                /* mm2, at the tool */
    double next_distance[CW_FEED_LEVELS], next_area[CW_FEED_LEVELS];    /* mm, mm2; area <= 0: none */
    double next_accel[CW_FEED_LEVELS];  /* mm/s2 the planner can brake with until there; 0: unknown */
    double tool_target;         /* mm3/s, what the tool stands; 0: unknown [1] */
    double most;                /* mm/s, never faster while cutting [5] */
    double floor_share, most_share;     /* the same as shares of F */
    double air;                 /* mm/s where there is no stock [5] */
    double plunge;              /* mm/s, of the downward part of the velocity while cutting [5] */
    double upward;              /* vertical part of the direction, -1..1 */
    double chip;                /* mm, bound of the mean chip thickness [6] */
    double teeth;               /* cutting edges z */
    double turns;               /* 1/s, spindle speed n, either sign */
    double tool_width;          /* mm, D */
    double stock_height;        /* mm, depth of cut; 0: unknown */
    double knob;                /* the operator's, 1: 100 %; not positive: unknown, 1 [9] */
    double jerk;                /* mm/s3 of the planner; 0: not bounded [10] */
    double speed, gain;         /* mm/s, mm/s2: how fast the tool goes now, and speeds up; gain below 0: it does not [10] */
};

struct cw_feed_out {
    double scale;               /* of the requested velocity, [0, 1] */
    int by;                     /* cw_limited_by */
};

struct cw_feed_easing {
    double ramp, held;          /* mm/s: where the climb has got to, what was given out */
    int begun;                  /* both are known */
};

/* Whether the override has to hold the machine: the feed is on, or a ceiling is left over from it [9]. */
int cw_feed_replaces(int kind, double programmed, double requested);

/* The removal rate that counts, mm3/s [1]; 0 where there is none. */
double cw_feed_target(const struct cw_feed_in *in);

/* `last_scale`: the scale given in the period before. */
struct cw_feed_out cw_feed(const struct cw_feed_in *in, double last_scale);

/* [7] `law`: what cw_feed gave; `recover`: mm/s2, 0: at once; `deadband`: relative, 0..1. */
struct cw_feed_out cw_feed_ease(struct cw_feed_easing *easing, const struct cw_feed_in *in,
                                struct cw_feed_out law, double recover, double deadband);

/* What the machine is given: `scale`, but F over the requested velocity while probing [8] and where a ceiling is
 * left over [9]. */
double cw_feed_override(const struct cw_feed_in *in, double scale);

#endif
