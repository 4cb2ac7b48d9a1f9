/* SPDX-License-Identifier: GPL-2.0-or-later */
/* chain_fit.h - as few lines and arcs as fit into a band of heights over the stations of a cut.
 *
 * Who calls it: remap/chipwise/clib/chain_fit.py, through the shared library. Never in realtime.
 * Source: the funnel of greedy polyline simplification (A. Melkman, J. O'Rourke, "On polygonal chain approximation", 1988), and
 * for arcs the inscribed angle (Euclid III.21).
 *
 * Principle:
 *  1. A line from a kept station reaches as far as a slope exists that is within the band at all stations on it.
 *  2. From every point of an arc the lines to its two ends turn by the same angle, half of the arc's sweep. So each station
 *     between two ends allows a range of that angle, from the turn at the lower end of its band to the turn at the upper end,
 *     and the arc fits if the ranges have an angle in common.
 *  3. How far an arc reaches is found by doubling and halving the number of stations. It is used if it reaches further than two
 *     lines, one after the other.
 */
#ifndef CHIPWISE_CHAIN_FIT_H
#define CHIPWISE_CHAIN_FIT_H

#include <stdint.h>

#define CHIP_CHAIN_LINE -1e30 /* radius of what is straight */

/* Thins a chain of n stations s (rising, mm) whose heights may be from low to high (mm); the first and the last have the height
 * `low`. arc_low: lowest heights on arcs; 0 if there are none. Writes the kept indices, their heights, and of the arc that
 * leads to each its centre (station, height) and radius, negative where the centre is above; CHIP_CHAIN_LINE for a line.
 * Returns their number. */
long chip_chain_fit(long n, const double *s, const double *low, const double *high, const double *arc_low,
                    int64_t *kept, double *height, double (*arc)[3]);

#endif
