/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pair.h - two numbers that are computed at once: of points, or of cells side by side.
 *
 * Who calls it: sweep_level.c, section_parts.h. Every result is the same as that of the numbers one by one, bit for bit. */
#ifndef CHIPWISE_PAIR_H
#define CHIPWISE_PAIR_H

#include "chip_math.h"

typedef double pair __attribute__((vector_size(16)));

static inline __attribute__((always_inline)) pair pair_root(pair x)
{
#ifdef __SSE2__
    pair root;
    __asm__("sqrtpd %1, %0" : "=x"(root) : "x"(x));
    return root;
#else
    return (pair){ chip_sqrt(x[0]), chip_sqrt(x[1]) };
#endif
}

/* Heights above low, at most up to high, of two heights. */
static inline __attribute__((always_inline)) pair pair_between(pair z, double low, double high)
{
#ifdef __SSE2__
    pair bottom = { low, low }, top = { high, high };
    __asm__("minpd %1, %0" : "+x"(z) : "x"(top));
    __asm__("maxpd %1, %0" : "+x"(z) : "x"(bottom));
    return z - bottom;
#else
    return (pair){ chip_max(chip_min(z[0], high), low) - low, chip_max(chip_min(z[1], high), low) - low };
#endif
}

#endif
