/* SPDX-License-Identifier: GPL-2.0-or-later */
/* fault.h - faults that a test puts into the core, one at a time, when it compiles it.
 *
 * Who calls it: the core, by a line beside the one it spoils; tests/core/test_sabotage.py, which compiles with
 * -DCHIPWISE_FAULT='"NAME"' and expects a test to fail. Without that every condition here is a constant 0 and the
 * compiler drops it, so that nothing of it is in a component. */
#ifndef CHIPWISE_FAULT_H
#define CHIPWISE_FAULT_H

#ifdef CHIPWISE_FAULT
#define CHIP_FAULTY(name) (__builtin_strcmp(#name, CHIPWISE_FAULT) == 0)
#else
#define CHIP_FAULTY(name) 0
#endif

#define CHIP_FAULT(name, ...)                                                                                          \
    if (CHIP_FAULTY(name)) {                                                                                           \
        __VA_ARGS__;                                                                                                   \
    }

#endif
