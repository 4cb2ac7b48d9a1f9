/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_state.c - see tracer_state.h; the numbers in brackets are those of tracer.h's principle. */
#include "chip_math.h"
#include "tracer.h"
#include "tracer_law.h"
#include "tracer_sensor.h"
#include "tracer_state.h"

#define CHIP_TRACER_ARRIVED_MM 0.01 /* from the end of a line, a pick feed or a return */
#define CHIP_TRACER_OUT_PERIODS 3   /* without contact: it is lost, not noise */
#define CHIP_TRACER_STEEP 0.3       /* smallest part of n in the plane that the normal velocity is raised for */
#define CHIP_TRACER_OVERHANG -0.4   /* height of a line's normal below which the stylus is under the model */
#define CHIP_TRACER_HOLD_HZ 20.0    /* gain back into the trace plane */
#define CHIP_TRACER_CLOSE_MM 2.0    /* a lap ends this near to its beginning, past it */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void copy(double to[3], const double from[3])
{
    int i;
    for (i = 0; i < 3; i++) to[i] = from[i];
}

static int is_scan(const struct chip_tracer *tracer)
{
    return tracer->settings.mode_number == CHIP_TRACER_ONE_WAY || tracer->settings.mode_number == CHIP_TRACER_BOTH_WAYS;
}

/* Axis of the pick feed. */
static int pick_axis(const struct chip_tracer *tracer)
{
    return is_scan(tracer) ? 1 - tracer->settings.scan_axis_number : 2;
}

/* Velocity from which the head stops within its range [5]. */
static double head_limit(const struct chip_tracer_settings *s, double period_s)
{
    return chip_min(s->max_vel_mm_s, chip_tracer_stop_vel(s, period_s));
}

static void enter(struct chip_tracer *tracer, int state, const struct chip_tracer_in *in)
{
    tracer->state = state;
    copy(tracer->from_mm, in->position_mm);
    tracer->periods_out = 0;
}

void chip_tracer_begin(struct chip_tracer *tracer, const struct chip_tracer_in *in)
{
    int i;
    tracer->lines = 0;
    tracer->sense = tracer->settings.direction_sign;
    tracer->law.friction_share = tracer->settings.friction_share;
    tracer->highest_mm = -dot(in->position_mm, tracer->settings.approach_dir);
    tracer->pick_to_mm = in->position_mm[pick_axis(tracer)];
    for (i = 0; i < 3; i++) tracer->normal[i] = -tracer->settings.approach_dir[i];
    enter(tracer, CHIP_TRACER_APPROACH, in);
}

/* The trace plane of a line through pick_to_mm. */
static void begin_trace(struct chip_tracer *tracer, const struct chip_tracer_in *in)
{
    double a[3] = { 0.0, 0.0, 0.0 }, b[3] = { 0.0, 0.0, 0.0 }, across[3], place[3];
    a[is_scan(tracer) ? tracer->settings.scan_axis_number : 0] = 1.0;
    b[is_scan(tracer) ? 2 : 1] = 1.0;
    cross(a, b, across);
    copy(place, in->position_mm);
    place[pick_axis(tracer)] = tracer->pick_to_mm;
    tracer->line_mm = dot(across, place);
    tracer->has_left_start = 0;
    chip_tracer_plane(&tracer->law, a, b, tracer->sense);
    enter(tracer, CHIP_TRACER_TRACE, in);
}

/* The plane of the pick feed: its axis, and Z for lines on what is not too steep, else the normal as far as it is
 * perpendicular to the axis. */
static void begin_pick(struct chip_tracer *tracer, const struct chip_tracer_in *in)
{
    double a[3] = { 0.0, 0.0, 0.0 }, b[3], across[3], along, size;
    int axis = pick_axis(tracer), i;
    a[axis] = tracer->settings.pick_mm < 0.0 ? -1.0 : 1.0;
    along = dot(tracer->normal, a);
    for (i = 0; i < 3; i++) b[i] = tracer->normal[i] - along * a[i];
    size = chip_sqrt(dot(b, b));
    if (size < 0.2 || (is_scan(tracer) && tracer->normal[2] > 0.5)) {
        b[0] = b[1] = b[2] = 0.0;
        b[is_scan(tracer) ? 2 : 0] = size = 1.0;
    }
    for (i = 0; i < 3; i++) b[i] /= size;
    cross(a, b, across);
    tracer->line_mm = dot(across, in->position_mm);
    chip_tracer_plane(&tracer->law, a, b, 1.0);
    enter(tracer, CHIP_TRACER_PICK, in);
}

/* A line or lap has ended: the next one, or the end. */
static void end_line(struct chip_tracer *tracer, const struct chip_tracer_in *in)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    int axis = pick_axis(tracer);
    double next = tracer->pick_to_mm + s->pick_mm;
    if (tracer->lines < 2147483647) tracer->lines++;
    if (s->pick_mm == 0.0 || next > s->window_max_mm[axis] + 1e-6 || next < s->window_min_mm[axis] - 1e-6) {
        enter(tracer, CHIP_TRACER_RETRACT, in);
        tracer->returns = 0;
        return;
    }
    tracer->pick_to_mm = next;
    if (s->mode_number == CHIP_TRACER_ONE_WAY) {
        enter(tracer, CHIP_TRACER_RETRACT, in);
        tracer->returns = 1;
    } else {
        begin_pick(tracer, in);
    }
}

/* Distance left to the window along the tangent on one axis, and the feed it leaves. */
static double window_feed(const struct chip_tracer *tracer, const struct chip_tracer_in *in, const double tangent[3],
                          int axis, double feed, int *ended)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    double part = tangent[axis], left, size = part < 0.0 ? -part : part;
    if (is_scan(tracer) ? part * tracer->sense <= 0.05 : size <= 0.05) return feed;
    left = part > 0.0 ? s->window_max_mm[axis] - in->position_mm[axis] : in->position_mm[axis] - s->window_min_mm[axis];
    CHIP_FAULT(WINDOW_PASSED, left -= 1.0);
    if (left < CHIP_TRACER_ARRIVED_MM) *ended = 1;
    return chip_min(feed, chip_tracer_normal_vel(s, chip_max(left, 0.0), CHIP_TRACER_END_GAIN) / size);
}

/* Whether a lap is complete: turned by most of a circle, near its beginning, and past it. */
static int is_lap(struct chip_tracer *tracer, const struct chip_tracer_in *in, const double tangent[3])
{
    double turned = tracer->law.turned_rad, off[3], past;
    int i;
    if (!tracer->has_left_start) {
        if (tracer->law.periods < CHIP_TRACER_WINDOW) return 0;
        tracer->has_left_start = 1;
        copy(tracer->start_mm, in->position_mm);
        copy(tracer->start_tangent, tangent);
    }
    for (i = 0; i < 3; i++) off[i] = in->position_mm[i] - tracer->start_mm[i];
    past = dot(off, tracer->start_tangent);
    return (turned > 1.5 * CHIP_PI || turned < -1.5 * CHIP_PI) && past >= 0.0
        && dot(off, off) < CHIP_TRACER_CLOSE_MM * CHIP_TRACER_CLOSE_MM;
}

/* Feed of a trace as its end comes near; *ended: it is there. */
static double end_of_trace(struct chip_tracer *tracer, const struct chip_tracer_in *in, const double tangent[3],
                           double feed, int *ended)
{
    double most = feed;
    if (tracer->state == CHIP_TRACER_PICK) {
        double left = tracer->pick_to_mm - in->position_mm[pick_axis(tracer)];
        if (tracer->settings.pick_mm < 0.0) left = -left;
        *ended = left < CHIP_TRACER_ARRIVED_MM;
        return chip_min(feed, chip_tracer_normal_vel(&tracer->settings, chip_max(left, 0.0), CHIP_TRACER_END_GAIN));
    }
    if (is_scan(tracer)) return window_feed(tracer, in, tangent, tracer->settings.scan_axis_number, feed, ended);
    if (tracer->settings.mode_number == CHIP_TRACER_CONTOUR) {
        *ended = is_lap(tracer, in, tangent);
        return feed;
    }
    most = window_feed(tracer, in, tangent, 0, most, ended);
    return window_feed(tracer, in, tangent, 1, most, ended);
}

/* Share of its velocity that every movement has. */
static double share_of(const struct chip_tracer_in *in)
{
    return chip_finite(in->feed_share) ? chip_clamp(in->feed_share, 0.0, 1.0) : 0.0;
}

/* TRACE and PICK: the law [2] to [5]; a fault if a line goes round below the model. */
static int trace(struct chip_tracer *tracer, const struct chip_tracer_in *in, double eps, double period_s,
                 double wanted[3], struct chip_tracer_out *out)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    const double *late = chip_tracer_late(tracer, period_s);
    struct chip_tracer_heading heading;
    double ball[3], across[3], feed, most, hold, height, swing;
    int i, ended = 0;
    for (i = 0; i < 3; i++) ball[i] = late[i] + in->deflection_mm[i];
    chip_tracer_heading(&tracer->law, in->deflection_mm, ball, s->dead_time_s, period_s, &heading);
    feed = chip_tracer_feed(s, &tracer->law, share_of(in), eps, period_s, &out->limit_number);
    most = end_of_trace(tracer, in, heading.tangent, feed, &ended);
    if (most < feed) feed = most, out->limit_number = CHIP_TRACER_BY_WINDOW;
    most = chip_tracer_blind_vel(s, tracer->sensor.held_periods, period_s);
    if (most < feed) feed = most, out->limit_number = CHIP_TRACER_BY_RANGE;
    swing = share_of(in) * s->feed_mm_s > 0.0 ? chip_tracer_swing(tracer) : 0.0;
    if (out->limit_number == CHIP_TRACER_BY_NOTHING && out->gain_hz < s->gain_hz)
        out->limit_number = CHIP_TRACER_BY_GAIN;
    out->velocity_limit_mm_s = head_limit(s, period_s);
    out->tangential_vel_mm_s = feed;
    out->normal_vel_mm_s = chip_tracer_normal_vel(s, eps - s->deflection_mm - swing, out->gain_hz)
                             / chip_max(heading.steepness, CHIP_TRACER_STEEP)
                         + heading.bend_vel_mm_s + (share_of(in) > 0.0 ? chip_tracer_lift(tracer) : 0.0);
    cross(tracer->law.a, tracer->law.b, across);
    hold = chip_clamp(CHIP_TRACER_HOLD_HZ * (tracer->line_mm - dot(across, in->position_mm)), -s->approach_vel_mm_s,
                      s->approach_vel_mm_s);
    for (i = 0; i < 3; i++)
        wanted[i] = feed * heading.tangent[i] + out->normal_vel_mm_s * heading.normal[i] + hold * across[i];
    height = -dot(in->position_mm, s->approach_dir);
    tracer->highest_mm = chip_max(tracer->highest_mm, height);
    if (eps > 0.5 * s->deflection_mm) copy(tracer->normal, heading.normal);
    if (is_scan(tracer) && tracer->state == CHIP_TRACER_TRACE && heading.normal[2] < CHIP_TRACER_OVERHANG)
        return CHIP_TRACER_BELOW;
    tracer->periods_out = eps < CHIP_TRACER_CONTACT * s->deflection_mm ? tracer->periods_out + 1 : 0;
    if (tracer->periods_out >= CHIP_TRACER_OUT_PERIODS && !CHIP_FAULTY(LOST_IGNORED)) {
        tracer->lost_in_pick = tracer->state == CHIP_TRACER_PICK;
        enter(tracer, CHIP_TRACER_LOST, in);
    } else if (ended && tracer->state == CHIP_TRACER_PICK) {
        if (s->mode_number != CHIP_TRACER_CONTOUR) tracer->sense = -tracer->sense;
        begin_trace(tracer, in);
    } else if (ended) {
        end_line(tracer, in);
    }
    return CHIP_TRACER_NO_FAULT;
}

/* APPROACH, and LOST: towards the model along `dir` until it is met; a fault if it is not. */
static int seek(struct chip_tracer *tracer, const struct chip_tracer_in *in, double eps, double period_s,
                const double dir[3], double most_mm, double wanted[3], struct chip_tracer_out *out)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    double gone[3], vel, most_vel = head_limit(s, period_s);
    int i;
    for (i = 0; i < 3; i++) gone[i] = in->position_mm[i] - tracer->from_mm[i];
    if (eps >= CHIP_TRACER_LANDED * s->deflection_mm) {
        chip_tracer_land(&tracer->law);
        if (tracer->state == CHIP_TRACER_APPROACH) {
            begin_trace(tracer, in);
        } else {
            chip_tracer_plane(&tracer->law, tracer->law.a, tracer->law.b, tracer->law.sense);
            enter(tracer, tracer->lost_in_pick ? CHIP_TRACER_PICK : CHIP_TRACER_TRACE, in);
        }
        return CHIP_TRACER_NO_FAULT;
    }
    if (chip_sqrt(dot(gone, gone)) > most_mm) return CHIP_TRACER_NO_CONTACT;
    out->velocity_limit_mm_s = most_vel;
    vel = chip_min(chip_min(s->approach_vel_mm_s, most_vel),
                   chip_tracer_normal_vel(s, s->deflection_mm - eps, out->gain_hz));
    for (i = 0; i < 3; i++) wanted[i] = share_of(in) * vel * dir[i];
    return CHIP_TRACER_NO_FAULT;
}

/* RETRACT: against the approach, above all of the line. */
static void retract(struct chip_tracer *tracer, const struct chip_tracer_in *in, double wanted[3])
{
    const struct chip_tracer_settings *s = &tracer->settings;
    double height = -dot(in->position_mm, s->approach_dir), vel;
    double left = tracer->highest_mm + s->retract_mm - height;
    int i;
    if (left < CHIP_TRACER_ARRIVED_MM) {
        enter(tracer, tracer->returns ? CHIP_TRACER_RETURN : CHIP_TRACER_DONE, in);
        return;
    }
    vel = chip_min(s->return_vel_mm_s, chip_tracer_normal_vel(s, left, CHIP_TRACER_END_GAIN));
    for (i = 0; i < 3; i++) wanted[i] = -share_of(in) * vel * s->approach_dir[i];
}

/* RETURN: above the model to the beginning of the next line. */
static int go_back(struct chip_tracer *tracer, const struct chip_tracer_in *in, double eps, double period_s,
                   double wanted[3], struct chip_tracer_out *out)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    double off[3] = { 0.0, 0.0, 0.0 }, left, vel;
    int along = s->scan_axis_number, across = pick_axis(tracer), i;
    if (eps > CHIP_TRACER_LANDED * s->deflection_mm) return CHIP_TRACER_COLLISION;
    off[along] = (tracer->sense > 0.0 ? s->window_min_mm[along] : s->window_max_mm[along]) - in->position_mm[along];
    off[across] = tracer->pick_to_mm - in->position_mm[across];
    left = chip_sqrt(dot(off, off));
    out->velocity_limit_mm_s = head_limit(s, period_s);
    if (left < CHIP_TRACER_ARRIVED_MM) {
        tracer->highest_mm = -1e9;
        enter(tracer, CHIP_TRACER_APPROACH, in);
        return CHIP_TRACER_NO_FAULT;
    }
    vel = chip_min(chip_min(s->return_vel_mm_s, out->velocity_limit_mm_s),
                   chip_tracer_normal_vel(s, left, CHIP_TRACER_END_GAIN));
    for (i = 0; i < 3; i++) wanted[i] = share_of(in) * vel * off[i] / left;
    return CHIP_TRACER_NO_FAULT;
}

int chip_tracer_run(struct chip_tracer *tracer, const struct chip_tracer_in *in, double eps, double period_s,
                    double wanted[3], struct chip_tracer_out *out)
{
    double back[3];
    int i;
    if (in->wants_retract && tracer->state >= CHIP_TRACER_APPROACH && tracer->state <= CHIP_TRACER_LOST
        && tracer->state != CHIP_TRACER_RETRACT) {
        enter(tracer, CHIP_TRACER_RETRACT, in);
        tracer->highest_mm = -dot(in->position_mm, tracer->settings.approach_dir);
        tracer->returns = 0;
    }
    for (i = 0; i < 3; i++) back[i] = -tracer->normal[i];
    switch (tracer->state) {
    case CHIP_TRACER_APPROACH:
        return seek(tracer, in, eps, period_s, tracer->settings.approach_dir, tracer->settings.search_mm, wanted, out);
    case CHIP_TRACER_LOST: return seek(tracer, in, eps, period_s, back, tracer->settings.lost_mm, wanted, out);
    case CHIP_TRACER_TRACE:
    case CHIP_TRACER_PICK: return trace(tracer, in, eps, period_s, wanted, out);
    case CHIP_TRACER_RETRACT: retract(tracer, in, wanted); break;
    case CHIP_TRACER_RETURN: return go_back(tracer, in, eps, period_s, wanted, out);
    default: break;
    }
    return CHIP_TRACER_NO_FAULT;
}
