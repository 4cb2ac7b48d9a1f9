/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path.c - see path.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "path.h"

#define CHIP_MIN_LENGTH 1e-7    /* mm, shorter segments are dropped */
#define CHIP_SAME_LENGTH 1e-5   /* mm: within this the planner has not changed a segment */
#define CHIP_SAME_HEADING 1e-6  /* the same for its direction */
#define CHIP_SMOOTH_CORNER 0.02 /* rad, segments that join at less are smooth [5] */
#define CHIP_SHARP_CORNER 0.25  /* rad, a corner however short its segments are */
#define CHIP_CORNERS_APART 0.5  /* of the step: distance of a lesser corner from the last point at least */
#define CHIP_BEND_BEGINS 0.05   /* rad per step, a change of the path's bend that has a point of its own [5] */
#define CHIP_BENDS_APART 0.2    /* of the step: its distance from the last point at least */
#define CHIP_NEVER 1e300        /* mm, nothing has changed */

void chip_segment_at(const struct chip_segment *segment, double s, double tip[3], double dir[3])
{
    double flat = s * segment->horizontal, half = 0.5 * segment->curvature * flat;
    double sine = 0.0, cosine = 1.0, chord = flat, mx, my;
    if (half != 0.0) {
        sine = sin(half);
        cosine = cos(half);
        if (fabs(half) > 1e-6) chord = flat * sine / half;
    }
    mx = segment->heading[0] * cosine - segment->heading[1] * sine; /* of the chord: at half the angle */
    my = segment->heading[1] * cosine + segment->heading[0] * sine;
    tip[0] = segment->origin[0] + chord * mx;
    tip[1] = segment->origin[1] + chord * my;
    tip[2] = segment->origin[2] + s * segment->vertical;
    dir[0] = segment->horizontal * (mx * cosine - my * sine);
    dir[1] = segment->horizontal * (my * cosine + mx * sine);
    dir[2] = segment->vertical;
}

int chip_segment_line(struct chip_segment *segment, const double start[3], const double end[3])
{
    double dx = end[0] - start[0], dy = end[1] - start[1], dz = end[2] - start[2];
    double flat = sqrt(dx * dx + dy * dy);
    int i;
    segment->length = sqrt(flat * flat + dz * dz);
    if (!(segment->length > CHIP_MIN_LENGTH) || !chip_finite(segment->length)) return 0;
    for (i = 0; i < 3; i++) segment->origin[i] = start[i];
    segment->heading[0] = flat > 0.0 ? dx / flat : 1.0;
    segment->heading[1] = flat > 0.0 ? dy / flat : 0.0;
    segment->horizontal = flat / segment->length;
    segment->vertical = dz / segment->length;
    segment->curvature = 0.0;
    segment->accel = segment->overlap[0] = segment->overlap[1] = 0.0;
    segment->rapid = segment->join = 0;
    return 1;
}

int chip_segment_arc(struct chip_segment *segment, const double centre[2], const double start[3], double angle,
                     double rise)
{
    double rx = start[0] - centre[0], ry = start[1] - centre[1];
    double radius = sqrt(rx * rx + ry * ry), flat = radius * fabs(angle);
    int i;
    segment->length = sqrt(flat * flat + rise * rise);
    if (!(flat > CHIP_MIN_LENGTH) || !chip_finite(segment->length)) return 0;
    for (i = 0; i < 3; i++) segment->origin[i] = start[i];
    segment->heading[0] = (angle > 0.0 ? -ry : ry) / radius;
    segment->heading[1] = (angle > 0.0 ? rx : -rx) / radius;
    segment->horizontal = flat / segment->length;
    segment->vertical = rise / segment->length;
    segment->curvature = (angle > 0.0 ? 1.0 : -1.0) / radius;
    segment->accel = segment->overlap[0] = segment->overlap[1] = 0.0;
    segment->rapid = segment->join = 0;
    return 1;
}

void chip_path_reset(struct chip_path *path)
{
    path->known = path->new_chain = 0;
    path->s = path->begin_s = path->end_s = 0.0;
    path->first = path->count = 0;
    path->blend.active = 0;
    path->changed_s = CHIP_NEVER;
}

void chip_path_mark_read(struct chip_path *path)
{
    path->new_chain = 0;
    path->changed_s = CHIP_NEVER;
}

void chip_path_follow(struct chip_path *path, long key, double length, double progress)
{
    while (path->count > 0 && path->key[chip_path_slot(path, 0)] != key) {
        path->begin_s += path->segment[chip_path_slot(path, 0)].length;
        path->first = chip_path_slot(path, 1);
        path->count--;
    }
    if (path->count == 0 || fabs(path->segment[chip_path_slot(path, 0)].length - length) > CHIP_SAME_LENGTH) {
        path->new_chain = 1;
        path->count = 0;
        path->begin_s = path->end_s = 0.0;
    }
    path->s = path->begin_s + progress;
    path->known = 1;
}

/* Whether a segment appended in place of a removed one is the same again. */
static int same_segment(const struct chip_segment *a, const struct chip_segment *b)
{
    return fabs(a->length - b->length) <= CHIP_SAME_LENGTH && fabs(a->vertical - b->vertical) <= CHIP_SAME_HEADING
        && fabs(a->heading[0] - b->heading[0]) <= CHIP_SAME_HEADING
        && fabs(a->heading[1] - b->heading[1]) <= CHIP_SAME_HEADING
        && fabs(a->curvature - b->curvature) <= CHIP_SAME_HEADING;
}

void chip_path_append(struct chip_path *path, long key, const struct chip_segment *segment)
{
    int n;
    if (path->count >= CHIP_PATH_SEGMENTS) return;
    if (path->count == 0) path->end_s = path->begin_s;
    n = chip_path_slot(path, path->count++);
    if (path->key[n] != key || !same_segment(&path->segment[n], segment))
        path->changed_s = chip_min(path->changed_s, path->end_s);
    path->key[n] = key;
    path->segment[n] = *segment;
    path->end_s += segment->length;
}

void chip_path_retract(struct chip_path *path)
{
    if (path->count == 0) return;
    path->end_s -= path->segment[chip_path_slot(path, --path->count)].length;
}

double chip_path_at(const struct chip_path *path, double s, double tip[3], double dir[3])
{
    double begin = path->begin_s;
    int n = 0;
    while (n + 1 < path->count && s > begin + path->segment[chip_path_slot(path, n)].length)
        begin += path->segment[chip_path_slot(path, n++)].length;
    chip_segment_at(&path->segment[chip_path_slot(path, n)], s - begin, tip, dir);
    return path->segment[chip_path_slot(path, n)].curvature;
}

double chip_segment_braking(const struct chip_segment *segment, double from, double to)
{
    double slow = chip_max(0.0, chip_min(to, segment->overlap[0]) - from)
                + chip_max(0.0, to - chip_max(from, segment->length - segment->overlap[1]));
    return segment->accel * (to - from - 0.5 * chip_min(slow, to - from));
}

double chip_path_braking(const struct chip_path *path, double s)
{
    double begin = path->begin_s, sum = 0.0;
    int n;
    for (n = 0; n < path->count && begin < s; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        double end = begin + segment->length;
        if (!(segment->accel > 0.0)) return 0.0;
        if (chip_min(end, s) > chip_max(begin, path->s))
            sum += chip_segment_braking(segment, chip_max(begin, path->s) - begin, chip_min(end, s) - begin);
        begin = end;
    }
    return sum;
}

double chip_path_descent(const struct chip_path *path, double *accel)
{
    double begin = path->begin_s;
    int n;
    *accel = 0.0;
    for (n = 0; path->known && n < path->count; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        if (segment->vertical < -CHIP_PATH_DESCENT && !segment->rapid) {
            double distance = chip_max(0.0, begin - path->s);
            if (distance > 0.0) *accel = chip_path_braking(path, begin) / distance;
            return distance;
        }
        if (segment->join == CHIP_JOIN_STOP) break;
        begin += segment->length;
    }
    return -1.0;
}

/* Angle between two unit vectors, rad. */
static double angle_between(const double a[3], const double b[3])
{
    double chord2 = 0.0, half;
    int i;
    for (i = 0; i < 3; i++) chord2 += (a[i] - b[i]) * (a[i] - b[i]);
    half = 0.5 * sqrt(chord2);
    return half < 0.1 ? 2.0 * half : 2.0 * asin(chip_min(half, 1.0));
}

/* Angle by which the path turns where a segment ends and the next one begins, rad. */
static double corner_angle(const struct chip_segment *segment, const struct chip_segment *next)
{
    double tip[3], before[3], after[3];
    chip_segment_at(segment, segment->length, tip, before);
    chip_segment_at(next, 0.0, tip, after);
    return angle_between(before, after);
}

/* [5] Whether the path bends otherwise behind the end of a segment than before it: a blend begins or ends there. */
static int bend_changes(const struct chip_segment *segment, const struct chip_segment *next, double step)
{
    return fabs(next->curvature * next->horizontal - segment->curvature * segment->horizontal) * step
         > CHIP_BEND_BEGINS;
}

static int point_at(const struct chip_segment *segment, double begin, double s, double turn, int corner,
                    struct chip_path_point *point)
{
    chip_segment_at(segment, s - begin, point->tip, point->dir);
    point->s = s;
    point->curvature = segment->curvature;
    point->turn = turn;
    point->corner = corner;
    return 1;
}

int chip_path_next(const struct chip_path *path, double s, double step, double turn, struct chip_path_point *next)
{
    double begin = path->begin_s, turned = 0.0;
    int n = 0;
    if (path->count == 0 || s >= path->end_s) return 0;
    while (n + 1 < path->count && s > begin + path->segment[chip_path_slot(path, n)].length)
        begin += path->segment[chip_path_slot(path, n++)].length;
    for (;;) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        double end = begin + segment->length, from = chip_max(s, begin), goal = s + step, angle;
        double turn_rate = fabs(segment->curvature) * segment->horizontal;
        if (turn_rate * (goal - from) > turn - turned) goal = from + chip_max(0.0, turn - turned) / turn_rate;
        if (goal < end || n + 1 >= path->count)
            return point_at(segment, begin, chip_min(goal, end), turned + turn_rate * (chip_min(goal, end) - from), 0,
                            next);
        turned += turn_rate * chip_max(0.0, end - from);
        angle = corner_angle(segment, &path->segment[chip_path_slot(path, n + 1)]);
        if (s >= end - CHIP_PATH_BEYOND && angle > CHIP_SMOOTH_CORNER)
            return point_at(&path->segment[chip_path_slot(path, n + 1)], end, end + CHIP_PATH_BEYOND, angle, 1, next);
        if (angle > CHIP_SHARP_CORNER || turned + angle > turn
            || (angle > CHIP_SMOOTH_CORNER && end - s >= CHIP_CORNERS_APART * step)
            || (bend_changes(segment, &path->segment[chip_path_slot(path, n + 1)], step)
                && end - s >= CHIP_BENDS_APART * step))
            return point_at(segment, begin, end, turned, 0, next);
        turned += angle;
        begin = end;
        n++;
    }
}

/* mm on a segment from `from` on until braking has taken off `energy`, mm2/s2, half of the square of the velocity. */
static double stop_on(const struct chip_segment *segment, double from, double energy)
{
    double border[3], at = from;
    int i;
    border[0] = segment->overlap[0];
    border[1] = segment->length - segment->overlap[1];
    border[2] = segment->length;
    for (i = 0; i < 3; i++) {
        double part = border[i] > at ? chip_segment_braking(segment, at, border[i]) : 0.0;
        if (!(border[i] > at)) continue;
        if (energy <= part) return at - from + energy / part * (border[i] - at);
        energy -= part;
        at = border[i];
    }
    return segment->length - from;
}

double chip_path_stop(const struct chip_path *path, double speed, double accel)
{
    double begin = path->begin_s, energy = 0.5 * speed * speed;
    int n;
    for (n = 0; n < path->count; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        double from = chip_max(begin, path->s), end = begin + segment->length;
        double sum =
            segment->accel > 0.0 ? chip_segment_braking(segment, from - begin, segment->length) : accel * (end - from);
        if (!(segment->accel > 0.0) && !(accel > 0.0)) return CHIP_NEVER;
        if (end > from) {
            if (energy <= sum)
                return from + (segment->accel > 0.0 ? stop_on(segment, from - begin, energy) : energy / accel);
            energy -= sum;
        }
        begin = end;
    }
    return path->end_s;
}
