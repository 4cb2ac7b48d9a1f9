/* SPDX-License-Identifier: GPL-2.0-or-later */
/* slave.h - master and slave: the movement of a master in each servo period, sent as counts, moves a slave machine.
 *
 * Who calls it: tracer.comp (the master's part) and tracer_slave.comp, once per servo period each, and chip_slave_pulse in
 * each period of a faster thread.
 * Source: the abstract on profiling control of a master-slave system: the slave's pulse distributor PDC2 gets the master's
 * movement of each period (TCC1). Departs from it: a packet
 * also has the sum of all increments and a number, so that nothing that happens to packets can change the position.
 *
 * Principle:
 *  1. The master rounds its position to counts; a packet has the number of the period, the counts since the start (64
 *     bits) and the increments since the packet before.
 *  2. A packet with the next number has to agree with itself: counts = counts before + increments, else it is a fault.
 *     After a gap the counts alone say what is missing. A number that is not newer is ignored.
 *  3. What is known and not yet done is done at once as far as it is the increment of this packet, and the rest by at
 *     most catch_up_counts a period. So the slave is one period behind, later only after a loss, and never ahead of what
 *     the master has sent.
 *  4. Scaling: increments x scale / divisor, the remainder is carried. A negative scale mirrors.
 *  5. The pulses of a period are even: in each of its `tick_count` parts the counts are added to a remainder, which is carried
 *     too; a pulse is due when it passes `tick_count`. After `tick_count` parts exactly the counts of the period are done; if the
 *     faster thread has had fewer parts, what is missing is added to the next period.
 *  6. No new packet for silence_periods: DEAD, nothing moves until the slave is disabled.
 *  7. Velocity and acceleration are the slave's own, whatever a packet says: at most most_counts in a period, and in either
 *     direction at most change_counts more than in the one before. A period without a packet rests at once; what was
 *     allowed falls by change_counts in each, so that the slave goes on as fast as a master that has braked meanwhile.
 */
#ifndef CHIPWISE_SLAVE_H
#define CHIPWISE_SLAVE_H

#include <stdint.h>

enum chip_slave_state {
    CHIP_SLAVE_IDLE = 0,
    CHIP_SLAVE_WAIT = 1,   /* for a first packet; it sets the zero */
    CHIP_SLAVE_FOLLOW = 2, /* one period behind */
    CHIP_SLAVE_CATCH_UP = 3,
    CHIP_SLAVE_DEAD = 4, /* no packets */
    CHIP_SLAVE_FAULT = 5
};

enum chip_slave_fault {
    CHIP_SLAVE_NO_FAULT = 0,
    CHIP_SLAVE_SETTINGS = 1, /* a setting is out of its range */
    CHIP_SLAVE_CORRUPT = 2,  /* counts and increments of a packet differ */
    CHIP_SLAVE_TOO_FAR = 3,  /* more is missing than max_behind_counts */
    CHIP_SLAVE_NO_MASTER = 4 /* with the state DEAD */
};

struct chip_packet {
    uint32_t sequence_number;
    int64_t position_counts[3];
    int32_t step_counts[3];
};

struct chip_master {
    int is_started;
    struct chip_packet packet; /* sent last */
};

struct chip_slave_settings {
    int32_t scale_numerator[3]; /* numerator, not 0; negative mirrors; -1000000..1000000 */
    int32_t scale_divisor[3];   /* 1..1000000 */
    int32_t most_counts;        /* of the master, in a period; 1..1000000000 */
    int32_t change_counts;      /* of the master, more in a period than in the one before; 0: any [7] */
    int32_t catch_up_counts;    /* of the master, in a period, beside the increment; 1..most_counts */
    int32_t max_behind_counts;  /* a larger difference is a fault */
    int32_t silence_periods;    /* without a packet; 1..1000000 */
    int32_t tick_count;         /* parts of a period for chip_slave_pulse; 0: not used */
};

struct chip_slave {
    int state_number, fault_number; /* chip_slave_state, chip_slave_fault */
    int silent_periods;
    uint32_t sequence_number;   /* of the last packet used */
    int64_t received_counts[3]; /* of the master, since the zero */
    int64_t done_counts[3];     /* of the master, since the zero */
    int64_t fastest_counts[3]
                          [2];  /* of the master, in a period, backwards and forwards, that need no acceleration [7] */
    int64_t zero_counts[3];     /* the master's at the first packet */
    int64_t remainder[3];       /* of the scaling, in 1 / divisor [4] */
    int64_t position_counts[3]; /* of the slave, at the end of this period */
    int32_t step_counts[3];     /* of the slave, in this period */
    int64_t pulsed_counts[3];   /* pulses given, of the same zero as position_counts */
    int32_t pulse_counts[3];    /* pulses to give in this period */
    int32_t tick_count;         /* of this period */
    int32_t phase[3];           /* remainder of the pulses, 0..tick_count - 1 [5] */
    int32_t tick;               /* parts of this period done */
    uint32_t lost_packets, ignored_packets;
};

/* The master's part: the packet of this period, from its position; counts_per_mm not 0. A position that is not finite, or
 * a step that does not fit, sends nothing: the number stays. */
void chip_master_step(struct chip_master *master, const double position_mm[3], const double counts_per_mm[3]);

/* One period of the slave: `packet` is what has arrived last. */
void chip_slave_step(struct chip_slave *slave, const struct chip_slave_settings *settings,
                     const struct chip_packet *packet, int is_enabled);

/* One of the parts of a period: 1, 0 or -1 pulse of an axis into `pulse`. */
void chip_slave_pulse(struct chip_slave *slave, int pulse[3]);

#endif
