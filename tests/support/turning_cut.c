/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a tool takes out of the cells of a half section: the inner loop of turning_cut.py, which describes it and calls it. */
#include <stdint.h>
#include <string.h>

struct cells {
    unsigned char *at;          /* row by row, 1: material, or of the tool */
    long rows, columns;
};

static long lesser(long a, long b)
{
    return a < b ? a : b;
}

static long larger(long a, long b)
{
    return a > b ? a : b;
}

/* Takes the cells of `tool` out of `own`, n of each; -> how many there were. */
static long take(unsigned char *own, const unsigned char *tool, long n)
{
    long taken = 0, i = 0;

    for (; i + 8 <= n; i += 8) {
        uint64_t a, b;
        memcpy(&a, own + i, 8);
        memcpy(&b, tool + i, 8);
        b &= a;
        if (!b)
            continue;
        a ^= b;
        memcpy(own + i, &a, 8);
        taken += __builtin_popcountll(b);
    }
    for (; i < n; i++) {
        taken += own[i] & tool[i];
        own[i] &= !tool[i];
    }
    return taken;
}

/* The same of a tool whose first cell is at (row, column) of the section, which may be outside; extent: first and last + 1 of its columns in each row. */
long turning_cut(const struct cells *section, const struct cells *tool, const long (*extent)[2], long row, long column)
{
    long taken = 0;

    for (long k = larger(0, -row); k < lesser(tool->rows, section->rows - row); k++) {
        long from = larger(extent[k][0], -column), to = lesser(extent[k][1], section->columns - column);
        if (from < to)
            taken += take(section->at + (row + k) * section->columns + column + from, tool->at + k * tool->columns + from, to - from);
    }
    return taken;
}
