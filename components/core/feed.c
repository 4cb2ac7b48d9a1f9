/* SPDX-License-Identifier: GPL-2.0-or-later */
/* feed.c - see feed.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "tooth_law.h"

#define CHIP_MIN_AREA 1e-6   /* mm2, below this the tool is in air */
#define CHIP_SKIM 0.05       /* mm2, a smaller cut may be too thin for a chip of its own (CHIP_MIN_CONTACT) [15] */
#define CHIP_MIN_SCALE 0.001 /* the stock never stops the machine altogether */
/* share of the acceleration a blended segment gets [2]; larger, and braking starts too late */
#define CHIP_BLEND_BRAKING 0.5
/* of the load at the tool: up to this a step ahead counts as the same load; larger, and a rise reads as stock here */
#define CHIP_SAME_LOAD 1.25
#define CHIP_LATENCY 2.0            /* periods from reading a position to braking */
#define CHIP_THICKEST 0.72462       /* largest mean chip thickness over fz: the maximum of 2 e / acos(1 - 2 e) [6] */
#define CHIP_MIN_DESCENT 1e-3       /* a direction that descends less than this is level */
#define CHIP_FALLS 1e-4             /* a direction that falls by more goes down [12] */
#define CHIP_UNBOUND 1e30           /* mm/s: no limit */
#define CHIP_PACE_IS_UNKNOWN (-1.5) /* mm: a distance below says that the path is unknown (path_pace.h) [14] */
#define CHIP_CATCH_UP 20.0          /* factor on the velocity above that share */
#define CHIP_CATCH_UP_FROM 0.98     /* share of the velocity from which the catch-up acts [10] */
#define CHIP_HALVINGS 20            /* of the bisection for the velocity [10] */

struct allowed {
    double velocity;
    int limit;
};

/* What the tool still does before it can begin to brake [2] [10]. */
struct delay {
    double travel; /* mm */
    double gain;   /* mm/s */
};

/* Whether no rate is asked for and the limits of the tooth alone bound the velocity [15]. */
static int limits_alone(const struct chip_feed_in *in)
{
    CHIP_FAULT(NO_RATE_IS_NONE, return in->mrr_target_mm3_s == 0.0);
    return in->mrr_target_mm3_s == 0.0 && in->feed_mode != CHIP_FEED_LIMIT && chip_tooth_known(in);
}

double chip_feed_target(const struct chip_feed_in *in)
{
    double target = chip_setting(in->mrr_target_mm3_s), tool = chip_setting(in->tool_max_rate_mm3_s);
    if (!(target > 0.0)) return limits_alone(in) ? tool : 0.0;
    return tool > 0.0 ? chip_min(target, tool) : target;
}

/* [15] Whether there is nothing but limits of the tooth, and the tracker has not given them for what it meets. */
static int unread(const struct chip_feed_in *in)
{
    double most = in->section_area_mm2, load = 0.0;
    int i;
    if (in->mrr_target_mm3_s > 0.0) return 0;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++) {
        most = chip_max(most, in->load_area_mm2[i]);
        load = chip_max(load, in->tooth_load_per_mm[i]);
    }
    CHIP_FAULT(UNREAD_IS_AIR, return 0);
    return most > CHIP_SKIM && !(load > 0.0);
}

/* Every number the law needs is finite and of the right sign [4]. */
static int trusted(const struct chip_feed_in *in)
{
    int i;
    if (!in->is_trusted) return 0;
    if (!(chip_setting(in->mrr_target_mm3_s) > 0.0) && !limits_alone(in)) return 0;
    if (!chip_finite(in->tool_max_rate_mm3_s)) return 0;
    if (!CHIP_FAULTY(ANY_NUMBER) && (!chip_finite(in->section_area_mm2) || in->section_area_mm2 < 0.0)) return 0;
    if (!chip_finite(in->acceleration_mm_s2) || !(in->acceleration_mm_s2 > 0.0)) return 0;
    if (in->feed_mode == CHIP_FEED_WINDOW
        && (!chip_finite(in->mrr_lower_mm3_s) || in->mrr_lower_mm3_s < 0.0
            || (in->mrr_target_mm3_s > 0.0 && in->mrr_lower_mm3_s > in->mrr_target_mm3_s)))
        return 0;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++)
        if (!chip_finite(in->load_area_mm2[i]) || !chip_finite(in->load_distance_mm[i])
            || !chip_finite(in->load_accel_mm_s2[i]))
            return 0;
    return !chip_tooth_asked(in) || (chip_tooth_trusted(in) && !unread(in));
}

/* F as a velocity, mm/s: never above the requested one. */
static double programmed_feed(const struct chip_feed_in *in)
{
    if (!chip_finite(in->programmed_vel_mm_s) || !(in->programmed_vel_mm_s > 0.0)) return in->requested_vel_mm_s;
    return chip_min(in->programmed_vel_mm_s, in->requested_vel_mm_s);
}

/* Highest velocity at which the mean chip of a cut of this area stays within its bound, mm/s [6]. */
static double thickness_limit(const struct chip_feed_in *in, double area)
{
    double bound = chip_setting(in->max_chip_thickness_mm), flutes = chip_setting(in->flutes);
    double rps = chip_finite(in->spindle_speed_rps) ? fabs(in->spindle_speed_rps) : 0.0;
    double face = chip_setting(in->depth_mm) * chip_setting(in->tool_diameter_mm);
    double share = CHIP_THICKEST;
    if (!(bound * flutes * rps > 0.0)) return CHIP_UNBOUND;
    if (face > 0.0 && chip_finite(face)) {
        double e = chip_clamp(area / face, 1e-6, 1.0);
        share = 2.0 * e / acos(1.0 - 2.0 * e);
        CHIP_FAULT(CHIP_OF_SMALL_CUT, share = sqrt(e));
    }
    return chip_min(bound * flutes * rps / share, CHIP_UNBOUND);
}

/* Highest velocity while cutting, whatever the removal rate, mm/s [5]. */
static double cutting_limit(const struct chip_feed_in *in, double programmed)
{
    double max_vel = chip_setting(in->max_vel_mm_s), share = chip_setting(in->max_scale_of_f),
           plunge = chip_setting(in->plunge_vel_mm_s);
    double limit = CHIP_UNBOUND;
    double down = chip_finite(in->dir_z) ? chip_clamp(-in->dir_z, 0.0, 1.0) : 0.0;
    if (max_vel > 0.0) limit = max_vel;
    if (share > 0.0) limit = chip_min(limit, share * programmed);
    if (plunge > 0.0 && down > CHIP_MIN_DESCENT) limit = chip_min(limit, plunge / down);
    return limit;
}

/* Highest velocity for a cut of this area: rate [1] [15] and chip thickness [6]; mm/s. */
static double load_limit(const struct chip_feed_in *in, double area)
{
    double target = chip_feed_target(in), rate = target > 0.0 ? target / area : CHIP_UNBOUND;
    CHIP_FAULT(TOO_FAST, rate *= 1.05);
    return chip_min(rate, thickness_limit(in, area));
}

/* Acceleration available for braking until a load step, of which the tracker knows `accel`, mm/s2 [2]. */
static double braking(const struct chip_feed_in *in, double accel)
{
    if (accel > 0.0) return chip_min(accel, in->acceleration_mm_s2);
    CHIP_FAULT(BRAKES_LATE, return in->acceleration_mm_s2);
    return CHIP_BLEND_BRAKING * in->acceleration_mm_s2;
}

/* Velocity from which `distance` mm are enough to brake to `end_vel` with `accel`, all at machine speed, mm/s [2]
 * [10]. */
static inline __attribute__((always_inline)) double braked_from(const struct chip_feed_in *in, double end_vel,
                                                                double accel, double distance)
{
    double jerk = chip_setting(in->max_jerk_mm_s3), half, low = end_vel, high, velocity;
    int i;
    if (!(jerk > 0.0)) return sqrt(end_vel * end_vel + 2.0 * accel * distance);
    half = 0.5 * accel * accel / jerk; /* mm/s, gained while the acceleration builds up */
    velocity = sqrt((end_vel - half) * (end_vel - half) + 2.0 * accel * distance) - half;
    if (velocity >= end_vel + 2.0 * half) return velocity;
    high = end_vel + 2.0 * half;
    for (i = 0; i < CHIP_HALVINGS; i++) { /* bisection: the distance rises with the velocity */
        velocity = 0.5 * (low + high);
        if ((velocity + end_vel) * sqrt((velocity - end_vel) / jerk) <= distance)
            low = velocity;
        else
            high = velocity;
    }
    return low;
}

/* Until the override takes effect, and until a planner that limits the jerk has stopped accelerating [2] [10]. */
static struct delay find_delay(const struct chip_feed_in *in, double last_scale)
{
    double period = chip_finite(in->period_s) ? chip_clamp(in->period_s, 0.0, 0.1) : 0.0;
    double last = chip_finite(last_scale) ? chip_clamp(last_scale, 0.0, 1.0) : 1.0;
    double speed = chip_override(in->feed_override_share) * last * in->requested_vel_mm_s,
           accel = chip_min(chip_setting(in->current_accel_mm_s2), in->acceleration_mm_s2),
           jerk = chip_setting(in->max_jerk_mm_s3), time;
    struct delay delay = { CHIP_LATENCY * period * speed, 0.0 };
    if (!(jerk > 0.0)) return delay;
    time = accel / jerk;
    delay.gain = 0.5 * accel * time;
    delay.travel += (chip_setting(in->current_vel_mm_s) + 2.0 / 3.0 * delay.gain) * time;
    return delay;
}

/* A jerk-limited planner follows a falling velocity with a delay: how much lower than `velocity` the command must
 * be when the tool is that fast already, mm/s [10]. */
static double catch_up(const struct chip_feed_in *in, double velocity)
{
    if (!(chip_setting(in->max_jerk_mm_s3) > 0.0)) return 0.0;
    return CHIP_CATCH_UP * chip_max(0.0, chip_setting(in->current_vel_mm_s) - CHIP_CATCH_UP_FROM * velocity);
}

/* Whether load step i is the load at the tool again, on the safe side. */
static int is_same_load(const struct chip_feed_in *in, int i)
{
    return in->load_distance_mm[i] <= 0.0 && in->load_area_mm2[i] <= CHIP_SAME_LOAD * in->section_area_mm2;
}

/* The lower one of `best` and of what the limits of the tooth allow here and ahead [13]. */
static struct allowed tooth_limit(const struct chip_feed_in *in, struct allowed best, const struct delay *delay)
{
    double edges = chip_edges_per_s(in), k = chip_override(in->feed_override_share);
    int i;
    for (i = 0; edges > 0.0 && i < CHIP_FEED_LOAD_STEPS; i++) {
        double end_vel, velocity;
        if (!(in->tooth_load_per_mm[i] > 0.0)) continue;
        end_vel = chip_min(edges / in->tooth_load_per_mm[i], CHIP_UNBOUND);
        CHIP_FAULT(OVERRIDE_RAISES_CHIP, end_vel *= k);
        velocity = braked_from(in, end_vel, braking(in, in->tooth_accel_mm_s2[i]),
                               chip_max(0.0, in->tooth_distance_mm[i] - delay->travel))
                 - delay->gain;
        velocity = chip_max(end_vel, velocity - catch_up(in, velocity)) / k;
        if (velocity < best.velocity) {
            best.velocity = velocity;
            best.limit = chip_tooth_code(in, in->tooth_limit[i]);
        }
    }
    return best;
}

/* Highest velocity the stock allows here and ahead, mm/s [1] [2]; `max_vel`: while cutting [5]. */
static struct allowed stock_limit(const struct chip_feed_in *in, const struct delay *delay, double max_vel)
{
    struct allowed best = { CHIP_UNBOUND, CHIP_LIMIT_NONE };
    double k = chip_override(in->feed_override_share);
    int i;
    if (in->section_area_mm2 > CHIP_MIN_AREA) {
        double load = load_limit(in, in->section_area_mm2);
        best.velocity = chip_min(load, max_vel);
        best.limit = load <= max_vel ? CHIP_LIMIT_STOCK_HERE : CHIP_LIMIT_CEILING;
    }
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++) {
        double end_vel, distance, velocity;
        CHIP_FAULT(LOOKAHEAD_OFF, continue);
        if (in->load_area_mm2[i] <= CHIP_MIN_AREA) continue;
        end_vel = chip_min(load_limit(in, in->load_area_mm2[i]), max_vel);
        CHIP_FAULT(CEILING_NOT_BRAKED, end_vel = load_limit(in, in->load_area_mm2[i]));
        distance = chip_max(0.0, in->load_distance_mm[i] - delay->travel);
        velocity = braked_from(in, k * end_vel, braking(in, in->load_accel_mm_s2[i]), distance) - delay->gain;
        velocity = chip_max(end_vel, (velocity - catch_up(in, velocity)) / k);
        if (velocity < best.velocity) {
            best.velocity = velocity;
            best.limit = is_same_load(in, i) ? CHIP_LIMIT_STOCK_HERE : CHIP_LIMIT_STOCK_AHEAD;
        }
    }
    return chip_tooth_asked(in) ? tooth_limit(in, best, delay) : best;
}

/* Highest velocity that lets a place at `distance` mm be passed with `end_vel`, mm/s [12] [14]. `accel`: mean braking the planner can use
 * until there, mm/s2, 0: unknown. A parabolic blend begins as far before a corner as stopping takes. */
static double braked_before(const struct chip_feed_in *in, const struct delay *delay, double end_vel, double distance,
                            double accel)
{
    double k = chip_override(in->feed_override_share), velocity;
    accel = braking(in, chip_setting(accel));
    distance = chip_max(0.0, distance - delay->travel - k * k * end_vel * end_vel / (2.0 * accel));
    velocity = braked_from(in, k * end_vel, accel, distance) - delay->gain;
    return chip_max(end_vel, (velocity - catch_up(in, velocity)) / k);
}

/* Highest velocity that lets the tool go down at F, here and ahead, mm/s [12]. */
static double descent_limit(const struct chip_feed_in *in, const struct delay *delay, double programmed)
{
    if (!in->keeps_f_down) return CHIP_UNBOUND;
    if (!chip_finite(in->dir_z) || in->dir_z < -CHIP_FALLS || !chip_finite(in->descent_mm)) return programmed;
    CHIP_FAULT(DESCENDS_UNBRAKED, return CHIP_UNBOUND);
    if (in->descent_mm < 0.0) return CHIP_UNBOUND;
    return braked_before(in, delay, programmed, in->descent_mm, in->descent_accel_mm_s2);
}

/* The same if feeds above the stock are free [14]. */
static double pace_limit(const struct chip_feed_in *in, const struct delay *delay, double programmed)
{
    double plain = chip_max(1.0, chip_setting(in->ceiling_of_f)) * programmed;
    int is_known = chip_finite(in->pace_mm) && in->pace_mm > CHIP_PACE_IS_UNKNOWN;
    if (!in->is_air_free) return descent_limit(in, delay, programmed);
    if (!is_known) return chip_min(plain, descent_limit(in, delay, programmed));
    CHIP_FAULT(PACE_IGNORED, return CHIP_UNBOUND);
    if (in->pace_mm < 0.0) return CHIP_UNBOUND;
    return braked_before(in, delay, chip_min(chip_setting(in->pace_vel_mm_s), CHIP_UNBOUND), in->pace_mm,
                         in->pace_accel_mm_s2);
}

/* Velocity the mode asks for if the stock allows it, mm/s [3] [5]. */
static struct allowed wanted(const struct chip_feed_in *in, double programmed)
{
    struct allowed want = { programmed, CHIP_LIMIT_NONE };
    double target = chip_feed_target(in),
           lower = target > 0.0 ? chip_min(in->mrr_lower_mm3_s, target) : in->mrr_lower_mm3_s,
           air = chip_setting(in->air_vel_mm_s);
    if (in->feed_mode == CHIP_FEED_CONSTANT) {
        want.velocity = in->requested_vel_mm_s;
        want.limit = CHIP_LIMIT_CEILING;
    } else if (in->feed_mode == CHIP_FEED_WINDOW && in->section_area_mm2 * programmed < lower) {
        double lifted = in->section_area_mm2 > CHIP_MIN_AREA ? lower / in->section_area_mm2 : CHIP_UNBOUND;
        want.limit = lifted >= in->requested_vel_mm_s ? CHIP_LIMIT_CEILING : CHIP_LIMIT_STOCK_HERE;
        want.velocity = chip_min(lifted, in->requested_vel_mm_s);
    }
    if (air > 0.0 && in->feed_mode != CHIP_FEED_LIMIT && in->section_area_mm2 <= CHIP_MIN_AREA) {
        want.velocity = chip_min(air, in->requested_vel_mm_s);
        want.limit = CHIP_LIMIT_CEILING;
    }
    return want;
}

/* Lowest velocity the stock may impose, mm/s: below F, and below the highest [5]. */
static double slowest(const struct chip_feed_in *in, double programmed, double max_vel)
{
    double floor =
        chip_max(chip_setting(in->min_vel_mm_s), chip_min(chip_setting(in->min_scale_of_f), 1.0) * programmed);
    floor = chip_min(chip_min(floor, programmed), max_vel);
    return chip_max(floor, CHIP_MIN_SCALE * in->requested_vel_mm_s);
}

int chip_feed_replaces(int feed_mode, double programmed, double requested)
{
    return chip_feed_is_on(feed_mode)
        || (chip_finite(programmed) && chip_finite(requested) && programmed > 0.0 && requested > programmed);
}

struct chip_feed_out chip_feed(const struct chip_feed_in *in, double last_scale)
{
    double programmed, max_vel, floor, descent;
    struct allowed want, stock;
    struct delay delay;

    if (!chip_feed_is_on(in->feed_mode)) return chip_feed_result(1.0, CHIP_LIMIT_NONE);
    if (in->motion != CHIP_MOTION_FEED && in->motion != CHIP_MOTION_ARC) return chip_feed_result(1.0, CHIP_LIMIT_NONE);
    if (!chip_finite(in->requested_vel_mm_s) || !(in->requested_vel_mm_s > 0.0))
        return chip_feed_result(1.0, CHIP_LIMIT_FALLBACK);
    programmed = programmed_feed(in);
    if (!trusted(in)) return chip_feed_result(programmed / in->requested_vel_mm_s, CHIP_LIMIT_FALLBACK);

    max_vel = cutting_limit(in, programmed);
    want = wanted(in, programmed);
    delay = find_delay(in, last_scale);
    stock = stock_limit(in, &delay, max_vel);
    descent = pace_limit(in, &delay, programmed);
    if (descent < want.velocity) {
        want.velocity = descent;
        want.limit = CHIP_LIMIT_CEILING;
    }
    if (stock.velocity < want.velocity) want = stock;
    floor = slowest(in, programmed, max_vel);
    if (want.velocity < floor) {
        want.velocity = floor;
        want.limit = CHIP_LIMIT_FLOOR;
    }
    return chip_feed_result(chip_clamp(want.velocity / in->requested_vel_mm_s, 0.0, 1.0), want.limit);
}

double chip_feed_override(const struct chip_feed_in *in, double scale)
{
    int moves = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    int left_over = !chip_feed_is_on(in->feed_mode) && moves;
    if (!chip_feed_replaces(in->feed_mode, in->programmed_vel_mm_s, in->requested_vel_mm_s)) return scale;
    if (in->motion != CHIP_MOTION_PROBING && !left_over) return scale;
    if (!chip_finite(in->requested_vel_mm_s) || !(in->requested_vel_mm_s > 0.0)) return scale;
    return programmed_feed(in) / in->requested_vel_mm_s;
}
