/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_load.h - the load that the spindle's inverter measures, against the power that the stock predicts.
 *
 * Who calls it: volumetric_feed.comp, once per servo period, after the limits of the tooth (tooth_law.h); bench_spindle_load.py.
 * Source: E. S. Page, Continuous Inspection Schemes, Biometrika 41, 1954, for the cumulated sum of 8; else none.
 *
 * Principle (spindle_load.c, except [5] spindle_teach.c, [7]..[11] spindle_alarm.c):
 *  1. Nothing is measured until the pin has shown a load above 0: an input that is not connected changes nothing.
 *  2. A sample that is not finite, negative or impossible is left out, and for CHIP_LOAD_REGAIN_S after it nothing is trusted. A spike
 *     counts as CHIP_LOAD_SPIKE times the load of the moment at most, or that many times the idle power: after a rest of the spindle the load
 *     of the moment is next to nothing. A sample that is the same for CHIP_LOAD_FROZEN_S is of a frozen sensor.
 *  3. What a turning spindle takes without a cut depends on its speed. It is read in air, when the load has come to rest, and kept for
 *     CHIP_LOAD_SPEEDS speeds; between two of them it lies on the line. Before the first feed at a speed LinuxCNC may not have waited for the
 *     spindle, and nothing is read. It follows slowly, so that a load in air is not learnt as idle; one that is lower at rest takes its place.
 *  4. The sensor is late by a time that nobody knows. So the prediction goes through CHIP_LOAD_LAGS delays of first order.
 *  5. Teach: for each delay the sum of squares (measured - idle - factor * predicted)^2 has a smallest value; the delay with the smallest of
 *     these, and its factor, are those of the cut. A cut that is long enough gives its factor when it is over, a longer one every
 *     CHIP_TEACH_LONGEST_S.
 *  6. Compare: the factor of the tool is given from outside. The load expected is factor * the prediction with the delay that was found,
 *     halfway down to the least of that, the one before and the next, which differ where the load rises or falls. Before one is found it
 *     allows no delay and all up to a long one. `trim` follows a gain that drifts, while the load is there.
 *  7. The comparison is trusted while tool, stock, idle power and factor are known, no sample was bad, and the load expected is well above the
 *     noise that is seen and the idle power.
 *  8. Broken: the load was there in this cut, and has fallen. The shortfall below CHIP_ALARM_SHORT of the load expected is summed over
 *     time, and reaches CHIP_ALARM_SUM_S, while the load is below CHIP_ALARM_HALF of it.
 *     A sensor that has not changed for a while has not fallen.
 *  9. Missing: in stock, and no load for CHIP_ALARM_MISSING_S. In air: a load for CHIP_ALARM_AIR_S.
 * 10. High, low: the ratio to the factor of the tool stays outside CHIP_ALARM_LOW .. CHIP_ALARM_HIGH for CHIP_ALARM_RATIO_S.
 * 11. An alarm stays until the motion is over, another tool is in the spindle, or a program starts or is aborted.
 */
#ifndef CHIPWISE_SPINDLE_LOAD_H
#define CHIPWISE_SPINDLE_LOAD_H

#define CHIP_LOAD_LAGS 8       /* delays [4] */
#define CHIP_LOAD_SPEEDS 8     /* speeds of which the idle power is kept [3] */
#define CHIP_LOAD_REGAIN_S 1.0 /* after a bad sample [2] */
#define CHIP_LOAD_FROZEN_S 2.0 /* a sensor that does not change for so long is frozen [2] */
#define CHIP_LOAD_SPIKE 3.0    /* times the load of the moment that a sample may be [2] */
#define CHIP_TEACH_LEAST_S 2.0 /* a shorter cut gives no factor [5] */
#define CHIP_TEACH_LONGEST_S 20.0
#define CHIP_ALARM_SHORT 0.7     /* of the load expected [8] */
#define CHIP_ALARM_HALF 0.55     /* of the load expected: below it the load has gone [8] */
#define CHIP_ALARM_NONE 0.3      /* of the load expected: below it there is none [9] [10] */
#define CHIP_ALARM_SUM_S 0.025   /* [8] */
#define CHIP_ALARM_MISSING_S 1.0 /* [9] */
#define CHIP_ALARM_AIR_S 0.5     /* [9] */
#define CHIP_ALARM_RATIO_S 3.0   /* [10] */
#define CHIP_ALARM_LOW 0.6       /* of the factor of the tool [10] */
#define CHIP_ALARM_HIGH 1.7

enum chip_load_alarm {
    CHIP_LOAD_SOUND = 0,
    CHIP_LOAD_BROKEN = 1,  /* the load has fallen in stock [8] */
    CHIP_LOAD_MISSING = 2, /* none in stock [9] */
    CHIP_LOAD_IN_AIR = 3,  /* [9] */
    CHIP_LOAD_HIGH = 4,    /* [10] */
    CHIP_LOAD_LOW = 5,     /* [10] */
    CHIP_LOAD_UNUSABLE = 6 /* the sensor: nothing but words follows from it [2] */
};

/* What an alarm does. */
enum chip_load_action { CHIP_LOAD_SAY = 0, CHIP_LOAD_HOLD = 1, CHIP_LOAD_SLOW = 2 };

/* Members carry the name of the pin they come from and their unit. */
struct chip_load_in {
    double spindle_load_w; /* as measured */
    double power_w;        /* predicted at the edges; 0: air, or unknown */
    double spindle_speed_rps;
    double load_factor_share; /* of the tool in the material; 0: not known [6] */
    double section_area_mm2;
    double period_s;
    double specific_force_n_mm2; /* another one: another cut */
    int is_known;                /* the power is: stock, tool, material, edges */
    int feeds;                   /* a feed move or an arc, and it moves */
    int moves;                   /* any motion */
    int tool_number;
    int is_decided; /* a program starts, or is aborted [11] */
};

struct chip_load_idle {
    double speed_rps, idle_w; /* 0: unused */
};

struct chip_spindle_load {
    int is_seen; /* [1] */
    double last_w, same_s, bad_left_s;
    int is_frozen;
    double now_w, fast_w, faster_w, medium_w, slow_w; /* the load: limited [2], and smoothed */
    double block_w, block_s, blocks_w[2], noise_w2;   /* mean square of the noise of a mean over a block [7] */
    int blocks;
    double speed_rps, steady_s; /* the commanded one, and for how long */
    int has_fed;                /* at this speed [3] */
    double air_s, still_s, wrong_s;
    double idle_w, idle_s;                        /* at this speed; time it was averaged over; 0: not known */
    int is_sure;                                  /* for long enough [3] */
    struct chip_load_idle idle[CHIP_LOAD_SPEEDS]; /* in no order */
    int next_idle;
    double late_w[CHIP_LOAD_LAGS], lag_s; /* predictions [4]; the delay found last, 0: none */
    int lag;                              /* its number */
    /* teach [5] */
    double sum_mp[CHIP_LOAD_LAGS], sum_pp[CHIP_LOAD_LAGS], sum_mm, sum_s, cut_s, out_s;
    double cut_factor; /* of the last cut */
    int cuts;          /* that gave one */
    /* compare [6]..[11] */
    double factor, trim, expected_w, short_s, there_s, missing_s, in_air_s, ratio, ratio_s, off_s, usual_w, unusable_s;
    double cut_ratio; /* measured / predicted, smoothed; 0: unknown */
    int was_there, is_trusted, is_unusable, alarm;
    int tool_number;
    double specific_force_n_mm2;
};

/* One period; returns the chip_load_alarm. */
int chip_spindle_load_step(struct chip_spindle_load *load, const struct chip_load_in *in);

/* Steps of it: [5]; [6]..[11]. */
void chip_spindle_teach(struct chip_spindle_load *load, const struct chip_load_in *in);
void chip_spindle_compare(struct chip_spindle_load *load, const struct chip_load_in *in);

/* Time constant of delay k, s. */
double chip_load_lag(int k);

/* Share of a step that a delay of first order lets through in a period. */
static inline double chip_load_share(double period_s, double lag_s) { return period_s / (lag_s + period_s); }

/* Measured load of the cut, W: smoothed as in `level_w`. */
static inline double chip_load_of_cut(const struct chip_spindle_load *load, double level_w)
{
    return level_w - load->idle_w;
}

/* Whether the load of a cut is known apart from the spindle's own [3]. */
static inline int chip_load_readable(const struct chip_spindle_load *load, const struct chip_load_in *in)
{
    return in->is_known && load->bad_left_s <= 0.0 && load->idle_s > 0.0 && load->steady_s > 0.3;
}

#endif
