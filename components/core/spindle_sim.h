/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_sim.h - a spindle with an inverter that measures its load, for simulation: what `spindle-load` shows of a cut.
 *
 * Who calls it: spindle_sim.comp, once per servo period; bench_spindle_load.py offline.
 * Source: a rigid body on a motor with a largest torque; the inverter's filter is a delay of first order.
 *
 * It shares nothing with spindle_load.h, which judges such a load: no constant and no code.
 * Principle:
 *  1. The motor turns the body up and down with at most its torque. Turning up costs the power torque times speed, braking costs none.
 *  2. At rest the load is 0. A turning spindle without a cut takes idle[0] + idle[1] n + idle[2] n^2.
 *  3. A cut takes its power times `factor`. Wear makes that more by a share of it for each hour of cutting, a broken tool nothing.
 *  4. The inverter shows the sum late (lag), with a gain that drifts for as long as the spindle has been there, and with noise: a share of
 *     the load, new in every `sample_s`.
 *  5. Whatever it is given, it shows a finite load that is not negative.
 */
#ifndef CHIPWISE_SPINDLE_SIM_H
#define CHIPWISE_SPINDLE_SIM_H

#include <stdint.h>

/* Members carry the name of the parameter and its unit. */
struct chip_spindle_settings {
    double inertia_kg_m2, torque_nm; /* 0: as fast as commanded, at once [1] */
    double idle_w[3];                /* W, W s, W s2 over revolutions a second [2] */
    double factor_share;             /* load of a cut over its power [3] */
    double wear_per_h;               /* of cutting [3] */
    double break_time_s;             /* of cutting after which the tool breaks; 0: never [3] */
    double lag_s, drift_per_h, noise_share, sample_s;
    double period_s;
    int seed_number; /* of the noise */
};

struct chip_spindle_sim {
    double speed_rps;     /* of the body */
    double hours;         /* since the first period */
    double cut_s;         /* time in which this tool has cut */
    double lagged_w;      /* behind the filter */
    double noise;         /* of this sample */
    double sample_left_s; /* until the next one */
    uint64_t random;
    int seeded; /* seed of `random` */
    int is_begun, is_broken;
};

struct chip_spindle_shown {
    double load_w;  /* as the inverter shows it */
    double quiet_w; /* without the noise */
    double true_w;  /* as it is, at once */
    double speed_rps;
    int is_at_speed;
};

/* One period. `mend`: another, sound tool; `break_now`: it breaks. */
struct chip_spindle_shown chip_spindle_sim_step(struct chip_spindle_sim *sim, const struct chip_spindle_settings *set,
                                                double speed_cmd_rps, double cut_power_w, int break_now, int mend);

#endif
