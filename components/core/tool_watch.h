/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tool_watch.h - checks that the tool the tracker knows is still the tool in the spindle.
 *
 * Who calls it: stock_tracker.comp, once per servo period, before the core.
 * Source: LinuxCNC 2.9.4 and 2.9.10, iotask/ioControl.cc: iocontrol.0.tool-number changes at the moment a tool is
 * loaded (M6) or named (M61).
 *
 * The tool's shape comes from chipwise-monitor, a user space process that can be late, stopped or dead.
 * Principle:
 *  1. The machine's own tool number is compared with the one that chipwise-monitor has followed. While they
 *     differ the tool is unknown: nothing is cut and the tracker is not ready. With a running monitor this
 *     lasts 20 ms. After CHIP_TOOL_GRACE_S it is a fault.
 *  2. Only the monitor sees a change of the tool that keeps its number (tool table, geometry file). It counts
 *     a heartbeat; a count that does not change for the timeout is a fault. The timeout is long (seconds), because a
 *     busy machine may leave the process waiting; 1 covers what cannot wait.
 *  3. A monitor that begins in place of one that has died sets the count back. Nobody followed the tool until then.
 *  4. If the whole computer was stopped (a virtual machine, a laptop asleep), the servo thread makes up
 *     the periods that it has missed at once. The monitor had no time in them, so they do not count against it.
 *  5. Nobody can say whether a traverse of an unknown tool meets stock or a clamp, so it waits (`is_awaited`), as long as the
 *     monitor may still come: until its timeout has passed since the tool changed, or since its last heartbeat. A tool that
 *     the monitor has followed is known, even if it has no shape that could be guarded: it is not waited for.
 */
#ifndef CHIPWISE_TOOL_WATCH_H
#define CHIPWISE_TOOL_WATCH_H

/* s a tool may be unknown before that is a fault. The monitor takes 20 ms; a shorter time makes every tool change a
 * fault, a longer one reports a dead monitor later. */
#define CHIP_TOOL_GRACE_S 0.05
#define CHIP_STOPPED_S                                                                                                 \
    0.5 /* between two periods, s, from which on the computer was stopped [4]; a late thread is later by milliseconds */

enum chip_tool_watch_fault {
    CHIP_TOOL_WATCHED = 0,
    CHIP_TOOL_CHANGED = 15,  /* the tool in the spindle is not the one that was described */
    CHIP_TOOL_UNWATCHED = 16 /* no heartbeat */
};

/* Members carry the name of the pin they come from and their unit. */
struct chip_tool_watch_in {
    int tool_in_spindle_number; /* by the machine itself */
    int tool_followed_number;   /* as the monitor has last seen and described it */
    int heartbeat_count;        /* counts while the monitor runs */
    double monitor_timeout_s;   /* without a heartbeat; not positive: not watched */
    double period_s;
    double since_last_s; /* by the computer's clock, since the period before; 0: not known */
};

struct chip_tool_watch {
    int last_heartbeat;
    double silent_s;  /* since the last heartbeat */
    double changed_s; /* since the tool is unknown */
    double stopped_s; /* of standstill that is still to be made up [4] */
    int is_unknown;   /* nothing may be cut with the tool that was described [1] */
    int is_unwatched; /* nobody follows the tool [2], or nobody did up to this period [3] */
    int is_awaited;   /* it is unknown, and the monitor may still describe it [5] */
    int code;         /* chip_tool_watch_fault */
};

/* One period. */
void chip_tool_watch_step(struct chip_tool_watch *watch, const struct chip_tool_watch_in *in);

#endif
