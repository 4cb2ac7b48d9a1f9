/* obey.c - see obey.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "feed.h"
#include "obey.h"

#define CW_OBEY_PERIODS 5       /* unexplained for so long [3] */
#define CW_OBEY_SLACK 1.02      /* of the explained velocity */
#define CW_OBEY_BRAKING 0.25    /* share of the acceleration [2] */
#define CW_OBEY_REST 0.1        /* s at rest that end a synchronised move [5] */
#define CW_OBEY_STANDS 1e-6     /* mm/s */
#define CW_OBEY_MOST 1e9        /* mm/s, mm/s2: no machine has more */
#define CW_OBEY_LATENCY 3.0     /* periods a speeding up goes on after the override has dropped [2] */

/* A velocity or acceleration as a pin gives it: 0 unless it is a number above 0. */
static double speed(double value)
{
    return cw_finite(value) && value > 0.0 ? cw_min(value, CW_OBEY_MOST) : 0.0;
}

/* Velocity the override in force leaves the machine, mm/s [2]. */
static double left_to_it(const struct cw_obey_in *in)
{
    double scale = cw_finite(in->scale) ? cw_clamp(in->scale, 0.0, 1.0) : 1.0;
    double most = cw_finite(in->most_override) ? cw_clamp(in->most_override, 1.0, 100.0) : 1.0;
    return most * cw_max(scale * speed(in->requested), speed(in->programmed));
}

/* Whether the move follows the spindle [5]. */
static int follow_spindle(struct cw_obey *obey, const struct cw_obey_in *in, int feeding, double dt)
{
    obey->at_rest = speed(in->actual) > CW_OBEY_STANDS ? 0.0 : obey->at_rest + dt;
    if (in->index) obey->synchronised = 1;
    else if (!feeding || obey->at_rest > CW_OBEY_REST) obey->synchronised = 0;
    return obey->synchronised;
}

int cw_obey_step(struct cw_obey *obey, const struct cw_obey_in *in)
{
    int feeding = in->motion == CW_MOTION_FEED || in->motion == CW_MOTION_ARC
        || in->motion == CW_MOTION_PROBING;
    int on = cw_feed_replaces(in->kind, in->programmed, in->requested);
    int ceiling = speed(in->programmed) > 0.0 && speed(in->requested) > in->programmed;
    double dt = cw_finite(in->dt) ? cw_clamp(in->dt, 0.0, 0.1) : 0.0;
    double left = left_to_it(in), actual = speed(in->actual), accel = speed(in->accel), jerk = speed(in->jerk);
    double falling = CW_OBEY_BRAKING * accel, gaining = CW_OBEY_LATENCY * accel * dt;

    if (!on || in->motion == 0) obey->disobeyed = 0;
    if (follow_spindle(obey, in, feeding, dt) || !on || !feeding || !ceiling) {
        obey->explained = cw_max(left, actual);
        obey->above = 0;
        obey->faster = 0.0;
        return obey->disobeyed;
    }
    obey->faster = actual > left ? cw_min(obey->faster + dt, CW_OBEY_MOST) : 0.0;
    if (jerk > 0.0) {
        falling = cw_min(falling, CW_OBEY_BRAKING * cw_max(0.0, jerk * obey->faster - accel));
        gaining += 0.5 * accel * accel / jerk;
    }
    obey->explained = cw_max(left, obey->explained - falling * dt);
    obey->above = actual > CW_OBEY_SLACK * obey->explained ? obey->above + 1 : 0;
    obey->explained = cw_min(obey->explained, actual + gaining);
    if (obey->above >= CW_OBEY_PERIODS || in->told) obey->disobeyed = 1;
    return obey->disobeyed;
}
