// SPDX-License-Identifier: GPL-2.0-or-later
component chipwise_guard "Stop the machine before a traverse meets stock or any move a clamp, and say why";
description """
Holds the machine when stock_tracker(9) reports a traverse that is about to meet stock, a move that is about to meet a clamp, or a feed move
on which the shank cuts, and when volumetric_feed(9) reports that the override is ignored or, if it is asked to, that the
load of the spindle does not belong to the cut. The hold stays until the
motion is over: the operator aborts the program (Stop, Esc) and may then jog or run again. A rising edge of
.B release
lets the machine continue past this stop once: a traverse until it has left the stock, or until the traverse or the
line ends.

.B waits
holds a traverse without ending it: while the shape of a new tool is still awaited, nobody can say whether the traverse meets
stock or a clamp. It goes on by itself when chipwise-monitor has described the tool, or
.B monitor-timeout
of stock_tracker has passed. Without a certain stock and without clamps nothing waits.

.B inhibit, hold
are stop and waits combined with the requests of other HAL files at
.B inhibit-in, hold-in.
They go to motion.feed-inhibit and motion.feed-hold. chipwise needs both: LinuxCNC 2.9 and 2.10 use the first only while
the spindle override is enabled (control.c: M51 P0 and M49 switch it off), the second only while M53 P1 is on. With
either of them a traverse, a feed move and an arc brake at the planner's acceleration. A thread (G33,
G76) ends first.

Add the function to the servo thread after that of stock_tracker.
""";

pin in bool rapid_contact "stock-tracker.N.rapid-contact";
pin in bool flute_excess "stock-tracker.N.flute-excess";
pin in bool override_ignored "volumetric-feed.N.override-ignored";
pin in bool load_stop "volumetric-feed.N.load-stop";
pin in bool clamp_contact "stock-tracker.N.clamp-contact";
pin in real clamp_distance "stock-tracker.N.clamp-distance, machine units";
pin in si32 clamp_number "stock-tracker.N.clamp-number";
pin in si32 clamp_part "stock-tracker.N.clamp-part";
pin in real rapid_distance "stock-tracker.N.rapid-distance, machine units";
pin in real depth "stock-tracker.N.depth, machine units";
pin in si32 motion_type "motion.motion-type; 0 ends the hold";
pin in bool coord_mode "motion.coord-mode; FALSE (jogging, homing) ends the hold";
pin in si32 program_line "motion.program-line";
pin in bool tool_awaited "stock-tracker.N.tool-awaited: a traverse waits";
pin in bool certain "stock-tracker.N.certain: there is a stock that traverses are guarded from";
pin in si32 clamp_count "stock-tracker.N.clamp-count";
pin in si32 tool_in_spindle "its number (iocontrol.0.tool-number), for the message";
pin in bool release "rising edge: continue past this stop";

pin in bool inhibit_in "request of another HAL file to inhibit the feed; passed on to inhibit";
pin in bool hold_in "request of another HAL file to hold the feed; passed on to hold";

pin out bool stop "TRUE while a guard stops the machine";
pin out bool waits "TRUE while a traverse waits for the shape of a new tool";
pin out bool inhibit "to motion.feed-inhibit: stop, waits or inhibit-in";
pin out bool hold "to motion.feed-hold: stop, waits or hold-in";
pin out si32 reason "reason of the stop: 0 none, 1 rapid contact, 2 flute excess, 3 override ignored, 4 spindle load, 5 clamp contact";
pin out si32 line "program line of the stop";
pin out real distance "distance from the traverse to the stock, or from the move to the clearance of the clamp, at the stop, machine units";
pin out si32 clamp "clamp-number at the stop";
pin out si32 part "clamp-part at the stop";
pin out real deepest "depth of cut at the stop, machine units; for a flute excess, the largest until the machine was at rest";

param rw bool guard_rapid = 1 "TRUE: stop on rapid-contact";
param rw bool guard_clamp = 1 "TRUE: stop on clamp-contact";
param rw bool guard_flute = 1 "TRUE: stop on flute-excess";
param rw real notice = 0.5 "time that a traverse waits until a message says so, s";
param rw bool guard_override = 1 "TRUE: stop on override-ignored";

variable int was_released;
variable int passing;
variable int reached;
variable int passing_line;
variable double waited_s;
variable int is_told;
function _;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9)";
include "registers.h";
include "core/motion_kind.h";
;;

#define REACHED 1e-6            /* machine units to the stock: the tool has reached it */

/* Whether the stop that was released lies behind: a traverse accelerates again after the release, and detects the
 * same stock only when it is fast enough. */
static int is_past(struct __comp_state *__comp_inst, int found)
{
    if (passing != CHIP_REASON_RAPID_CONTACT) return found != passing;
    return motion_type != CHIP_MOTION_TRAVERSE || program_line != passing_line || (reached && !rapid_contact);
}

/* A length from a pin; 0 if it is not a length. */
static double length(double value) { return value >= 0.0 && value < 1e9 ? value : 0.0; }

/* Tells the operator of a traverse that waits for long, once: chipwise-monitor may be what does not come. */
static void tell(struct __comp_state *__comp_inst, long period)
{
    waited_s = waits ? waited_s + fperiod : 0.0;
    is_told &= waits;
    if (is_told || !(waited_s > notice)) return;
    is_told = 1;
    rtapi_print_msg(RTAPI_MSG_ERR,
        "chipwise: a traverse waits because chipwise-monitor has not described tool %d yet; it goes on by itself, after some "
        "seconds without a guard\n", (int)tool_in_spindle);
}

FUNCTION(_) {
    int moving = motion_type != CHIP_MOTION_NONE && coord_mode;
    int found = clamp_contact && guard_clamp ? CHIP_REASON_CLAMP_CONTACT
        : rapid_contact && guard_rapid ? CHIP_REASON_RAPID_CONTACT
        : flute_excess && guard_flute ? CHIP_REASON_FLUTE_EXCESS
        : override_ignored && guard_override ? CHIP_REASON_OVERRIDE_IGNORED
        : load_stop ? CHIP_REASON_LOAD : CHIP_REASON_NONE;
    int released = release && !was_released;

    was_released = release;
    if (passing == CHIP_REASON_RAPID_CONTACT) reached |= rapid_contact && rapid_distance <= REACHED;
    if (!moving || is_past(__comp_inst, found)) passing = CHIP_REASON_NONE;
    if (released && reason != CHIP_REASON_NONE) {
        passing = reason;
        passing_line = program_line;
        reached = 0;
    }
    if (!moving || released) reason_set(CHIP_REASON_NONE);
    else if (reason == CHIP_REASON_NONE && found != CHIP_REASON_NONE && found != passing) {
        reason_set(found);
        line_set(program_line);
        distance_set(length(found == CHIP_REASON_CLAMP_CONTACT ? clamp_distance : rapid_distance));
        clamp_set(clamp_number);
        part_set(clamp_part);
        deepest_set(length(depth));
    } else if (reason == CHIP_REASON_FLUTE_EXCESS && length(depth) > deepest) {
        deepest_set(length(depth)); /* at the first touch the edge of the stock is known within a cell only */
    }
    stop_set(reason != CHIP_REASON_NONE);
    waits_set(moving && motion_type == CHIP_MOTION_TRAVERSE && tool_awaited
        && ((certain && guard_rapid) || (clamp_count > 0 && guard_clamp)));
    tell(__comp_inst, period);
    inhibit_set(stop || waits || inhibit_in);
    hold_set(stop || waits || hold_in);
}
