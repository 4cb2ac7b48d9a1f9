/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The slave of slave.h behind a channel that loses, doubles, delays and reorders packets.
 *
 * Without a loss the slave is in every period where the master was in the period before, bit for bit. At the end the sums agree exactly: the slave's counts with floor(master's counts x scale / divisor),
 * computed with 128 bits, and the pulses with the counts.
 *
 * CHIPWISE_RANDOM_COUNT periods (default 10^7; the proof has 10^8; a third of them through the bad channel), CHIPWISE_SEED.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/slave.h"
#include "random_numbers.h"

#define TICKS 40
#define QUEUE 8

static long period, failures, losses;
static struct chip_slave slave;
static struct chip_slave_settings settings = { .scale_numerator = { 1, -3, 254 },
                                               .scale_divisor = { 1, 7, 100 },
                                               .most_counts = 15,
                                               .catch_up_counts = 3,
                                               .max_behind_counts = 100000,
                                               .silence_periods = 1000,
                                               .tick_count = TICKS };
static struct chip_packet sent, zero;

static void expect(int good, const char *what, long long value)
{
    if (good || failures++ > 10) return;
    printf("period %ld: %s: %lld (state %d, fault %d)\n", period, what, value, slave.state_number, slave.fault_number);
}

/* floor(counts x scale / divisor) */
static long long scaled(long long counts, int axis)
{
    __int128 all = (__int128)counts * settings.scale_numerator[axis], whole = all / settings.scale_divisor[axis];
    return (long long)(all % settings.scale_divisor[axis] < 0 ? whole - 1 : whole);
}

/* The master walks: each axis has a velocity that changes now and then; counts of up to 12 a period. */
static void walk(void)
{
    static int velocity[3];
    int i;
    sent.sequence_number++;
    for (i = 0; i < 3; i++) {
        if (pick(2000) == 0) velocity[i] = pick(25) - 12;
        sent.step_counts[i] = velocity[i];
        sent.position_counts[i] += velocity[i];
    }
}

/* What arrives: lost in one of 50, late by up to QUEUE - 1 in one of 50 (so out of order), doubled when nothing is due. */
static struct chip_packet channel(void)
{
    static struct chip_packet queue[QUEUE], last;
    static int waits[QUEUE];
    static int is_started;
    int i, late;
    if (!is_started) is_started = 1, last = zero;
    if (pick(50) == 0) {
        losses++;
    } else {
        late = pick(50) == 0 ? pick(QUEUE) : 0;
        for (i = 0; i < QUEUE && waits[i]; i++)
            ;
        if (i < QUEUE) queue[i] = sent, waits[i] = late + 1;
    }
    for (i = 0; i < QUEUE; i++)
        if (waits[i] && --waits[i] == 0) last = queue[i];
    return last;
}

static void run_period(int is_bad)
{
    struct chip_packet arrived;
    int i, tick, pulse[3];
    walk();
    arrived = is_bad ? channel() : sent;
    chip_slave_step(&slave, &settings, &arrived, 1);
    for (i = 0; i < 3; i++) {
        long long master = sent.position_counts[i] - zero.position_counts[i];
        expect(slave.position_counts[i] == scaled(slave.done_counts[i], i), "scaling", slave.position_counts[i]);
        if (!is_bad && slave.state_number == CHIP_SLAVE_FOLLOW)
            expect(slave.done_counts[i] == master, "not the master's", slave.done_counts[i]);
    }
    expect(slave.state_number == CHIP_SLAVE_FOLLOW || slave.state_number == CHIP_SLAVE_CATCH_UP, "state",
           slave.state_number);
    if (period % 64 == 0 || failures)
        for (tick = 0; tick < TICKS - pick(2); tick++) chip_slave_pulse(&slave, pulse);
}

int main(void)
{
    long periods = random_begin(10000000);
    int i, tick, pulse[3];
    sent.sequence_number = 4294967295u - 1000; /* it wraps soon */
    sent.position_counts[0] = 5000000000000000000;
    sent.position_counts[1] = -1234567890123456789;
    chip_slave_step(&slave, &settings, &sent, 0);
    sent.sequence_number++;
    zero = sent;
    chip_slave_step(&slave, &settings, &sent, 1);
    for (period = 0; period < periods; period++) run_period(period % 3000000 < 1000000);
    for (period = 0; period < 100000; period++) { /* rest: what is missing comes */
        int k;
        sent.sequence_number++;
        for (k = 0; k < 3; k++) sent.step_counts[k] = 0;
        chip_slave_step(&slave, &settings, &sent, 1);
        for (tick = 0; tick < TICKS; tick++) chip_slave_pulse(&slave, pulse);
    }
    for (i = 0; i < 3; i++) {
        long long master = sent.position_counts[i] - zero.position_counts[i];
        expect(slave.position_counts[i] == scaled(master, i), "sum", slave.position_counts[i] - scaled(master, i));
        expect(slave.pulsed_counts[i] == slave.position_counts[i], "pulses", slave.pulsed_counts[i]);
    }
    expect(slave.lost_packets > 0 && slave.ignored_packets > 0 && losses > 0, "the channel was good",
           slave.lost_packets);
    printf("%ld periods, %u lost, %u late ones ignored, master at %lld, %ld failures\n", periods, slave.lost_packets,
           slave.ignored_packets, (long long)(sent.position_counts[0] - zero.position_counts[0]), failures);
    return failures != 0;
}
