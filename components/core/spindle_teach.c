/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_teach.c - the factor measured / predicted of a cut; see spindle_load.h, 5. */
#include "chip_math.h"
#include "spindle_load.h"

#define CHIP_LOAD_LEAST_LAG 0.03 /* s */
#define CHIP_LOAD_LAG_STEP 1.6
#define CHIP_TEACH_OUT_S 1.0  /* in air, then the cut is over */
#define CHIP_TEACH_LOAD 0.2   /* of the idle power: a weaker cut gives no factor */
#define CHIP_TEACH_LATE 0.01  /* of the power of the cut: later than this the delays have no more to say */
#define CHIP_TEACH_LEAST 0.02 /* a factor outside of this and the next is of something else */
#define CHIP_TEACH_MOST 50.0
#define CHIP_TEACH_UNKNOWN 5 /* number of the delay that counts as found before one is */

double chip_load_lag(int k)
{
    double lag = CHIP_LOAD_LEAST_LAG;
    for (; k > 0; k--) lag *= CHIP_LOAD_LAG_STEP;
    return lag;
}

/* The delay that explains the load best, and its factor. */
static double best_factor(struct chip_spindle_load *load)
{
    double least = 0.0, factor = 0.0;
    int k, found = 0;
    for (k = 0; k < CHIP_LOAD_LAGS; k++) {
        double rest;
        if (!(load->sum_pp[k] > 0.0)) continue;
        rest = load->sum_mm - load->sum_mp[k] * load->sum_mp[k] / load->sum_pp[k];
        if (found && rest >= least) continue;
        found = 1;
        least = rest;
        factor = load->sum_mp[k] / load->sum_pp[k];
        load->lag = k;
    }
    return factor;
}

static void begin_cut(struct chip_spindle_load *load)
{
    int k;
    for (k = 0; k < CHIP_LOAD_LAGS; k++) load->sum_mp[k] = load->sum_pp[k] = 0.0;
    load->sum_mm = load->sum_s = load->cut_s = load->out_s = 0.0;
}

/* The cut is over, or long enough: its factor, if it is known. */
static void end_cut(struct chip_spindle_load *load)
{
    double factor = load->cut_s >= CHIP_TEACH_LEAST_S ? best_factor(load) : 0.0;
    double mean_w2 = load->sum_s > 0.0 ? load->sum_pp[load->lag] / load->sum_s : 0.0;
    if (factor > CHIP_TEACH_LEAST && factor < CHIP_TEACH_MOST
        && factor * chip_sqrt(mean_w2) > CHIP_TEACH_LOAD * load->idle_w) {
        load->cut_factor = factor;
        load->lag_s = chip_load_lag(load->lag);
        load->cuts = load->cuts < 1000000000 ? load->cuts + 1 : 1;
    }
    begin_cut(load);
}

/* measured / predicted now, with the delay found; 0 where it is not known. */
static void show_ratio(struct chip_spindle_load *load, const struct chip_load_in *in, double dt)
{
    double late = load->late_w[load->lag_s > 0.0 ? load->lag : CHIP_TEACH_UNKNOWN], ratio;
    if (!chip_load_readable(load, in) || !(late > CHIP_TEACH_LOAD * load->idle_w)) {
        load->cut_ratio = 0.0;
        return;
    }
    ratio = chip_clamp(chip_load_of_cut(load, load->now_w) / late, 0.0, CHIP_TEACH_MOST);
    load->cut_ratio += (ratio - load->cut_ratio) * (load->cut_ratio > 0.0 ? chip_load_share(dt, 0.5) : 1.0);
}

void chip_spindle_teach(struct chip_spindle_load *load, const struct chip_load_in *in)
{
    double dt = chip_finite(in->period_s) ? chip_clamp(in->period_s, 1e-6, 0.1) : 1e-3;
    double measured = chip_load_of_cut(load, load->now_w), slowest = load->late_w[CHIP_LOAD_LAGS - 1];
    int k, cuts = in->power_w > 0.0;
    show_ratio(load, in, dt);
    if (!chip_load_readable(load, in) || !load->is_sure || load->is_frozen
        || load->alarm != CHIP_LOAD_SOUND) { /* such a cut teaches nothing */
        begin_cut(load);
        return;
    }
    load->out_s = cuts ? 0.0 : load->out_s + dt;
    if (load->out_s > CHIP_TEACH_OUT_S || load->cut_s > CHIP_TEACH_LONGEST_S) end_cut(load);
    if (!cuts && !(load->cut_s > 0.0 && slowest > CHIP_TEACH_LATE * load->usual_w)) return;
    if (cuts) {
        load->cut_s += dt;
        load->usual_w += (in->power_w - load->usual_w) * chip_load_share(dt, 1.0);
    }
    load->sum_s += dt;
    load->sum_mm += measured * measured * dt;
    for (k = 0; k < CHIP_LOAD_LAGS; k++) {
        load->sum_mp[k] += measured * load->late_w[k] * dt;
        load->sum_pp[k] += load->late_w[k] * load->late_w[k] * dt;
    }
}
