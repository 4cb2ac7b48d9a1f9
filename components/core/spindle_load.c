/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_load.c - see spindle_load.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "spindle_load.h"

#define CHIP_LOAD_MOST_W 1e7      /* W, more cannot be */
#define CHIP_LOAD_FASTEST_S 0.012 /* each of two delays of the fast load */
#define CHIP_LOAD_MEDIUM_S 0.15
#define CHIP_LOAD_SLOW_S 0.4
#define CHIP_LOAD_NOISE_S 2.0 /* over which the noise is averaged */
#define CHIP_LOAD_BLOCK_S 0.05
#define CHIP_LOAD_BEND 9.0    /* times the mean square, at most, that a block counts */
#define CHIP_LOAD_STANDS 1e-3 /* 1/s, a slower spindle stands */
#define CHIP_LOAD_SAME_SPEED 0.02
#define CHIP_LOAD_AIR_MM2 0.01
#define CHIP_LOAD_STILL 0.08   /* of the load: less between medium and slow load is rest [3] */
#define CHIP_LOAD_STILL_S 0.5  /* of rest, then the idle power is read */
#define CHIP_LOAD_TRACK_S 20.0 /* over which it is averaged [3] */
#define CHIP_LOAD_WRONG 0.12   /* of it: an air that differs by more for CHIP_LOAD_WRONG_S was read wrong [3] */
#define CHIP_LOAD_WRONG_S 1.0
#define CHIP_LOAD_INNOVATION 0.3 /* of it, at most, that a sample of air counts */
#define CHIP_LOAD_CREEP 0.02     /* the same of a load in air */
#define CHIP_LOAD_LONG_S 1e6     /* times are not counted any further */

/* [2] Whether the sample can be used. */
static int good_sample(const struct chip_load_in *in)
{
    return chip_finite(in->spindle_load_w) && in->spindle_load_w >= 0.0 && in->spindle_load_w <= CHIP_LOAD_MOST_W;
}

/* [2] The sample of this period, or the last good one; smoothed. */
static void sense(struct chip_spindle_load *load, const struct chip_load_in *in, double dt)
{
    double most = CHIP_LOAD_SPIKE * chip_max(chip_max(load->medium_w, load->slow_w), load->idle_w);
    int good = good_sample(in);
    CHIP_FAULT(BAD_SAMPLE_TAKEN, good = 1);
    load->bad_left_s = good ? chip_max(0.0, load->bad_left_s - dt) : CHIP_LOAD_REGAIN_S;
    if (good) {
        load->same_s = in->spindle_load_w != load->last_w ? 0.0 : chip_min(load->same_s + dt, CHIP_LOAD_LONG_S);
        load->last_w = in->spindle_load_w;
    }
    load->is_frozen = load->same_s > CHIP_LOAD_FROZEN_S && load->last_w > 0.0;
    load->now_w = load->slow_w > 0.0 ? chip_min(load->last_w, most) : load->last_w;
    load->faster_w += (load->now_w - load->faster_w) * chip_load_share(dt, CHIP_LOAD_FASTEST_S);
    load->fast_w += (load->faster_w - load->fast_w) * chip_load_share(dt, CHIP_LOAD_FASTEST_S);
    load->medium_w += (load->now_w - load->medium_w) * chip_load_share(dt, CHIP_LOAD_MEDIUM_S);
    load->slow_w += (load->now_w - load->slow_w) * chip_load_share(dt, CHIP_LOAD_SLOW_S);
}

/* [7] The noise, from means over CHIP_LOAD_BLOCK_S: their second difference, in which a load that rises or falls leaves next to nothing. */
static void read_noise(struct chip_spindle_load *load, double dt)
{
    double bend;
    load->block_w += load->now_w * dt;
    load->block_s += dt;
    if (load->block_s < CHIP_LOAD_BLOCK_S) return;
    load->block_w /= load->block_s;
    bend = load->block_w - 2.0 * load->blocks_w[0] + load->blocks_w[1];
    bend = bend * bend / 6.0; /* the square of a mean's deviation, if they are independent */
    if (load->noise_w2 > 0.0) bend = chip_min(bend, CHIP_LOAD_BEND * load->noise_w2); /* a step is of the load */
    if (load->blocks < 2)
        load->blocks++;
    else
        load->noise_w2 +=
            (bend - load->noise_w2) * (load->noise_w2 > 0.0 ? chip_load_share(load->block_s, CHIP_LOAD_NOISE_S) : 1.0);
    load->blocks_w[1] = load->blocks_w[0];
    load->blocks_w[0] = load->block_w;
    load->block_w = load->block_s = 0.0;
}

/* [3] Idle power that is kept for a speed, W; 0: none near enough, nor one on either side. */
static double kept_idle(const struct chip_spindle_load *load, double speed)
{
    const struct chip_load_idle *below = 0, *above = 0;
    int i;
    for (i = 0; i < CHIP_LOAD_SPEEDS; i++) {
        const struct chip_load_idle *at = &load->idle[i];
        if (!(at->idle_w > 0.0)) continue;
        if (fabs(at->speed_rps - speed) <= CHIP_LOAD_SAME_SPEED * speed) return at->idle_w;
        if (at->speed_rps < speed && (!below || at->speed_rps > below->speed_rps)) below = at;
        if (at->speed_rps > speed && (!above || at->speed_rps < above->speed_rps)) above = at;
    }
    if (!below || !above) return 0.0;
    return below->idle_w
         + (above->idle_w - below->idle_w) * (speed - below->speed_rps) / (above->speed_rps - below->speed_rps);
}

/* [3] Keeps the idle power of this speed, in the place of one for the same speed, else of the oldest. */
static void keep_idle(struct chip_spindle_load *load)
{
    int i, at = -1;
    for (i = 0; i < CHIP_LOAD_SPEEDS; i++)
        if (load->idle[i].idle_w > 0.0
            && fabs(load->idle[i].speed_rps - load->speed_rps) <= CHIP_LOAD_SAME_SPEED * load->speed_rps)
            at = i;
    if (at < 0) {
        at = load->next_idle;
        load->next_idle = at + 1 < CHIP_LOAD_SPEEDS ? at + 1 : 0;
        load->idle[at].speed_rps = load->speed_rps;
    }
    load->idle[at].idle_w = load->idle_w;
}

/* [3] The commanded speed: another one has another idle power. */
static void follow_speed(struct chip_spindle_load *load, const struct chip_load_in *in, double dt)
{
    double speed = chip_finite(in->spindle_speed_rps) ? fabs(in->spindle_speed_rps) : 0.0;
    if (speed <= CHIP_LOAD_STANDS) speed = 0.0;
    if (fabs(speed - load->speed_rps) > CHIP_LOAD_SAME_SPEED * load->speed_rps
        || (speed > 0.0) != (load->speed_rps > 0.0)) {
        load->speed_rps = speed;
        load->steady_s = load->still_s = load->wrong_s = 0.0;
        load->has_fed = 0;
        load->idle_w = speed > 0.0 ? kept_idle(load, speed) : 0.0;
        load->is_sure = load->idle_w > 0.0;
        load->idle_s = load->is_sure ? 0.5 * CHIP_LOAD_TRACK_S : 0.0;
    }
    load->steady_s = speed > 0.0 ? chip_min(load->steady_s + dt, CHIP_LOAD_LONG_S) : 0.0;
    if (!in->feeds || load->has_fed || !(speed > 0.0)) return;
    load->has_fed = 1;
    load->still_s = load->air_s = 0.0; /* it may just have come to its speed */
}

/* [3] Reads the idle power in air. */
static void read_idle(struct chip_spindle_load *load, const struct chip_load_in *in, double dt)
{
    int air =
        in->is_known && !(in->power_w > 0.0) && !(in->section_area_mm2 > CHIP_LOAD_AIR_MM2) && load->speed_rps > 0.0;
    double most, error;
    int lower, higher;
    load->air_s = air ? chip_min(load->air_s + dt, CHIP_LOAD_LONG_S) : 0.0;
    if (!air || load->steady_s < CHIP_LOAD_STILL_S
        || fabs(load->medium_w - load->slow_w) > CHIP_LOAD_STILL * load->slow_w)
        load->still_s = 0.0;
    else
        load->still_s = chip_min(load->still_s + dt, CHIP_LOAD_LONG_S);
    if (load->still_s <= CHIP_LOAD_STILL_S || load->bad_left_s > 0.0 || !load->has_fed) return;
    lower = load->medium_w < (1.0 - CHIP_LOAD_WRONG) * load->idle_w; /* less than idle cannot be: it was read wrong */
    higher = load->medium_w > (1.0 + CHIP_LOAD_WRONG) * load->idle_w;
    load->wrong_s = load->idle_s > 0.0 && (lower || (higher && !(load->factor > 0.0))) ? load->wrong_s + dt : 0.0;
    if (load->wrong_s > CHIP_LOAD_WRONG_S) load->idle_s = load->wrong_s = 0.0;
    load->idle_s = chip_min(load->idle_s + dt, CHIP_LOAD_TRACK_S);
    most = (higher && load->factor > 0.0 ? CHIP_LOAD_CREEP : CHIP_LOAD_INNOVATION) * load->idle_w;
    error = load->now_w - load->idle_w;
    if (load->idle_s > dt) error = chip_clamp(error, -most, most);
    load->idle_w += error * chip_min(1.0, dt / load->idle_s);
    load->is_sure = load->idle_s > CHIP_LOAD_STILL_S;
    if (load->is_sure) keep_idle(load);
}

/* Another tool or material: what was found of the cut is of another one. */
static void forget_cut(struct chip_spindle_load *load, const struct chip_load_in *in)
{
    int k;
    load->tool_number = in->tool_number;
    load->specific_force_n_mm2 = in->specific_force_n_mm2;
    for (k = 0; k < CHIP_LOAD_LAGS; k++) load->sum_mp[k] = load->sum_pp[k] = 0.0;
    load->sum_mm = load->sum_s = load->cut_s = load->out_s = load->usual_w = 0.0;
    load->factor = 0.0; /* the comparison begins anew */
}

int chip_spindle_load_step(struct chip_spindle_load *load, const struct chip_load_in *in)
{
    double dt = chip_finite(in->period_s) ? chip_clamp(in->period_s, 1e-6, 0.1) : 1e-3;
    double power = in->is_known && chip_finite(in->power_w) ? chip_clamp(in->power_w, 0.0, CHIP_LOAD_MOST_W) : 0.0;
    int k;
    if (!load->is_seen && !(good_sample(in) && in->spindle_load_w > 0.0)) return CHIP_LOAD_SOUND; /* [1] */
    load->is_seen = 1;
    if (in->tool_number != load->tool_number || !(in->specific_force_n_mm2 == load->specific_force_n_mm2))
        forget_cut(load, in);
    sense(load, in, dt);
    read_noise(load, dt);
    follow_speed(load, in, dt);
    read_idle(load, in, dt);
    for (k = 0; k < CHIP_LOAD_LAGS; k++)
        load->late_w[k] += (power - load->late_w[k]) * chip_load_share(dt, chip_load_lag(k));
    chip_spindle_teach(load, in);
    chip_spindle_compare(load, in);
    return load->alarm != CHIP_LOAD_SOUND || !load->is_unusable ? load->alarm : CHIP_LOAD_UNUSABLE;
}
