/* SPDX-License-Identifier: GPL-2.0-or-later */
/* registers.h - the numbers with which the interpreter talks to chipwise_command, and the monitor with its pins.
 *
 * Who uses it: chipwise_command.comp, chipwise_guard.comp; Python through remap/chipwise/clib/layout.py, which
 * tools/make_layout.py makes of this file.
 */
#ifndef CHIPWISE_REGISTERS_H
#define CHIPWISE_REGISTERS_H

/* Content of chipwise-command.N.word: number of the register that `value` goes to. */
enum chip_register {
    CHIP_REGISTER_IDLE = 0,
    CHIP_REGISTER_BOX_FIRST = 1,    /* 1..6: min X Y Z, max X Y Z of the stock box, machine units */
    CHIP_REGISTER_BOX_COMMIT = 7,   /* defines the stock */
    CHIP_REGISTER_BOX_SHAPE = 8,    /* chip_stock_shape */
    CHIP_REGISTER_BOX_TURN = 9,     /* degrees */
    CHIP_REGISTER_FEED_FIRST = 11,  /* 11..14: mode, target, lower, 1 if a program switches the feed */
    CHIP_REGISTER_FEED_COMMIT = 17, /* switches the feed */
    CHIP_REGISTER_FILE_SLOT = 21,
    CHIP_REGISTER_SAVE_COMMIT = 27,
    CHIP_REGISTER_RESTORE_COMMIT = 28,
    CHIP_REGISTER_CLAMPS_COMMIT = 29 /* clamps of the set-up whose number is in the slot */
};

#define CHIP_BOX_REGISTERS 6
#define CHIP_FEED_REGISTERS 4

/* chipwise-command.N.request: what the monitor is asked to do. */
enum chip_file_request {
    CHIP_REQUEST_NONE = 0,
    CHIP_REQUEST_SAVE = 1,
    CHIP_REQUEST_RESTORE = 2,
    CHIP_REQUEST_CLAMPS = 3
};

/* chipwise-command.N.run-end: how the last program has ended. */
enum chip_run_end { CHIP_RUN_GOES_ON = 0, CHIP_RUN_WHOLE = 1, CHIP_RUN_STOPPED = 2 };

/* Mode of a program that a person has set up: up to the requested velocity, which is F until its first F has put the ceiling there. */
#define CHIP_FEED_OF_JOB 2
#define CHIP_MOST_JOB_RATE 1e12 /* mm3/min */

/* chipwise-command.N.status: the mode plus these, each times its value.  The largest is below 2^53, so a double has all of its digits; motion's analog
 * input is a double until the interpreter has it (motion.h, emc_nml.hh). */
#define CHIP_STATUS_STOCK 10    /* 1 if a certain stock is defined */
#define CHIP_STATUS_FAULT 100   /* chip_fault */
#define CHIP_STATUS_REPLY 10000 /* reply code of the stock files, remap/chipwise/stock/reasons.py */
#define CHIP_STATUS_JOB 1000000 /* ceiling of the program's set-up, hundredths of F, 100 to 1000; 0: it has none */
#define CHIP_STATUS_WAITS 10000000000.0   /* 1 if it waits for adaptive feed */
#define CHIP_STATUS_ACTIVE 20000000000.0  /* 1 if it is in force */
#define CHIP_STATUS_CARRIED 40000000000.0 /* 1 if M251 of MDI is in force in the program that runs */
#define CHIP_STATUS_AIR 80000000000.0     /* 1 if feeds above its stock may be as fast as the axes */
#define CHIP_MOST_CEILING 10.0            /* times F */

/* chipwise-guard.N.reason: why the machine was stopped. */
enum chip_guard_reason {
    CHIP_REASON_NONE = 0,
    CHIP_REASON_RAPID_CONTACT = 1,
    CHIP_REASON_FLUTE_EXCESS = 2,
    CHIP_REASON_OVERRIDE_IGNORED = 3,
    CHIP_REASON_LOAD = 4,
    CHIP_REASON_CLAMP_CONTACT = 5
};

#endif
