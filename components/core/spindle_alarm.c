/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_alarm.c - the load expected against the one measured; see spindle_load.h, 6 to 11. */
#include "chip_math.h"
#include "spindle_load.h"

#define CHIP_ALARM_FALL 0.8    /* of the load expected: what is below it is summed [8] */
#define CHIP_ALARM_NOISE 7.0   /* times the noise that is seen: the load expected must be that large [7] */
#define CHIP_ALARM_SIGMAS 5.3  /* times the noise that is seen: a fall must be that deep [8] */
#define CHIP_ALARM_MOVED_S 0.3 /* in which the sensor must have changed: a frozen one does not fall [8] */
#define CHIP_ALARM_UNUSABLE_S 1.0
#define CHIP_ALARM_OF_IDLE 0.5  /* and this share of the idle power */
#define CHIP_ALARM_THERE_S 0.1  /* of load as expected: it is there [8] */
#define CHIP_ALARM_TRIM_S 20.0  /* in which `trim` follows [6] */
#define CHIP_ALARM_TRIM 2.0     /* it stays between its inverse and this */
#define CHIP_ALARM_UNKNOWN 5    /* number of the delay that counts as found before one is */
#define CHIP_ALARM_AIR_LOAD 0.3 /* of the usual load of a cut, and [9] */
#define CHIP_ALARM_AIR_IDLE 0.5 /* of the idle power: less in air is nothing [9] */
#define CHIP_ALARM_OUT_S 0.2    /* in air: the next load is of another cut [8] */
#define CHIP_ALARM_SETTLE_S 1.5 /* in air, until the load of the cut has gone [9] */

/* [6] The least of the predictions that can be meant, W. */
static double least_prediction(const struct chip_spindle_load *load, double power)
{
    int found = load->lag_s > 0.0, first = found ? load->lag - 1 : 0,
        last = found ? load->lag + 1 : CHIP_ALARM_UNKNOWN + 1, k;
    double least = found ? load->late_w[load->lag] : power;
    for (k = first > 0 ? first : 0; k <= last && k < CHIP_LOAD_LAGS; k++) least = chip_min(least, load->late_w[k]);
    CHIP_FAULT(LAG_NOT_ALLOWED, return power);
    return found ? 0.5 * (least + load->late_w[load->lag]) : least;
}

/* [11] Sets an alarm, the first one. */
static void raise_alarm(struct chip_spindle_load *load, int alarm)
{
    if (load->alarm == CHIP_LOAD_SOUND) load->alarm = alarm;
}

/* [8] [9] In stock. */
static void watch_cut(struct chip_spindle_load *load, double dt)
{
    double expected = load->expected_w, fast = chip_load_of_cut(load, load->fast_w);
    double gone =
        expected - chip_max((1.0 - CHIP_ALARM_HALF) * expected, CHIP_ALARM_SIGMAS * chip_sqrt(load->noise_w2));
    load->there_s = fast >= CHIP_ALARM_SHORT * expected ? load->there_s + dt : 0.0;
    if (load->there_s > CHIP_ALARM_THERE_S) load->was_there = 1;
    load->short_s += (CHIP_ALARM_FALL - chip_load_of_cut(load, load->now_w) / expected) * dt;
    load->short_s = chip_clamp(load->short_s, 0.0, 1.0);
    load->missing_s = fast < CHIP_ALARM_NONE * expected && !load->was_there ? load->missing_s + dt : 0.0;
    if (load->was_there && load->short_s > CHIP_ALARM_SUM_S && fast < gone && load->same_s < CHIP_ALARM_MOVED_S)
        raise_alarm(load, CHIP_LOAD_BROKEN);
    if (load->missing_s > CHIP_ALARM_MISSING_S && load->is_sure && !load->is_frozen)
        raise_alarm(load, CHIP_LOAD_MISSING);
}

/* [6] [10] How the load is to the one expected. */
static void watch_ratio(struct chip_spindle_load *load, double dt)
{
    double late = load->late_w[load->lag_s > 0.0 ? load->lag : CHIP_ALARM_UNKNOWN];
    double ratio = chip_load_of_cut(load, load->now_w) / (load->factor * late);
    load->ratio += (chip_clamp(ratio, -10.0, 100.0) - load->ratio)
                 * chip_load_share(dt, load->ratio_s > 0.0 ? chip_min(load->ratio_s, 2.0) : 0.0);
    load->ratio_s += dt;
    if (load->was_there && load->short_s <= 0.0) {
        load->trim += (ratio - load->trim) * chip_load_share(dt, CHIP_ALARM_TRIM_S);
        load->trim = chip_clamp(load->trim, 1.0 / CHIP_ALARM_TRIM, CHIP_ALARM_TRIM);
    }
    load->off_s = load->ratio < CHIP_ALARM_LOW || load->ratio > CHIP_ALARM_HIGH ? load->off_s + dt : 0.0;
    if (load->off_s > CHIP_ALARM_RATIO_S && load->is_sure && !load->is_frozen && load->ratio > CHIP_ALARM_NONE)
        raise_alarm(load, load->ratio > 1.0 ? CHIP_LOAD_HIGH : CHIP_LOAD_LOW);
}

/* [9] In air. */
static void watch_air(struct chip_spindle_load *load, const struct chip_load_in *in, double dt)
{
    double least = chip_max(CHIP_ALARM_AIR_IDLE * load->idle_w, CHIP_ALARM_AIR_LOAD * load->factor * load->usual_w);
    int is_load =
        !load->is_frozen && load->air_s > CHIP_ALARM_SETTLE_S && load->is_sure && load->has_fed && load->factor > 0.0
        && load->usual_w > 0.0 && in->moves
        && chip_load_of_cut(load, load->medium_w) > chip_max(least, CHIP_ALARM_NOISE * chip_sqrt(load->noise_w2));
    load->in_air_s = is_load ? load->in_air_s + dt : 0.0;
    if (load->in_air_s > CHIP_ALARM_AIR_S) raise_alarm(load, CHIP_LOAD_IN_AIR);
}

/* The comparison begins anew [11]. */
static void begin_comparison(struct chip_spindle_load *load, double factor)
{
    load->factor = factor;
    load->alarm = CHIP_LOAD_SOUND;
    load->ratio = load->ratio_s = load->off_s = load->short_s = load->there_s = load->missing_s = load->in_air_s = 0.0;
    load->was_there = 0;
}

void chip_spindle_compare(struct chip_spindle_load *load, const struct chip_load_in *in)
{
    double dt = chip_finite(in->period_s) ? chip_clamp(in->period_s, 1e-6, 0.1) : 1e-3,
           factor = chip_setting(in->load_factor_share), floor;
    int readable = chip_load_readable(load, in);
    if (factor != load->factor) {
        load->trim = 1.0;
        begin_comparison(load, factor);
    }
    if (!in->moves || in->is_decided) begin_comparison(load, factor);
    load->unusable_s =
        load->bad_left_s > 0.0 || (load->is_frozen && in->power_w > 0.0) ? chip_min(load->unusable_s + dt, 1e6) : 0.0;
    load->is_unusable = load->unusable_s > CHIP_ALARM_UNUSABLE_S;
    load->expected_w = readable ? factor * load->trim * least_prediction(load, chip_setting(in->power_w)) : 0.0;
    floor = chip_max(CHIP_ALARM_OF_IDLE * load->idle_w, CHIP_ALARM_NOISE * chip_sqrt(load->noise_w2));
    load->is_trusted = readable && factor > 0.0 && load->expected_w > floor && load->expected_w < 1e9;
    CHIP_FAULT(TRUSTED_ANYHOW, load->is_trusted = load->expected_w > 0.0);
    if (load->is_trusted) {
        watch_cut(load, dt);
        watch_ratio(load, dt);
    } else {
        load->short_s = load->there_s = load->missing_s = 0.0;
    }
    if (!readable || load->air_s > CHIP_ALARM_OUT_S) load->was_there = 0;
    if (readable) watch_air(load, in, dt);
    if (!readable) load->in_air_s = 0.0;
}
