/* SPDX-License-Identifier: GPL-2.0-or-later */
/* run_sums.c - see run_sums.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "run_sums.h"
#include "tooth_law.h"

/* A number that may be added: 0 unless it is finite and above 0. */
static double sound(double value) { return chip_min(chip_setting(value), CHIP_SUMS_LARGEST); }

/* Adds within the largest sum. */
static void add(double *sum, double value) { *sum = chip_clamp(*sum + value, -CHIP_SUMS_LARGEST, CHIP_SUMS_LARGEST); }

static void clear_totals(struct chip_run_totals *totals)
{
    totals->run_s = totals->cut_s = totals->air_s = totals->fed_s = totals->saved_s = 0.0;
    totals->volume_mm3 = totals->peak_mm3_s = totals->rub_s = 0.0;
}

/* Mean rate of the window that ends now, mm3/s; 0 unless all of it was in feed moves [5]. */
static double window_rate(struct chip_run_sums *sums, double removed_mm3, double period_s, int feeds)
{
    int slots = (int)chip_clamp(CHIP_SUMS_WINDOW_S / period_s + 0.5, 1.0, CHIP_SUMS_SLOTS);
    if (!feeds) {
        sums->next = sums->filled = 0;
        sums->in_window_mm3 = 0.0;
        return 0.0;
    }
    if (sums->next >= slots) sums->next = 0;
    if (sums->filled >= slots) sums->in_window_mm3 -= sums->window[sums->next];
    sums->window[sums->next] = removed_mm3;
    sums->in_window_mm3 += removed_mm3;
    sums->next++;
    if (sums->filled < slots) sums->filled++;
    return sums->filled >= slots ? chip_max(0.0, sums->in_window_mm3 / (slots * period_s)) : 0.0;
}

/* Volume the map has lost in this period by cutting, mm3 [4]. */
static double lost_volume(struct chip_run_sums *sums, double removed_mm3, int moves)
{
    double lost = removed_mm3 - sums->last_removed_mm3;
    sums->last_removed_mm3 = removed_mm3;
    sums->since_motion = moves ? 0 : sums->since_motion + (sums->since_motion < CHIP_SUMS_SETTLE);
    return sums->is_begun && sums->since_motion < CHIP_SUMS_SETTLE ? chip_max(0.0, lost) : 0.0;
}

/* Adds what has waited to the time that cuts or to that in air. */
static void end_waiting(struct chip_run_waiting *waiting, double cuts_s, struct chip_run_totals *totals)
{
    cuts_s = chip_min(cuts_s, waiting->time_s);
    add(&totals->cut_s, cuts_s);
    add(&totals->air_s, waiting->time_s - cuts_s);
    waiting->time_s = waiting->read_mm3 = waiting->lost_mm3 = 0.0;
}

static int is_lost_as_read(const struct chip_run_waiting *waiting)
{
    return waiting->read_mm3 > 0.0 && waiting->lost_mm3 >= CHIP_SUMS_SHARE * waiting->read_mm3;
}

static void wait_period(struct chip_run_waiting *waiting, double period_s, double read_mm3, double lost_mm3)
{
    waiting->time_s += period_s;
    waiting->read_mm3 = chip_min(waiting->read_mm3 + read_mm3, CHIP_SUMS_LARGEST);
    waiting->lost_mm3 = chip_min(waiting->lost_mm3 + lost_mm3, CHIP_SUMS_LARGEST);
}

/* [3b] Whether the period belongs to a plunge whose contact the map has not shown before. */
static int wait_in_plunge(struct chip_run_sums *sums, struct chip_run_totals *totals, int loaded, int down,
                          double period_s, double read_mm3, double lost_mm3)
{
    struct chip_run_waiting *plunge = &sums->plunge;
    if (loaded && down && sums->since_load >= CHIP_SUMS_SETTLE) sums->is_plunge = 1;
    if (!sums->is_plunge) return 0;
    if (!loaded) {
        end_waiting(plunge, 0.0, totals);
        sums->is_plunge = 0;
        return 0;
    }
    wait_period(plunge, period_s, read_mm3, lost_mm3);
    if (lost_mm3 > 0.0) {
        end_waiting(plunge, is_lost_as_read(plunge) ? plunge->time_s : CHIP_SUMS_SETTLE * period_s, totals);
        sums->is_plunge = 0;
    } else if (plunge->time_s > CHIP_SUMS_WAIT_S) {
        end_waiting(plunge, 0.0, totals);
    }
    return 1;
}

/* [7] Whether the largest chip is below the smallest one of the tool. */
static int rubs(const struct chip_feed_in *in)
{
    double least = sound(in->min_chip_mm), edges, chip;
    if (!(least > 0.0)) return 0;
    edges = chip_edges_per_s(in);
    chip = edges > 0.0 ? sound(in->current_vel_mm_s) / edges * sound(in->chip_share_now) : 0.0;
    CHIP_FAULT(RUBS_UNKNOWN, return chip < least);
    return chip > 0.0 && chip < least;
}

/* [3] Adds a period of a feed move (feeds), or of anything else, to the time that cuts or to that in air. */
static void divide_time(struct chip_run_sums *sums, struct chip_run_totals *totals, const struct chip_feed_in *in,
                        int feeds, double area, double read_mm3, double lost_mm3, double period_s)
{
    struct chip_run_waiting *thin = &sums->thin;
    int loaded = feeds && area >= CHIP_SUMS_THIN;
    int cuts = feeds && area >= CHIP_SUMS_AREA && area >= CHIP_SUMS_WIDTH * sound(in->depth_mm);
    int down = chip_finite(in->dir_z) && in->dir_z < -CHIP_SUMS_DOWN;
    int waits = wait_in_plunge(sums, totals, loaded, down, period_s, read_mm3, lost_mm3);
    int is_thin = loaded && !cuts && !waits;

    sums->since_load = loaded ? 0 : sums->since_load + (sums->since_load < CHIP_SUMS_SETTLE);
    sums->since_cut = cuts ? 0 : sums->since_cut + (sums->since_cut <= CHIP_SUMS_SETTLE);
    if (is_thin) {
        int before = sums->since_cut <= CHIP_SUMS_SETTLE; /* the map may still lose what was cut before */
        wait_period(thin, period_s, before ? 0.0 : read_mm3, before ? 0.0 : lost_mm3);
    }
    if (thin->time_s > 0.0 && (!is_thin || thin->time_s > CHIP_SUMS_WAIT_S))
        end_waiting(thin, is_lost_as_read(thin) ? thin->time_s : 0.0, totals);
    if (cuts && rubs(in)) add(&totals->rub_s, period_s);
    if (waits || is_thin || !feeds) return;
    add(cuts ? &totals->cut_s : &totals->air_s, period_s);
}

/* Adds a period to the sums but for the times that cut and in air. */
static void add_period(struct chip_run_totals *totals, const struct chip_feed_in *in, double velocity, double period_s,
                       double lost, double rate)
{
    int feeds = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    int on = in->feed_mode >= CHIP_FEED_LIMIT && in->feed_mode <= CHIP_FEED_WINDOW;
    double programmed =
        sound(in->programmed_vel_mm_s) > 0.0 ? sound(in->programmed_vel_mm_s) : sound(in->requested_vel_mm_s);
    double override = sound(in->feed_override_share) > 0.0 ? sound(in->feed_override_share) : 1.0;
    add(&totals->run_s, period_s);
    add(&totals->volume_mm3, lost);
    totals->peak_mm3_s = chip_max(totals->peak_mm3_s, rate);
    if (!feeds || !(velocity > 0.0) || !on || !(programmed * override > 0.0)) return;
    add(&totals->fed_s, period_s);
    add(&totals->saved_s, chip_min(velocity * period_s / (programmed * override), CHIP_SUMS_LARGEST) - period_s);
}

void chip_run_sums_step(struct chip_run_sums *sums, const struct chip_feed_in *in, int is_running,
                        double removed_volume_mm3)
{
    double period_s = chip_finite(in->period_s) ? chip_clamp(in->period_s, 1e-6, 0.1) : 0.001;
    double velocity = sound(in->current_vel_mm_s), lost, rate;
    int moves = in->motion != 0, feeds = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    double area = in->is_trusted ? sound(in->section_area_mm2) : 0.0,
           read = chip_min(area * velocity * period_s, CHIP_SUMS_LARGEST);
    struct chip_run_totals *totals;

    lost = lost_volume(sums, sound(removed_volume_mm3), moves);
    rate = window_rate(sums, read, period_s, feeds);
    sums->is_begun = 1;
    if (moves && sums->rest_s >= CHIP_SUMS_REST_S && !is_running) clear_totals(&sums->beginning); /* [2] */
    sums->rest_s = moves ? 0.0 : chip_min(sums->rest_s + period_s, CHIP_SUMS_LARGEST);
    if (is_running && !sums->was_running) {
        if (sums->rest_s >= CHIP_SUMS_REST_S) clear_totals(&sums->beginning);
        sums->program = sums->beginning;
    }
    sums->was_running = is_running;
    totals = is_running ? &sums->program : &sums->beginning;
    add_period(totals, in, velocity, period_s, lost, rate);
    divide_time(sums, totals, in, feeds && velocity > 0.0, area, read, lost, period_s);
}

double chip_run_mean(const struct chip_run_totals *totals)
{
    return totals->cut_s > 0.0 ? chip_min(totals->volume_mm3 / totals->cut_s, CHIP_SUMS_LARGEST) : 0.0;
}
