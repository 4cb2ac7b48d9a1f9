/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_times.c - see height_sweep.h: chip_height_times. */
#include "core/chip_math.h"

#include "height_sweep.h"


/* Seconds for a path of `length` from speed u to v with at most w. */
static double seconds_of(double length, double u, double v, double w, double a)
{
    double peak = sqrt(chip_min(w * w, a * length + 0.5 * (u * u + v * v)));
    double ramps = (2.0 * peak * peak - u * u - v * v) / (2.0 * a);
    if (!(length > 0.0) || !(peak > 0.0)) return 0.0;
    return (peak - u + peak - v) / a + chip_max(length - ramps, 0.0) / peak;
}

double chip_height_times(long n, const double *length, const double *most_speed, const double *accel,
                         const double *corner, double *end_speed, double *speed, double *seconds)
{
    double at = *speed, sum = 0.0;
    long i;
    for (i = n - 1; i >= 0; i--) {
        double end = chip_min(corner[i], most_speed[i]);
        if (i + 1 < n) {
            double next = chip_min(end_speed[i + 1], most_speed[i + 1]);
            end = chip_min(end, chip_min(most_speed[i + 1], sqrt(next * next + 2.0 * accel[i + 1] * length[i + 1])));
        }
        end_speed[i] = end;
    }
    for (i = 0; i < n; i++) {
        double begin = chip_min(at, most_speed[i]);
        double end = chip_min(end_speed[i], sqrt(begin * begin + 2.0 * accel[i] * length[i]));
        seconds[i] = seconds_of(length[i], begin, end, most_speed[i], accel[i]);
        sum += seconds[i];
        at = length[i] > 0.0 ? end : at;
    }
    *speed = at;
    return sum;
}
