/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Random numbers of the C tests: the same ones from the same seed.
 *
 * CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED in the environment decide how many cases and from which seed, as in Python
 * (tests/support/random_cases.py). */
#ifndef CHIPWISE_RANDOM_NUMBERS_H
#define CHIPWISE_RANDOM_NUMBERS_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

static unsigned long seed, start_seed; /* of now, and for the report of a failure */

/* Sets the seed; -> how many cases. */
static inline long random_begin(long usual_count)
{
    const char *count = getenv("CHIPWISE_RANDOM_COUNT"), *from = getenv("CHIPWISE_SEED");
    start_seed = seed = from && *from ? strtoul(from, 0, 10) : 7134;
    return count && *count ? atol(count) : usual_count;
}

/* 0..1, without 1. */
static inline double chance(void)
{
    seed = seed * 6364136223846793005ul + 1442695040888963407ul;
    return (double)(seed >> 11) / 9007199254740992.0;
}

/* 0..count - 1. */
static inline int pick(int count) { return (int)(chance() * count); }

/* A number that an input should not have: a border, a huge one, not finite, or any 64 bits. */
static inline double hostile(void)
{
    static const double some[] = { 0.0,
                                   -0.0,
                                   1.0,
                                   -1.0,
                                   4.9e-324,
                                   1e-300,
                                   -1e-300,
                                   1e-12,
                                   1e-6,
                                   0.001,
                                   0.25,
                                   0.3,
                                   50.0,
                                   180.0,
                                   1e5,
                                   999999.0,
                                   1e6,
                                   -1e6,
                                   1.1e6,
                                   1e9,
                                   2147483647.0,
                                   2147483648.0,
                                   -2147483649.0,
                                   1e18,
                                   1e150,
                                   -1e150,
                                   1e300,
                                   -1e300,
                                   -1.8e307,
                                   1.7976931348623157e308,
                                   -1.7976931348623157e308,
                                   INFINITY,
                                   -INFINITY,
                                   NAN };
    double value = some[pick(COUNT(some))];
    if (chance() < 0.3) value *= 1.0 + chance();
    if (chance() < 0.1) {
        uint64_t bits = 0;
        int i;
        for (i = 0; i < 8; i++) bits = bits << 8 | (uint64_t)pick(256);
        memcpy(&value, &bits, 8);
    }
    return value;
}

/* A whole number that an input should not have. */
static inline int hostile_whole(void)
{
    static const int some[] = { 0, 1, 2, 3, 4, 5, 8, -1, 16, 255, 2147483647, -2147483647 - 1 };
    return some[pick(COUNT(some))];
}

#endif
