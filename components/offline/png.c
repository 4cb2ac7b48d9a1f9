/* SPDX-License-Identifier: GPL-2.0-or-later */
/* png.c - see png.h. */

#include "png.h"

static int paeth(int a, int b, int c)
{
    int p = a + b - c, pa = p > a ? p - a : a - p, pb = p > b ? p - b : b - p, pc = p > c ? p - c : c - p;
    return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
}

int chip_png_unfilter(unsigned char *data, long rows, long bytes, int step)
{
    long row, k;
    for (row = 0; row < rows; row++) {
        unsigned char *line = data + row * (bytes + 1) + 1, *before = row ? line - bytes - 1 : 0;
        int filter = line[-1];
        if (filter > 4) return 0;
        for (k = 0; k < bytes; k++) {
            int a = k >= step ? line[k - step] : 0, b = before ? before[k] : 0;
            int c = before && k >= step ? before[k - step] : 0;
            int add = filter == 1 ? a : filter == 2 ? b : filter == 3 ? (a + b) / 2 : filter == 4 ? paeth(a, b, c) : 0;
            line[k] = (unsigned char)(line[k] + add);
        }
    }
    return 1;
}
