/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The load that is measured: teach, a broken tool, missing stock, stock in air, wear, and hours without anything, in simulated runs.
 *
 * Called by bench/run.py (prints JSON rows); by hand build/bench/spindle_load [RUNS [HOURS [SEED]]].
 */
#include <stdio.h>
#include <stdlib.h>

#include "../tests/core/spindle_runs.h"

#define LONGEST_RUN_H 4.0

static struct run run;

static void row(const char *name, double value, const char *unit, double target, const char *note)
{
    printf("{\"name\": \"%s\", \"value\": %.5g, \"unit\": \"%s\", \"target\": %g, \"note\": \"%s%s\"}\n", name, value,
           unit, target, value <= target ? "meets" : "MISSES", note);
    fflush(stdout);
}

static double larger(double a, double b) { return a > b ? a : b; }

/* Runs up to a moment in a later cut at which a load has been there for `age_s`. */
static int run_to_cut(double age_s)
{
    int number;
    if (!(run_teach(&run, 300.0) > 0.0)) return 0;
    number = run.cut_number + 1 + (int)run_uniform(&run, 0.0, 3.0);
    while (run.cut_number < number || !run.cutting || run.age_s < age_s)
        if (run_step(&run, 0)) return 0;
    return 1;
}

/* Time from the moment at which the sensor shows half of the load until the alarm, s; 9: none, 99: a false one before. */
static double broken(void)
{
    double fall_s = -1.0, end_s;
    if (!run_to_cut(run_uniform(&run, 1.2, 2.8))) return 99.0;
    if (run_step(&run, 1)) return 99.0;
    for (end_s = run.clock_s + 3.0; run.clock_s < end_s;) {
        int alarm = run_step(&run, 0);
        if (fall_s < 0.0 && run_shows(&run) < 0.5) fall_s = run.clock_s;
        if (alarm) return alarm == CHIP_LOAD_BROKEN ? (fall_s < 0.0 ? 0.0 : run.clock_s - fall_s) : 99.0;
    }
    return 9.0;
}

/* Time until no stock, or stock in air, is found, s. */
static double wrong_stock(double missing, double in_air, int wanted)
{
    double begin_s = -1.0, end_s;
    if (!(run_teach(&run, 300.0) > 0.0)) return 99.0;
    while (run.cutting)
        if (run_step(&run, 0)) return 99.0;
    while (!run.cutting)
        if (run_step(&run, 0)) return 99.0;
    run.missing = missing;
    run.in_air_w = in_air * run.level_w;
    for (end_s = run.clock_s + 120.0; run.clock_s < end_s;) {
        int alarm = run_step(&run, 0);
        if (begin_s < 0.0 && !run.cutting && wanted == CHIP_LOAD_IN_AIR) begin_s = run.clock_s;
        if (begin_s < 0.0 && wanted == CHIP_LOAD_MISSING) begin_s = run.clock_s;
        if (alarm) return alarm == wanted ? run.clock_s - begin_s : 98.0;
    }
    return 97.0;
}

static void teach_and_breakage(int runs, uint64_t seed)
{
    double worst = 0.0, latest = 0.0, sum = 0.0, error = 0.0;
    int i, late = 0, early = 0;
    for (i = 0; i < runs; i++) {
        double taught, after;
        run_begin(&run, seed + (uint64_t)i);
        taught = run_teach(&run, 300.0);
        worst = larger(worst, fabs(taught - 1.0));
        error += fabs(taught - 1.0) / runs;
        run_begin(&run, seed + (uint64_t)i);
        after = broken();
        late += after > 0.1 && after < 99.0;
        early += after >= 99.0;
        if (after < 9.0) latest = larger(latest, after);
        if (after < 9.0) sum += after;
    }
    row("factor after one cut, largest error", 100.0 * worst, "%", 5.0, "");
    row("factor after one cut, mean error", 100.0 * error, "%", 5.0, "");
    row("broken tools not held 0.1 s after the sensor has lost half of the load", late, "runs", 0.0, "");
    row("latest of them", latest, "s", 0.1, "");
    row("mean of them", sum / runs, "s", 0.1, "");
    row("another alarm before the tool broke", early, "runs", 0.0, "");
}

static void stock_and_wear(int runs, uint64_t seed)
{
    int i, missing = 0, air = 0, wear = 0;
    for (i = 0; i < runs; i++) {
        run_begin(&run, seed + (uint64_t)i);
        missing += wrong_stock(0.0, 0.0, CHIP_LOAD_MISSING) > 3.0;
        run_begin(&run, seed + (uint64_t)i);
        air += wrong_stock(1.0, 1.0, CHIP_LOAD_IN_AIR) > 120.0;
        run_begin(&run, seed + (uint64_t)i);
        run.set.drift_per_h = 0.0;
        run_teach(&run, 300.0);
        run.set.wear_per_h = 4.0; /* from now on */
        run.sim.cut_s = 0.0;
        while (run.sim.cut_s < 0.1 * 3600.0) run_step(&run, 0); /* 40 % */
        wear += run.judge.cut_factor / run.in.load_factor_share < 1.25;
    }
    row("missing stock not found in 3 s", missing, "runs", 0.0, "");
    row("stock in air not found in 2 minutes with air of 0.5 to 6 s", air, "runs", 0.0, "");
    row("wear of 40 % of which the factor shows less than 25 %", wear, "runs", 0.0, "");
}

static void hours(double wanted, uint64_t seed)
{
    double done_s = 0.0, end_s;
    int alarms[CHIP_LOAD_UNUSABLE + 1] = { 0 }, number = 0, all;
    double trusted_s = 0.0, cut_s = 0.0;
    while (done_s < wanted * 3600.0) {
        run_begin(&run, seed + (uint64_t)(1000003 * ++number));
        end_s = run_uniform(&run, 0.2, LONGEST_RUN_H) * 3600.0;
        if (end_s > wanted * 3600.0 - done_s) end_s = wanted * 3600.0 - done_s + 1.0;
        run.least = 0.2; /* small cuts, too */
        while (run.clock_s < end_s) {
            int alarm = run_step(&run, 0);
            run.in.is_decided = alarm != 0;
            alarms[alarm]++;
            if (alarm)
                fprintf(stderr,
                        "seed %d: alarm %d after %.3f s, cut %d, %.3f s; expected %.0f W, noise %.1f W, idle %.0f W, "
                        "sample %g s, trim %.3f, dip %.3f\n",
                        number, alarm, run.clock_s, run.cut_number, run.age_s, run.judge.expected_w,
                        sqrt(run.judge.noise_w2), run.judge.idle_w, run.set.sample_s, run.judge.trim, run.dip_left_s);
            trusted_s += run.judge.is_trusted * RUN_PERIOD_S;
            cut_s += (run.in.power_w > 0.0) * RUN_PERIOD_S;
        }
        done_s += end_s;
    }
    all = alarms[1] + alarms[2] + alarms[3] + alarms[4] + alarms[5];
    printf("%d runs, %.1f h, trusted %.0f %% of the time in stock; alarms: broken %d, missing %d, in air %d, high %d, "
           "low %d\n",
           number, done_s / 3600.0, 100.0 * trusted_s / cut_s, alarms[1], alarms[2], alarms[3], alarms[4], alarms[5]);
    row("false alarms in the hours", all, "", 0.0, "");
    row("simulated hours", done_s / 3600.0, "h", 1e9, "");
}

int main(int count, char **words)
{
    int runs = count > 1 ? atoi(words[1]) : 200;
    double wanted = count > 2 ? atof(words[2]) : 100.0;
    uint64_t seed = count > 3 ? strtoull(words[3], 0, 10) : 1;
    teach_and_breakage(runs, seed);
    stock_and_wear(runs / 4 + 1, seed + 5000);
    hours(wanted, seed + 9000);
    return 0;
}
