/* SPDX-License-Identifier: GPL-2.0-or-later */
/* axis_offset.h - a commanded position becomes LinuxCNC's external offset of the axes, without the lag of LinuxCNC's
 * planner of external offsets.
 *
 * Who calls it: tracer_offset.comp, once per servo period, after motion and after tracer.
 * Source: own. The planner is simple_tp_update() of LinuxCNC, read in 2.9.4 and in master of 2026-08; control.c and axis.c
 * there say when it reads what.
 *
 * Principle:
 *  1. LinuxCNC's planner asks for v = sqrt(2 A s + (A T)^2) - A T towards a request at distance s, and gets there with A at most.
 *     So a request that moves with v is followed at the distance v^2 / (2 A) + v T: 2.8 mm at 50 mm/s and 450 mm/s2. Given
 *     the other direction: a request at exactly this distance makes the planner move with v, from its next run on.
 *  2. A request is in force two periods after it was computed, so the offset then is the one of now and the step before.
 *  3. v is the velocity of the position plus a part of what is still missing, within A of the step before. With a position
 *     that itself keeps A nothing is missing, and the offset is the position of two periods before.
 *  4. The offset of now has to be the one that was computed in the period before. If it is not (a soft limit, another planner, another A, axes not
 *     homed), that is a fault: brake with A and hold.
 *  5. What stops: `permit` or `request` FALSE brakes with A and holds the offset. It begins again with a rising edge of
 *     `request`, if `permit` is TRUE within a second of it. Without `machine` nothing is asked for; LinuxCNC holds the place and counts its offset as 0 afterwards.
 *     While there is an offset the axes are not where a program has sent them: `is_off` keeps it from moving them.
 *  6. CLEAR takes the offset back to 0: rising axes first, then X and Y, then falling ones. A deflection that grows meanwhile is a fault.
 */
#ifndef CHIPWISE_AXIS_OFFSET_H
#define CHIPWISE_AXIS_OFFSET_H

#include <stdint.h>

enum chip_axis_offset_state {
    CHIP_AXIS_OFFSET_HOLD = 0,   /* the offset is kept */
    CHIP_AXIS_OFFSET_FOLLOW = 1, /* it moves with the position */
    CHIP_AXIS_OFFSET_CLEAR = 2,  /* it goes back to 0 */
    CHIP_AXIS_OFFSET_FAULT = 3
};

enum chip_axis_offset_fault {
    CHIP_AXIS_OFFSET_NO_FAULT = 0,
    CHIP_AXIS_OFFSET_SETTINGS = 1,   /* a setting is not finite or out of its range */
    CHIP_AXIS_OFFSET_NOT_FINITE = 2, /* position or offset */
    CHIP_AXIS_OFFSET_ASTRAY = 3,     /* LinuxCNC's offset is not where it should be [4] */
    CHIP_AXIS_OFFSET_BEHIND = 4,     /* more is missing than max_behind_mm */
    CHIP_AXIS_OFFSET_COLLISION = 5,  /* a deflection on the way back */
    CHIP_AXIS_OFFSET_TOO_FAR = 6     /* the request does not fit into the 32 bits of LinuxCNC's counts */
};

struct chip_axis_offset_settings {
    double acceleration_mm_s2[3]; /* of LinuxCNC's planner of external offsets: A */
    double max_vel_mm_s[3];       /* of the same */
    double count_mm;              /* one count of the request */
    double clear_vel_mm_s;        /* back to 0 */
    double max_astray_mm;         /* [4] */
    double max_behind_mm;
    double contact_mm; /* growth of the deflection that ends CLEAR */
};

struct chip_axis_offset_in {
    int has_request, has_permit, has_machine, wants_clear;
    double period_s;
    double position_mm[3];  /* to follow; only its changes count */
    double offset_mm[3];    /* axis.L.eoffset */
    double requested_mm[3]; /* axis.L.eoffset-request */
    double deflection_mm;   /* of the head */
};

struct chip_axis_offset_out {
    int state_number, fault_number;
    int is_enabled;    /* to tracer: follow the model */
    int is_cleared;    /* the offset is 0 */
    int is_off;        /* the axes are not where the program has them: it may not move them */
    int32_t counts[3]; /* axis.L.eoffset-counts */
    double behind_mm;  /* largest of the axes: what is missing [3] */
    double lead_mm;    /* largest of the axes: request - offset in force then */
    double astray_mm;  /* largest of the axes [4] */
};

struct chip_axis_offset {
    int state, fault;
    int had_request, had_clear, had_machine;
    double begin_s, clear_s; /* left for `permit` after the edge [5] */
    int stage;               /* of CLEAR [6] */
    double least_mm;         /* deflection, smallest since CLEAR began */
    int known;               /* periods for which `expected_mm` holds, up to 2 */
    int32_t counts[3];
    double from_mm[3];    /* position of the period before */
    double missing_mm[3]; /* of the position, not yet in the offset */
    double velocity_mm_s[3];
    double expected_mm[3]; /* the offset of the next period [4] */
};

void chip_axis_offset_init(struct chip_axis_offset *axes);

/* One period. */
void chip_axis_offset_step(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *settings,
                           const struct chip_axis_offset_in *in, struct chip_axis_offset_out *out);

#endif
