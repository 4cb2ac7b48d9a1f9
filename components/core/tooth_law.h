/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_law.h - the limits of a cutting edge, of the tool and of the spindle: from chip, side force, power and torque to the tooth load, and back.
 *
 * Who calls it: feed.c for the velocity, volumetric_feed.comp for the weights that the tracker is given, and what is cut now.
 * Source: O. Kienzle, VDI-Z 94, 1952; the torque is the mean over a revolution (tooth.h, 2).
 *
 * Principle:
 *  1. With n revolutions and z edges the feed per tooth is v / (n z). A tooth load of tau allows v = n z / tau.
 *  2. The tooth load is the largest of the chip over the largest chip, and (kc11 z A_mc / 2 pi T)^(1 / (1 - mc)). The tracker knows chip
 *     and A_mc and is given the rest as weights: 1 / largest chip, and (kc11 z / 2 pi T)^(1 / (1 - mc)).
 *     The side force F has the weight (kc11 x 1.044 / F)^(1 / (1 - mc)), whatever the spindle does.
 *  3. T is the smaller of the largest torque and of P / 2 pi n. It does not depend on the velocity.
 *  4. What is not known limits nothing: a spindle that stands or a number of edges of 0, a material without a specific force.
 *  5. A limit of the tooth is one of the machine, not of the program: the operator's override does not raise it.
 *  6. The power is predicted with a limit of power or torque, and where the load of the spindle is measured (spindle_load.h).
 */
#ifndef CHIPWISE_TOOTH_LAW_H
#define CHIPWISE_TOOTH_LAW_H

#include "feed.h"

struct chip_tooth_out {
    double chip_weight_per_mm, power_weight_per_mm; /* for the tracker; 0: not limited [2] */
    double chip_mm;                                 /* the largest chip now; 0: unknown or none */
    double power_w, torque_nm;                      /* at the edges now; 0: unknown or none */
    double force_weight_per_mm;                     /* for the tracker, as the others */
    double side_force_n, mean_force_n;              /* the largest one of a turn, and its mean; 0: unknown or none */
    double deflection_mm;                           /* of the tool's tip by the largest one; 0: unknown or none */
};

/* Whether any limit is asked for. */
static inline __attribute__((always_inline)) int chip_tooth_asked(const struct chip_feed_in *in)
{
    return in->max_chip_mm > 0.0 || in->max_power_w > 0.0 || in->max_torque_nm > 0.0 || in->max_force_n > 0.0;
}

/* Whether at least one limit is known and can be kept [4]. */
int chip_tooth_known(const struct chip_feed_in *in);

/* Edges a second, n z; 0: unknown [1] [4]. */
double chip_edges_per_s(const struct chip_feed_in *in);

/* Whether the tooth loads are finite. */
int chip_tooth_trusted(const struct chip_feed_in *in);

/* What the tracker is given, and what is cut now. */
struct chip_tooth_out chip_tooth_law(const struct chip_feed_in *in);

/* Which chip_limited_by a tooth load of this chip_tooth_limit is. */
int chip_tooth_code(const struct chip_feed_in *in, int limit);

#endif
