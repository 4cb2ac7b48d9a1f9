/* SPDX-License-Identifier: GPL-2.0-or-later */
/* chip_math.h - the few numeric helpers every core file shares; the maths library
 * comes from rtapi in the component and from libm elsewhere. */
#ifndef CHIPWISE_MATH_H
#define CHIPWISE_MATH_H

#ifdef CHIPWISE_RTAPI
#include "rtapi_math.h"
#else
#include <math.h>
#endif

#include "fault.h"

#define CHIP_PI 3.14159265358979323846
#define CHIP_LARGEST 1.7976931348623157e308 /* of the finite numbers */

/* Root without the library's call for errno, which the realtime flags keep. */
static inline double chip_sqrt(double x)
{
#ifdef __SSE2__
    double root;
    __asm__("sqrtsd %1, %0" : "=x"(root) : "x"(x));
    return root;
#else
    return sqrt(x);
#endif
}

/* Finite: neither NaN nor infinite; spelt out so that no compiler flag can drop it. */
static inline int chip_finite(double x) { return fabs(x) <= CHIP_LARGEST; }

/* A setting: 0 (off) unless it is a finite number above 0. */
static inline double chip_setting(double x) { return x > 0.0 && x <= CHIP_LARGEST ? x : 0.0; }

static inline double chip_clamp(double x, double lo, double hi) { return x < lo ? lo : (x > hi ? hi : x); }

static inline double chip_min(double a, double b) { return a < b ? a : b; }
static inline double chip_max(double a, double b) { return a > b ? a : b; }

/* The operator's feed override from a pin, within what is accepted; 1 if it is unknown. */
static inline double chip_override(double share)
{
    double known = chip_setting(share);
    return known > 0.0 ? chip_clamp(known, 0.01, 10.0) : 1.0;
}

/* Machine units per mm, from a parameter; 0 if it cannot be. */
static inline double chip_units(double per_mm) { return per_mm >= 1e-3 && per_mm <= 1e3 ? per_mm : 0.0; }

#endif
