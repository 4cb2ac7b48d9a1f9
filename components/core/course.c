/* course.c - see course.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "course.h"

#define CW_STILL 1e-6           /* mm, a step below this has no heading */
#define CW_LEVEL 1e-9           /* horizontal part below this: straight up or down */
#define CW_OFF_HEADING 0.03     /* rad the heading may differ from the course's */
#define CW_NEXT 2.0             /* mm ahead where a wrong curvature must not show either */
#define CW_CORNER 0.08          /* rad between circle and step that show a corner */
#define CW_SHARP 0.2            /* rad from step to step: a corner, not an arc */

struct motion {                 /* what one step says; mm, rad */
    double unit[3];             /* direction */
    double step;                /* length */
    double heading;             /* in XY, at the end of the step */
    double turn;                /* curvature, rad/mm */
};

void cw_course_reset(struct cw_course *course)
{
    course->known = 0;
    course->travelled = 0.0;
    course->last_step = course->last_turn = course->last_heading = course->last_slope = 0.0;
    course->speed = 0.0;
    course->places = 0;
}

static double wrap(double angle)
{
    while (angle > CW_PI) angle -= 2.0 * CW_PI;
    while (angle < -CW_PI) angle += 2.0 * CW_PI;
    return angle;
}

/* Heading and curvature from this step and the one before: exact on lines and arcs, once
 * two steps running agree about the curvature. */
static struct motion read_step(struct cw_course *course, const double from[3], const double to[3],
                               double step)
{
    struct motion now;
    double level, middle, turn = 0.0, a, b;
    int i;
    now.step = step;
    for (i = 0; i < 3; i++) now.unit[i] = (to[i] - from[i]) / step;
    level = sqrt(now.unit[0] * now.unit[0] + now.unit[1] * now.unit[1]);
    middle = level > CW_LEVEL ? atan2(now.unit[1], now.unit[0]) : course->last_heading;
    if (course->last_step > CW_STILL && level > CW_LEVEL) {
        double change = wrap(middle - course->last_heading);
        if (fabs(change) < CW_SHARP) turn = 2.0 * change / ((step + course->last_step) * level);
        else course->places = 0;
    }
    a = fabs(turn);
    b = fabs(course->last_turn);
    now.turn = turn * course->last_turn > 0.0 && cw_max(a, b) < 1.5 * cw_min(a, b)
        ? 0.5 * (turn + course->last_turn) : 0.0;
    now.heading = middle + 0.5 * now.turn * step * level;
    course->last_turn = turn;
    course->last_heading = middle;
    course->last_step = step;
    course->last_slope = now.unit[2];
    return now;
}

static const double *place_back(const struct cw_course *course, int back)
{
    return course->place[(course->newest - back + CW_TRAIL) % CW_TRAIL];
}

/* Keeps the tip's place when it is a grain away from the last one kept. */
static void keep_place(struct cw_course *course, const double tip[3], double grain)
{
    double dx, dy;
    if (course->places > 0) {
        dx = tip[0] - place_back(course, 0)[0];
        dy = tip[1] - place_back(course, 0)[1];
        if (dx * dx + dy * dy < grain * grain) return;
    }
    course->newest = (course->newest + 1) % CW_TRAIL;
    course->place[course->newest][0] = tip[0];
    course->place[course->newest][1] = tip[1];
    if (course->places < CW_TRAIL) course->places++;
}

/* [2] Replaces heading and curvature by those of the circle through three places, where it
 * points the way the tool goes; forgets the places where it does not. */
static void read_circle(struct cw_course *course, const double tip[3], struct motion *now)
{
    const double *b, *c;
    double ax, ay, bx, by, a2, b2, c2, cross, turn, heading;
    if (course->places <= 2 * CW_TRAIL_ARM) return;
    b = place_back(course, CW_TRAIL_ARM);
    c = place_back(course, 2 * CW_TRAIL_ARM);
    ax = tip[0] - b[0]; ay = tip[1] - b[1];
    bx = b[0] - c[0]; by = b[1] - c[1];
    a2 = ax * ax + ay * ay;
    b2 = bx * bx + by * by;
    c2 = (ax + bx) * (ax + bx) + (ay + by) * (ay + by);
    if (a2 <= 0.0 || b2 <= 0.0 || c2 <= 0.0) return;
    cross = bx * ay - by * ax;
    turn = 2.0 * cross / sqrt(a2 * b2 * c2);
    heading = atan2(ay, ax) + asin(cw_clamp(0.5 * turn * sqrt(a2), -1.0, 1.0));
    if (fabs(wrap(heading - now->heading)) > CW_CORNER) {
        course->places = 0;
        return;
    }
    now->heading = heading;
    now->turn = turn;
}

/* [3] Whether the step that ended at `tip` keeps to the course. */
static int on_course(const struct cw_course *course, const double tip[3], const struct motion *now,
                     double tolerance)
{
    double at[3], dir[3], off2 = 0.0, level2, aim = 0.0;
    int i;
    if (!course->known) return 0;
    cw_piece_at(&course->piece, course->travelled + now->step, at, dir);
    for (i = 0; i < 3; i++) off2 += (tip[i] - at[i]) * (tip[i] - at[i]);
    level2 = dir[0] * dir[0] + dir[1] * dir[1];
    if (level2 > CW_LEVEL) aim = fabs(wrap(now->heading - atan2(dir[1], dir[0])));
    return off2 < tolerance * tolerance && aim < CW_OFF_HEADING
        && fabs(now->unit[2] - course->piece.slope) < CW_OFF_HEADING
        && 0.5 * fabs(now->turn - course->piece.curvature) * CW_NEXT * CW_NEXT < 2.0 * tolerance;
}

int cw_course_step(struct cw_course *course, const double from[3], const double to[3],
                   double period, double tolerance, double grain)
{
    double step = 0.0;
    struct motion now;
    int i;
    for (i = 0; i < 3; i++) step += (to[i] - from[i]) * (to[i] - from[i]);
    step = sqrt(step);
    if (!cw_finite(step)) return 0;
    course->speed = step / period;
    if (step <= CW_STILL) return 0;
    now = read_step(course, from, to, step);
    keep_place(course, to, grain);
    read_circle(course, to, &now);
    if (on_course(course, to, &now, tolerance)) {
        course->travelled += step;
        return 0;
    }
    for (i = 0; i < 3; i++) course->piece.origin[i] = to[i];
    course->piece.level = sqrt(now.unit[0] * now.unit[0] + now.unit[1] * now.unit[1]);
    course->piece.slope = now.unit[2];
    course->piece.aim[0] = cos(now.heading);
    course->piece.aim[1] = sin(now.heading);
    course->piece.curvature = now.turn;
    course->travelled = 0.0;
    course->known = 1;
    return 1;
}
