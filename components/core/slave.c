/* SPDX-License-Identifier: GPL-2.0-or-later */
/* slave.c - see slave.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "slave.h"

static int is_sound(const struct chip_slave_settings *s)
{
    int i;
    if (s->most_counts < 1 || s->most_counts > 1000000000 || s->change_counts < 0 || s->catch_up_counts < 1
        || s->catch_up_counts > s->most_counts || s->max_behind_counts < 1 || s->silence_periods < 1
        || s->silence_periods > 1000000 || s->tick_count < 0 || s->tick_count > 1000000)
        return 0;
    for (i = 0; i < 3; i++) {
        int64_t most = s->scale_numerator[i] < 0 ? -(int64_t)s->scale_numerator[i] : s->scale_numerator[i];
        if (most < 1 || most > 1000000 || s->scale_divisor[i] < 1 || s->scale_divisor[i] > 1000000) return 0;
        most = s->most_counts * most / s->scale_divisor[i] + 1;
        if (most > 2147483647 || (s->tick_count > 0 && most > s->tick_count)) return 0;
    }
    return 1;
}

static void stop(struct chip_slave *slave, int state, int fault)
{
    slave->state_number = state;
    slave->fault_number = fault;
}

/* The first packet: where the master is counts as 0. */
static void begin(struct chip_slave *slave, const struct chip_packet *packet)
{
    int i;
    for (i = 0; i < 3; i++) {
        slave->zero_counts[i] = packet->position_counts[i];
        slave->received_counts[i] = slave->done_counts[i] = 0;
        slave->fastest_counts[i][0] = slave->fastest_counts[i][1] = 0;
    }
    slave->sequence_number = packet->sequence_number;
    slave->silent_periods = 0;
    slave->state_number = CHIP_SLAVE_FOLLOW;
}

/* Takes what has arrived [2]; -> whether it is new. */
static int receive(struct chip_slave *slave, const struct chip_slave_settings *s, const struct chip_packet *packet)
{
    int32_t newer = (int32_t)(packet->sequence_number - slave->sequence_number);
    int i;
    CHIP_FAULT(OLD_PACKETS_USED, newer = newer < 0 ? 2 : newer);
    CHIP_FAULT(DOUBLED_PACKETS_USED, newer = newer == 0 ? 2 : newer);
    if (newer <= 0) {
        if (newer < 0 && slave->ignored_packets < 4294967295u) slave->ignored_packets++;
        return 0;
    }
    for (i = 0; i < 3; i++) {
        /* as unsigned: the difference of any two counts, without overflow */
        int64_t now = (int64_t)((uint64_t)packet->position_counts[i] - (uint64_t)slave->zero_counts[i]);
        int64_t step = (int64_t)((uint64_t)now - (uint64_t)slave->received_counts[i]);
        CHIP_FAULT(GAPS_IGNORED, now = slave->received_counts[i] + packet->step_counts[i];
                   step = packet->step_counts[i]);
        if (newer == 1 && step != packet->step_counts[i] && !CHIP_FAULTY(CORRUPT_USED)) {
            stop(slave, CHIP_SLAVE_FAULT, CHIP_SLAVE_CORRUPT);
            return 0;
        }
        step = (int64_t)((uint64_t)now - (uint64_t)slave->done_counts[i]);
        if (step > s->max_behind_counts || step < -(int64_t)s->max_behind_counts) {
            stop(slave, CHIP_SLAVE_FAULT, CHIP_SLAVE_TOO_FAR);
            return 0;
        }
        slave->received_counts[i] = now;
    }
    if (slave->lost_packets < 2147483648u) slave->lost_packets += (uint32_t)newer - 1u;
    slave->sequence_number = packet->sequence_number;
    return 1;
}

/* Counts of the master to do in this period on an axis [3]. */
static int64_t counts_to_do(const struct chip_slave *slave, const struct chip_slave_settings *s, int axis, int32_t step)
{
    int64_t missing = slave->received_counts[axis] - slave->done_counts[axis], extra = missing - step;
    if (extra > s->catch_up_counts) extra = s->catch_up_counts;
    if (extra < -(int64_t)s->catch_up_counts) extra = -(int64_t)s->catch_up_counts;
    CHIP_FAULT(CATCHES_UP_AT_ONCE, extra = missing - step);
    extra += step;
    if (extra > s->most_counts) extra = s->most_counts;
    if (extra < -(int64_t)s->most_counts) extra = -(int64_t)s->most_counts;
    if (missing >= 0 ? extra < 0 : extra > 0) extra = 0; /* the rest goes the other direction: never away from it */
    if (missing >= 0 ? extra > missing : extra < missing) extra = missing;
    return extra;
}

/* `counts` as far as the slave's acceleration allows; 0 always [7]. */
static int64_t held_back(struct chip_slave *slave, const struct chip_slave_settings *s, int axis, int64_t counts)
{
    int64_t *low = &slave->fastest_counts[axis][0], *high = &slave->fastest_counts[axis][1], change = s->change_counts;
    if (change < 1 || CHIP_FAULTY(ANY_ACCELERATION)) return counts;
    if (counts > *high + change) counts = *high + change > 0 ? *high + change : 0;
    if (counts < *low - change) counts = *low - change < 0 ? *low - change : 0;
    *high = counts > *high - change ? counts : *high - change;
    *low = counts < *low + change ? counts : *low + change;
    return counts;
}

/* The movement of this period, scaled [4]. */
static void move(struct chip_slave *slave, const struct chip_slave_settings *s, const int32_t step[3])
{
    int i, behind = 0;
    for (i = 0; i < 3; i++) {
        int64_t counts = held_back(slave, s, i, counts_to_do(slave, s, i, step[i])), all;
        slave->done_counts[i] += counts;
        behind |= slave->done_counts[i] != slave->received_counts[i];
        all = counts * s->scale_numerator[i] + slave->remainder[i];
        counts = all / s->scale_divisor[i];
        if (all % s->scale_divisor[i] < 0) counts--; /* rounded down, so that the remainder is never negative */
        slave->remainder[i] = all - counts * s->scale_divisor[i];
        CHIP_FAULT(REMAINDER_DROPPED, slave->remainder[i] = 0);
        slave->step_counts[i] = (int32_t)counts;
        slave->position_counts[i] = (int64_t)((uint64_t)slave->position_counts[i] + (uint64_t)counts);
    }
    slave->state_number = behind ? CHIP_SLAVE_CATCH_UP : CHIP_SLAVE_FOLLOW;
}

/* The pulses of this period [5]. */
static void plan_pulses(struct chip_slave *slave, int32_t ticks)
{
    int i;
    if (slave->tick_count != ticks) slave->phase[0] = slave->phase[1] = slave->phase[2] = 0;
    slave->tick_count = ticks;
    slave->tick = 0;
    for (i = 0; i < 3; i++) {
        int64_t left = (int64_t)((uint64_t)slave->position_counts[i] - (uint64_t)slave->pulsed_counts[i]);
        if (ticks < 1) slave->pulsed_counts[i] = slave->position_counts[i];
        CHIP_FAULT(MISSED_PULSES_DROPPED, left = slave->step_counts[i]);
        slave->pulse_counts[i] = (int32_t)(left > ticks ? ticks : left < -(int64_t)ticks ? -ticks : left);
    }
}

/* One period with settings that can be. */
static void follow(struct chip_slave *slave, const struct chip_slave_settings *settings,
                   const struct chip_packet *packet, int is_enabled)
{
    static const int32_t nothing[3];
    int is_new;
    if (!is_enabled) {
        stop(slave, CHIP_SLAVE_IDLE, CHIP_SLAVE_NO_FAULT);
        slave->sequence_number = packet->sequence_number;
        return;
    }
    if (slave->state_number == CHIP_SLAVE_IDLE) slave->state_number = CHIP_SLAVE_WAIT;
    if (slave->state_number >= CHIP_SLAVE_DEAD) return;
    if (slave->state_number == CHIP_SLAVE_WAIT) {
        if (packet->sequence_number != slave->sequence_number) begin(slave, packet);
        return;
    }
    is_new = receive(slave, settings, packet);
    if (slave->state_number == CHIP_SLAVE_FAULT) return;
    slave->silent_periods = is_new ? 0 : slave->silent_periods + 1;
    if (slave->silent_periods >= settings->silence_periods && !CHIP_FAULTY(DEAD_MASTER_AWAITED)) {
        stop(slave, CHIP_SLAVE_DEAD, CHIP_SLAVE_NO_MASTER);
        return;
    }
    if (slave->silent_periods > 1000000) slave->silent_periods = 1000000;
    move(slave, settings, is_new ? packet->step_counts : nothing);
}

void chip_slave_step(struct chip_slave *slave, const struct chip_slave_settings *settings,
                     const struct chip_packet *packet, int is_enabled)
{
    int sound = is_sound(settings);
    slave->step_counts[0] = slave->step_counts[1] = slave->step_counts[2] = 0;
    if (sound)
        follow(slave, settings, packet, is_enabled);
    else
        stop(slave, is_enabled ? CHIP_SLAVE_FAULT : CHIP_SLAVE_IDLE,
             is_enabled ? CHIP_SLAVE_SETTINGS : CHIP_SLAVE_NO_FAULT);
    plan_pulses(slave, sound ? settings->tick_count : slave->tick_count);
}

void chip_slave_pulse(struct chip_slave *slave, int pulse[3])
{
    int i;
    pulse[0] = pulse[1] = pulse[2] = 0;
    if (slave->tick_count < 1 || slave->tick >= slave->tick_count) return;
    slave->tick++;
    for (i = 0; i < 3; i++) {
        CHIP_FAULT(PULSES_BUNCHED, slave->phase[i] = 0; pulse[i] = slave->tick <= slave->pulse_counts[i];
                   slave->pulsed_counts[i] += pulse[i]; continue);
        slave->phase[i] += slave->pulse_counts[i];
        if (slave->phase[i] >= slave->tick_count) {
            slave->phase[i] -= slave->tick_count;
            pulse[i] = 1;
        } else if (slave->phase[i] < 0) {
            slave->phase[i] += slave->tick_count;
            pulse[i] = -1;
        }
        slave->pulsed_counts[i] += pulse[i];
    }
}
