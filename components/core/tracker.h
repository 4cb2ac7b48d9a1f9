/* tracker.h - follows the machine and keeps the stock true: what stock_tracker.comp does in a
 * servo period, without pins.
 *
 * Who calls it: stock_tracker.comp in realtime, the shared library for tests.
 * Source: JP3131045 [0006]..[0009].
 *
 * Principle, one period:
 *  1. Position in: tip = axis - tool offset, in mm. What cannot be a position is a fault,
 *     and the tool is placed anew when positions are sound again. Whether a step is possible is judged by
 *     the axes. Another tool offset (G43, G49) places the tool anew: it sweeps nothing, and is no fault.
 *  2. A request for a new stock box starts filling the map, a part per period. While another
 *     program writes the map (`foreign`) it is not touched at all; what stands in it afterwards
 *     is the stock, if it can be one: its writer has come to the end (generation even), and nothing
 *     was to be cut meanwhile.
 *     A head that has changed between two periods without `foreign`, or a result that is not finite, means that
 *     another program has written into the map: no stock is known then.
 *  3. A tool whose numbers changed is built anew; nothing is cut by an unknown tool, nor by one that is not in the
 *     spindle any more (tool_watch.h).
 *  4. While cutting is enabled the way since the last period is queued and cut; what is left is
 *     cut in the next (sweep.h, 2).
 *  5. The guards look at a traverse and at the shank (guard.h), the look-ahead takes its samples
 *     (ahead.h). Their views and the sums go out.
 *  6. 4 and 5 share CW_WORK_PER_PERIOD, cutting first, so that a period has a bound whatever the
 *     tool, the cells and the speed are. What does not get its turn is taken for the worst case.
 */
#ifndef CHIPWISE_TRACKER_H
#define CHIPWISE_TRACKER_H

#include "ahead.h"
#include "guard.h"
#include "sweep.h"

#define CW_CELLS_PER_PERIOD 12000       /* filled at most */
#define CW_WORK_PER_PERIOD 16500        /* in cells of a flat end (sweep.h, 2), about a dozen instructions each */
#define CW_WORK_TO_CUT 10500            /* of it, for cutting at most */
#define CW_WORK_A_NODE 14               /* of a place read for a sample of the look-ahead */
#define CW_RATE_SLOTS 1024              /* periods the removal rate can be averaged over */

#define CHIP_LEAST_UNIT 1e-3            /* machine units per mm: 1, 1/25.4, .. */
#define CHIP_MOST_UNIT 1e3

enum cw_fault {
    CW_FAULT_NONE = 0,
    CW_FAULT_BOX_NOT_FINITE = 1,        /* 1..3: cw_stock_error of the last request */
    CW_FAULT_BOX_EMPTY = 2,
    CW_FAULT_BOX_TOO_LARGE = 3,
    CW_FAULT_MAP = 4,
    CW_FAULT_TOOL_DIAMETER = 11,        /* 11..14: 10 + cw_tool_error, only while cutting is enabled */
    CW_FAULT_TOOL_CORNER = 12,
    CW_FAULT_TOOL_ANGLE = 13,
    CW_FAULT_TOOL_FLUTE = 14,
    CW_FAULT_TOOL_CHANGED = 15,         /* 15, 16: chip_tool_watch_fault */
    CW_FAULT_NO_MONITOR = 16,
    CW_FAULT_POSITION = 20,             /* a position is not finite */
    CW_FAULT_JUMP = 21,                 /* a step no machine can make */
    CW_FAULT_UNITS = 22,                /* units per mm not from CHIP_LEAST_UNIT to CHIP_MOST_UNIT */
    CW_FAULT_TURNED = 23                /* an axis beside X Y Z has moved: the map is not where the stock is */
};

struct cw_tracker_in {
    double axis[3], offset[3];          /* machine units */
    double unit;                        /* machine units per mm */
    int motion;                         /* motion.motion-type */
    int cutting;                        /* cut what the tool meets */
    int other_moved;                      /* an axis beside X Y Z has moved since the stock was defined */
    double tool_size[4];                /* diameter, corner radius (machine units), tip angle (degrees), flute length */
    double box_min[3], box_max[3];      /* machine units */
    int form;                           /* cw_stock_shape of the box */
    double box_turn;                    /* degrees the box is turned by about its middle */
    int request;                        /* level: a rising edge defines the stock */
    int foreign;                         /* another program has the map */
    int tool_unknown;                   /* the tool in the spindle is not the one of tool_size (tool_watch.h) */
    int watch_fault;                    /* CW_FAULT_TOOL_CHANGED, CW_FAULT_NO_MONITOR or 0 (tool_watch.h) */
    double to_go;                       /* machine units to the end of the segment; not positive: unknown */
    double accel;                       /* machine units/s2; not positive: unknown */
    double axis_accel[3];               /* of X, Y, Z, machine units/s2; not positive: unknown */
    double jerk;                        /* machine units/s3 of a planner that bounds it; not positive: it does not */
    double window;                      /* s, of the removal rate */
    double period;                      /* s */
};

struct cw_tracker_out {
    int has_stock, is_ready, has_fault, code;
    double removed_mm3;                 /* since the stock was defined */
    double rate;                        /* mm3/min over the window */
    double here;                        /* mm2, section area at the tool */
    double deepest;                     /* mm above the tip */
    double upward;                      /* vertical part of the direction, -1..1 */
    int over_flute, rapid_hit;
    double rapid_mm;                    /* mm to the stock a traverse meets; 0: none seen */
    int is_held;                        /* the map is not touched: answer to `foreign` */
    struct cw_ahead_view view;          /* distances in mm */
};

struct cw_tracker {
    struct cw_tool tool;
    double built[4];                    /* what the tool was built from, mm and degrees */
    int tool_error;                     /* cw_tool_error of the last build; -1: not built */
    struct cw_sweep sweep;
    struct cw_ahead ahead;
    double tip[3], axis[3];             /* mm, of the last period */
    double offset[3];                   /* machine units, of the last period */
    double start[3];                    /* mm, where the tool was placed by another offset [1] */
    int has_start;                      /* and has cut nothing since, because legs from before wait */
    int tip_known, last_request, box_error, fault;
    int parted;                         /* cutting was off, and legs from before still wait */
    struct cw_guard guard;
    int held;                           /* another program had the map in the last period */
    int held_cut;                       /* the machine went on in the meantime: a cut may be missing */
    int held_left;                      /* legs were still to be cut when it took it */
    uint32_t held_generation;           /* of the map when it took it */
    double held_cell, held_mm3;         /* cell and volume removed when it took it, mm, mm3 */
    uint32_t held_capacity;
    uint64_t own_head[(sizeof(struct cw_stock) + 7) / 8];       /* the map's head as of the last period: nobody else can write it */
    int own_known;
    double rate_log[CW_RATE_SLOTS];     /* mm3 removed so far, a value per period */
    int rate_next, rate_filled;
};

void cw_tracker_init(struct cw_tracker *tracker);

/* Notes the head of a map that has just been made: cell, capacity and everything else count as they are here, whatever the
 * shared memory says later. */
void chip_tracker_own_map(struct cw_tracker *tracker, const struct cw_stock *stock);

/* How far the core looks ahead in this period, mm. */
double cw_tracker_horizon(const struct cw_tracker *tracker, const struct cw_stock *stock,
                          const struct cw_tracker_in *in);

/* Whether the tool offset is another one than in the last period: what was read of the way ahead is void. */
int cw_tracker_offset_changed(const struct cw_tracker *tracker, const struct cw_tracker_in *in);

/* One period. `stock` is a block made by cw_stock_init. */
void cw_tracker_step(struct cw_tracker *tracker, struct cw_stock *stock,
                     const struct cw_tracker_in *in, struct cw_tracker_out *out);

#endif
