/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_law.c - see tracer_law.h; the numbers in brackets are those of tracer.h's principle. */
#include "chip_math.h"
#include "tracer_law.h"

#define CHIP_TRACER_STABLE 0.75      /* gain x (dead time + period): the loop oscillates from about 1 */
#define CHIP_TRACER_FRICTION_S 0.05  /* s over which friction is averaged; less follows noise */
#define CHIP_TRACER_FRICTION_MAX 0.6 /* sine of the largest friction angle */
#define CHIP_TRACER_CHORD_MM 0.02    /* a shorter chord is noise */
#define CHIP_TRACER_CHORD_BEND 0.3   /* rad: a chord over a larger bend shows no tangent */
#define CHIP_TRACER_ANGLE_GAIN 0.4   /* of the heading's filter; the rate's is the square over 2 - this [4] */
#define CHIP_TRACER_RATE_GAIN 0.1
#define CHIP_TRACER_ROOM 0.6 /* share of range - eps0 to stop in; the rest is for n, which turns first */
#define CHIP_TRACER_BLIND 4  /* periods until a frozen sensor is seen [8] */
#define CHIP_TRACER_BLIND_ROOM 0.8
#define CHIP_TRACER_SLIDES 0.9   /* share of the friction along the tangent from which it is learned */
#define CHIP_TRACER_RISE 10.0    /* dead times and periods over which the feed rises at the beginning of a line */
#define CHIP_TRACER_LEAD_MAX 0.5 /* rad the heading is turned ahead at most */

/* Difference of two angles, -pi..pi; both are at most a few turns. */
static double turn(double angle) { return angle - 2.0 * CHIP_PI * floor(angle / (2.0 * CHIP_PI) + 0.5); }

void chip_tracer_plane(struct chip_tracer_law *law, const double a[3], const double b[3], double sense)
{
    int i;
    for (i = 0; i < 3; i++) {
        law->a[i] = a[i];
        law->b[i] = b[i];
    }
    law->sense = sense;
    law->periods = 0;
    law->since_s = 0.0;
    law->rate_rad_s = law->turned_rad = 0.0;
    law->newest = 0;
}

void chip_tracer_land(struct chip_tracer_law *law)
{
    law->has_head = law->sliding = 0;
    law->drag[0] = law->drag[1] = law->drag[2] = 0.0;
}

/* Average friction from the chord whose middle is CHIP_TRACER_CHORD periods ago [3]. */
static void learn_friction(struct chip_tracer_law *law, double period_s)
{
    const struct chip_tracer_point
        *end = &law->point[law->newest],
        *start = &law->point[(law->newest + 1) % CHIP_TRACER_WINDOW],
        *middle = &law->point[(law->newest + CHIP_TRACER_WINDOW - CHIP_TRACER_CHORD) % CHIP_TRACER_WINDOW];
    double x = end->ball_a_mm - start->ball_a_mm, y = end->ball_b_mm - start->ball_b_mm, measured, weight;
    double bend = law->rate_rad_s * 2.0 * CHIP_TRACER_CHORD * period_s;
    if (law->periods < CHIP_TRACER_WINDOW || law->sliding < CHIP_TRACER_WINDOW
        || x * x + y * y < CHIP_TRACER_CHORD_MM * CHIP_TRACER_CHORD_MM || bend > CHIP_TRACER_CHORD_BEND
        || bend < -CHIP_TRACER_CHORD_BEND)
        return;
    CHIP_FAULT(CHORD_AT_ITS_END, middle = end);
    measured = sin(law->sense * turn(middle->angle_rad - atan2(y, x)) - 0.5 * CHIP_PI) * middle->share;
    weight = chip_min(1.0, period_s / CHIP_TRACER_FRICTION_S);
    measured = chip_clamp(measured, 0.0, CHIP_TRACER_FRICTION_MAX);
    law->friction_share += weight * (measured - law->friction_share);
    CHIP_FAULT(FRICTION_AS_NORMAL, law->friction_share = 0.0);
}

/* The force of friction follows the head until the stylus slides: after a change of direction it sticks first [3]. */
static void follow_drag(struct chip_tracer_law *law, const double head[3], double eps)
{
    double along = 0.0, size = 0.0, share;
    int i;
    if (law->has_head) {
        for (i = 0; i < 3; i++) along += (head[i] - law->head_mm[i]) * law->normal[i];
        for (i = 0; i < 3; i++) law->drag[i] -= (head[i] - law->head_mm[i] - along * law->normal[i]) / eps;
    }
    for (i = 0; i < 3; i++) {
        law->head_mm[i] = head[i];
        size += law->drag[i] * law->drag[i];
    }
    size = chip_sqrt(size);
    share = size > law->friction_share ? law->friction_share / size : 1.0;
    for (i = 0; i < 3; i++) law->drag[i] *= share;
}

/* Part of the drag against the travel along a surface whose normal is near `angle`. */
static double slip(const struct chip_tracer_law *law, double angle)
{
    double against = 0.0;
    int i;
    for (i = 0; i < 3; i++) against -= law->drag[i] * law->sense * (sin(angle) * law->a[i] - cos(angle) * law->b[i]);
    CHIP_FAULT(STICKING_FORGOTTEN, against = law->friction_share);
    return against;
}

/* Rate of the heading by an alpha-beta filter: it has no lag while the rate is constant [4]. */
static void follow_heading(struct chip_tracer_law *law, double angle, double period_s)
{
    double miss;
    if (law->periods == 0) law->heading_rad = angle;
    miss = turn(angle - law->heading_rad - law->rate_rad_s * period_s);
    law->turned_rad += law->rate_rad_s * period_s + CHIP_TRACER_ANGLE_GAIN * miss;
    law->heading_rad = turn(law->heading_rad + law->rate_rad_s * period_s + CHIP_TRACER_ANGLE_GAIN * miss);
    law->rate_rad_s += CHIP_TRACER_RATE_GAIN * miss / period_s;
    law->rate_rad_s = chip_clamp(law->rate_rad_s, -0.5 / period_s, 0.5 / period_s);
    law->turned_rad = chip_clamp(law->turned_rad, -1e6, 1e6);
}

void chip_tracer_heading(struct chip_tracer_law *law, const double e[3], const double c[3], double dead_time_s,
                         double period_s, struct chip_tracer_heading *heading)
{
    double x = 0.0, y = 0.0, all = 0.0, ball_x = 0.0, ball_y = 0.0, inside, angle, sine, lead, head[3];
    struct chip_tracer_point *point;
    int i;
    for (i = 0; i < 3; i++) {
        x += e[i] * law->a[i];
        y += e[i] * law->b[i];
        ball_x += c[i] * law->a[i];
        ball_y += c[i] * law->b[i];
        all += e[i] * e[i];
    }
    all = chip_max(chip_sqrt(all), 1e-9);
    inside = chip_max(chip_sqrt(x * x + y * y), 1e-9);
    law->newest = (law->newest + 1) % CHIP_TRACER_WINDOW;
    point = &law->point[law->newest];
    point->ball_a_mm = ball_x;
    point->ball_b_mm = ball_y;
    point->angle_rad = atan2(y, x);
    point->share = chip_min(1.0, inside / all);
    learn_friction(law, period_s);

    for (i = 0; i < 3; i++) head[i] = c[i] - e[i];
    follow_drag(law, head, all);
    law->has_head = 1;
    sine = chip_clamp(slip(law, point->angle_rad) / chip_max(point->share, 1e-3), -0.8, 0.8);
    law->sliding = slip(law, point->angle_rad) > CHIP_TRACER_SLIDES * law->friction_share - 1e-6 ? law->sliding + 1 : 0;
    if (law->sliding > CHIP_TRACER_WINDOW) law->sliding = CHIP_TRACER_WINDOW;
    angle = point->angle_rad - law->sense * asin(sine);
    follow_heading(law, angle, period_s);
    if (law->periods < CHIP_TRACER_WINDOW) law->periods++;
    law->since_s = chip_min(law->since_s + period_s, 1e3);
    lead = chip_clamp(law->rate_rad_s * (dead_time_s + 0.5 * period_s), -CHIP_TRACER_LEAD_MAX, CHIP_TRACER_LEAD_MAX);
    CHIP_FAULT(HEADING_LATE, lead = 0.0);
    heading->bend_vel_mm_s = law->sense * law->rate_rad_s * inside * sine;
    CHIP_FAULT(BEND_FORGOTTEN, heading->bend_vel_mm_s = 0.0);
    heading->steepness = chip_clamp(
        chip_sqrt(chip_max(0.0, point->share * point->share - law->friction_share * law->friction_share)), 0.0, 1.0);
    for (i = 0; i < 3; i++) {
        double ahead = angle + lead;
        heading->normal[i] = law->normal[i] = cos(angle) * law->a[i] + sin(angle) * law->b[i];
        heading->tangent[i] = law->sense * (sin(ahead) * law->a[i] - cos(ahead) * law->b[i]);
    }
}

double chip_tracer_gain(const struct chip_tracer_settings *settings, double period_s)
{
    double most = CHIP_TRACER_STABLE / (settings->dead_time_s + period_s);
    CHIP_FAULT(GAIN_UNLIMITED, most = 1e9);
    return chip_min(settings->gain_hz, most);
}

/* Velocity from which the head stops within `room_mm` after `late_s`. */
static double stop_vel(const struct chip_tracer_settings *settings, double room_mm, double late_s)
{
    double accel = settings->acceleration_mm_s2;
    CHIP_FAULT(RANGE_UNLIMITED, return 1e6);
    return accel * (chip_sqrt(late_s * late_s + 2.0 * room_mm / accel) - late_s);
}

double chip_tracer_stop_vel(const struct chip_tracer_settings *settings, double period_s)
{
    double room_mm = settings->range_mm - settings->deflection_mm, late = settings->dead_time_s + period_s;
    return chip_min(stop_vel(settings, CHIP_TRACER_ROOM * room_mm, late),
                    chip_tracer_blind_vel(settings, CHIP_TRACER_BLIND, period_s));
}

double chip_tracer_blind_vel(const struct chip_tracer_settings *settings, int blind_periods, double period_s)
{
    double room_mm = CHIP_TRACER_BLIND_ROOM * (settings->range_mm - settings->deflection_mm);
    return stop_vel(settings, room_mm, settings->dead_time_s + (blind_periods + 1) * period_s);
}

double chip_tracer_normal_vel(const struct chip_tracer_settings *settings, double error_mm, double gain_hz)
{
    double size = error_mm < 0.0 ? -error_mm : error_mm, accel = settings->acceleration_mm_s2, vel = gain_hz * size;
    double bent = 0.5 * accel / (gain_hz * gain_hz);
    if (size > 2.0 * bent) vel = chip_sqrt(2.0 * accel * (size - bent));
    return error_mm < 0.0 ? -vel : vel;
}

double chip_tracer_feed(const struct chip_tracer_settings *settings, const struct chip_tracer_law *law, double share,
                        double eps, double period_s, int *limited_by)
{
    double eps0 = settings->deflection_mm, range = settings->range_mm, feed = share * settings->feed_mm_s;
    double rate = law->rate_rad_s < 0.0 ? -law->rate_rad_s : law->rate_rad_s, most;
    *limited_by = CHIP_TRACER_BY_NOTHING;
    most = chip_tracer_stop_vel(settings, period_s);
    if (feed > most) feed = most, *limited_by = CHIP_TRACER_BY_RANGE;
    if (feed > settings->max_vel_mm_s) feed = settings->max_vel_mm_s, *limited_by = CHIP_TRACER_BY_MAX_VEL;
    if (feed * rate > settings->acceleration_mm_s2)
        feed = settings->acceleration_mm_s2 / rate, *limited_by = CHIP_TRACER_BY_BEND;
    most = share * settings->feed_mm_s * law->since_s / (CHIP_TRACER_RISE * (settings->dead_time_s + period_s));
    CHIP_FAULT(RISES_WITHOUT_RATE, most = feed);
    if (feed > most) feed = most, *limited_by = CHIP_TRACER_BY_BEND;
    most = eps > eps0 ? feed * chip_clamp(1.25 - (eps - eps0) / (range - eps0), 0.0, 1.0)
                      : feed * chip_clamp(2.5 * eps / eps0 - 0.5, 0.0, 1.0);
    if (feed > most) feed = most, *limited_by = CHIP_TRACER_BY_DEFLECTION;
    return feed;
}
