/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_front.c - see engage.h: engagement [2]. */
#include "engage_state.h"

#define FRONT 60 /* parts of the front half circle that are looked at */

/* How far from 90 degrees aside a circle still lies within its own slot, less the slack. */
static double aside(void) { return 1.4 * acos(1.0 - CHIP_ENGAGE_SLACK); }

static void fan_make(struct chip_engage_fan *fan, double part)
{
    int k;
    for (k = 0; k <= CHIP_ENGAGE_HALVINGS; k++, part *= 0.5) {
        fan->turn[k][0] = cos(part);
        fan->turn[k][1] = sin(part);
    }
}

void chip_engage_fans(struct chip_engage *e)
{
    fan_make(&e->inner, (CHIP_PI - 2.0 * aside()) / FRONT);
    fan_make(&e->whole, CHIP_PI / FRONT);
}

/* A circle that is asked where it is uncut, and the segment that covered the last place: it mostly covers the next one, too. */
struct rim {
    const struct chip_engage *e;
    double x, y, radius, within;
    int32_t covering;
};

static struct rim rim_of(const struct chip_engage *e, struct chip_engage_pose p)
{
    return (struct rim){ e, p.x, p.y, e->radius, e->radius * (1.0 - CHIP_ENGAGE_SLACK), -1 };
}

/* Whether a place of the rim is uncut by all segments of its square. */
static int uncut_in(struct rim *rim, const struct chip_engage_square *square, double x, double y)
{
    const struct chip_engage_grid *g = &rim->e->ground;
    int32_t k;
    CHIP_FAULT(COVER_UNASKED, if (rim->covering >= 0) return 0)
    if (rim->covering >= 0 && chip_engage_covers(&g->segment[rim->covering], x, y, rim->within)) return 0;
    for (k = square->count - 1; k >= 0; k--)
        if (chip_engage_covers(&g->segment[square->segment[k]], x, y, rim->within)) {
            rim->covering = square->segment[k];
            return 0;
        }
    return 1;
}

/* Whether the rim is uncut in the direction of a unit vector. */
static inline int uncut_toward(struct rim *rim, double c, double s)
{
    double x = rim->x + rim->radius * c, y = rim->y + rim->radius * s;
    const struct chip_engage_square *square = chip_engage_square_at(&rim->e->ground, x, y);
    if (!square) return 1;
    return square->count > 0 ? uncut_in(rim, square, x, y) : square->count == 0;
}

/* Turns a unit vector (c, s) by the angle of another to the left. */
static void turn(double *c, double *s, const double by[2])
{
    double old = *c;
    *c = old * by[0] - *s * by[1];
    *s = old * by[1] + *s * by[0];
}

/* The angle at which what is uncut begins or ends in the part of a fan between `from`, whose unit vector is (c, s), and `to`. */
static double border(struct rim *rim, const struct chip_engage_fan *fan, double from, double to, double c, double s,
                     int uncut_from)
{
    int k;
    for (k = 1; k <= CHIP_ENGAGE_HALVINGS; k++) {
        double middle = 0.5 * (from + to), middle_c = c, middle_s = s;
        turn(&middle_c, &middle_s, fan->turn[k]);
        if (uncut_toward(rim, middle_c, middle_s) == uncut_from) {
            from = middle;
            c = middle_c;
            s = middle_s;
        } else {
            to = middle;
        }
    }
    return 0.5 * (from + to);
}

/* Engagement; once it is known to be below `low` or above `high`, only that. */
static double front_to(const struct chip_engage *e, struct chip_engage_pose p, double low, double high)
{
    double edge = aside(), first = p.heading - 0.5 * CHIP_PI + edge, part = (CHIP_PI - 2.0 * edge) / FRONT;
    double sum = 0.0, last = first, c = cos(first), s = sin(first);
    struct rim rim = rim_of(e, p);
    int before = uncut_toward(&rim, c, s), k;
    if (before) sum += edge;
    for (k = 1; k <= FRONT && sum <= high; k++) {
        if (sum + part * (FRONT + 1 - k) + edge < low) return sum; /* were all of the rest uncut */
        double angle = first + part * k, last_c = c, last_s = s;
        int now;
        turn(&c, &s, e->inner.turn[0]);
        now = uncut_toward(&rim, c, s);
        if (now && before) sum += part;
        if (now != before) {
            double end = border(&rim, &e->inner, last, angle, last_c, last_s, before);
            sum += before ? end - last : angle - end;
        }
        before = now;
        last = angle;
    }
    CHIP_FAULT(ENGAGEMENT_LESS, sum *= 0.8)
    return before ? sum + edge : sum;
}

double chip_engage_front(const struct chip_engage *e, struct chip_engage_pose p) { return front_to(e, p, -1.0, 1e9); }

int chip_engage_above(const struct chip_engage *e, struct chip_engage_pose p, double limit)
{
    return front_to(e, p, limit, limit) > limit;
}

/* Whether anything of the front half circle is uncut, and the direction of the leftmost such place [3]. */
int chip_engage_leftmost(const struct chip_engage *e, struct chip_engage_pose p, double *toward)
{
    double left = p.heading + 0.5 * CHIP_PI, last = left, c = cos(left), s = sin(left);
    double right[2] = { e->whole.turn[0][0], -e->whole.turn[0][1] };
    struct rim rim = rim_of(e, p);
    int k;
    for (k = 0; k <= FRONT; k++) {
        double angle = left - CHIP_PI * k / FRONT;
        if (uncut_toward(&rim, c, s)) {
            *toward = k ? border(&rim, &e->whole, angle, last, c, s, 1) : angle;
            return 1;
        }
        last = angle;
        turn(&c, &s, right);
    }
    return 0;
}

void chip_engage_at(struct chip_engage *e, long n, const double (*pose)[3], double *angle)
{
    long k;
    for (k = 0; k < n; k++)
        angle[k] = chip_engage_front(e, (struct chip_engage_pose){ pose[k][0], pose[k][1], pose[k][2] });
}
