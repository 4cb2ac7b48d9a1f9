/* SPDX-License-Identifier: GPL-2.0-or-later */
/* disc_roll.h - a profile with a disc rolled along it, above or below.
 *
 * Who calls it: remap/chipwise/rewrite/shift.py, through the shared library. Never in realtime.
 * Source: CN105492980 [0105] to [0111]; dilation and erosion by a disc.
 */
#ifndef CHIPWISE_DISC_ROLL_H
#define CHIPWISE_DISC_ROLL_H

/* At each of n stations s (rising, mm) the most of the values (mm) with discs of `radius` (mm) round them, or the least below them if `side` is -1 in
 * place of 1. */
void chip_disc_roll(long n, const double *s, const double *values, double radius, double side, double *result);

#endif
