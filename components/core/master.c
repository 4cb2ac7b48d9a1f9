/* SPDX-License-Identifier: GPL-2.0-or-later */
/* master.c - the master's part of slave.h. */
#include "chip_math.h"
#include "slave.h"

#define CHIP_MASTER_LARGEST 4e18 /* counts: what fits into 64 bits */

void chip_master_step(struct chip_master *master, const double position_mm[3], const double counts_per_mm[3])
{
    struct chip_packet next = master->packet;
    int i;
    for (i = 0; i < 3; i++) {
        double counts = floor(position_mm[i] * counts_per_mm[i] + 0.5), step;
        if (!(counts > -CHIP_MASTER_LARGEST && counts < CHIP_MASTER_LARGEST)) return;
        next.position_counts[i] = (int64_t)counts;
        step = counts - (double)master->packet.position_counts[i];
        if (!master->is_started) step = 0.0;
        if (!(step >= -2147483648.0 && step <= 2147483647.0)) return;
        next.step_counts[i] =
            master->is_started ? (int32_t)(next.position_counts[i] - master->packet.position_counts[i]) : 0;
    }
    next.sequence_number++;
    master->packet = next;
    master->is_started = 1;
}
