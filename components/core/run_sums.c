/* SPDX-License-Identifier: GPL-2.0-or-later */
/* run_sums.c - see run_sums.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "run_sums.h"

/* A number that may be added: 0 unless it is finite and above 0. */
static double sound(double value)
{
    return chip_finite(value) && value > 0.0 ? chip_min(value, CHIP_SUMS_LARGEST) : 0.0;
}

/* Adds within the largest sum. */
static void add(double *sum, double value) { *sum = chip_clamp(*sum + value, -CHIP_SUMS_LARGEST, CHIP_SUMS_LARGEST); }

static void clear_totals(struct chip_run_totals *totals)
{
    totals->run_s = totals->cut_s = totals->air_s = totals->fed_s = totals->saved_s = 0.0;
    totals->volume_mm3 = totals->peak_mm3_s = 0.0;
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

/* Adds a period to the sums. */
static void add_period(struct chip_run_totals *totals, const struct chip_feed_in *in, double velocity, double period_s,
                       double lost, double rate)
{
    int feeds = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    int on = in->feed_mode >= CHIP_FEED_LIMIT && in->feed_mode <= CHIP_FEED_WINDOW;
    double area = in->is_trusted ? sound(in->section_area_mm2) : 0.0;
    double programmed =
        sound(in->programmed_vel_mm_s) > 0.0 ? sound(in->programmed_vel_mm_s) : sound(in->requested_vel_mm_s);
    double override = sound(in->feed_override_share) > 0.0 ? sound(in->feed_override_share) : 1.0;
    add(&totals->run_s, period_s);
    add(&totals->volume_mm3, lost);
    totals->peak_mm3_s = chip_max(totals->peak_mm3_s, rate);
    if (!feeds || !(velocity > 0.0)) return;
    if (area >= CHIP_SUMS_AREA && area >= CHIP_SUMS_WIDTH * sound(in->depth_mm))
        add(&totals->cut_s, period_s);
    else
        add(&totals->air_s, period_s);
    if (!on || !(programmed * override > 0.0)) return;
    add(&totals->fed_s, period_s);
    add(&totals->saved_s, chip_min(velocity * period_s / (programmed * override), CHIP_SUMS_LARGEST) - period_s);
}

void chip_run_sums_step(struct chip_run_sums *sums, const struct chip_feed_in *in, int is_running,
                        double removed_volume_mm3)
{
    double period_s = chip_finite(in->period_s) ? chip_clamp(in->period_s, 1e-6, 0.1) : 0.001;
    double velocity = sound(in->current_vel_mm_s), lost, rate;
    int moves = in->motion != 0, feeds = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    double area = in->is_trusted ? sound(in->section_area_mm2) : 0.0;

    lost = lost_volume(sums, sound(removed_volume_mm3), moves);
    rate = window_rate(sums, chip_min(area * velocity * period_s, CHIP_SUMS_LARGEST), period_s, feeds);
    sums->is_begun = 1;
    if (moves && sums->rest_s >= CHIP_SUMS_REST_S && !is_running) clear_totals(&sums->beginning); /* [2] */
    sums->rest_s = moves ? 0.0 : chip_min(sums->rest_s + period_s, CHIP_SUMS_LARGEST);
    if (is_running && !sums->was_running) {
        if (sums->rest_s >= CHIP_SUMS_REST_S) clear_totals(&sums->beginning);
        sums->program = sums->beginning;
    }
    sums->was_running = is_running;
    add_period(is_running ? &sums->program : &sums->beginning, in, velocity, period_s, lost, rate);
}

double chip_run_mean(const struct chip_run_totals *totals)
{
    return totals->cut_s > 0.0 ? chip_min(totals->volume_mm3 / totals->cut_s, CHIP_SUMS_LARGEST) : 0.0;
}
