/* SPDX-License-Identifier: GPL-2.0-or-later */
/* run_sums.h - what a program has done so far: times, the mean and the peak of the removal rate.
 *
 * Who calls it: volumetric_feed.comp, once per servo period. Display, panel page and summary show these sums: a program
 * that looks ten times a second sees other sums on a busy computer.
 * Source: none.
 *
 * Principle:
 *  1. A period counts while a program runs. The sums begin with the program; its end leaves them as they are.
 *  2. That a program runs is reported some ms late. So the sums of what may be its beginning are made apart, from the
 *     first motion after a rest on, and are its sums as soon as it is reported.
 *  3. A period cuts if it is in a feed move, and the section area is at least CHIP_SUMS_AREA and, over the depth, at least
 *     CHIP_SUMS_WIDTH wide. A feed move that does not cut is in air. Two readings decide nothing; the map does:
 *     a. Thinner, down to CHIP_SUMS_THIN: a wall that was cut already may read the same as a cut. Such periods wait, up to
 *        CHIP_SUMS_WAIT_S, and cut if the map has lost CHIP_SUMS_SHARE of what the reading says; the periods in
 *        which it still loses what was cut before them are left out of the comparison.
 *     b. A plunge from air: the load comes at once, and the reading rises towards it over a cell before. Periods before the
 *        map has lost anything are air, but for the CHIP_SUMS_SETTLE that it may lag.
 *  4. Mean: volume that the map has lost, over the time that cuts. The map lags some periods behind the tool: what it loses
 *     within CHIP_SUMS_SETTLE periods after the last motion counts; what it loses later is another stock.
 *  5. Peak: the largest section area times velocity, in the mean of CHIP_SUMS_WINDOW_S wholly in feed moves.
 *  6. Time saved: a moment dt at the velocity v takes v dt / F at the programmed F with the operator's override. It counts
 *     while the volumetric feed is on; negative if that was slower than F.
 *  7. An edge rubs while it cuts and its largest chip is below the smallest one of the tool. Chip and tool have to be known.
 */
#ifndef CHIPWISE_RUN_SUMS_H
#define CHIPWISE_RUN_SUMS_H

#include "feed.h"

#define CHIP_SUMS_AREA 0.01      /* mm2 [3] */
#define CHIP_SUMS_WIDTH 0.01     /* mm [3] */
#define CHIP_SUMS_THIN 0.001     /* mm2 [3a] */
#define CHIP_SUMS_SHARE 0.5      /* of the volume read [3a] */
#define CHIP_SUMS_WAIT_S 0.5     /* s [3a] */
#define CHIP_SUMS_DOWN 0.999     /* downward part of the direction of a plunge [3b] */
#define CHIP_SUMS_SETTLE 20      /* periods [4] */
#define CHIP_SUMS_WINDOW_S 0.010 /* s [5] */
#define CHIP_SUMS_SLOTS 128      /* periods of a window at most */
#define CHIP_SUMS_REST_S 0.1     /* s at rest after which motion may be a program's beginning [2] */
#define CHIP_SUMS_LARGEST 1e12   /* of a sum, and of what is added: no program has more */

struct chip_run_totals {
    double run_s, cut_s, air_s; /* of the program; of feed moves [3] */
    double fed_s;               /* of feed moves with the volumetric feed on */
    double saved_s;             /* [6] */
    double volume_mm3;          /* [4] */
    double peak_mm3_s;          /* [5] */
    double rub_s;               /* [7] */
};

/* Periods that wait for the map [3]. */
struct chip_run_waiting {
    double time_s;
    double read_mm3, lost_mm3; /* what the reading says, and what the map has lost */
};

struct chip_run_sums {
    struct chip_run_totals program, beginning; /* [1] [2] */
    double window[CHIP_SUMS_SLOTS];            /* mm3 removed in the last periods [5] */
    double in_window_mm3;
    int next, filled;
    double rest_s;           /* time without motion */
    double last_removed_mm3; /* of the last period */
    int since_motion;        /* periods */
    int was_running, is_begun;
    struct chip_run_waiting thin, plunge; /* [3a] [3b] */
    int since_cut, since_load;            /* periods since one that cut, and since a reading above CHIP_SUMS_THIN */
    int is_plunge;                        /* in a plunge that has not reached the stock yet [3b] */
};

/* One period. `in`: the law's input; is_running: a program runs; removed_volume_mm3: of the map. */
void chip_run_sums_step(struct chip_run_sums *sums, const struct chip_feed_in *in, int is_running,
                        double removed_volume_mm3);

/* Mean removal rate while cutting, mm3/s; 0 without a cut. */
double chip_run_mean(const struct chip_run_totals *totals);

#endif
