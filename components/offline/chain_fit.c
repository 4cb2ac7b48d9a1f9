/* SPDX-License-Identifier: GPL-2.0-or-later */
/* chain_fit.c - see chain_fit.h. */

#include "core/chip_math.h"
#include "core/fault.h"
#include "chain_fit.h"

#define STEEPEST 1.4        /* rad, of the path at the ends of an arc */
#define MOST_RADIUS 10000.0 /* mm: what is flatter is a line */
#define LEAST_CHORD 0.2     /* mm: a shorter arc saves nothing */
#define NARROW 1e-9         /* mm between two stations of a wall */
#define FEWEST 4            /* stations after the first that an arc reaches over */

struct chain {
    long n;
    const double *s, *low, *high, *arc_low;
};

struct point {
    double s, z;
};

static double clamped(double v, double low, double high) { return chip_max(low, chip_min(v, high)); }

/* Where a line ends. */
struct reach {
    long last;
    double z;
    long ready;     /* the last station at which an arc may begin, and */
    double ready_z; /* the height there */
};

/* How far a line from k, at height z, reaches [1]; to k + 1 if even that is a wall; the last station reaches itself. */
static struct reach line_reach(const struct chain *c, long k, double z)
{
    double flattest = -1e30, steepest = 1e30;
    struct reach found = { k, z, k, z };
    long j;
    for (j = k + 1; j < c->n; j++) {
        double ds = c->s[j] - c->s[k], down = (c->low[j] - z) / ds, up = (c->high[j] - z) / ds;
        if (j == c->n - 1) up = down; /* the last one's height is `low` */
        if (down > steepest || up < flattest) break;
        flattest = chip_max(flattest, down);
        CHIP_FAULT(BAND_LEFT, up = 1e30)
        steepest = chip_min(steepest, up);
        found.last = j;
        found.z = clamped(z + 0.5 * (flattest + steepest) * ds, c->low[j], j == c->n - 1 ? c->low[j] : c->high[j]);
        if (c->arc_low && j < c->n - 1 && z + steepest * ds >= c->arc_low[j]) {
            found.ready = j;
            found.ready_z = chip_max(c->arc_low[j], found.z);
        }
    }
    if (found.last == k && (k + 1 < c->n || CHIP_FAULTY(STATION_BEYOND))) {
        found.last = k + 1;
        found.z = c->low[k + 1];
    }
    return found;
}

/* The tangent of the angle by which a path turns at (s, z), between two ends [2]; clockwise is positive. */
static double turn_at(const struct point *a, const struct point *b, double s, double z)
{
    double ax = s - a->s, az = z - a->z, bx = b->s - s, bz = b->z - z;
    double cross = az * bx - ax * bz, dot = ax * bx + az * bz;
    return dot > 0.0 ? cross / dot : cross > 0.0 ? 1e30 : -1e30;
}

/* Whether an arc between the stations k and j fits [2]; *middle: the tangent of half its sweep. */
static int arc_fits(const struct chain *c, long k, long j, const struct point *a, const struct point *b, double *middle)
{
    double room = STEEPEST - fabs(atan2(b->z - a->z, b->s - a->s)), least, most;
    long i;
    if (room <= 0.0) return 0;
    most = tan(chip_min(room, STEEPEST));
    least = -most;
    for (i = k + 1; i < j; i++) {
        least = chip_max(least, turn_at(a, b, c->s[i], c->arc_low[i]));
        most = chip_min(most, turn_at(a, b, c->s[i], c->high[i]));
        if (least > most) return 0;
    }
    *middle = 0.5 * (least + most);
    return 1;
}

/* The arc from station k, at height z, to station j, at some height of its band: 0 if there is none. */
static int arc_to(const struct chain *c, long k, double z, long j, struct point *b, double *middle)
{
    static const double shares[3] = { 0.5, 0.15, 0.85 };
    struct point a = { c->s[k], z };
    int t;
    b->s = c->s[j];
    if (j == c->n - 1) {
        b->z = c->low[j];
        return arc_fits(c, k, j, &a, b, middle);
    }
    for (t = 0; t < 3; t++) {
        b->z = c->arc_low[j] + shares[t] * (c->high[j] - c->arc_low[j]);
        if (arc_fits(c, k, j, &a, b, middle)) return 1;
    }
    return 0;
}

/* The last station that an arc from k reaches [3], its end and half of its sweep; k if there is none. */
static long arc_reach(const struct chain *c, long k, double z, struct point *end, double *middle)
{
    struct point b;
    long step = FEWEST, best = k, limit = k, beyond, at;
    double half;
    while (limit + 1 < c->n && limit - k < 2 * step && c->s[limit + 1] - c->s[limit] > NARROW) limit++;
    for (;;) { /* twice as far each time, as long as it fits */
        at = k + step;
        while (limit < at && limit + 1 < c->n && c->s[limit + 1] - c->s[limit] > NARROW) limit++;
        at = at < limit ? at : limit;
        if (at <= best || !arc_to(c, k, z, at, &b, &half)) break;
        best = at;
        *end = b;
        *middle = half;
        step *= 2;
    }
    if (best == k) return k;
    beyond = at > best ? at : best;
    while (beyond - best > 1 + (best - k) / 16) { /* a sixteenth more is not worth the search */
        at = best + (beyond - best) / 2;
        if (arc_to(c, k, z, at, &b, &half)) {
            best = at;
            *end = b;
            *middle = half;
        } else {
            beyond = at;
        }
    }
    return best;
}

/* Centre and radius of an arc; 0 if it is too short or too flat. */
static int centre_of(const struct point *a, const struct point *b, double middle, double arc[3])
{
    double ds = b->s - a->s, dz = b->z - a->z, chord = sqrt(ds * ds + dz * dz), radius, off;
    if (chord < LEAST_CHORD || fabs(middle) < 1e-9) return 0;
    off = 0.5 / middle; /* of the chord: the centre of what turns clockwise is below it */
    radius = chord * sqrt(0.25 + off * off);
    if (radius > MOST_RADIUS) return 0;
    arc[0] = 0.5 * (a->s + b->s) + off * dz;
    arc[1] = 0.5 * (a->z + b->z) - off * ds;
    arc[2] = middle > 0.0 ? radius : -radius;
    return 1;
}

/* The arc from station k, at height z, if it reaches further than two lines [3]: where it ends, else k. */
static struct reach arc_from(const struct chain *c, long k, double z, struct reach line, double arc[3])
{
    struct point a = { c->s[k], z }, b = a;
    struct reach found = { k, z, k, z };
    double middle = 0.0;
    long reached;
    if (!c->arc_low || line.last >= c->n - 1 || CHIP_FAULTY(LINES_ONLY)) return found;
    reached = arc_reach(c, k, z, &b, &middle);
    if (reached <= line_reach(c, line.last, line.z).last || !centre_of(&a, &b, middle, arc)) return found;
    found.last = reached;
    found.z = b.z;
    return found;
}

long chip_chain_fit(long n, const double *s, const double *low, const double *high, const double *arc_low,
                    int64_t *kept, double *height, double (*arc)[3])
{
    struct chain c = { n, s, low, high, arc_low };
    struct reach line, round;
    long count = 0, k = 0;
    double unused[3];
    for (k = 0; k < n; k++) {
        arc[k][0] = arc[k][1] = 0.0;
        arc[k][2] = CHIP_CHAIN_LINE;
    }
    if (n < 1) return 0;
    kept[count] = k = 0;
    height[count++] = low[0];
    while (k < n - 1) {
        double z = height[count - 1];
        line = line_reach(&c, k, z);
        round = arc_from(&c, k, z, line, arc[count]);
        if (round.last > k) {
            line = round;
        } else if (line.ready > k && line.ready < line.last) { /* a shorter line, if an arc goes on from its end */
            round = arc_from(&c, line.ready, line.ready_z, line_reach(&c, line.last, line.z), unused);
            if (round.last > line.ready) {
                line.last = line.ready;
                line.z = line.ready_z;
            }
        }
        kept[count] = line.last;
        height[count++] = line.z;
        k = line.last;
    }
    return count;
}
