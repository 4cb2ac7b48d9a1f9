/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clock.h - what the C benchmarks time with. */
#ifndef CHIPWISE_BENCH_CLOCK_H
#define CHIPWISE_BENCH_CLOCK_H

#include <time.h>

static inline double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e6 + t.tv_nsec * 1e-3;
}

/* For qsort: doubles, rising. */
static inline int rising(const void *a, const void *b)
{
    double d = *(const double *)a - *(const double *)b;
    return d > 0.0 ? 1 : d < 0.0 ? -1 : 0;
}

#endif
