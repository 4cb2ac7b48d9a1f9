/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth.h - what a cutting edge meets: the largest chip, the sum that power and torque follow, and the side force.
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
 *     Contact counts from a share of the highest one on; of a wall that is only touched beside the path, times its n . d.
 *  5. Each band of a round end has an edge of its own, and n . d of its outer radius: never too low.
 *  6. A limit bounds fz, whatever the spindle does. So both become one number along the path, the tooth load: 1 / the largest fz
 *     allowed, in 1/mm. That of the chip is chip / largest chip, that of power and torque (kc11 z A_mc / 2 pi T)^(1 / (1 - mc)).
 *  7. The chip is there at first contact, while the area rises over millimetres. So between two samples the largest tooth load from
 *     CHIP_TOOTH_BEHIND cells before to CHIP_TOOTH_AHEAD cells behind them counts; nothing is interpolated, and nothing read across a
 *     corner.
 *  8. Without a limit nothing of this is computed.
 *  9. Side force: an edge at the angle phi from the heading pushes with kc11 fz^(1 - mc) f(phi), f the integral of (n . d)^(1 - mc) over its
 *     length in the stock, in mm. All edges together are a vector sum. Its largest value over a turn is `side_force`, its mean z / 2 pi times
 *     the integral of f with cosine and sine, `push`. The edges are straight here: a helix spreads the force and makes it less.
 * 10. f is kept every CHIP_FORCE_STEP degrees round the tool. The points of a strip, and of a band of a tool that falls or rises in front of its
 *     axis, are stairs: heights that rise or fall one after the other within some cells are one wall, which lies where the area is kept. Its place
 *     is known better than the steps, so an edge right there counts, too: what it meets is all that begins nearer to the heading, each band with
 *     its own n . d. The strongest walls on each side are looked at and, if the tool falls or rises, the one behind which f is largest: there the small walls of many bands
 *     add up. Heights that are interpolated between the cells would lack a tenth of the force of a ball in rows.
 * 11. The force that pushes an edge off the stock is a fixed share of it (J. Tlusty, P. MacNeil, Annals of the CIRP 24, 1975). It turns every
 *     force by one angle and makes all of them larger by one factor, which is part of the weight.
 */
#ifndef CHIPWISE_TOOTH_H
#define CHIPWISE_TOOTH_H

#define CHIP_WEIGHTS 256        /* steps of the tables [3] */
#define CHIP_ARC_POINTS 196     /* points of a strip: 48 intervals, each with CHIP_REFINE more, and the first one */
#define CHIP_FORCE_NODES 72     /* angles round the tool at which f is kept [10] */
#define CHIP_FORCE_RADIAL 1.044 /* the whole force over the part along the edge's path: sqrt(1 + 0.3^2) [11] */
#define CHIP_FORCE_STEP 5.0     /* degrees between them */
#define CHIP_FORCE_BRINKS 96    /* walls on one side that are looked at */
#define CHIP_FORCE_EDGES 36     /* more edges of a cutter count as so many */
#define CHIP_MAX_EXPONENT 0.6   /* largest mc: its weight must stay integrable */
#define CHIP_MAX_TOOTH_LOAD 1e6 /* 1/mm, the largest one that is given: the feed is then as good as 0 */

/* Which limit has made a tooth load. */
enum chip_tooth_limit { CHIP_TOOTH_CHIP = 0, CHIP_TOOTH_POWER = 1, CHIP_TOOTH_FORCE = 2 };

/* What new weights change: nothing; the load of samples; what has to be read for one. */
enum chip_tooth_change { CHIP_TOOTH_SAME = 0, CHIP_TOOTH_CHANGED = 1, CHIP_TOOTH_BEGUN = 2 };

/* A tooth load [6]. */
struct chip_tooth_load {
    double load; /* 1/mm */
    int limit;   /* chip_tooth_limit: which limit has made it */
};

/* A step of the stock [10]: sine of the angle; f changes there by `unit` (scale c + off)^(1 - mc) mm, c the cosine; `ahead`: that in the heading. */
struct chip_brink_force {
    float at, unit, scale, off, ahead;
};

/* What the limits are set to: weights, 1/mm; mc; number of edges. */
struct chip_tooth_weights {
    double chip, power, force, exponent, edges;
};

/* The limits of the tooth; all weights 0: none [8]. */
struct chip_tooth {
    double chip_weight;  /* 1/mm: 1 / largest chip; 0: not limited [6] */
    double power_weight; /* (kc11 z / 2 pi T)^(1 / (1 - mc)), 1/mm per mm^(2 / (1 - mc)); 0: not limited [6] */
    double
        force_weight; /* (kc11 x 1.044 / largest force)^(1 / (1 - mc)), 1/mm per mm^(1 / (1 - mc)); 0: not limited [9] [11] */
    double exponent;                 /* mc of the tables */
    int edges;                       /* of the cutter, for the force */
    int made;                        /* the tables are those of `exponent` */
    struct chip_tooth_weights given; /* what they were set to last */
    float weight[CHIP_WEIGHTS + 2];  /* integral of (1 - q^2)^(-mc / 2) from 0 to i / CHIP_WEIGHTS [3] */
    float root[CHIP_WEIGHTS + 2];    /* x^(1 - mc) */
    float ahead[CHIP_WEIGHTS + 2], aside[CHIP_WEIGHTS + 2]; /* the same of f with cosine and with sine [9] */
    float sine[CHIP_FORCE_NODES], cosine[CHIP_FORCE_NODES],
        part[CHIP_FORCE_NODES]; /* of the angles at which f is kept, from behind the tool to the left; cosine^(1 - mc) */
    unsigned char node[CHIP_WEIGHTS + 2]; /* number of the angle from the heading, of a sine */
    float slot;                           /* `side_force` of a full slot, over its depth */
    /* the points of the strip that is read now, from beside the path on the right to the left: */
    int points;
    float side[CHIP_ARC_POINTS], height[CHIP_ARC_POINTS]; /* sine of the angle from the heading; mm */
    /* the section that is read now [10]: f at the angles, mm; walls on the right and on the left; the sums with cosine and sine */
    float force[CHIP_FORCE_NODES],
        more[CHIP_FORCE_NODES], /* `more`: of it, if there is any, what is not in the stairs; `end`: what a flat end that falls adds; */
        end[CHIP_FORCE_NODES];
    float rise[2][CHIP_FORCE_NODES / 4
                  + 1]; /* f over the power of the cosine rises by that at an angle, on the right and on the left */
    int has_more, has_end, is_round; /* `is_round`: there may be some behind the tool */
    struct chip_brink_force brink[2][CHIP_FORCE_BRINKS];
    int brinks[2];
    double push[2];
};

/* Sets the weights; what is not finite, negative or impossible limits nothing. Returns a chip_tooth_change. */
int chip_tooth_set(struct chip_tooth *tooth, const struct chip_tooth_weights *weights);

/* Makes the tables of the force of an exponent; and of a number of edges. */
void chip_force_tables(struct chip_tooth *tooth);
void chip_force_slot(struct chip_tooth *tooth);

/* Whether anything is limited [8]. */
static inline int chip_tooth_limits(const struct chip_tooth *tooth)
{
    return tooth && tooth->chip_weight + tooth->power_weight + tooth->force_weight > 0.0; /* none is negative */
}

#endif
