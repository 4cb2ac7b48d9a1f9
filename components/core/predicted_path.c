/* SPDX-License-Identifier: GPL-2.0-or-later */
/* predicted_path.c - see predicted_path.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "predicted_path.h"

#define CHIP_MIN_STEP 1e-6       /* mm, a step below this has no heading */
#define CHIP_MIN_HORIZONTAL 1e-9 /* horizontal part below this: straight up or down */
#define CHIP_OFF_HEADING 0.03    /* rad the heading may differ from the predicted one */
#define CHIP_CURVATURE_RANGE 2.0 /* mm ahead within which a wrong curvature must not show either */
#define CHIP_CORNER_ANGLE 0.08   /* rad between circle and step that mean a corner */
#define CHIP_SHARP_TURN 0.2      /* rad from step to step: a corner, not an arc */

struct motion {     /* reading of one step; mm, rad */
    double unit[3]; /* direction */
    double step;    /* length */
    double heading; /* in XY, at the end of the step */
    double turn;    /* curvature, rad/mm */
};

void chip_predicted_path_reset(struct chip_predicted_path *predicted)
{
    predicted->known = 0;
    predicted->travelled = 0.0;
    predicted->last_step = predicted->last_turn = predicted->last_heading = predicted->last_dir_z = 0.0;
    predicted->speed = 0.0;
    predicted->points = 0;
}

static double wrap(double angle)
{
    while (angle > CHIP_PI) angle -= 2.0 * CHIP_PI;
    while (angle < -CHIP_PI) angle += 2.0 * CHIP_PI;
    return angle;
}

/* Heading and curvature from this step and the one before: exact on lines and arcs, once
 * two steps running agree about the curvature. */
static struct motion read_step(struct chip_predicted_path *predicted, const double from[3], const double to[3],
                               double step)
{
    struct motion now;
    double level, middle, turn = 0.0, a, b;
    int i;
    now.step = step;
    for (i = 0; i < 3; i++) now.unit[i] = (to[i] - from[i]) / step;
    level = sqrt(now.unit[0] * now.unit[0] + now.unit[1] * now.unit[1]);
    middle = level > CHIP_MIN_HORIZONTAL ? atan2(now.unit[1], now.unit[0]) : predicted->last_heading;
    if (predicted->last_step > CHIP_MIN_STEP && level > CHIP_MIN_HORIZONTAL) {
        double change = wrap(middle - predicted->last_heading);
        if (fabs(change) < CHIP_SHARP_TURN)
            turn = 2.0 * change / ((step + predicted->last_step) * level);
        else
            predicted->points = 0;
    }
    a = fabs(turn);
    b = fabs(predicted->last_turn);
    now.turn = turn * predicted->last_turn > 0.0 && chip_max(a, b) < 1.5 * chip_min(a, b)
                 ? 0.5 * (turn + predicted->last_turn)
                 : 0.0;
    now.heading = middle + 0.5 * now.turn * step * level;
    predicted->last_turn = turn;
    predicted->last_heading = middle;
    predicted->last_step = step;
    predicted->last_dir_z = now.unit[2];
    return now;
}

static const double *past_point(const struct chip_predicted_path *predicted, int back)
{
    return predicted->point[(predicted->newest - back + CHIP_PAST_POINTS) % CHIP_PAST_POINTS];
}

/* Keeps the tip's position if it is a grain away from the last one kept. */
static void keep_point(struct chip_predicted_path *predicted, const double tip[3], double grain)
{
    double dx, dy;
    if (predicted->points > 0) {
        dx = tip[0] - past_point(predicted, 0)[0];
        dy = tip[1] - past_point(predicted, 0)[1];
        if (dx * dx + dy * dy < grain * grain) return;
    }
    predicted->newest = (predicted->newest + 1) % CHIP_PAST_POINTS;
    predicted->point[predicted->newest][0] = tip[0];
    predicted->point[predicted->newest][1] = tip[1];
    if (predicted->points < CHIP_PAST_POINTS) predicted->points++;
}

/* [2] Replaces heading and curvature by those of the circle through three points, if it
 * points where the tool goes; otherwise drops the points. */
static void read_circle(struct chip_predicted_path *predicted, const double tip[3], struct motion *now)
{
    const double *b, *c;
    double ax, ay, bx, by, a2, b2, c2, cross, turn, heading;
    if (predicted->points <= 2 * CHIP_PAST_ARM) return;
    b = past_point(predicted, CHIP_PAST_ARM);
    c = past_point(predicted, 2 * CHIP_PAST_ARM);
    ax = tip[0] - b[0];
    ay = tip[1] - b[1];
    bx = b[0] - c[0];
    by = b[1] - c[1];
    a2 = ax * ax + ay * ay;
    b2 = bx * bx + by * by;
    c2 = (ax + bx) * (ax + bx) + (ay + by) * (ay + by);
    if (a2 <= 0.0 || b2 <= 0.0 || c2 <= 0.0) return;
    cross = bx * ay - by * ax;
    turn = 2.0 * cross / sqrt(a2 * b2 * c2);
    heading = atan2(ay, ax) + asin(chip_clamp(0.5 * turn * sqrt(a2), -1.0, 1.0));
    if (fabs(wrap(heading - now->heading)) > CHIP_CORNER_ANGLE) {
        predicted->points = 0;
        return;
    }
    now->heading = heading;
    now->turn = turn;
}

/* [3] Whether the step that ended at `tip` stays on the predicted path. */
static int on_predicted_path(const struct chip_predicted_path *predicted, const double tip[3], const struct motion *now,
                             double tolerance)
{
    double at[3], dir[3], off2 = 0.0, level2, aim = 0.0;
    int i;
    if (!predicted->known) return 0;
    chip_segment_at(&predicted->segment, predicted->travelled + now->step, at, dir);
    for (i = 0; i < 3; i++) off2 += (tip[i] - at[i]) * (tip[i] - at[i]);
    level2 = dir[0] * dir[0] + dir[1] * dir[1];
    if (level2 > CHIP_MIN_HORIZONTAL) aim = fabs(wrap(now->heading - atan2(dir[1], dir[0])));
    return off2 < tolerance * tolerance && aim < CHIP_OFF_HEADING
        && fabs(now->unit[2] - predicted->segment.vertical) < CHIP_OFF_HEADING
        && 0.5 * fabs(now->turn - predicted->segment.curvature) * CHIP_CURVATURE_RANGE * CHIP_CURVATURE_RANGE
               < 2.0 * tolerance;
}

int chip_predicted_path_step(struct chip_predicted_path *predicted, const double from[3], const double to[3],
                             double period, double tolerance, double grain)
{
    double step = 0.0;
    struct motion now;
    int i;
    for (i = 0; i < 3; i++) step += (to[i] - from[i]) * (to[i] - from[i]);
    step = sqrt(step);
    if (!chip_finite(step)) return 0;
    predicted->speed = step / period;
    if (step <= CHIP_MIN_STEP) return 0;
    now = read_step(predicted, from, to, step);
    keep_point(predicted, to, grain);
    read_circle(predicted, to, &now);
    if (on_predicted_path(predicted, to, &now, tolerance)) {
        predicted->travelled += step;
        return 0;
    }
    for (i = 0; i < 3; i++) predicted->segment.origin[i] = to[i];
    predicted->segment.horizontal = sqrt(now.unit[0] * now.unit[0] + now.unit[1] * now.unit[1]);
    predicted->segment.vertical = now.unit[2];
    predicted->segment.heading[0] = cos(now.heading);
    predicted->segment.heading[1] = sin(now.heading);
    predicted->segment.curvature = now.turn;
    CHIP_FAULT(ARCS_STRAIGHT, predicted->segment.curvature = 0.0);
    predicted->travelled = 0.0;
    predicted->known = 1;
    return 1;
}
