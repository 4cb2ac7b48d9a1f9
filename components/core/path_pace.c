/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_pace.c - see path_pace.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "path_pace.h"

#define CHIP_PACE_SAME_Z 1e-4      /* mm: a retract plane at the clearance is clear of the stock */
#define CHIP_PACE_UPRIGHT 0.999999 /* a unit step that rises by more goes straight up, within 0.08 degrees */
#define CHIP_PACE_MOST 1e300       /* mm2/s2: no limit */
#define CHIP_PACE_LEVEL 1e-9       /* a unit step that falls by less does not come down */

/* mm from the beginning of a segment to the first point below `clear_z`, at `from` or behind; negative: there is none [1] [2]. */
static double first_below(const struct chip_segment *segment, double from, double clear_z)
{
    double above = segment->origin[2] + segment->vertical * from - (clear_z - CHIP_PACE_SAME_Z);
    if (above < 0.0) return from;
    if (!(segment->vertical < -CHIP_PACE_LEVEL)) return -1.0;
    from += above / -segment->vertical;
    return from < segment->length ? from : -1.0;
}

/* Square of the velocity, mm2/s2, that a place allows now; `sum`: of acceleration x travel until there [3]. */
static double allowed_now(const struct chip_pace_in *in, double vel, double sum, double distance)
{
    double far = distance > in->late && distance > 0.0 ? 2.0 * sum * (1.0 - in->late / distance) : 0.0,
           there = in->override * vel;
    return chip_max(there * there, far);
}

/* Takes a place if it allows less than the one found so far. */
static void take_lower(const struct chip_pace_in *in, double vel, double sum, double distance, struct chip_pace *best,
                       double *least)
{
    double now = allowed_now(in, vel, sum, distance);
    if (!(now < *least)) return;
    *least = now;
    best->distance = distance;
    best->vel = vel;
    best->accel = distance > 0.0 ? sum / distance : 0.0;
}

struct chip_pace chip_path_pace(const struct chip_path *path, const struct chip_pace_in *in)
{
    struct chip_pace best = { CHIP_PACE_NONE, 0.0, 0.0 };
    double travelled = 0.0, sum = 0.0, least = CHIP_PACE_MOST, last = 0.0, from = path->s - path->begin_s;
    int n;
    if (!path->known || path->count == 0 || !chip_finite(in->clear_z)
        || !(in->ceiling >= 1.0 && chip_finite(in->ceiling))) {
        best.distance = CHIP_PACE_UNKNOWN;
        return best;
    }
    for (n = 0; n < path->count; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        double begin = chip_clamp(from, 0.0, segment->length), low;
        low = segment->rapid || segment->vertical > CHIP_PACE_UPRIGHT || !(segment->feed > 0.0)
                ? -1.0
                : first_below(segment, begin, in->clear_z);
        if (low >= 0.0) {
            double vel = segment->vertical < -CHIP_PATH_DESCENT ? segment->feed : in->ceiling * segment->feed;
            take_lower(in, vel, sum + chip_segment_braking(segment, begin, low), travelled + low - begin, &best,
                       &least);
        }
        travelled += segment->length - begin;
        sum += chip_segment_braking(segment, begin, segment->length);
        last = segment->rapid ? 0.0 : segment->feed;
        if (segment->join == CHIP_JOIN_STOP) return best;
        from = 0.0;
    }
    if (last > 0.0 && travelled < in->horizon) take_lower(in, last, sum, travelled, &best, &least); /* [4] */
    return best;
}
