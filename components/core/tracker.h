/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker.h - follows the machine and keeps the stock model up to date: what stock_tracker.comp does in a
 * servo period, without pins.
 *
 * Who calls it: stock_tracker.comp in realtime, the shared library for tests.
 * Source: JP3131045 [0006]..[0009].
 *
 * Principle, one period:
 *  1. Position in: tip = axis - tool offset, in mm. An impossible position is a fault,
 *     and the tool is placed anew when positions are sound again. Only the axes decide whether a step is
 *     possible. Another tool offset (G43, G49) places the tool anew: it sweeps nothing, and is not a fault. If its tip is
 *     in the stock then, no tool can have got there: length, shape or stock is wrong, and the output says how deep it is.
 *     Until it moves at feed it cuts nothing at rest there, nor where it is jogged to, nor in a stock that is defined anew.
 *  2. A request for a new stock box starts filling the map, a part per period. While another
 *     program writes the map (`external_writer`) the tracker does not touch it. Its content afterwards
 *     is the stock, if it can be one: the writer has finished (generation even), and nothing
 *     had to be cut meanwhile.
 *     A head that changes between two periods without `external_writer`, or a result that is not finite, means that
 *     another program has written into the map: the stock is unknown then.
 *     A stock that another program has assumed (`is_assumed`) is not certain: it is cut and read, and nothing may act on
 *     it. The guards do not look, and no fault comes of it. It never takes the place of a certain stock.
 *  3. A tool whose numbers changed is built anew. An unknown tool, or one that is not in the
 *     spindle any more (tool_watch.h), cuts nothing; an assumed one is unknown in a certain stock.
 *  4. While cutting is enabled the segment since the last period is queued and cut; the rest is
 *     cut in the next period (sweep.h, 2). A round end that moves level on a feed does a part of a segment in each period.
 *  5. The guards look at a traverse and at the shank (guard.h), the look-ahead takes its samples
 *     (lookahead.h). Their results and the sums are the output.
 *     Clamps (clamp.h) are looked at before all that, with or without a stock, on every move but a probe's.
 *  6. 4 and 5 share CHIP_WORK_PER_PERIOD, cutting first, so that a period is bounded whatever the
 *     tool, the cells and the speed are. Work that does not fit is replaced by the worst case. A slow computer
 *     does a part of it (chip_tracker_set_work).
 */
#ifndef CHIPWISE_TRACKER_H
#define CHIPWISE_TRACKER_H

#include "clamp.h"
#include "lookahead.h"
#include "path_pace.h"
#include "guard.h"
#include "sweep.h"

/* The bounds of a period: larger ones lengthen the servo period's worst case, smaller ones let the map lag
 * behind the tool and make the look-ahead assume the worst case more often. */
#define CHIP_CELLS_PER_PERIOD 12000 /* filled at most */
#define CHIP_WORK_PER_PERIOD 16500  /* in cells of a flat end (sweep.h, 2), about a dozen instructions each */
#define CHIP_WORK_TO_CUT 10500      /* of it, for cutting at most */
/* A round end lowers all cells in front of it in every period, however short the step is. So it does a part of a level step in
 * a period, and what it moves meanwhile is joined to one step. More parts let the map lag more, by two or three periods each. */
#define CHIP_WORK_PARTS 3
#define CHIP_WORK_TO_RAMP 5250 /* and less than CHIP_WORK_TO_CUT of a ramp, which takes several periods in any case */
#define CHIP_WORK_TO_RAMP_LATE 8000 /* where more wait; a point on a ramp takes longer than its work says */
#define CHIP_WAITING_MAX 3          /* steps that wait; if there are more, as in a bend, the whole step is done */
#define CHIP_WORK_LEAST 1500        /* a part is at least so large */
#define CHIP_WORK_A_NODE 14         /* of a point read for a sample of the look-ahead, */
/* of one for a tool whose end is not flat: its samples have several times the points */
#define CHIP_WORK_A_ROUND_NODE 20
#define CHIP_WORK_MIN_PERCENT 10 /* of these bounds: with less the map lags too far behind the tool */
#define CHIP_RATE_SLOTS 1024     /* periods the removal rate can be averaged over */

#define CHIP_MIN_MU_PER_MM 1e-3 /* machine units per mm: 1, 1/25.4, .. */
#define CHIP_MAX_MU_PER_MM 1e3

enum chip_fault {
    CHIP_FAULT_NONE = 0,
    CHIP_FAULT_BOX_NOT_FINITE = 1, /* 1..3: chip_stock_error of the last request */
    CHIP_FAULT_BOX_EMPTY = 2,
    CHIP_FAULT_BOX_TOO_LARGE = 3,
    CHIP_FAULT_MAP = 4,            /* another program has left or written what cannot be the stock */
    CHIP_FAULT_TOOL_DIAMETER = 11, /* 11..14: 10 + chip_tool_error, only while cutting is enabled */
    CHIP_FAULT_TOOL_CORNER = 12,
    CHIP_FAULT_TOOL_ANGLE = 13,
    CHIP_FAULT_TOOL_FLUTE = 14,
    CHIP_FAULT_TOOL_CHANGED = 15, /* 15, 16: chip_tool_watch_fault */
    CHIP_FAULT_NO_MONITOR = 16,
    CHIP_FAULT_POSITION = 20, /* a position is not finite */
    CHIP_FAULT_JUMP = 21,     /* a step no machine can make */
    CHIP_FAULT_UNITS = 22,    /* units per mm not from CHIP_MIN_MU_PER_MM to CHIP_MAX_MU_PER_MM */
    CHIP_FAULT_TURNED = 23    /* an axis other than X Y Z has moved: the map is not where the stock is */
};

/* What the tracker does with the map. */
enum chip_tracker_state {
    CHIP_TRACKER_CUTTING = 0,        /* segments are queued as the tool moves, and cut [4] */
    CHIP_TRACKER_FLUSHING = 1,       /* cutting was off or the position was lost: queued segments are finished
                                         * first, new ones are not queued [1] [4] */
    CHIP_TRACKER_EXTERNAL_WRITER = 2 /* another program has the map, the tracker does not touch it [2] */
};

/* Members carry the name of the pin they come from and their unit; mu: machine units. */
struct chip_tracker_in {
    double pos_mu[3], tool_offset_mu[3];
    double mu_per_mm; /* machine units per mm */
    int motion;       /* motion.motion-type */
    int is_enabled;   /* cut what the tool meets */
    int is_turned;    /* an axis other than X Y Z has moved since the stock was defined */
    double tool_diameter_mu, tool_corner_radius_mu, tool_tip_angle_deg, tool_flute_length_mu;
    double box_min_mu[3], box_max_mu[3];
    int box_shape;                     /* chip_stock_shape */
    double box_turn_deg;               /* the box is turned by that about its middle */
    int define_request;                /* level: a rising edge defines the stock */
    int external_writer;               /* another program has the map */
    int is_assumed;                    /* and what it writes is a stock that nobody has confirmed [2] */
    int tool_is_assumed;               /* nobody has said that the tool is the described one [3] */
    int tool_unknown;                  /* the tool in the spindle is not the described one (tool_watch.h) */
    int watch_fault;                   /* CHIP_FAULT_TOOL_CHANGED, CHIP_FAULT_NO_MONITOR or 0 (tool_watch.h) */
    double distance_to_go_mu;          /* to the end of the segment; not positive: unknown */
    double acceleration_mu_s2;         /* not positive: unknown */
    double axis_acceleration_mu_s2[3]; /* of X, Y, Z; not positive: unknown */
    double max_jerk_mu_s3;             /* of a jerk-limited planner; not positive: not limited */
    double mrr_window_s;               /* of the removal rate */
    /* a set-up lets feeds above the stock be as fast as the axes (path_pace.h) */
    int is_air_free;
    double air_clearance_mu, ceiling_of_f, feed_override_share;
    double programmed_vel_mu_s; /* F of the program now; not positive: not replaced */
    int f_output;               /* the analog output that carries F; negative: unknown */
    /* the limits of the tooth (tooth.h): weights, 1/mm, 0: none; Kienzle's exponent; edges of the tool */
    double chip_weight_per_mm, power_weight_per_mm, force_weight_per_mm, force_exponent_mc, flutes;
    double tool_stick_out_mu, tool_holder_diameter_mu; /* of the holder; 0: unknown */
    double current_vel_mu_s;                           /* of the planner; not positive: unknown */
    const struct chip_clamp_table *clamps;             /* in shared memory; null: there are none */
    double period_s;
};

/* Members carry the name of the pin they go to and their unit, always mm. */
struct chip_tracker_out {
    int has_stock, is_ready, has_fault;
    int fault_number;          /* chip_fault */
    double removed_volume_mm3; /* since the stock was defined */
    double mrr_mm3_min;        /* over the window */
    double section_area_mm2;   /* at the tool */
    double depth_mm;           /* above the tip */
    double buried_depth_mm; /* of a tool where another offset or shape has placed it in the stock; 0: not in it [1] */
    double dir_z;           /* vertical part of the unit direction, -1..1 */
    double descent_mm;      /* of travel until a feed goes down; negative: none in sight */
    double descent_accel_mm_s2; /* mean the planner may brake with until there; 0: unknown */
    struct chip_pace pace;      /* unknown if feeds above the stock are not free */
    int has_flute_excess, has_rapid_contact;
    double rapid_distance_mm; /* to the stock a traverse meets; 0: none seen */
    int is_held;              /* the map is not touched: answer to `external_writer` */
    int is_certain;           /* there is a stock, and a program or a person has confirmed it [2] */
    struct chip_load_profile load;
    int has_clamp_contact; /* the tool has to stop before a clamp (clamp.h) */
    double clamp_distance_mm;
    int met_clamp, met_part; /* the clamp, from 1, and the body of the tool; 0 and 0: none */
    int clamps_in_force,
        tables_taken; /* in force; half the generation of the table that was looked at last, -1: it was refused */
};

struct chip_tracker {
    enum chip_tracker_state state;
    struct chip_tool tool;
    struct chip_tooth tooth;
    double built[4]; /* numbers the tool was built from, mm and degrees */
    int tool_error;  /* chip_tool_error of the last build; -1: not built */
    struct chip_sweep sweep;
    struct chip_path path; /* the programmed path, filled by the planner's reader */
    struct chip_lookahead lookahead;
    double tip[3], axis[3]; /* mm, of the last period */
    double offset_mu[3];    /* machine units, of the last period */
    double start[3];        /* mm, where another offset has placed the tool [1] */
    int has_start;          /* it has cut nothing since, because earlier segments wait */
    double buried_mm;       /* depth in the stock of the tool where it was placed anew, until a feed; 0: none */
    int tip_known, last_request, box_error, fault;
    struct chip_guard guard;
    struct chip_clamps clamps;
    uint32_t feed_finished;   /* sweep.finished when no feed's segment waits any more */
    int work_percent;         /* of the bounds of a period [6] */
    int parts_left;           /* periods until a round end's work is not divided any more [4] */
    int is_uncertain;         /* the stock is assumed [2] */
    int held_assumed;         /* and so is the one that is being written */
    int held_moved;           /* the machine moved while another program had the map: a cut may be missing */
    int held_waiting;         /* segments were still to be cut when it took the map */
    uint32_t held_generation; /* of the map then */
    double held_coarsest, held_finest, held_mm3; /* mm, mm, mm3: bounds of the cell, and volume removed then */
    uint64_t held_definitions;                   /* of the map then (stock.h) */
    uint32_t held_capacity;
    /* the map's head as of the last period: private memory */
    uint64_t own_head[(sizeof(struct chip_stock) + 7) / 8];
    int own_known;
    double rate_log[CHIP_RATE_SLOTS]; /* mm3 removed so far, a value per period */
    int rate_next, rate_filled;
};

void chip_tracker_init(struct chip_tracker *tracker);

/* From now on a period does that part of its work, CHIP_WORK_MIN_PERCENT to 100 (clamped) [6]. */
void chip_tracker_set_work(struct chip_tracker *tracker, int percent);

/* Notes the head of a map that has just been made: its cell, capacity and everything else are used as they are now,
 * whatever the shared memory says later. */
void chip_tracker_own_map(struct chip_tracker *tracker, const struct chip_stock *stock);

/* How far the core looks ahead in this period, mm. */
double chip_tracker_horizon(const struct chip_tracker *tracker, const struct chip_stock *stock,
                            const struct chip_tracker_in *in);

/* Whether the tool offset differs from the last period's: the path read so far is void. */
static inline int chip_tracker_offset_changed(const struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    int i;
    for (i = 0; i < 3; i++)
        if (!(in->tool_offset_mu[i] == tracker->offset_mu[i])) return 1;
    return 0;
}

/* One period. `stock` is a block made by chip_stock_init; tracker->path follows the planner already. */
void chip_tracker_step(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                       struct chip_tracker_out *out);

#endif
