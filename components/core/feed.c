/* feed.c - see feed.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "feed.h"

#define CW_LEAST_AREA 1e-6      /* mm2, below this the tool is in air */
#define CW_LEAST_SCALE 0.001    /* the stock never stops the machine altogether */
#define CW_BRAKING 0.5          /* share of the acceleration a blending segment gets [2] */
#define CW_AT_HAND 1.25         /* of the load at the tool: the same load, read with caution */
#define CW_LATENCY 2.0          /* periods from reading a position to braking */
#define CW_THICKEST 0.72462     /* largest mean chip thickness over fz: of 2 e / acos(1 - 2 e) [6] */
#define CW_LEAST_DOWN 1e-3      /* a way less steep than this is level */
#define CW_UNBOUND 1e30         /* mm/s: no limit */
#define CW_LEAST_KNOB 0.01      /* bounds of the operator's override that are believed [9] */
#define CW_MOST_KNOB 10.0
#define CW_PULL 20.0            /* of the velocity above that */
#define CW_NEARLY 0.98          /* of the velocity [10] */
#define CW_HALVINGS 20          /* of the velocity sought [10] */

struct allowed { double velocity; int by; };

static struct cw_feed_out result(double scale, int by)
{
    struct cw_feed_out out;
    out.scale = scale;
    out.by = by;
    return out;
}

/* A setting: 0 (off) unless it is a number above 0. */
static double setting(double value)
{
    return cw_finite(value) && value > 0.0 ? value : 0.0;
}

double cw_feed_target(const struct cw_feed_in *in)
{
    double target = setting(in->target), tool = setting(in->tool_target);
    return tool > 0.0 ? cw_min(target, tool) : target;
}

/* Every number the law needs is finite and of the right sign [4]. */
static int trusted(const struct cw_feed_in *in)
{
    int i;
    if (!in->trusted) return 0;
    if (!(cw_feed_target(in) > 0.0) || !cw_finite(in->tool_target)) return 0;
    if (!cw_finite(in->area) || in->area < 0.0) return 0;
    if (!cw_finite(in->accel) || !(in->accel > 0.0)) return 0;
    if (in->kind == CW_FEED_WINDOW
        && (!cw_finite(in->lower) || in->lower < 0.0 || in->lower > in->target)) return 0;
    for (i = 0; i < CW_FEED_LEVELS; i++)
        if (!cw_finite(in->next_area[i]) || !cw_finite(in->next_distance[i])
            || !cw_finite(in->next_accel[i])) return 0;
    return 1;
}

/* F as a velocity, mm/s: never above the requested one. */
static double programmed_feed(const struct cw_feed_in *in)
{
    if (!cw_finite(in->programmed) || !(in->programmed > 0.0)) return in->requested;
    return cw_min(in->programmed, in->requested);
}

/* Highest velocity at which the mean chip of a cut of this area stays in its bound, mm/s [6]. */
static double chip_limit(const struct cw_feed_in *in, double area)
{
    double bound = setting(in->chip), teeth = setting(in->teeth);
    double turns = cw_finite(in->turns) ? fabs(in->turns) : 0.0;
    double face = setting(in->stock_height) * setting(in->tool_width);
    double share = CW_THICKEST;
    if (!(bound * teeth * turns > 0.0)) return CW_UNBOUND;
    if (face > 0.0 && cw_finite(face)) {
        double e = cw_clamp(area / face, 1e-6, 1.0);
        share = 2.0 * e / acos(1.0 - 2.0 * e);
    }
    return cw_min(bound * teeth * turns / share, CW_UNBOUND);
}

/* Highest velocity while cutting, whatever the removal rate, mm/s [5]. */
static double cutting_limit(const struct cw_feed_in *in, double programmed)
{
    double most = setting(in->most), share = setting(in->most_share), plunge = setting(in->plunge);
    double limit = CW_UNBOUND;
    double down = cw_finite(in->upward) ? cw_clamp(-in->upward, 0.0, 1.0) : 0.0;
    if (most > 0.0) limit = most;
    if (share > 0.0) limit = cw_min(limit, share * programmed);
    if (plunge > 0.0 && down > CW_LEAST_DOWN) limit = cw_min(limit, plunge / down);
    return limit;
}

/* Highest velocity for a cut of this area: rate [1] and chip [6]; mm/s. */
static double load_limit(const struct cw_feed_in *in, double area)
{
    return cw_min(cw_feed_target(in) / area, chip_limit(in, area));
}

/* Acceleration that braking until a place ahead can count on, mm/s2 [2]. */
static double braking(const struct cw_feed_in *in, int i)
{
    if (in->next_accel[i] > 0.0) return cw_min(in->next_accel[i], in->accel);
    return CW_BRAKING * in->accel;
}

/* The operator's override [9]. */
static double knob(const struct cw_feed_in *in)
{
    return setting(in->knob) > 0.0 ? cw_clamp(in->knob, CW_LEAST_KNOB, CW_MOST_KNOB) : 1.0;
}

/* Velocity from which `room` mm are enough to brake to `there` with `accel`, all as the machine goes, mm/s [2] [10]. */
static double braked_from(const struct cw_feed_in *in, double there, double accel, double room)
{
    double jerk = setting(in->jerk), half, low = there, high, velocity;
    int i;
    if (!(jerk > 0.0)) return sqrt(there * there + 2.0 * accel * room);
    half = 0.5 * accel * accel / jerk;                  /* mm/s, gained while the acceleration builds up */
    velocity = sqrt((there - half) * (there - half) + 2.0 * accel * room) - half;
    if (velocity >= there + 2.0 * half) return velocity;
    high = there + 2.0 * half;
    for (i = 0; i < CW_HALVINGS; i++) {                 /* a rising function of the velocity */
        velocity = 0.5 * (low + high);
        if ((velocity + there) * sqrt((velocity - there) / jerk) <= room) low = velocity;
        else high = velocity;
    }
    return low;
}

/* What a planner that bounds the jerk still gains in velocity (*more, mm/s) before it can begin to brake; returns the
 * way until then, mm [10]. */
static double gained_yet(const struct cw_feed_in *in, double *more)
{
    double jerk = setting(in->jerk), gain = cw_finite(in->gain) ? cw_clamp(in->gain, 0.0, in->accel) : 0.0, time;
    *more = 0.0;
    if (!(jerk > 0.0)) return 0.0;
    time = gain / jerk;
    *more = 0.5 * gain * time;
    return (setting(in->speed) + 2.0 / 3.0 * *more) * time;
}

/* A planner that bounds the jerk follows a falling velocity late: by how much less than `velocity` it is to be told
 * where it goes that fast already, mm/s [10]. */
static double behind(const struct cw_feed_in *in, double velocity)
{
    if (!(setting(in->jerk) > 0.0)) return 0.0;
    return CW_PULL * cw_max(0.0, setting(in->speed) - CW_NEARLY * velocity);
}

/* Whether a place ahead is the load at the tool over again, on its safe side. */
static int is_here(const struct cw_feed_in *in, int i)
{
    return in->next_distance[i] <= 0.0 && in->next_area[i] <= CW_AT_HAND * in->area;
}

/* Highest velocity the stock allows here and ahead, mm/s [1] [2]; `most`: while cutting [5]. */
static struct allowed stock_limit(const struct cw_feed_in *in, double last_scale, double most)
{
    struct allowed best = { CW_UNBOUND, CW_BY_NOTHING };
    double period = cw_finite(in->dt) ? cw_clamp(in->dt, 0.0, 0.1) : 0.0;
    double last = cw_finite(last_scale) ? cw_clamp(last_scale, 0.0, 1.0) : 1.0;
    double k = knob(in), speed = k * last * in->requested, late = CW_LATENCY * period * speed;
    double more;
    int i;
    late += gained_yet(in, &more);
    if (in->area > CW_LEAST_AREA) {
        double load = load_limit(in, in->area);
        best.velocity = cw_min(load, most);
        best.by = load <= most ? CW_BY_STOCK_HERE : CW_BY_CEILING;
    }
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        double there, room, velocity;
        if (in->next_area[i] <= CW_LEAST_AREA) continue;
        there = cw_min(load_limit(in, in->next_area[i]), most);
        room = cw_max(0.0, in->next_distance[i] - late);
        velocity = braked_from(in, k * there, braking(in, i), room) - more;
        velocity = cw_max(there, (velocity - behind(in, velocity)) / k);
        if (velocity < best.velocity) {
            best.velocity = velocity;
            best.by = is_here(in, i) ? CW_BY_STOCK_HERE : CW_BY_STOCK_AHEAD;
        }
    }
    return best;
}

/* Velocity the mode wants where the stock allows it, mm/s [3] [5]. */
static struct allowed wanted(const struct cw_feed_in *in, double programmed)
{
    struct allowed want = { programmed, CW_BY_NOTHING };
    double lower = cw_min(in->lower, cw_feed_target(in)), air = setting(in->air);
    if (in->kind == CW_FEED_CONSTANT) {
        want.velocity = in->requested;
        want.by = CW_BY_CEILING;
    } else if (in->kind == CW_FEED_WINDOW && in->area * programmed < lower) {
        double lifted = in->area > CW_LEAST_AREA ? lower / in->area : CW_UNBOUND;
        want.by = lifted >= in->requested ? CW_BY_CEILING : CW_BY_STOCK_HERE;
        want.velocity = cw_min(lifted, in->requested);
    }
    if (air > 0.0 && in->kind != CW_FEED_LIMIT && in->area <= CW_LEAST_AREA) {
        want.velocity = cw_min(air, in->requested);
        want.by = CW_BY_CEILING;
    }
    return want;
}

/* Lowest velocity for the stock's sake, mm/s: below F, and below the highest [5]. */
static double slowest(const struct cw_feed_in *in, double programmed, double most)
{
    double floor = cw_max(setting(in->floor), cw_min(setting(in->floor_share), 1.0) * programmed);
    floor = cw_min(cw_min(floor, programmed), most);
    return cw_max(floor, CW_LEAST_SCALE * in->requested);
}

/* Whether the mode is one of 1, 2, 3. */
static int is_on(int kind)
{
    return kind >= CW_FEED_LIMIT && kind <= CW_FEED_WINDOW;
}

int cw_feed_replaces(int kind, double programmed, double requested)
{
    return is_on(kind) || (cw_finite(programmed) && cw_finite(requested)
                           && programmed > 0.0 && requested > programmed);
}

struct cw_feed_out cw_feed(const struct cw_feed_in *in, double last_scale)
{
    double programmed, most, floor;
    struct allowed want, stock;

    if (!is_on(in->kind)) return result(1.0, CW_BY_NOTHING);
    if (in->motion != CW_MOTION_FEED && in->motion != CW_MOTION_ARC)
        return result(1.0, CW_BY_NOTHING);
    if (!cw_finite(in->requested) || !(in->requested > 0.0)) return result(1.0, CW_BY_FALLBACK);
    programmed = programmed_feed(in);
    if (!trusted(in)) return result(programmed / in->requested, CW_BY_FALLBACK);

    most = cutting_limit(in, programmed);
    want = wanted(in, programmed);
    stock = stock_limit(in, last_scale, most);
    if (stock.velocity < want.velocity) want = stock;
    floor = slowest(in, programmed, most);
    if (want.velocity < floor) {
        want.velocity = floor;
        want.by = CW_BY_FLOOR;
    }
    return result(cw_clamp(want.velocity / in->requested, 0.0, 1.0), want.by);
}

/* What the climb has got to after a period: at once down, `recover` up, mm/s [7]. */
static double climb(double ramp, double goal, double recover, double dt)
{
    double step = setting(recover) * (cw_finite(dt) ? cw_clamp(dt, 0.0, 0.1) : 0.0);
    return setting(recover) > 0.0 ? cw_min(goal, ramp + step) : goal;
}

struct cw_feed_out cw_feed_ease(struct cw_feed_easing *easing, const struct cw_feed_in *in,
                                struct cw_feed_out law, double recover, double deadband)
{
    double goal = law.scale * in->requested, band = cw_min(setting(deadband), 1.0);
    int eased = law.by != CW_BY_FALLBACK && is_on(in->kind)
        && (in->motion == CW_MOTION_FEED || in->motion == CW_MOTION_ARC);
    int top = law.by == CW_BY_NOTHING || law.by == CW_BY_CEILING;

    if (!eased || !cw_finite(goal)) {
        easing->begun = 0;
        return law;
    }
    if (!easing->begun) easing->ramp = easing->held = goal;
    easing->begun = 1;
    easing->ramp = climb(easing->ramp, goal, recover, in->dt);
    if (easing->ramp < easing->held || easing->ramp > (1.0 + band) * easing->held
        || (top && easing->ramp >= goal))
        easing->held = easing->ramp;
    return result(cw_clamp(easing->held / in->requested, 0.0, law.scale), law.by);
}

double cw_feed_override(const struct cw_feed_in *in, double scale)
{
    int moves = in->motion == CW_MOTION_FEED || in->motion == CW_MOTION_ARC;
    int left_over = !is_on(in->kind) && moves;
    if (!cw_feed_replaces(in->kind, in->programmed, in->requested)) return scale;
    if (in->motion != CW_MOTION_PROBING && !left_over) return scale;
    if (!cw_finite(in->requested) || !(in->requested > 0.0)) return scale;
    return programmed_feed(in) / in->requested;
}
