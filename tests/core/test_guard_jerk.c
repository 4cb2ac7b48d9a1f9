/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Traverses of a planner that limits the jerk (components/core/guard.h, [4]): those that end before the stock are never stopped, and one
 * that does not brake is stopped before it is too late.
 *
 * The planner here goes by the textbook's seven segments, from rest to rest. */
#include <math.h>

#include "one_tracker.h"
#include "random_numbers.h"

#define PERIOD 0.001
#define RADIUS 3.0
#define CELL 0.25

struct profile {
    double jerk, accel, top; /* mm/s3; mm/s2 and mm/s reached */
    double ramp, rising;     /* s: of the jerk, of the velocity */
    double cruise;           /* s */
};

/* Time and distance to reach a velocity; -> mm. */
static double rise(struct profile *profile, double velocity)
{
    profile->top = velocity;
    profile->ramp = fmin(profile->accel / profile->jerk, sqrt(velocity / profile->jerk));
    profile->rising = velocity / (profile->jerk * profile->ramp) + profile->ramp;
    return 0.5 * velocity * profile->rising;
}

static struct profile plan(double length, double velocity, double accel, double jerk)
{
    struct profile profile = { jerk, accel, 0.0, 0.0, 0.0, 0.0 };
    double low = 0.0, high = velocity;
    int i;
    if (2.0 * rise(&profile, velocity) > length) {
        for (i = 0; i < 60; i++) {
            double middle = 0.5 * (low + high);
            if (2.0 * rise(&profile, middle) > length)
                high = middle;
            else
                low = middle;
        }
        rise(&profile, low);
    }
    profile.cruise = (length - profile.top * profile.rising) / profile.top;
    return profile;
}

/* mm gone after t s of the rise. */
static double risen(const struct profile *profile, double t)
{
    double ramp = profile->ramp, held = profile->jerk * ramp, left = profile->rising - t;
    if (t <= ramp) return profile->jerk * t * t * t / 6.0;
    if (t <= profile->rising - ramp)
        return profile->jerk * ramp * ramp * ramp / 6.0 + 0.5 * held * ramp * (t - ramp)
             + 0.5 * held * (t - ramp) * (t - ramp);
    return 0.5 * profile->top * profile->rising - profile->top * left + profile->jerk * left * left * left / 6.0;
}

/* mm gone after t s. */
static double gone(const struct profile *profile, double length, double t)
{
    double whole = 2.0 * profile->rising + profile->cruise;
    if (t >= whole) return length;
    if (t < profile->rising) return risen(profile, t);
    if (t > whole - profile->rising) return length - risen(profile, whole - t);
    return 0.5 * profile->top * profile->rising + profile->top * (t - profile->rising);
}

/* A traverse along +X at Z-5 toward a box at X0 that ends `gap` mm before the tool touches it.  brakes: or goes on at its speed.
 * -> mm to the stock where the guard stops it, or -1; *speed: mm/s there. */
static double traverse(double length, double gap, double velocity, double accel, double jerk, double told, int brakes,
                       double *speed)
{
    const double size[3] = { 20.0, 20.0, 10.0 }, at[3] = { -RADIUS - gap - length, 10.0, -5.0 };
    struct profile profile = plan(length, velocity, accel, jerk);
    double whole = 2.0 * profile.rising + profile.cruise, x = 0.0;
    int i, n;
    define(CELL, size, 2.0 * RADIUS, at);
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = accel;
    in.acceleration_mu_s2 = accel;
    in.max_jerk_mu_s3 = told;
    in.motion = 1;
    for (n = 1; n * PERIOD <= whole + PERIOD && x < length + gap; n++) {
        double t = n * PERIOD, before = x;
        if (brakes || t < whole - profile.rising)
            x = gone(&profile, length, t);
        else
            x += profile.top * PERIOD;
        in.pos_mu[0] = at[0] + x;
        in.distance_to_go_mu = fmax(length - x, 0.0);
        periods(1);
        *speed = (x - before) / PERIOD;
        if (out.has_rapid_contact) return length + gap - x;
    }
    return -1.0;
}

/* The shortest braking distance, mm, of such a planner. */
static double least_stop(double speed, double accel, double jerk)
{
    struct profile profile = { jerk, accel, 0.0, 0.0, 0.0, 0.0 };
    return rise(&profile, speed);
}

int main(void)
{
    long k, count = random_begin(40), mistaken = 0;
    double speed = 0.0, left;
    for (k = 0; k < count; k++) {
        double length = 5.0 + 140.0 * chance(), gap = 0.5 + 30.0 * chance() * chance(),
               velocity = 20.0 + 180.0 * chance();
        double accel = 100.0 + 1900.0 * chance(), jerk = exp(log(800.0) + chance() * log(100.0));
        char what[200];
        snprintf(what, sizeof what,
                 "seed %lu, case %ld: %g mm to %g mm before the stock at %g mm/s, %g mm/s2, %g mm/s3", start_seed, k,
                 length, gap, velocity, accel, jerk);
        left = traverse(length, gap, velocity, accel, jerk, jerk, 1, &speed);
        expect(left < 0.0, what);
        mistaken += traverse(length, gap, velocity, accel, jerk, 0.0, 1, &speed) >= 0.0;
        if (length < 40.0) continue;
        left = traverse(length, gap, velocity, accel, jerk, jerk, 0, &speed);
        if (least_stop(speed, accel, jerk) < gap)
            continue; /* it still stops before the stock when it has gone past the end */
        expect(left >= 0.0, what);
        expect(left > 0.5 * least_stop(speed, accel, jerk) - 0.2, what);
    }
    expect(mistaken > 0, "a guard that does not know the jerk stops good traverses: else nothing is tested here");
    printf("%ld traverses, %ld stopped where the jerk is not known, %d failures\n", count, mistaken, failures);
    return failures != 0;
}
