/* SPDX-License-Identifier: GPL-2.0-or-later */
/* feed_hold.h - the feed while the load is lost (load_watch.h): at most what it was.
 *
 * Who calls it: volumetric_feed.comp, once per servo period, after the feed law.
 * Source: none.
 *
 * Principle:
 *  1. While the load is known, override and velocity of the last feed move are noted, and the lowest velocity of the cut:
 *     from the tool's entry into the stock on.
 *  2. When it is lost in the stock, the last values are the bound; in air, the lowest of the last cut, because the next one
 *     may be like it.
 *  3. Until it is known again neither override nor velocity exceed the bound. They may fall: F may be less.
 *  4. A feed that is off is not bounded, and forgets what it was.
 */
#ifndef CHIPWISE_FEED_HOLD_H
#define CHIPWISE_FEED_HOLD_H

#include "feed.h"

struct chip_feed_bound {
    double scale;    /* of the requested velocity */
    double vel_mm_s; /* commanded velocity */
};

struct chip_feed_hold {
    struct chip_feed_bound last, lowest, held;
    int is_begun;  /* a feed move has run with a known load: last and lowest are valid */
    int is_in_cut; /* in the last of these periods */
    int has_cut;   /* lowest is of a cut */
    int is_held;   /* [3] */
};

/* One period: the law's output (after easing), bounded if the load is lost. */
struct chip_feed_out chip_feed_hold_step(struct chip_feed_hold *hold, const struct chip_feed_in *in, int is_lost,
                                         struct chip_feed_out law);

#endif
