// SPDX-License-Identifier: GPL-2.0-or-later
component chipwise_command "Carry M250..M254 and M256 from the interpreter to the HAL, in step with motion";
description """
The interpreter runs far ahead of the machine, so a code that must act in step with the machine
uses motion's analog outputs, which M68 sets in queue order. Two
outputs carry any number of values: first the number of a register goes to
.B word,
then its content to
.B value.
Registers 1..6 are the stock box, 8 its shape, 9 its turn, 11..14 the feed, 21 the slot of a file or the set-up of clamps. They take effect
only with the word that commits them (7: the stock, 17: the feed, 27: save, 28: restore, 29: clamps), so a program aborted in between
changes nothing.

The feed ends by itself:
.B mode
goes to 0 when the machine is switched off (
.B enabled
FALSE) and when the program that has switched it on ends (
.B program-running
FALSE: end, abort, error, E-stop), is aborted (
.B aborted
TRUE, also if chipwise-monitor is late or dead) or is not seen while nothing moves for a second (
.B current-vel
). A feed switched on in MDI ends when a program starts. If
.B program-mark
is what it was when the feed was switched on, and not 0, that program has the feed as if it had switched it on itself:
.B feed-carried
is TRUE then, and the set-up of
.B job
does not count in that run.

A program that a person has set up (
.B job
TRUE when it starts) runs in mode 2 with
.B job-target
as long as
.B job-active
is TRUE: until it switches the feed itself, ends, is aborted, the machine goes off, or
.B job
goes FALSE. It does not come back before the next start.

.B request
ends with an abort and with the machine off, too: nobody waits for the file any more.
""";

pin in real word "number of the register that value goes to (motion.analog-out-N)";
pin in real value "content of the register (motion.analog-out-M)";
pin out real min_x "register 1: stock box, machine units";
pin out real min_y "register 2";
pin out real min_z "register 3";
pin out real max_x "register 4";
pin out real max_y "register 5";
pin out real max_z "register 6";
pin out si32 shape "register 8, as of the last commit: shape of the stock, stock_tracker(9)";
pin out real turn "register 9, as of the last commit: angle of the box in degrees, stock_tracker(9)";
pin out bool define "TRUE while word is 7";
pin out si32 mode "register 11, as of the last commit: mode of volumetric_feed(9)";
pin in bool enabled = 1 "motion.motion-enabled";
pin in bool program_running "chipwise-monitor.program-running: TRUE while a program runs, not MDI";
pin in si32 program_mark "chipwise-monitor.program-mark: checksum of path and state of the loaded program; 0: none";
pin in real current_vel "motion.current-vel, machine units/s: 0 while nothing moves";
pin in bool aborted "stock-tracker.N.aborted: TRUE for the period in which motion gets the command to abort";
pin in bool stock_defined "stock-tracker.N.stock-defined";
pin in bool certain = 1 "stock-tracker.N.certain; FALSE: the stock is assumed, and none to the codes";
pin in si32 fault_code "stock-tracker.N.fault-code";
pin in si32 reply "chipwise-monitor.reply";
pin in bool job "chipwise-monitor.job: the loaded program has a set-up that a person has confirmed";
pin in real job_target "chipwise-monitor.job-target: mm3/min that the tool in the spindle may remove in it; 0: the feed is F";
pin in bool job_waits "chipwise-monitor.job-waits: and it waits until the program's first F switches adaptive feed on";
pin in real job_ceiling "chipwise-monitor.job-ceiling: how many times its F a move of it may be fast, 1..10";
pin out bool feed_carried "M251 of MDI is in force in the program that runs, which was loaded when it was given; to chipwise-monitor.feed-carried";
pin out bool job_active "the set-up is in force: mode and mrr-target follow it";
pin out si32 run_end "how the last program has ended: 0 it runs, or none has, 1 by itself, 2 stopped (abort, machine off); to chipwise-monitor.run-end";
pin out bool feed_decided "TRUE for a period when M251 or M252 takes effect, a program starts or is aborted, or the machine goes off; to stock-tracker.N.feed-decided";
pin out si32 request "to the monitor: 1 save while word is 27, 2 restore while it is 28, 3 clamps while it is 29, until an abort or machine off, else 0";
pin out si32 slot "register 21, as of the last commit: number of the file or of the set-up of clamps";
pin in bool job_air "chipwise-monitor.job-air: feeds above the stock of the set-up may be as fast as the axes";
pin out bool air "job-air while the set-up is in force; to stock-tracker.N.air and volumetric-feed.N.air";
pin out real status "to motion.analog-in-N, where the codes check that they took effect: mode + 10 if a certain stock is defined + 100 * fault-code + 10000 * reply + 1000000 * (100 * job-ceiling) + 10000000000 if job-waits + 20000000000 if job-active + 40000000000 if feed-carried + 80000000000 if job-air";
pin out real mrr_target "register 12, as of the last commit: mm3/min; 0: none (volumetric_feed(9))";
pin out real mrr_lower "register 13, as of the last commit: mm3/min";

variable double box[6];
variable int form;
variable double angle;
variable double number_of_file;
variable double feed[4];
variable int of_program;
variable int mark_of_feed;
variable int was_running;
variable int is_started;
variable int is_stopped;
variable double unseen_for;
variable int committed;
variable int file_given_up;
function _;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9)";
include "registers.h";
;;

#define UNSEEN_S 1.0            /* of rest, longer than chipwise-monitor may take to see a program begin */

/* Whether the feed has to end: the machine is off, its program is over or aborted, or a program starts after MDI. */
static int feed_is_over(struct __comp_state *__comp_inst, long period)
{
    int starts = program_running && !was_running, ends = !program_running && was_running,
        moves = current_vel > 0.0; /* nothing has ended then; the processor may have been busy with other things */
    was_running = program_running;
    is_started = starts;
    is_stopped = !starts && (is_stopped || (program_running && (aborted || !enabled)));
    if (starts) run_end_set(CHIP_RUN_GOES_ON);
    if (ends) run_end_set(is_stopped ? CHIP_RUN_STOPPED : CHIP_RUN_WHOLE);
    feed_decided_set(starts || aborted || !enabled);
    unseen_for = program_running || moves ? 0.0 : unseen_for + fperiod;
    if (starts) {                       /* once: the feed belongs to this program from here on */
        feed_carried_set(!of_program && mode != 0 && mark_of_feed != 0 && mark_of_feed == program_mark);
        of_program = of_program || feed_carried;
    }
    return !enabled || (of_program ? ends || aborted || unseen_for > UNSEEN_S : starts);
}

/* The set-up of the program that runs. `commits`: the program has switched the feed itself, and that counts from here on. */
static void follow_job(struct __comp_state *__comp_inst, int commits)
{
    int before = job_active, is_on = (job_active || is_started) && job && program_running && enabled && !aborted && !commits
        && !feed_carried;
    job_active_set(is_on);
    if (is_on) {
        double target = job_target;
        int known = target > 0.0 && target < CHIP_MOST_JOB_RATE;
        mode_set(known ? CHIP_FEED_OF_JOB : 0);
        mrr_target_set(known ? target : 0.0);
        mrr_lower_set(0.0);
    } else if (before && !commits) {
        mode_set(0);
    }
    air_set(job_active && job_air);
}

/* What the interpreter asks of the set-up, as a part of `status`. */
static double job_status(struct __comp_state *__comp_inst)
{
    double times = job_ceiling;
    int hundredths = times >= 1.0 && times <= CHIP_MOST_CEILING ? (int)(100.0 * times + 0.5) : 100;
    if (!job) return 0.0;
    return (double)CHIP_STATUS_JOB * hundredths + (job_waits ? CHIP_STATUS_WAITS : 0.0) + (job_active ? CHIP_STATUS_ACTIVE : 0.0)
        + (job_air ? CHIP_STATUS_AIR : 0.0);
}

FUNCTION(_) {
    double w = word;
    int number = w > 0.5 && w < 100.0 ? (int)(w + 0.5) : 0;
    int of_file = number == CHIP_REGISTER_SAVE_COMMIT || number == CHIP_REGISTER_RESTORE_COMMIT
        || number == CHIP_REGISTER_CLAMPS_COMMIT, commits = 0;

    if (number >= CHIP_REGISTER_BOX_FIRST && number < CHIP_REGISTER_BOX_FIRST + CHIP_BOX_REGISTERS)
        box[number - CHIP_REGISTER_BOX_FIRST] = value;
    if (number == CHIP_REGISTER_BOX_SHAPE) form = value > 0.5 && value < 1.5;
    if (number == CHIP_REGISTER_BOX_TURN) angle = value > -1000.0 && value < 1000.0 ? value : 0.0;
    if (number == CHIP_REGISTER_FILE_SLOT) number_of_file = value;
    else if (number >= CHIP_REGISTER_FEED_FIRST && number < CHIP_REGISTER_FEED_FIRST + CHIP_FEED_REGISTERS)
        feed[number - CHIP_REGISTER_FEED_FIRST] = value;
    if (number == CHIP_REGISTER_BOX_COMMIT) {
        min_x_set(box[0]); min_y_set(box[1]); min_z_set(box[2]);
        max_x_set(box[3]); max_y_set(box[4]); max_z_set(box[5]);
        if (!define) {                  /* shape and turn apply to this box only */
            shape_set(form);
            turn_set(angle);
            form = 0;
            angle = 0.0;
        }
    }
    define_set(number == CHIP_REGISTER_BOX_COMMIT);
    if (feed_is_over(__comp_inst, period)) mode_set(0);
    if (mode == 0) feed_carried_set(0);
    if (number == CHIP_REGISTER_FEED_COMMIT && !committed) {
        commits = feed[0] >= 0.5 || feed[3] > 0.5;
        feed_decided_set(1);
        of_program = feed[3] > 0.5;
        mark_of_feed = of_program ? 0 : program_mark;
        feed_carried_set(0);
        unseen_for = 0.0;
        mode_set(feed[0] >= 0.5 && feed[0] < 3.5 ? (int)(feed[0] + 0.5) : 0);
        mrr_target_set(feed[1]);
        mrr_lower_set(feed[2]);
    }
    committed = number == CHIP_REGISTER_FEED_COMMIT;
    follow_job(__comp_inst, commits);
    /* The word stays there after an abort; another chipwise-monitor would serve the request once more, hours later. */
    file_given_up = of_file && (file_given_up || aborted || !enabled);
    if (of_file)
        slot_set(number_of_file > -0.5 && number_of_file < 999.5 ? (int)(number_of_file + 0.5) : -1);
    request_set(!of_file || file_given_up ? CHIP_REQUEST_NONE : number == CHIP_REGISTER_SAVE_COMMIT ? CHIP_REQUEST_SAVE
        : number == CHIP_REGISTER_CLAMPS_COMMIT ? CHIP_REQUEST_CLAMPS : CHIP_REQUEST_RESTORE);
    status_set(mode + (stock_defined && certain ? CHIP_STATUS_STOCK : 0) + (double)CHIP_STATUS_FAULT * fault_code
        + (double)CHIP_STATUS_REPLY * reply + job_status(__comp_inst) + (feed_carried ? CHIP_STATUS_CARRIED : 0.0));
}
