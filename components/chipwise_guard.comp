component chipwise_guard "Stop the machine before a traverse meets stock, and say why";
description """
Holds the machine when stock_tracker(9) sees a traverse that is about to meet stock, or a feed
on which the shank cuts. The hold stays until the motion is over: the operator aborts the program
(Stop, Esc) and may then jog or run what he likes. A rising edge of
.B release
lets the machine go on as it is, past this one place: on a traverse until it has come out of the stock, or the traverse or the
line ends.

.B inhibit, hold
are stop, or what another HAL file wants of the same two pins and gives to
.B inhibit-in, hold-in.
They belong to motion.feed-inhibit and motion.feed-hold. chipwise needs both: LinuxCNC 2.9 and 2.10 look at the first only while
the spindle override is enabled (control.c: M51 P0 and M49 switch it off), at the second only while M53 P1 is on; with
either of them a traverse, a feed and an arc brake at the planner's acceleration. A thread (G33,
G76) ends first.

Add the function to the servo thread after that of stock_tracker.
""";

pin in bit rapid_contact "stock-tracker.N.rapid-contact";
pin in bit flute_excess "stock-tracker.N.flute-excess";
pin in bit disobeyed "TRUE: the override is set but not obeyed";
pin in float rapid_distance "stock-tracker.N.rapid-distance, machine units";
pin in float depth "stock-tracker.N.depth, machine units";
pin in s32 motion_type "motion.motion-type; 0 ends the hold";
pin in bit coord_mode "motion.coord-mode; FALSE (jogging, homing) ends the hold";
pin in s32 program_line "motion.program-line";
pin in bit release "rising edge: go on past this place";

pin in bit inhibit_in "another wish to inhibit the feed; passed on to inhibit";
pin in bit hold_in "another wish to hold the feed; passed on to hold";

pin out bit stop "a guard stops the machine";
pin out bit inhibit "to motion.feed-inhibit: stop or inhibit-in";
pin out bit hold "to motion.feed-hold: stop or hold-in";
pin out s32 reason "of the stop: 0 none, 1 rapid contact, 2 flute excess, 3 disobeyed";
pin out s32 line "of the program, where it came to that";
pin out float distance "machine units the traverse had left until the stock, when it was stopped";
pin out float deepest "machine units, depth of cut when it came to that; of a flute excess the largest until the machine stood";

param rw bit guard_rapid = 1 "stop for rapid-contact";
param rw bit guard_flute = 1 "stop for flute-excess";
param rw bit guard_obeyed = 1 "stop for disobeyed";

variable int was_released;
variable int passing;
variable int reached;
variable int passing_line;
function _ fp;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9)";
;;

#define NOTHING 0
#define RAPID 1
#define FLUTE 2
#define DISOBEYED 3

#define REACHED 1e-6            /* machine units to the stock: it is there */

/* Whether the place the machine was let past lies behind: a traverse speeds up again after the release, and sees the
 * same stock only when it is fast enough. */
static int is_past(struct __comp_state *__comp_inst, int found)
{
    if (passing != RAPID) return found != passing;
    return motion_type != RAPID || program_line != passing_line || (reached && !rapid_contact);
}

/* A length of a pin: 0 where it is none. */
static double length(double value) { return value >= 0.0 && value < 1e9 ? value : 0.0; }

FUNCTION(_) {
    int moving = motion_type != 0 && coord_mode;
    int found = rapid_contact && guard_rapid ? RAPID
        : flute_excess && guard_flute ? FLUTE
        : disobeyed && guard_obeyed ? DISOBEYED : NOTHING;
    int released = release && !was_released;

    was_released = release;
    if (passing == RAPID) reached |= rapid_contact && rapid_distance <= REACHED;
    if (!moving || is_past(__comp_inst, found)) passing = NOTHING;
    if (released && reason != NOTHING) {
        passing = reason;
        passing_line = program_line;
        reached = 0;
    }
    if (!moving || released) reason = NOTHING;
    else if (reason == NOTHING && found != NOTHING && found != passing) {
        reason = found;
        line = program_line;
        distance = length(rapid_distance);
        deepest = length(depth);
    } else if (reason == FLUTE && length(depth) > deepest) {
        deepest = length(depth);        /* at the first touch the edge of the stock is known within a cell only */
    }
    stop = reason != NOTHING;
    inhibit = stop || inhibit_in;
    hold = stop || hold_in;
}
