/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_law.c - see tooth_law.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "tooth.h"
#include "tooth_law.h"

#define CHIP_SLOWEST_SPINDLE 1e-3 /* 1/s, a slower one stands */
#define CHIP_MOST_FLUTES 1000.0
#define CHIP_MM_PER_M 1000.0
#define CHIP_NO_WEIGHT 1e-12 /* limits no feed, and has the tracker read A_mc [6] */

/* Revolutions a second, 0: it stands. */
static double revolutions(const struct chip_feed_in *in)
{
    double rps = chip_finite(in->spindle_speed_rps) ? fabs(in->spindle_speed_rps) : 0.0;
    return rps > CHIP_SLOWEST_SPINDLE ? rps : 0.0;
}

double chip_edges_per_s(const struct chip_feed_in *in)
{
    return chip_min(chip_setting(in->flutes), CHIP_MOST_FLUTES) * revolutions(in);
}

int chip_tooth_trusted(const struct chip_feed_in *in)
{
    double sum = 0.0; /* one that is not finite makes it so */
    int i;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++)
        sum += 1e-9 * (in->tooth_load_per_mm[i] + in->tooth_distance_mm[i] + in->tooth_accel_mm_s2[i]);
    return chip_finite(sum);
}

/* [3] Torque that the spindle's power allows, Nm; 0: not limited. */
static double torque_of_power(const struct chip_feed_in *in)
{
    double rps = revolutions(in);
    return rps > 0.0 ? chip_setting(in->max_power_w) / (2.0 * CHIP_PI * rps) : 0.0;
}

/* [3] Largest torque, Nm; 0: not limited. */
static double largest_torque(const struct chip_feed_in *in)
{
    double power = torque_of_power(in), torque = chip_setting(in->max_torque_nm);
    return power > 0.0 && torque > 0.0 ? chip_min(power, torque) : power + torque;
}

int chip_tooth_code(const struct chip_feed_in *in, int limit)
{
    double power = torque_of_power(in), torque = chip_setting(in->max_torque_nm);
    if (limit == CHIP_TOOTH_CHIP) return CHIP_LIMIT_CHIP;
    if (limit == CHIP_TOOTH_FORCE) return CHIP_LIMIT_FORCE;
    return torque > 0.0 && !(power > 0.0 && power < torque) ? CHIP_LIMIT_TORQUE : CHIP_LIMIT_POWER;
}

/* kc11, N/mm2; 0: the material is not known. */
static double specific_force(const struct chip_feed_in *in)
{
    if (!(in->force_exponent_mc >= 0.0 && in->force_exponent_mc <= CHIP_MAX_EXPONENT)) return 0.0;
    return chip_setting(in->specific_force_n_mm2);
}

/* [2] kc11 z / 2 pi, Nm for an A_mc of 1 mm2 and 1 mm of feed per tooth; 0: the material is not known. */
static double torque_factor(const struct chip_feed_in *in)
{
    return specific_force(in) * chip_min(chip_setting(in->flutes), CHIP_MOST_FLUTES) / (2.0 * CHIP_PI * CHIP_MM_PER_M);
}

/* [2] Side force and bending: the weight for the tracker, and what they are now with this feed per tooth, mm. */
static void force_law(const struct chip_feed_in *in, double per_tooth, struct chip_tooth_out *out)
{
    double kc = CHIP_FORCE_RADIAL * specific_force(in), most = chip_setting(in->max_force_n), root = 1.0;
    if (!(kc > 0.0 && most > 0.0 && chip_setting(in->flutes) > 0.0)) return;
    root = 1.0 - in->force_exponent_mc;
    out->force_weight_per_mm = pow(kc / most, 1.0 / root);
    if (per_tooth > 0.0 && chip_setting(in->force_root_now) > 0.0)
        out->side_force_n = kc * pow(per_tooth * in->force_root_now, root);
    out->mean_force_n = out->side_force_n * chip_clamp(chip_setting(in->force_mean_share_now), 0.0, 1.0);
    if (chip_setting(in->tool_stiffness_n_mm) > 0.0) out->deflection_mm = out->side_force_n / in->tool_stiffness_n_mm;
    if (!chip_finite(out->force_weight_per_mm)) out->force_weight_per_mm = 0.0;
    if (!chip_finite(out->side_force_n) || !chip_finite(out->deflection_mm))
        out->side_force_n = out->mean_force_n = out->deflection_mm = 0.0;
}

int chip_tooth_known(const struct chip_feed_in *in)
{
    return chip_edges_per_s(in) > 0.0
        && (chip_setting(in->max_chip_mm) > 0.0
            || (torque_factor(in) > 0.0 && (largest_torque(in) > 0.0 || chip_setting(in->max_force_n) > 0.0)));
}

struct chip_tooth_out chip_tooth_law(const struct chip_feed_in *in)
{
    struct chip_tooth_out out = { 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0 };
    double factor, torque, edges, per_tooth = 0.0;
    if (!chip_tooth_asked(in) && !in->is_load_measured) return out;
    factor = torque_factor(in);
    torque = largest_torque(in);
    edges = chip_edges_per_s(in);
    if (chip_setting(in->flutes) > 0.0 && chip_setting(in->max_chip_mm) > 0.0)
        out.chip_weight_per_mm = 1.0 / in->max_chip_mm;
    if (factor > 0.0 && torque > 0.0)
        out.power_weight_per_mm = pow(factor / torque, 1.0 / (1.0 - in->force_exponent_mc));
    else if (factor > 0.0 && in->is_load_measured)
        out.power_weight_per_mm = CHIP_NO_WEIGHT;
    if (edges > 0.0) per_tooth = chip_setting(in->current_vel_mm_s) / edges;
    out.chip_mm = per_tooth * chip_setting(in->chip_share_now);
    force_law(in, per_tooth, &out);
    if (factor > 0.0 && chip_setting(in->power_root_now) > 0.0 && per_tooth > 0.0)
        out.torque_nm = factor * pow(per_tooth * in->power_root_now, 1.0 - in->force_exponent_mc);
    out.power_w = out.torque_nm * 2.0 * CHIP_PI * revolutions(in);
    if (!chip_finite(out.chip_weight_per_mm) || !chip_finite(out.chip_mm)) out.chip_weight_per_mm = out.chip_mm = 0.0;
    if (!chip_finite(out.power_weight_per_mm)) out.power_weight_per_mm = 0.0;
    if (!chip_finite(out.power_w)) out.power_w = out.torque_nm = 0.0;
    return out;
}
