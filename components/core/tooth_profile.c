/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_profile.c - the tooth load between the samples of the look-ahead: see samples.h and tooth.h; the numbers in brackets are those
 * of tooth.h. */
#include "samples.h"

/* cells from a sample within which its tooth load may be met: the edge of a chip is there at once, and heights are interpolated [7] */
#define CHIP_TOOTH_AHEAD 2.0
#define CHIP_TOOTH_BEHIND 1.0
#define CHIP_TOOTH_JUMP 0.15 /* of a tooth load, a change from one sample to the next that is a jump */

/* [6] A tooth load, 1/mm: of n . d, and of A_mc^(1 / (1 - mc)), and the same of the side force. */
static struct chip_tooth_load load_of(const struct chip_lookahead *lookahead, double chip, double power, double force)
{
    struct chip_tooth_load load = { chip_min(lookahead->chip_weight * chip, CHIP_MAX_TOOTH_LOAD), CHIP_TOOTH_CHIP };
    power = chip_min(lookahead->power_weight * power, CHIP_MAX_TOOTH_LOAD);
    if (power > load.load) {
        load.load = power;
        load.limit = CHIP_TOOTH_POWER;
    }
    force = chip_min(lookahead->force_weight * force, CHIP_MAX_TOOTH_LOAD);
    if (force > load.load) {
        load.load = force;
        load.limit = CHIP_TOOTH_FORCE;
    }
    return load;
}

void chip_tooth_follow(struct chip_lookahead *lookahead, const struct chip_tooth *tooth)
{
    int i;
    if (lookahead->chip_weight == tooth->chip_weight && lookahead->power_weight == tooth->power_weight
        && lookahead->force_weight == tooth->force_weight)
        return;
    lookahead->chip_weight = tooth->chip_weight;
    lookahead->power_weight = tooth->power_weight;
    lookahead->force_weight = tooth->force_weight;
    lookahead->power_root = 1.0 / (1.0 - tooth->exponent);
    for (i = 0; i < CHIP_SAMPLE_RING; i++) {
        lookahead->tooth[i] = load_of(lookahead, lookahead->chip[i], lookahead->power[i], lookahead->force[i]);
        lookahead->completed[i] = 0;
    }
}

/* A_mc or a side force to the power of 1 / (1 - mc), to single precision; 0 if it is not limited. */
static double root_of(const struct chip_lookahead *lookahead, double weight, double sum)
{
    return weight > 0.0 && sum > 0.0 ? powf((float)chip_min(sum, 1e12), (float)lookahead->power_root) : 0.0;
}

void chip_tooth_sample(struct chip_lookahead *lookahead, int n, const struct chip_section *met)
{
    lookahead->chip[n] = (float)met->chip;
    lookahead->power[n] = (float)root_of(lookahead, lookahead->power_weight, met->power_area);
    lookahead->force[n] = (float)root_of(lookahead, lookahead->force_weight, met->side_force);
    lookahead->force_mean[n] = met->side_force > 0.0 ? (float)(met->mean_force / met->side_force) : 0.0f;
    lookahead->tooth[n] = load_of(lookahead, lookahead->chip[n], lookahead->power[n], lookahead->force[n]);
}

void chip_tooth_carry(struct chip_lookahead *lookahead, int from, int n)
{
    int a = slot_of(from), b = slot_of(from + 1);
    lookahead->carried[0][n] = lookahead->chip[a] > lookahead->chip[b] ? lookahead->chip[a] : lookahead->chip[b];
    lookahead->carried[1][n] = lookahead->power[a] > lookahead->power[b] ? lookahead->power[a] : lookahead->power[b];
    lookahead->carried[2][n] = lookahead->force[a] > lookahead->force[b] ? lookahead->force[a] : lookahead->force[b];
}

void chip_tooth_carried(struct chip_lookahead *lookahead, int n)
{
    lookahead->chip[n] = lookahead->carried[0][n];
    lookahead->power[n] = lookahead->carried[1][n];
    lookahead->force[n] = lookahead->carried[2][n];
    lookahead->tooth[n] = load_of(lookahead, lookahead->chip[n], lookahead->power[n], lookahead->force[n]);
}

/* Of sample i. */
static inline __attribute__((always_inline)) struct chip_tooth_load sample_tooth(const struct chip_lookahead *lookahead,
                                                                                 int i)
{
    return lookahead->tooth[sample_slot(lookahead, i)];
}

/* The larger one. */
static struct chip_tooth_load larger(struct chip_tooth_load a, struct chip_tooth_load b)
{
    return b.load > a.load ? b : a;
}

struct chip_tooth_load chip_tooth_worst(const struct chip_lookahead *lookahead, const struct chip_tool *tool,
                                        const double dir[3], double depth)
{
    double area = lookahead->power_weight > 0.0 ? chip_tooth_full_area(tool, dir, depth) : 0.0;
    double force = lookahead->force_weight > 0.0 ? chip_force_full(tool, dir, depth) : 0.0;
    return load_of(lookahead, 1.0, root_of(lookahead, lookahead->power_weight, area),
                   root_of(lookahead, lookahead->force_weight, force));
}

int chip_tooth_jumps(const struct chip_lookahead *lookahead, int i)
{
    double a = sample_tooth(lookahead, i - 1).load, b = sample_tooth(lookahead, i).load;
    return fabs(b - a) > CHIP_TOOTH_JUMP * chip_max(a, b);
}

struct chip_tooth_load chip_tooth_between(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double error = lookahead->position_error[sample_slot(lookahead, i)] * stock->cell;
    double begin = sample_s(lookahead, i - 1) - CHIP_TOOTH_BEHIND * error,
           end = sample_s(lookahead, i) + CHIP_TOOTH_AHEAD * error;
    double half = 0.5 * lookahead->turn[sample_slot(lookahead, i)];
    struct chip_tooth_load most;
    int k, best = i, least = i - (lookahead->read_clear[sample_slot(lookahead, i)] ? CHIP_CLEAR_BACK : 1),
           last = lookahead->first + lookahead->count - 1;
    CHIP_FAULT(TOOTH_NOT_AHEAD, end = sample_s(lookahead, i));
    for (k = i; k < last && lookahead->s[slot_of(k)] < end && !lookahead->corner[slot_of(k + 1)]; k++)
        if (lookahead->tooth[slot_of(k + 1)].load > lookahead->tooth[slot_of(best)].load) best = k + 1;
    for (k = i - 1; k >= lookahead->first && !lookahead->corner[slot_of(k + 1)]; k--) {
        if (lookahead->tooth[slot_of(k)].load > lookahead->tooth[slot_of(best)].load) best = k;
        if (lookahead->s[slot_of(k)] <= begin && k <= least) break;
    }
    most = lookahead->tooth[slot_of(best)];
    if (half > 0.0 && !is_corner(lookahead, i)) most.load *= 1.0 + 0.55 * half * half; /* 1 / cos of a small angle */
    return most;
}

struct chip_tooth_load chip_tooth_now(const struct chip_lookahead *lookahead)
{
    double to = lookahead->at_s + lookahead->latency_travel;
    struct chip_tooth_load most = { 0.0, CHIP_TOOTH_CHIP };
    int i, last = lookahead->first + lookahead->count - 1;
    if (!limits_tooth(lookahead)) return most;
    if (lookahead->count == 0) return lookahead->begin_tooth;
    if (sample_s(lookahead, lookahead->first) > lookahead->at_s) most = sample_tooth(lookahead, lookahead->first);
    if (lookahead->at_s < lookahead->begin_s + lookahead->spacing) most = larger(most, lookahead->begin_tooth);
    if (sample_s(lookahead, last) <= to) most = larger(most, sample_tooth(lookahead, last));
    for (i = lookahead->first + 1; i <= last && lookahead->s[slot_of(i - 1)] <= to; i++)
        if (lookahead->s[slot_of(i)] > lookahead->at_s) most = larger(most, lookahead->between[slot_of(i)]);
    return most;
}
