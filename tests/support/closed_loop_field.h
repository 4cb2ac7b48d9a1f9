/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The truth of closed_loop.c: a field of needles on a grid turned against the cells, cut at every period's tip, and the box it is in. */
#ifndef CHIPWISE_TESTS_CLOSED_LOOP_FIELD_H
#define CHIPWISE_TESTS_CLOSED_LOOP_FIELD_H

#include <math.h>
#include <stdlib.h>

#define NEEDLE 0.025 /* mm between needles; half of it for an end with a flat part, which cuts a needle at once */
#define STEP 0.02    /* mm */
#define TURNED 0.4371 /* rad, the needles against the cells */

/* mm of the box and its half diagonal, for a tool of D12; a smaller tool has all of it smaller */
static const double WHOLE[3] = { 61.37, 47.83, 12.0 };
static double SIZE[3], HALF;

struct field {
    double pitch;   /* mm between needles */
    int side;       /* needles along u and v */
    float *top;     /* mm */
    double last[3]; /* u, v, z of the last cut, mm */
};

struct cutter {
    double radius, corner, slope;
};

static int is_flat(const struct cutter *tool) { return tool->corner == 0.0 && tool->slope == 0.0; }

static double profile(const struct cutter *tool, double r)
{
    if (tool->slope > 0.0) return tool->slope * r;
    r -= tool->radius - tool->corner;
    return r <= 0.0 ? 0.0 : tool->corner - sqrt(fmax(0.0, tool->corner * tool->corner - r * r));
}

static void new_field(struct field *field, const struct cutter *tool)
{
    int i, j;
    field->pitch = tool->slope == 0.0 && tool->corner < tool->radius ? 0.5 * NEEDLE : NEEDLE;
    field->side = (int)(2.0 * HALF / field->pitch);
    field->last[2] = 1e9;
    field->top = realloc(field->top, sizeof *field->top * field->side * field->side);
    if (!field->top) exit(2);
    for (j = 0; j < field->side; j++)
        for (i = 0; i < field->side; i++) {
            double u = (i + 0.5) * field->pitch - HALF, v = (j + 0.5) * field->pitch - HALF;
            double x = cos(TURNED) * u - sin(TURNED) * v, y = sin(TURNED) * u + cos(TURNED) * v;
            field->top[j * field->side + i] = fabs(x) <= SIZE[0] / 2 && fabs(y) <= SIZE[1] / 2 ? 0.0F : -1e9F;
        }
}

/* First needle of a row at or behind u, mm. */
static int column(const struct field *field, double u)
{
    return (int)fmin(fmax(ceil((u + HALF) / field->pitch - 0.5), 0.0), field->side);
}

/* Half the width, mm, of a disc at the distance v from its centre; negative: none. */
static double half_width(const struct cutter *tool, double v)
{
    double half2 = tool->radius * tool->radius - v * v;
    return half2 > 0.0 ? sqrt(half2) : -1.0;
}

/* Cuts the needles from..to - 1 of row j with the tool at u, y from that row, and z, mm; returns the sum of what they lose. */
static double cut_row(const struct field *field, const struct cutter *tool, int j, int from, int to, double u, double y,
                      double z)
{
    double sum = 0.0;
    float *top = &field->top[(long)j * field->side];
    int i;
    for (i = from; i < to; i++) {
        double x = (i + 0.5) * field->pitch - HALF - u, height;
        if (top[i] <= z) continue;
        height = fmax(-SIZE[2], z + profile(tool, sqrt(x * x + y * y)));
        if (top[i] <= height) continue;
        sum += top[i] - height;
        top[i] = (float)height;
    }
    return sum;
}

/* Cuts with the tool at `tip`; mm3. The box is round X0 Y0 here. What a flat end that does not fall has cut at the tip before is not
 * looked at again. */
static double cut_field(struct field *field, const struct cutter *tool, const double tip[3])
{
    double u = cos(TURNED) * tip[0] + sin(TURNED) * tip[1], v = cos(TURNED) * tip[1] - sin(TURNED) * tip[0], sum = 0.0;
    int j, last = column(field, v + tool->radius), skips = is_flat(tool) && tip[2] >= field->last[2];
    for (j = column(field, v - tool->radius); j < last; j++) {
        double y = (j + 0.5) * field->pitch - HALF, half = half_width(tool, y - v),
               before = half_width(tool, y - field->last[1]);
        int from, to, gone_from, gone_to;
        if (half < 0.0) continue;
        from = column(field, u - half);
        to = column(field, u + half);
        gone_from = skips && before > 0.0 ? column(field, field->last[0] - before) : to;
        gone_to = skips && before > 0.0 ? column(field, field->last[0] + before) : to;
        sum += cut_row(field, tool, j, from, gone_from < to ? gone_from : to, u, y - v, tip[2]);
        if (gone_to > from) from = gone_to;
        sum += cut_row(field, tool, j, from, to, u, y - v, tip[2]);
    }
    field->last[0] = u;
    field->last[1] = v;
    field->last[2] = tip[2];
    return sum * field->pitch * field->pitch;
}

/* Cuts along a straight step in parts of STEP: an end that is not flat would leave ridges between the periods' tips. */
static double cut_along(struct field *field, const struct cutter *tool, const double from[3], const double to[3])
{
    double length = sqrt(pow(to[0] - from[0], 2) + pow(to[1] - from[1], 2) + pow(to[2] - from[2], 2)), sum = 0.0,
           tip[3];
    int i, j, count = (int)ceil(length / STEP);
    for (j = 1; j <= count; j++) {
        for (i = 0; i < 3; i++) tip[i] = from[i] + (to[i] - from[i]) * j / count;
        sum += cut_field(field, tool, tip);
    }
    return sum;
}

#endif
