/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clamp_guard.c - whether the tool has to stop before a clamp: see clamp.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "clamp.h"

#define CHIP_CLAMP_LATE 3.0      /* periods of travel until the planner brakes, and one in reserve */
#define CHIP_CLAMP_CERTAIN 0.8   /* of the braking that the planner is capable of */
#define CHIP_CLAMP_UNKNOWN 20.0  /* mm, braking distance if the acceleration is unknown */
#define CHIP_CLAMP_SAGITTA 0.005 /* mm, of the chords of an arc [3] */
#define CHIP_CLAMP_SLACK 0.01    /* mm by which a tool that sets out within the clearance may come nearer [6] */
#define CHIP_CLAMP_CHORDS 64     /* of an arc at most */
#define CHIP_CLAMP_BLEND_PARTS 8 /* chords of a parabola [4] */
#define CHIP_CLAMP_FINE 0.01     /* mm to which the nearest place of a line is located [2] */
#define CHIP_CLAMP_STEPS 32      /* of the golden section at most */
#define CHIP_CLAMP_GOLDEN 0.6180339887498949
#define CHIP_CLAMP_AT_REST 1e-6 /* mm, a shorter step has no direction */

/* What one body is kept from by one clamp. */
struct watched {
    struct chip_clamps *clamps;
    const struct chip_clamp *clamp;
    const struct chip_clamp_body *body;
    double least;     /* mm, the distance that is allowed */
    double travelled; /* mm of travel to the beginning of the line that is looked at */
    double free_to;   /* mm of travel that are known to be free [2] */
    double met;       /* mm of travel at which it is met */
};

/* [7] The distance above what is allowed; negative too if the work does not suffice. */
static double spare(struct watched *watched, const double tip[3])
{
    if (++watched->clamps->work > CHIP_CLAMP_WORK) return -1.0;
    return chip_clamp_distance(watched->clamp, watched->body, tip) - watched->least;
}

static void point_between(const double a[3], const double b[3], double share, double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) tip[i] = a[i] + share * (b[i] - a[i]);
}

/* Halves the line from `good` to `bad` (shares of a to b): where the clamp is met first. */
static int meet(struct watched *watched, const double a[3], const double b[3], double length, double good, double bad)
{
    double tip[3];
    while ((bad - good) * length > CHIP_CLAMP_FINE && watched->clamps->work < CHIP_CLAMP_WORK) {
        double half = 0.5 * (good + bad);
        point_between(a, b, half, tip);
        if (spare(watched, tip) < 0.0)
            bad = half;
        else
            good = half;
    }
    watched->met = watched->travelled + good * length;
    return 1;
}

/* [2] Whether the line from a to b, `length` mm, is nearer to the clamp than allowed. */
static int line_meets(struct watched *watched, const double a[3], const double b[3], double length)
{
    double low = 0.0, high = 1.0, left, right, at_low, at_high, at_left = 0.0, at_right = 0.0, tip[3];
    int i, ask = 3;
    if (watched->travelled + length <= watched->free_to) return 0;
    at_low = spare(watched, a);
    if (at_low < 0.0) return meet(watched, a, b, length, 0.0, 0.0);
    watched->free_to = chip_max(watched->free_to, watched->travelled + at_low);
    if (at_low >= length) return 0;
    at_high = spare(watched, b);
    if (at_high < 0.0) return meet(watched, a, b, length, 0.0, 1.0);
    left = high - CHIP_CLAMP_GOLDEN;
    right = low + CHIP_CLAMP_GOLDEN;
    for (i = 0; i < CHIP_CLAMP_STEPS && at_low + at_high < (high - low) * length; i++) {
        if ((high - low) * length <= CHIP_CLAMP_FINE) break;
        if (ask & 1) {
            point_between(a, b, left, tip);
            at_left = spare(watched, tip);
            if (at_left < 0.0) return meet(watched, a, b, length, low, left);
        }
        if (ask & 2) {
            point_between(a, b, right, tip);
            at_right = spare(watched, tip);
            if (at_right < 0.0) return meet(watched, a, b, length, low, right);
        }
        if (at_left <= at_right) {
            high = right;
            at_high = at_right;
            right = left;
            at_right = at_left;
            left = high - CHIP_CLAMP_GOLDEN * (high - low);
            ask = 1;
        } else {
            low = left;
            at_low = at_left;
            left = right;
            at_left = at_right;
            right = low + CHIP_CLAMP_GOLDEN * (high - low);
            ask = 2;
        }
    }
    return 0;
}

/* [3] A part of a segment, mm along it. */
static int segment_meets(struct watched *watched, const struct chip_segment *segment, double from, double to)
{
    double angle = fabs(segment->curvature) * segment->horizontal * (to - from), a[3], b[3], dir[3], begin;
    int i, chords = 1;
    if (angle > 0.0) {
        double most = sqrt(8.0 * CHIP_CLAMP_SAGITTA * fabs(segment->curvature));
        chords = (int)chip_clamp(ceil(angle / most), 1.0, CHIP_CLAMP_CHORDS);
    }
    begin = watched->travelled;
    chip_segment_at(segment, from, a, dir);
    for (i = 1; i <= chords; i++) {
        double length = (to - from) / chords;
        chip_segment_at(segment, from + length * i, b, dir);
        if (line_meets(watched, a, b, length)) return 1;
        watched->travelled = begin + length * i;
        a[0] = b[0];
        a[1] = b[1];
        a[2] = b[2];
    }
    return 0;
}

/* [4] The blend from a segment that ends `ahead` mm of travel from here into the next one. */
static int blend_meets(struct watched *watched, const struct chip_segment *segment, const struct chip_segment *next,
                       double ahead, double speed)
{
    double first = 0.5 * segment->length, second = 0.5 * next->length, begin[3], end[3], corner[3], dir[3], a[3], b[3];
    double travelled = watched->travelled, free_to = watched->free_to;
    int i, k, found = 0;
    if (segment->accel > 0.0) first = chip_min(first, 0.5 * speed * speed / segment->accel);
    if (next->accel > 0.0) second = chip_min(second, 0.5 * speed * speed / next->accel);
    if (watched->free_to >= ahead + second) return 0;
    chip_segment_at(segment, segment->length - first, begin, dir);
    chip_segment_at(segment, segment->length, corner, dir);
    chip_segment_at(next, second, end, dir);
    for (i = 0; i < 3; i++) a[i] = begin[i];
    watched->travelled = chip_max(0.0, ahead - first);
    watched->free_to = 0.0;
    for (k = 1; k <= CHIP_CLAMP_BLEND_PARTS && !found; k++) {
        double t = (double)k / CHIP_CLAMP_BLEND_PARTS, u = 1.0 - t, length = 0.0;
        for (i = 0; i < 3; i++) {
            b[i] = u * u * begin[i] + 2.0 * u * t * corner[i] + t * t * end[i];
            length += (b[i] - a[i]) * (b[i] - a[i]);
        }
        found = line_meets(watched, a, b, sqrt(length));
        for (i = 0; i < 3; i++) a[i] = b[i];
    }
    watched->travelled = travelled;
    watched->free_to = free_to;
    return found;
}

/* [3] The programmed path up to `until`. */
static int path_meets(struct watched *watched, const struct chip_path *path, double until, double speed)
{
    double begin = path->begin_s;
    int n;
    for (n = 0; n < path->count && begin < until; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        double from = chip_max(path->s, begin), to = chip_min(until, begin + segment->length);
        watched->travelled = from - path->s;
        if (to > from && watched->free_to < to - path->s && segment_meets(watched, segment, from - begin, to - begin))
            return 1;
        begin += segment->length;
        if (segment->join == CHIP_JOIN_PARABOLIC && n + 1 < path->count && begin <= until && !CHIP_FAULTY(BLENDS_FREE)
            && blend_meets(watched, segment, &path->segment[chip_path_slot(path, n + 1)], begin - path->s, speed))
            return 1;
    }
    return 0;
}

/* [3] mm of travel until a tool that has to stop now is at rest; without a path. */
static double stop_after(const struct chip_clamp_in *in, double speed, double late)
{
    double accel = 0.5 * in->acceleration_mm_s2, to_go = in->distance_to_go_mm;
    double far = chip_setting(accel) > 0.0 ? 0.5 * speed * speed / accel + late : CHIP_CLAMP_UNKNOWN;
    return chip_finite(to_go) && to_go > 0.0 ? chip_min(far, to_go) : far;
}

/* [6] mm that a body which is `now` mm from a clamp has to keep. */
static double kept(double *allowed, double now, double clearance)
{
    *allowed = chip_min(clearance, chip_max(*allowed, now - CHIP_CLAMP_SLACK));
    CHIP_FAULT(CLAMPS_CREEP, *allowed = chip_min(clearance, now - CHIP_CLAMP_SLACK));
    return *allowed;
}

/* Looks at one clamp for one body: at the path up to `until`, or at the line to `end`. */
static int body_meets(struct watched *watched, const struct chip_clamp_in *in, double *allowed, double until,
                      const double end[3], double speed)
{
    struct chip_clamps *clamps = watched->clamps;
    const struct chip_clamp *clamp = watched->clamp;
    double far = clamps->table.clearance + clamps->window, now;
    double wide = clamp->half_x + clamp->half_y + watched->body->radius + far;
    if (fabs(in->to[0] - clamp->x) > wide || fabs(in->to[1] - clamp->y) > wide
        || in->to[2] + watched->body->begins > clamp->top + far) {
        *allowed = clamps->table.clearance;
        return 0;
    }
    clamps->work++;
    now = chip_clamp_distance(clamp, watched->body, in->to);
    watched->least = kept(allowed, now, clamps->table.clearance);
    if (now > far) return 0;
    watched->travelled = watched->free_to = 0.0;
    if (in->path) return path_meets(watched, in->path, until, speed);
    return line_meets(watched, in->to, end, clamps->window);
}

/* [4] mm that the tool may be ahead of its place on the path, because it is in a blend. */
static double blended(const struct chip_path *path, double speed)
{
    const struct chip_segment *segment = &path->segment[path->first], *next = &path->segment[chip_path_slot(path, 1)];
    double energy = 0.5 * speed * speed, left = path->begin_s + segment->length - path->s;
    if (segment->join != CHIP_JOIN_PARABOLIC || path->count < 2 || !(segment->accel > 0.0) || !(next->accel > 0.0))
        return 0.0;
    return left <= energy / segment->accel ? chip_min(0.5 * next->length, energy / next->accel) : 0.0;
}

int chip_clamps_check(struct chip_clamps *clamps, const struct chip_clamp_in *in)
{
    double step2 = 0.0, speed, late, jerk = chip_setting(in->max_jerk_mm_s3), until = 0.0, end[3], accel;
    uint64_t c;
    int i, k;
    for (i = 0; i < 3; i++) step2 += (in->to[i] - in->from[i]) * (in->to[i] - in->from[i]);
    clamps->number = clamps->part = 0;
    clamps->work = 0;
    clamps->distance = clamps->window = 0.0;
    if (!chip_finite(step2) || !(in->period_s > 0.0)) return 0;
    accel = chip_setting(in->acceleration_mm_s2);
    speed = chip_max(sqrt(step2) / in->period_s, chip_setting(in->current_vel_mm_s))
          + CHIP_CLAMP_LATE * accel * in->period_s;
    late = CHIP_CLAMP_LATE * speed * in->period_s + (jerk > 0.0 ? 1.5 * speed * accel / jerk : 0.0);
    CHIP_FAULT(CLAMPS_LATE, late = 0.0; speed *= 0.5);
    if (in->path) {
        until =
            chip_path_stop(in->path, speed / sqrt(CHIP_CLAMP_CERTAIN), 0.5 * accel) + late + blended(in->path, speed);
        if (!(accel > 0.0)) until = chip_min(until, in->path->s + CHIP_CLAMP_UNKNOWN);
        until = chip_min(until, in->path->end_s);
        clamps->window = chip_max(0.0, until - in->path->s);
    } else {
        clamps->window = step2 > CHIP_CLAMP_AT_REST * CHIP_CLAMP_AT_REST ? stop_after(in, speed, late) : 0.0;
        for (i = 0; i < 3; i++)
            end[i] = in->to[i] + (step2 > 0.0 ? clamps->window * (in->to[i] - in->from[i]) / sqrt(step2) : 0.0);
    }
    if (!(clamps->window > 0.0)) return 0;
    for (c = 0; c < clamps->table.count && c < CHIP_CLAMPS; c++) {
        for (k = 0; k < clamps->bodies; k++) {
            struct watched watched = { clamps, &clamps->table.clamp[c], &clamps->body[k], 0.0, 0.0, 0.0, 0.0 };
            if (!body_meets(&watched, in, &clamps->allowed[c][k], until, end, speed)) continue;
            if (clamps->number && !(watched.met < clamps->distance)) continue;
            clamps->number = (int)c + 1;
            clamps->part = k;
            clamps->distance = watched.met;
        }
    }
    return clamps->number != 0;
}
