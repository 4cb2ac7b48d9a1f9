/* SPDX-License-Identifier: GPL-2.0-or-later */
/* disc_roll.c - see disc_roll.h. */
#include <math.h>

#include "disc_roll.h"

void chip_disc_roll(long n, const double *s, const double *values, double radius, double side, double *result)
{
    long i, j;
    for (i = 0; i < n; i++) result[i] = values[i] + side * radius;
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n && s[j] - s[i] <= radius; j++) {
            double gap = s[j] - s[i], disc = side * sqrt(radius * radius - gap * gap);
            double ahead = values[i] + disc, behind = values[j] + disc;
            if (side * ahead > side * result[j]) result[j] = ahead;
            if (side * behind > side * result[i]) result[i] = behind;
        }
}
