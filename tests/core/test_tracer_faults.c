/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Faults of the tracer head's sensor at random moments: the stylus is never deflected above its range.
 *
 * A head follows a model, its sensor has noise as a real one has; at a random moment a fault of FAULTS begins and stays.  The
 * deflection as it was, which the tracer cannot see any more, may be above `range` by one period's travel at most.  A fault
 * that must be seen has ended the trace in time, and the head rests; without a fault nothing is seen.
 *
 * CHIPWISE_RANDOM_COUNT runs (default 400; the proof has 10000), CHIPWISE_SEED; a failure prints seed, run, period and what.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/stylus.h"
#include "core/tracer.h"
#include "random_numbers.h"

#define PERIOD_S 0.001
#define IDLE 300     /* periods at rest before the trace */
#define LONGEST 6000 /* periods of a run */
#define AFTER 3000   /* periods after the fault */
#define HELD 64      /* readings kept for one that is late */

enum {
    NONE,
    BROKEN,
    FROZEN,
    FULL,
    INVERTED,
    INVERTED_AXIS,
    BROKEN_AXIS,
    FROZEN_AXIS,
    DRIFT,
    NOT_FINITE,
    SPIKE,
    LATE,
    WEAK,
    FAULTS
};

static const char *const NAMES[FAULTS] = { "none",          "broken cable", "frozen",      "full scale", "inverted",
                                           "inverted axis", "broken axis",  "frozen axis", "drift",      "not finite",
                                           "spike",         "late",         "weak" };
/* periods in contact within which the fault has to be seen; 0: it may stay unseen, as the deflection is in its range */
static const int SEEN_IN[FAULTS] = { 0, 40, 60, 40, 60, 0, 0, 0, 0, 1, 0, 0, 0 };

static long run, period, failures, shown;
static struct chip_tracer tracer;
static struct chip_tracer_settings settings;
static struct chip_tracer_in in;
static struct chip_tracer_out out;
static struct chip_stylus stylus;
static struct chip_stylus_settings model;
static double head[3], healthy[HELD][3], held[3], worst[FAULTS], axis_scale[3], drift_mm_s[3], spike_mm[3];
static int kind, begins, axis, late_periods;
static long runs_of[FAULTS], seen_of[FAULTS], traced_of[FAULTS], done_of[FAULTS];

static void expect(int good, const char *what, double value)
{
    if (good) return;
    failures++;
    if (shown++ > 20) return;
    printf("CHIPWISE_SEED=%lu run %ld, %s from %d, period %ld: %s: %.9g (state %d, fault %d, surface %d, mode %d)\n",
           start_seed, run, NAMES[kind], begins, period, what, value, out.state_number, out.fault_number,
           model.surface_number, settings.mode_number);
}

static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* The model and where the head begins. */
static void set_up_model(int is_scan)
{
    double tilt = 1.2 * (chance() - 0.5);
    model.surface_number = is_scan ? pick(5) : CHIP_STYLUS_CYLINDER + pick(2);
    model.normal[0] = sin(tilt);
    model.normal[2] = cos(tilt);
    model.size_mm = 2.0 + 10.0 * chance();
    model.angle_deg = 45.0 + 45.0 * chance();
    model.ball_mm = 0.6 + 1.5 * chance(); /* above the deflection, else the stylus snaps round an edge */
    model.friction_share = 0.3 * chance();
    model.noise_mm = 0.0001 + 0.0005 * chance();
    if (model.surface_number == CHIP_STYLUS_BOWL) model.size_mm += model.ball_mm;
    if (is_scan) {
        head[2] = 2.0 + model.ball_mm + (model.surface_number == CHIP_STYLUS_BALL ? model.size_mm : 0.0);
        if (model.surface_number == CHIP_STYLUS_BOWL) head[2] = 0.0;
        if (model.surface_number == CHIP_STYLUS_CORNER || model.surface_number == CHIP_STYLUS_STEP) {
            settings.direction_sign = 1;
            head[0] = -5.0 - 8.0 * chance();
        }
    } else {
        head[0] = -2.0 - model.ball_mm - model.size_mm;
    }
}

static void begin(void)
{
    int i;
    memset(&settings, 0, sizeof settings);
    memset(&model, 0, sizeof model);
    memset(&stylus, 0, sizeof stylus);
    memset(head, 0, sizeof head);
    memset(healthy, 0, sizeof healthy);
    stylus.random = (uint64_t)(chance() * 1e15);
    settings.mode_number = 1 + pick(4);
    settings.scan_axis_number = 0;
    settings.direction_sign = chance() < 0.7 ? 1 : -1;
    settings.feed_mm_s = 5.0 + 95.0 * chance() * chance();
    settings.approach_vel_mm_s = 5.0 + 10.0 * chance();
    settings.return_vel_mm_s = 10.0 + 50.0 * chance();
    settings.max_vel_mm_s = 200.0;
    settings.acceleration_mm_s2 = 300.0 + 3000.0 * chance();
    settings.gain_hz = 50.0 + 1000.0 * chance();
    settings.deflection_mm = 0.1 + 0.4 * chance();
    settings.range_mm = settings.deflection_mm + 0.5 + 2.0 * chance();
    model.delay_periods = pick(8);
    settings.dead_time_s = PERIOD_S * model.delay_periods;
    settings.max_jump_mm = 0.5;
    settings.pick_mm = 0.1 + 0.9 * chance();
    settings.retract_mm = 1.0 + chance();
    settings.search_mm = 20.0;
    settings.lost_mm = 10.0;
    settings.approach_dir[settings.mode_number > 2 ? 0 : 2] = settings.mode_number > 2 ? 1.0 : -1.0;
    for (i = 0; i < 3; i++) {
        settings.window_min_mm[i] = i == 1 ? -3.0 : -15.0;
        settings.window_max_mm[i] = i == 1 ? 1.0 : 15.0;
        settings.soft_min_mm[i] = -100.0;
        settings.soft_max_mm[i] = 100.0;
    }
    set_up_model(settings.mode_number <= 2);
    chip_tracer_init(&tracer);
}

static void choose_fault(void)
{
    int i;
    kind = run % FAULTS;
    begins = IDLE + 50 + pick(LONGEST - AFTER - IDLE);
    axis = pick(3);
    late_periods = 1 + pick(40);
    for (i = 0; i < 3; i++) {
        axis_scale[i] = kind == INVERTED || (kind == INVERTED_AXIS && i == axis) ? -1.0 : kind == WEAK ? 0.0 : 1.0;
        drift_mm_s[i] = 0.1 * (chance() - 0.5);
        spike_mm[i] = 2.0 * (chance() - 0.5);
    }
    if (kind == WEAK) axis_scale[0] = axis_scale[1] = axis_scale[2] = 0.15 + 0.7 * chance();
}

/* What the sensor says: `reading` is healthy. */
static void spoil(double reading[3])
{
    long since = period - begins;
    int i;
    memcpy(healthy[period % HELD], reading, sizeof healthy[0]);
    if (since == 0) memcpy(held, healthy[(period + HELD - 1) % HELD], sizeof held);
    if (since < 0) return;
    for (i = 0; i < 3; i++) {
        reading[i] *= axis_scale[i];
        if (kind == BROKEN || (kind == BROKEN_AXIS && i == axis)) reading[i] = 0.0;
        if (kind == FROZEN || (kind == FROZEN_AXIS && i == axis)) reading[i] = held[i];
        if (kind == FULL) reading[i] = settings.range_mm * (spike_mm[i] > 0.0 ? 1.0 : -1.0);
        if (kind == DRIFT) reading[i] += drift_mm_s[i] * PERIOD_S * since;
        if (kind == NOT_FINITE && i == axis) reading[i] = spike_mm[0] > 0.0 ? NAN : INFINITY;
        if (kind == SPIKE && since % 97 == 0) reading[i] += spike_mm[i];
        if (kind == LATE)
            reading[i] = since < late_periods ? held[i] : healthy[(period + HELD - late_periods) % HELD][i];
    }
}

/* One period; -> whether the stylus is in contact with the model. */
static int one(void)
{
    double now[3];
    int i, touching;
    chip_stylus_step(&stylus, &model, head, in.deflection_mm, now);
    touching = stylus.is_touching;
    spoil(in.deflection_mm);
    memcpy(in.position_mm, head, sizeof head);
    in.is_enabled = period >= IDLE;
    in.feed_share = 1.0;
    in.period_s = PERIOD_S;
    chip_tracer_step(&tracer, &settings, &in, &out);
    if (length(now) > worst[kind]) worst[kind] = length(now);
    if (length(now) > settings.range_mm + length(out.velocity_mm_s) * PERIOD_S)
        expect(0, "deflection above range, mm", length(now) - settings.range_mm), period = LONGEST;
    for (i = 0; i < 3; i++) head[i] += PERIOD_S * out.velocity_mm_s[i];
    return touching && (out.state_number == CHIP_TRACER_TRACE || out.state_number == CHIP_TRACER_PICK);
}

static void run_one(void)
{
    int contact = 0, ended = 0, was_done = 0;
    begin();
    choose_fault();
    runs_of[kind]++;
    in.is_enabled = 0;
    for (period = 0; period < LONGEST && period < begins + AFTER; period++) {
        int touching;
        if (period == begins) was_done = ended || out.state_number == CHIP_TRACER_DONE;
        touching = one();
        ended = out.state_number == CHIP_TRACER_FAULT || out.state_number == CHIP_TRACER_OVER_RANGE;
        if (touching && period >= begins && !ended) contact++;
        if (SEEN_IN[kind] && contact > SEEN_IN[kind] + model.delay_periods) {
            expect(0, "not seen, periods in contact", contact);
            break;
        }
        if ((ended || out.state_number == CHIP_TRACER_DONE) && length(out.velocity_mm_s) == 0.0 && period > begins)
            break;
    }
    traced_of[kind] += contact > 0 || ended;
    seen_of[kind] += ended && !was_done;
    done_of[kind] += out.state_number == CHIP_TRACER_DONE;
    if (kind == NONE)
        expect(out.fault_number == 0 || out.fault_number == CHIP_TRACER_BELOW
                   || (out.fault_number >= CHIP_TRACER_NO_CONTACT && out.fault_number <= CHIP_TRACER_COLLISION),
               "a sensor's fault without one", out.fault_number);
}

int main(void)
{
    long runs = random_begin(400);
    for (run = 0; run < runs; run++) run_one();
    for (kind = 0; kind < FAULTS; kind++)
        printf("%-14s %5ld runs, %5ld ended by a fault, %5ld done, deflected to %.3f mm at most\n", NAMES[kind],
               runs_of[kind], seen_of[kind], done_of[kind], worst[kind]);
    printf("%ld runs, %ld failures\n", runs, failures);
    return failures != 0;
}
