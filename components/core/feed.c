/* feed.c - see feed.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "feed.h"

#define CW_LEAST_AREA 1e-6      /* mm2, below this the tool is in air */
#define CW_LEAST_SCALE 0.001    /* the stock never stops the machine altogether */
#define CW_BRAKING 0.5          /* share of the acceleration a blending segment gets [2] */
#define CW_LATENCY 2.0          /* periods from reading a position to braking */

struct allowed { double velocity; int by; };

static struct cw_feed_out result(double scale, int by)
{
    struct cw_feed_out out;
    out.scale = scale;
    out.by = by;
    return out;
}

/* Every number the law needs is finite and of the right sign [4]. */
static int trusted(const struct cw_feed_in *in)
{
    int i;
    if (!in->trusted) return 0;
    if (!cw_finite(in->target) || !(in->target > 0.0)) return 0;
    if (!cw_finite(in->area) || in->area < 0.0) return 0;
    if (!cw_finite(in->accel) || !(in->accel > 0.0)) return 0;
    if (in->kind == CW_FEED_WINDOW
        && (!cw_finite(in->lower) || in->lower < 0.0 || in->lower > in->target)) return 0;
    for (i = 0; i < CW_FEED_LEVELS; i++)
        if (!cw_finite(in->next_area[i]) || !cw_finite(in->next_distance[i])) return 0;
    return 1;
}

/* Highest velocity the stock allows here and ahead, mm/s [1] [2]. */
static struct allowed stock_limit(const struct cw_feed_in *in, double last_scale)
{
    struct allowed best = { 1e30, CW_BY_NOTHING };
    double period = cw_finite(in->dt) ? cw_clamp(in->dt, 0.0, 0.1) : 0.0;
    double last = cw_finite(last_scale) ? cw_clamp(last_scale, 0.0, 1.0) : 1.0;
    double late = CW_LATENCY * period * last * in->requested;
    int i;
    if (in->area > CW_LEAST_AREA) {
        best.velocity = in->target / in->area;
        best.by = CW_BY_STOCK_HERE;
    }
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        double there, room, velocity;
        if (in->next_area[i] <= CW_LEAST_AREA) continue;
        there = in->target / in->next_area[i];
        room = cw_max(0.0, in->next_distance[i] - late);
        velocity = sqrt(there * there + 2.0 * CW_BRAKING * in->accel * room);
        if (velocity < best.velocity) {
            best.velocity = velocity;
            best.by = CW_BY_STOCK_AHEAD;
        }
    }
    return best;
}

/* Velocity the mode wants where the stock allows it, mm/s [3]. */
static struct allowed wanted(const struct cw_feed_in *in, double programmed)
{
    struct allowed want = { programmed, CW_BY_NOTHING };
    if (in->kind == CW_FEED_CONSTANT) {
        want.velocity = in->requested;
        want.by = CW_BY_CEILING;
    } else if (in->kind == CW_FEED_WINDOW && in->area * programmed < in->lower) {
        double lifted = in->area > CW_LEAST_AREA ? in->lower / in->area : 1e30;
        want.by = lifted >= in->requested ? CW_BY_CEILING : CW_BY_STOCK_HERE;
        want.velocity = cw_min(lifted, in->requested);
    }
    return want;
}

struct cw_feed_out cw_feed(const struct cw_feed_in *in, double last_scale)
{
    double programmed, floor, scale;
    struct allowed want, stock;

    if (in->kind < CW_FEED_LIMIT || in->kind > CW_FEED_WINDOW) return result(1.0, CW_BY_NOTHING);
    if (in->motion != CW_MOTION_FEED && in->motion != CW_MOTION_ARC)
        return result(1.0, CW_BY_NOTHING);
    if (!cw_finite(in->requested) || !(in->requested > 0.0)) return result(1.0, CW_BY_FALLBACK);
    programmed = in->requested;
    if (cw_finite(in->programmed) && in->programmed > 0.0)
        programmed = cw_min(in->programmed, in->requested);
    if (!trusted(in)) return result(programmed / in->requested, CW_BY_FALLBACK);

    want = wanted(in, programmed);
    stock = stock_limit(in, last_scale);
    if (stock.velocity < want.velocity) want = stock;
    floor = cw_finite(in->floor) ? cw_clamp(in->floor, 0.0, programmed) : 0.0;
    floor = cw_max(floor, CW_LEAST_SCALE * in->requested);
    if (want.velocity < floor) {
        want.velocity = floor;
        want.by = CW_BY_FLOOR;
    }
    scale = want.velocity / in->requested;
    return result(cw_clamp(scale, 0.0, 1.0), want.by);
}
