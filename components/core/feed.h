/* SPDX-License-Identifier: GPL-2.0-or-later */
/* feed.h - the feed law: how fast the tool may go, given the load it meets.
 *
 * Who calls it: volumetric_feed.comp, once per servo period.
 * Source: JP3131045 [0008], F = UQ x LC / VC, here F = Q / A with the section area A = VC / LC;
 * [0013]: a range UQ1..UQ2 instead of one value (mode 3). A removal rate for each tool is ours.
 * Chip thickness: h(phi) = fz sin phi over the arc of engagement (M. E. Martellotti, An Analysis of
 * the Milling Process, Trans. ASME 63, 1941; Y. Altintas, Manufacturing Automation, 2nd ed. 2012,
 * ch. 2, gives the mean over the arc). Tool makers use its limit for light cuts, fz sqrt(ae / D).
 *
 * Principle:
 *  1. At the tool: v <= Q / A. Q is the smaller of the program's and the tool's removal rate.
 *  2. Ahead: v^2 <= (Q / A_i)^2 + 2 a d_i for every area A_i at the distance d_i, so that
 *     braking ends where the load begins. `a` is the acceleration the planner can brake with until there
 *     (on a blended arc only a quarter of its acceleration) if the tracker knows it; otherwise half the
 *     acceleration, which is what a blended line gets. d_i is shortened by the distance
 *     travelled before the override takes effect.
 *  3. The mode chooses between what the program asked for and what 1 and 2 allow.
 *  4. The result is a factor on the requested velocity in [0, 1], finite for any input.
 *     Invalid inputs leave the programmed feed; feed_hold.h bounds it where the load was known before.
 *  5. While cutting, v stays between a minimum and a maximum velocity, each also available as a share of F;
 *     the downward part of v stays below the plunge velocity. In air (modes 2, 3) v has a velocity of its own.
 *     If a limit of the cut applies ahead, 2 brakes to it.
 *  6. Mean chip thickness, if a bound is set: with the engagement e = A / (depth x D) the arc is
 *     phi = acos(1 - 2 e) and h = fz 2 e / phi, fz = v / (n z); so v <= h n z phi / (2 e). Departs
 *     from the source: e comes from area and depth, so a stepped stock reads as a lighter cut than
 *     its deepest part. An unknown e is treated as the one with the thickest mean chip.
 *  7. Easing: a drop passes at once. A rise is held back until it exceeds the deadband, and then
 *     climbs at a bounded acceleration. The result never exceeds what the law allows.
 *  8. A probing move must run at F, not at the ceiling that replaces it: it gets an override of its own.
 *  9. The operator's override k is a factor on all of it, as on any feed: the target is k Q, the velocity k times
 *     the commanded one. Only braking does not scale with it: 2 becomes (k v)^2 <= (k Q / A_i)^2 + 2 a d_i.
 * 10. A planner that limits the jerk to J needs more distance: from v1 down to v2 it travels (v1^2 - v2^2) / 2a
 *     + (v1 + v2) a / 2J or, if the change is less than a^2 / J, (v1 + v2) sqrt((v1 - v2) / J). A tool that
 *     accelerates at g gains another g^2 / 2J in the time g / J before it can begin to brake.
 * 11. The feed may end (E-stop, abort) while LinuxCNC still uses the ceiling in place of F, and a program without
 *     an F word would continue at the ceiling. While the requested velocity is above F, the override is F over the
 *     requested velocity.
 * 12. If moves down keep F (a job), the tool goes down at F at most, and brakes before: as 2 with F in place of
 *     Q / A_i, and shorter by F^2 / 2a, since a parabolic blend begins that much before the corner.
 * 13. A cutting edge, the tool and the spindle have limits of their own: largest chip, side force, power, torque (tooth_law.h). They bound the feed per tooth,
 *     here and ahead as 2 does; the operator's override raises none of them.
 * 14. A set-up may leave feeds above the stock to the axes: the requested velocity is what they allow. Where the path comes down the
 *     tracker says how fast the tool may be there, its own F if it falls and `ceiling` times that otherwise (path_pace.h): it brakes to it as in 12.
 *     If that is not known it is at most `ceiling` times F, and F down, wherever it is.
 * 15. In modes 2 and 3 a target of 0 leaves the velocity to the limits of 13, and the tool's own rate if it has one. They have to be
 *     known, and the tracker has to give a tooth load where it meets stock; otherwise the feed is F.
 */
#ifndef CHIPWISE_FEED_H
#define CHIPWISE_FEED_H

#include "motion_kind.h"

enum chip_feed_mode { CHIP_FEED_OFF = 0, CHIP_FEED_LIMIT = 1, CHIP_FEED_CONSTANT = 2, CHIP_FEED_WINDOW = 3 };

enum chip_limited_by {
    CHIP_LIMIT_NONE = 0,
    CHIP_LIMIT_STOCK_HERE = 1,
    CHIP_LIMIT_STOCK_AHEAD = 2,
    CHIP_LIMIT_FLOOR = 3,
    CHIP_LIMIT_CEILING = 4,
    CHIP_LIMIT_FALLBACK = 5,
    CHIP_LIMIT_CHIP = 6, /* limits of the tooth [13] */
    CHIP_LIMIT_POWER = 7,
    CHIP_LIMIT_TORQUE = 8,
    CHIP_LIMIT_FORCE = 9
};

#define CHIP_FEED_LOAD_STEPS 8 /* load steps, as in CHIP_LOAD_STEPS */

/* Members carry the name of the pin they come from and their unit. A limit of 0 is off; NaN and infinite settings
 * are treated as 0. */
struct chip_feed_in {
    int feed_mode; /* chip_feed_mode; any other value is off */
    double mrr_target_mm3_s, mrr_lower_mm3_s;
    double programmed_vel_mm_s; /* F of the program; not positive: the same as requested_vel_mm_s */
    double requested_vel_mm_s;  /* the velocity the override multiplies */
    int motion;                 /* motion.motion-type */
    double acceleration_mm_s2;  /* of the planner */
    double min_vel_mm_s;        /* the stock never slows the tool below this, nor below F if F is less */
    double period_s;
    int is_trusted;                                /* the areas can be trusted: tracker ready and without fault */
    double section_area_mm2;                       /* at the tool */
    double load_distance_mm[CHIP_FEED_LOAD_STEPS]; /* until load_area_mm2 applies */
    double load_area_mm2[CHIP_FEED_LOAD_STEPS];    /* not positive: unused */
    double load_accel_mm_s2[CHIP_FEED_LOAD_STEPS]; /* braking the planner can use until there; 0: unknown */
    double tool_max_rate_mm3_s;                    /* removal rate the tool permits; 0: unknown [1] */
    double max_vel_mm_s;                           /* never faster while cutting [5] */
    double min_scale_of_f, max_scale_of_f;         /* min_vel_mm_s and max_vel_mm_s as shares of F */
    double air_vel_mm_s;                           /* velocity outside the stock [5] */
    double plunge_vel_mm_s;                        /* largest downward part of the velocity while cutting [5] */
    double dir_z;                                  /* vertical part of the unit direction, -1..1 */
    int keeps_f_down;                              /* moves that go down are at most as fast as F [12] */
    double descent_mm;                             /* of travel until one begins; negative: none in sight */
    double descent_accel_mm_s2;                    /* mean braking the planner can use until there; 0: unknown */
    int is_air_free;                               /* feeds above the stock are as fast as the axes [14] */
    double ceiling_of_f;                           /* times F, elsewhere; below 1: 1 */
    double pace_mm; /* of travel until pace_vel_mm_s applies; -1: none in sight, -2: unknown (path_pace.h) */
    double pace_vel_mm_s;
    double pace_accel_mm_s2;      /* mean braking the planner can use until there; 0: unknown */
    double max_chip_thickness_mm; /* bound of the mean chip thickness [6] */
    double flutes;                /* cutting edges z */
    double spindle_speed_rps;     /* 1/s, spindle speed n, either sign */
    double tool_diameter_mm;      /* D */
    double depth_mm;              /* depth of cut; 0: unknown */
    double feed_override_share;   /* the operator's feed override, 1 = 100 %; not positive: unknown, 1 [9] */
    double max_jerk_mm_s3;        /* of the planner; 0: not limited [10] */
    double current_vel_mm_s;      /* velocity of the tool now [10] */
    double current_accel_mm_s2;   /* its rate of change; not positive: the tool does not accelerate [10] */
    /* the tooth load ahead, and which chip_tooth_limit has made it, as the areas are [13] */
    double tooth_distance_mm[CHIP_FEED_LOAD_STEPS]; /* until tooth_load_per_mm applies */
    double tooth_load_per_mm[CHIP_FEED_LOAD_STEPS]; /* not positive: unused */
    double tooth_accel_mm_s2[CHIP_FEED_LOAD_STEPS]; /* braking the planner can use until there; 0: unknown */
    int tooth_limit[CHIP_FEED_LOAD_STEPS];
    double chip_share_now, power_root_now;          /* at the tool: chip over feed per tooth; A_mc^(1 / (1 - mc)) */
    double force_root_now, force_mean_share_now;    /* side force^(1 / (1 - mc)); its mean over the largest one */
    double max_chip_mm, max_power_w, max_torque_nm; /* the limits; 0: none */
    double max_force_n, tool_stiffness_n_mm;        /* of the side force; 0: none, not known */
    double specific_force_n_mm2, force_exponent_mc; /* kc11 and mc of the material; 0 and any: unknown */
    int is_load_measured; /* the power is to be predicted without a limit of it, too (spindle_load.h) */
    double min_chip_mm;   /* a smaller chip is rubbed, not cut (run_sums.h); 0: unknown */
};

struct chip_feed_out {
    double scale; /* factor on the requested velocity, [0, 1] */
    int limit;    /* chip_limited_by */
};

struct chip_feed_easing {
    double ramp_mm_s;  /* velocity the climb has reached */
    double given_mm_s; /* velocity of the last output */
    int is_begun;      /* both are valid */
};

/* Whether the mode is one of 1, 2, 3. */
static inline int chip_feed_is_on(int feed_mode)
{
    return feed_mode >= CHIP_FEED_LIMIT && feed_mode <= CHIP_FEED_WINDOW;
}

static inline struct chip_feed_out chip_feed_result(double scale, int limit)
{
    struct chip_feed_out out;
    out.scale = scale;
    out.limit = limit;
    return out;
}

/* Whether the override must hold the machine: the feed is on, or a ceiling is left over from it [11]. */
int chip_feed_replaces(int feed_mode, double programmed_vel_mm_s, double requested_vel_mm_s);

/* The effective removal rate, mm3/s [1]; 0 if there is none [15]. */
double chip_feed_target(const struct chip_feed_in *in);

/* The law [1]..[6]. `last_scale`: the scale of the last period. */
struct chip_feed_out chip_feed(const struct chip_feed_in *in, double last_scale);

/* [7] `law`: the result of chip_feed; `recover`: mm/s2, 0: at once; `deadband`: relative, 0..1. */
struct chip_feed_out chip_feed_ease(struct chip_feed_easing *easing, const struct chip_feed_in *in,
                                    struct chip_feed_out law, double recover, double deadband);

/* The override sent to the machine: `scale`, but F over the requested velocity while probing [8] and while a
 * ceiling is left over [11]. */
double chip_feed_override(const struct chip_feed_in *in, double scale);

#endif
