/* tool_watch.h - is the tool the tracker knows still the tool in the spindle?
 *
 * Who calls it: stock_tracker.comp, once per servo period, before the core.
 * Source: LinuxCNC 2.9.4 and 2.9.10, iotask/ioControl.cc: iocontrol.0.tool-number changes in the moment a tool is
 * loaded (M6) or named (M61).
 *
 * The tool's shape comes from chipwise-monitor, a process in user space that can be late, stopped or dead.
 * Principle:
 *  1. The machine's own tool number is compared with the one that chipwise-monitor has followed. While they
 *     differ the tool is unknown: at once nothing is cut and the tracker is not ready. For a monitor that runs this
 *     lasts 20 ms. After CHIP_TOOL_GRACE_S it is a fault.
 *  2. A change of the tool that leaves its number alone (tool table, geometry file) is seen by the monitor only. It counts
 *     a heartbeat; a count that stands still for the limit is a fault. The limit is long (seconds), because a busy machine
 *     may leave the process waiting: what cannot wait is 1.
 */
#ifndef CHIPWISE_TOOL_WATCH_H
#define CHIPWISE_TOOL_WATCH_H

#define CHIP_TOOL_GRACE_S 0.05      /* s a tool may be unknown before that is a fault */

enum chip_tool_watch_fault {
    CHIP_TOOL_WATCHED = 0,
    CHIP_TOOL_CHANGED = 15,         /* the tool in the spindle is not the one that was described */
    CHIP_TOOL_UNWATCHED = 16        /* no heartbeat */
};

struct chip_tool_watch_in {
    int machine_tool;               /* number of the tool in the spindle, by the machine itself */
    int followed_tool;              /* the same as the monitor has last seen and described it */
    int beats;                      /* counts while the monitor runs */
    double limit_s;                 /* s without a heartbeat; not positive: not watched */
    double period_s;
};

struct chip_tool_watch {
    int last_heartbeat;
    double silent_s;                /* since the last heartbeat */
    double changed_s;               /* since the tool is unknown */
    int is_unknown;                 /* nothing may be cut with the tool that was described [1] */
    int code;                       /* chip_tool_watch_fault */
};

/* One period. */
void chip_tool_watch_step(struct chip_tool_watch *watch, const struct chip_tool_watch_in *in);

#endif
