// SPDX-License-Identifier: GPL-2.0-or-later
component tracer_slave "Repeat the movement of a master, scaled and mirrored";
description """
Repeats what a master has moved in the period before: tracer(9) sends a packet in each servo period with a number, its
position in counts (64 bits) and the counts since the packet before. A packet that is lost, doubled or late costs time and
never changes the position; a packet that contradicts itself is a fault; after dead-periods without a packet the slave
stops.

Wire
.B sequence, sequence-check, count-low-N, count-high-N, step-N
to the pins of tracer with the same names; N is 0 for X, 1 for Y, 2 for Z. A transport that writes them one by one writes
sequence-check first and sequence last; a packet is read only while both are the same.
.B pos-x -y -z
is the commanded position. With ticks above 0 and the function
.B pulse
in a faster thread,
.B phase-a-N, phase-b-N
are quadrature signals, one edge for each count of the slave, spread evenly over the period.

.B enable
TRUE: the master's position at the first packet counts as the zero. FALSE: stopped; the position is kept.
""";

pin in bool enable "TRUE: follow the master";
pin in ui32 sequence "tracer.N.sequence";
pin in ui32 sequence_check "tracer.N.sequence-check";
pin in ui32 count_low_#[3] "tracer.N.count-low-M";
pin in si32 count_high_#[3] "tracer.N.count-high-M";
pin in si32 step_#[3] "tracer.N.step-M";

pin out real pos_x "commanded position since the component was loaded, machine units";
pin out real pos_y "";
pin out real pos_z "";
pin out si32 step_out_#[3] "counts of the slave in this period";
pin out bool phase_a_#[3] "quadrature signal, for function pulse";
pin out bool phase_b_#[3] "";
pin out si32 state "0 idle, 1 wait, 2 follow, 3 catch up, 4 dead, 5 fault";
pin out si32 fault_code "0 none, 1 settings, 2 corrupt packet, 3 too far behind, 4 no packets";
pin out si32 last_fault "fault-code of the last fault, kept until enable is TRUE again";
pin out bool fault "the slave has stopped with a fault";
pin out ui32 lost "packets lost";
pin out ui32 ignored "packets ignored, because they were late";

param rw si32 scale_#[3] = 1 "slave counts = master counts x scale / divisor; negative mirrors; not 0";
param rw si32 divisor_#[3] = 1 "1..1000000";
param rw si32 max_counts = 1000 "largest number of the master's counts done in a period";
param rw si32 max_change = 0 "the master's counts done in a period are at most so many more than in the one before: the slave's acceleration; 0: any";
param rw si32 catch_up = 10 "counts in a period beside the master's own, while something is missing";
param rw si32 max_behind = 100000 "a larger difference in counts is a fault";
param rw si32 dead_periods = 20 "periods without a packet until the slave stops";
param rw si32 ticks = 0 "periods of the faster thread in a servo period, for function pulse; 0: not used";
param rw real counts_per_unit = 1000.0 "counts of the slave per machine unit";

variable chip_slave_t slave;
variable int quarter[3];

function _;
function pulse /* nofp */;
license "GPL";
author "chipwise";
see_also "tracer(9)";
include "core/tracer_slave_core.h";
;;

/* The packet on the pins; the one of before while a transport is writing. */
static void read_packet(struct __comp_state *__comp_inst, struct chip_packet *packet)
{
    int i;
    packet->sequence_number = sequence;
    for (i = 0; i < 3; i++) {
        packet->position_counts[i] = (int64_t)(((uint64_t)(uint32_t)count_high(i) << 32) | count_low(i));
        packet->step_counts[i] = step(i);
    }
    if (sequence_check != packet->sequence_number) packet->sequence_number = slave.sequence_number;
}

FUNCTION(_) {
    struct chip_slave_settings settings;
    struct chip_packet packet;
    int i;
    for (i = 0; i < 3; i++) {
        settings.scale_numerator[i] = scale(i);
        settings.scale_divisor[i] = divisor(i);
    }
    settings.most_counts = max_counts;
    settings.change_counts = max_change;
    settings.catch_up_counts = catch_up;
    settings.max_behind_counts = max_behind;
    settings.silence_periods = dead_periods;
    settings.tick_count = ticks;
    read_packet(__comp_inst, &packet);
    chip_slave_step(&slave, &settings, &packet, enable);
    for (i = 0; i < 3; i++) step_out_set(i, slave.step_counts[i]);
    if (counts_per_unit >= 1e-6 && counts_per_unit <= 1e12) {
        pos_x_set(slave.position_counts[0] / counts_per_unit);
        pos_y_set(slave.position_counts[1] / counts_per_unit);
        pos_z_set(slave.position_counts[2] / counts_per_unit);
    }
    state_set(slave.state_number);
    fault_code_set(slave.fault_number);
    fault_set(slave.fault_number != CHIP_SLAVE_NO_FAULT);
    if (fault || enable) last_fault_set(slave.fault_number);
    lost_set(slave.lost_packets);
    ignored_set(slave.ignored_packets);
}

FUNCTION(pulse) {
    int edges[3], i;
    chip_slave_pulse(&slave, edges);
    for (i = 0; i < 3; i++) {
        quarter[i] = (quarter[i] + edges[i]) & 3;
        phase_a_set(i, quarter[i] == 1 || quarter[i] == 2);
        phase_b_set(i, quarter[i] >= 2);
    }
}
