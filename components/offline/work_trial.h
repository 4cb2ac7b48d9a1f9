/* SPDX-License-Identifier: GPL-2.0-or-later */
/* work_trial.h - how long the costliest periods of the stock model take on this computer.
 *
 * Who calls it: clib/work_trial.py for `chipwise load`, bench/bench_slow.py.
 *
 *  1. Ends of each kind, large for their cells, go down a ramp and along a curve, so that every period has more to do than its bound
 *     allows (tracker.h, 6): then its time hardly depends on the tool. A ball on a ramp takes longest for its work.
 *  2. All is done several times, and the time of a period is its fastest: what another program has displaced from the cache, or an
 *     interrupt, is not the work.
 *  3. The clock is that of the thread: it stands while others run. */
#ifndef CHIPWISE_WORK_TRIAL_H
#define CHIPWISE_WORK_TRIAL_H

/* The largest time, ns, of a period that does `percent` of its work; each path `repeats` times. Negative: there is no memory. */
double chip_work_trial(int percent, int repeats);

#endif
