/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth.h - what a cutting edge meets: the largest chip, and the sum that power and torque follow.
 *
 * Who calls it: section_strip.c and section_band.c for a section, lookahead.c and tooth_profile.c for the tooth load along the path.
 * Source: h = fz (n . d), the chip of a surface element with outward normal n in the direction d, with fz the feed per tooth (M. E.
 * Martellotti, An Analysis of the Milling Process, Trans. ASME 63, 1941); F = kc11 b h^(1 - mc) (O. Kienzle, VDI-Z 94, 1952).
 *
 * Principle:
 *  1. The largest chip over fz is the largest n . d where stock is touched: `chip`. It breaks a tool, not the mean.
 *  2. Torque is kc11 z fz^(1 - mc) A_mc / 2 pi with A_mc, the integral of (n . d)^(1 - mc) dS over the surface that touches: `power_area`.
 *     Power is torque times the angular velocity.
 *  3. Seen along the path an element has the area (n . d) dS, which section_strip.c integrates already. A_mc weights it with
 *     (n . d)^-mc: on a wall (1 - q^2)^(-mc / 2), q the distance beside the path over the radius. The weight's integral is in a table,
 *     so that between two points of the wall the sum is as exact as the area.
 *  4. The map knows the stock to a cell, and where it touches at all is therefore no measure of the largest chip. The edge of the stock
 *     is searched from the heading outwards, on both sides: from the first contact that counts to the highest point within CHIP_EDGE
 *     cells, and lies so far out that the area up to there has that height. Area is kept: one arc, islands, steps and stairs are right.
 *  5. Each band of a round end has an edge of its own, and n . d of its outer radius: never too low.
 *  6. A limit bounds fz, whatever the spindle does. So both become one number along the path, the tooth load: 1 / the largest fz
 *     allowed, in 1/mm. That of the chip is chip / largest chip, that of power and torque (kc11 z A_mc / 2 pi T)^(1 / (1 - mc)).
 *  7. The chip is there at first contact, while the area rises over millimetres. So between two samples the largest tooth load from
 *     CHIP_TOOTH_BEHIND cells before to CHIP_TOOTH_AHEAD cells behind them counts; nothing is interpolated, and nothing read across a
 *     corner.
 *  8. Without a limit nothing of this is computed.
 */
#ifndef CHIPWISE_TOOTH_H
#define CHIPWISE_TOOTH_H

#define CHIP_WEIGHTS 256        /* steps of the tables [3] */
#define CHIP_ARC_POINTS 196     /* points of a strip: 48 intervals, each with CHIP_REFINE more, and the first one */
#define CHIP_MAX_EXPONENT 0.6   /* largest mc: its weight must stay integrable */
#define CHIP_MAX_TOOTH_LOAD 1e6 /* 1/mm, the largest one that is given: the feed is then as good as 0 */

/* Which limit has made a tooth load. */
enum chip_tooth_limit { CHIP_TOOTH_CHIP = 0, CHIP_TOOTH_POWER = 1 };

/* What new weights change: nothing; the load of samples; what has to be read for one. */
enum chip_tooth_change { CHIP_TOOTH_SAME = 0, CHIP_TOOTH_CHANGED = 1, CHIP_TOOTH_BEGUN = 2 };

/* A tooth load [6]. */
struct chip_tooth_load {
    double load; /* 1/mm */
    int limit;   /* chip_tooth_limit: which limit has made it */
};

/* The limits of the tooth; both weights 0: none [8]. */
struct chip_tooth {
    double chip_weight;  /* 1/mm: 1 / largest chip; 0: not limited [6] */
    double power_weight; /* (kc11 z / 2 pi T)^(1 / (1 - mc)), 1/mm per mm^(2 / (1 - mc)); 0: not limited [6] */
    double exponent;     /* mc of the tables */
    int made;            /* the tables are those of `exponent` */
    double given[3];     /* what they were set to last */
    float weight[CHIP_WEIGHTS + 2]; /* integral of (1 - q^2)^(-mc / 2) from 0 to i / CHIP_WEIGHTS [3] */
    float root[CHIP_WEIGHTS + 2];   /* x^(1 - mc) */
    /* the points of the strip that is read now, from beside the path on the right to the left: */
    int points;
    float side[CHIP_ARC_POINTS], height[CHIP_ARC_POINTS]; /* sine of the angle from the heading; mm */
};

/* Sets the weights, 1/mm, and mc; what is not finite, negative or impossible limits nothing. Returns a chip_tooth_change. */
int chip_tooth_set(struct chip_tooth *tooth, double chip_weight, double power_weight, double exponent);

/* Whether anything is limited [8]. */
static inline int chip_tooth_limits(const struct chip_tooth *tooth)
{
    return tooth && (tooth->chip_weight > 0.0 || tooth->power_weight > 0.0);
}

#endif
