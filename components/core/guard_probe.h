/* SPDX-License-Identifier: GPL-2.0-or-later */
/* guard_probe.h - the probe that a guard sends ahead of the tool.
 *
 * Internal: guard.c decides where to, and whether the tool has to stop; guard_probe.c moves it. The numbers in brackets
 * are those of the principle in guard.h. */
#ifndef CHIPWISE_GUARD_PROBE_H
#define CHIPWISE_GUARD_PROBE_H

#include "chip_math.h"
#include "guard.h"

#define CHIP_GUARD_MIN_CONTACT 1e-3 /* mm2, smaller contact is ignored */

/* Starts a probe at `s`. */
static inline void begin_probe(struct chip_guard_probe *probe, double s)
{
    probe->clear = s;
    probe->hit_near = 0.0;
    probe->hit_far = -1.0;
}

static inline int found(const struct chip_guard_probe *probe) { return probe->hit_far > probe->hit_near; }

/* Width of a strip of stock that is ignored, mm. */
static inline double ignored_strip(const struct chip_stock *stock)
{
    return chip_max(CHIP_GUARD_STRIP * stock->cell, CHIP_GUARD_STRIP_MM);
}

/* Whether a step is a plunge: more down than across. */
static inline int plunges(const double a[3], const double b[3])
{
    double dx = b[0] - a[0], dy = b[1] - a[1], dz = b[2] - a[2];
    return dz < 0.0 && dz * dz > dx * dx + dy * dy;
}

/* Height of the stock above `low`, mm. */
static inline double stands_above(const struct chip_stock *stock, double low)
{
    return chip_max(0.0, stock->z_max - low);
}

/* Contact, mm3, that is ignored on `length` mm: a thin strip, `across` mm from one end to the other. */
static inline double ignored(const struct chip_stock *stock, double across, double length)
{
    return length * (CHIP_GUARD_MIN_CONTACT + ignored_strip(stock) * across);
}

/* Whether a step is above or beside the stock; looks at no cell. */
static inline int misses(const struct chip_stock *stock, double radius, const double a[3], const double b[3])
{
    return chip_min(a[2], b[2]) >= stock->z_max || chip_min(a[0], b[0]) - radius >= stock->x_max
        || chip_max(a[0], b[0]) + radius <= stock->x0 || chip_min(a[1], b[1]) - radius >= stock->y_max
        || chip_max(a[1], b[1]) + radius <= stock->y0;
}

/* What a probe follows: the programmed path or the line. */
struct chip_probe_track {
    const struct chip_guard *guard;
    const struct chip_path *path; /* null: the line */
    long bound;                   /* of the work */
};

/* Functions of the core's own; nothing outside calls them. */
#pragma GCC visibility push(hidden)

/* The tip `s` mm on the line, with what is left of the blend that leads to it. */
void chip_guard_point_on_line(const struct chip_guard *guard, double s, double tip[3]);

/* [2] A probe's work in a period: ahead up to `wanted` mm, then to where the stock begins. One of its steps ends at
 * `end`. */
void chip_guard_send(struct chip_guard_probe *probe, const struct chip_probe_track *track,
                     const struct chip_stock *stock, const struct chip_tool *tool, double wanted, double end,
                     long *work);

#pragma GCC visibility pop

#endif
