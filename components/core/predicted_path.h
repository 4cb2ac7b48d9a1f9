/* SPDX-License-Identifier: GPL-2.0-or-later */
/* predicted_path.h - the path ahead, predicted from the motion so far.
 *
 * Who calls it: lookahead.c, once per servo period.
 * Source: none. It is used when the planner's queue cannot be read (path.h, 3).
 *
 * Principle:
 *  1. A predicted path has an origin, a heading, a curvature in XY and a slope: it is a line, an arc or a
 *     helix. On lines, arcs and helices of the program it is exact.
 *  2. Heading and curvature come from the circle through three past points,
 *     about a millimetre apart: a chain of small CAM segments then reads as the curve it
 *     approximates. If that circle does not point where the tool goes (a corner), only the last
 *     steps count and the past points are dropped.
 *  3. The predicted path is kept until the tool leaves it.
 */
#ifndef CHIPWISE_PREDICTED_PATH_H
#define CHIPWISE_PREDICTED_PATH_H

#include "path.h"

#define CHIP_PAST_POINTS 32 /* past points that are kept */
#define CHIP_PAST_ARM 12    /* points between the three the circle goes through */

struct chip_predicted_path {
    int known;                                 /* `segment` is valid */
    struct chip_segment segment;               /* the path ahead, endless */
    double travelled;                          /* mm since the origin */
    double speed;                              /* mm/s, of the last step */
    double last_heading, last_step, last_turn; /* rad, mm, rad/mm of the step before */
    double last_dir_z;                         /* vertical part of its direction */
    double point[CHIP_PAST_POINTS][2];         /* mm, XY of past points, newest at `newest` */
    int newest, points;                        /* points in use */
};

/* Clears everything. */
void chip_predicted_path_reset(struct chip_predicted_path *predicted);

/* The tool went from `from` to `to` (tips, mm) in `period` s. `tolerance`, mm: how far it may
 * deviate from the predicted path; `grain`, mm: distance of the points kept. Returns 1 if the predicted path
 * is a new one, 0 if the old one holds. */
int chip_predicted_path_step(struct chip_predicted_path *predicted, const double from[3], const double to[3],
                             double period, double tolerance, double grain);

#endif
