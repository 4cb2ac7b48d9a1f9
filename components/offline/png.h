/* SPDX-License-Identifier: GPL-2.0-or-later */
/* png.h - the part of reading a PNG that is slow in Python.  Called by remap/chipwise/surface/png.py. */
#ifndef CHIPWISE_PNG_H
#define CHIPWISE_PNG_H

/* PNG: takes the filter off `rows` rows of `bytes` bytes, each after its filter's number; `step` bytes a pixel. Returns 0 for
 * a filter that PNG does not have. */
int chip_png_unfilter(unsigned char *data, long rows, long bytes, int step);

#endif
