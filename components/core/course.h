/* course.h - where the tool is going: the way ahead predicted from the way behind.
 *
 * Who calls it: ahead.c, once per servo period.
 * Source: none. It serves where the planner's queue cannot be read (way.h, 3).
 *
 * Principle:
 *  1. A course is an origin, a heading, a curvature in XY and a slope: a line, an arc or a
 *     helix. On lines, arcs and helices of the program it is exact.
 *  2. Heading and curvature come from the circle through three places of the way behind,
 *     about a millimetre apart: a chain of small CAM segments then reads as the curve it
 *     stands for. Where that circle does not point where the tool goes (a corner), the last
 *     steps alone count and the places behind are forgotten.
 *  3. The course is kept until the tool leaves it.
 */
#ifndef CHIPWISE_COURSE_H
#define CHIPWISE_COURSE_H

#include "way.h"

#define CW_TRAIL 32             /* places of the way behind that are kept */
#define CW_TRAIL_ARM 12          /* places between the three the circle goes through */

struct cw_course {
    int known;                  /* there is a piece */
    struct cw_piece piece;      /* the way ahead, endless */
    double travelled;           /* mm since the origin */
    double speed;               /* mm/s, of the last step */
    double last_heading, last_step, last_turn;  /* rad, mm, rad/mm of the step before */
    double last_slope;          /* vertical part of its direction */
    double place[CW_TRAIL][2];  /* mm, XY of the way behind, newest at `newest` */
    int newest, places;         /* places in use */
};

/* Forgets everything. */
void cw_course_reset(struct cw_course *course);

/* The tool went from `from` to `to` (tips, mm) in `period` s. `tolerance`, mm: how far it may
 * stray from the course; `grain`, mm: spacing of the places kept. Returns 1 when the course is
 * a new one, 0 when the old one holds. */
int cw_course_step(struct cw_course *course, const double from[3], const double to[3],
                   double period, double tolerance, double grain);

#endif
