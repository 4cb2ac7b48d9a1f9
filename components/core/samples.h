/* SPDX-License-Identifier: GPL-2.0-or-later */
/* samples.h - the samples of the look-ahead: how they are numbered, and what is known of the load between them.
 *
 * Internal: lookahead.c takes the samples, load_bound.c reads them, load_profile.c makes the load profile of what it
 * reads. The numbers in brackets are those of the principle in lookahead.h. */
#ifndef CHIPWISE_SAMPLES_H
#define CHIPWISE_SAMPLES_H

#include "chip_math.h"
#include "lookahead.h"

/* cells between samples where the load jumps [5]; smaller takes more work, larger places jumps too early */
#define CHIP_CLOSEST 0.25
#define CHIP_LATE_FALL 1.0 /* cells [6] */
#define CHIP_CLEAR_BACK 2  /* samples before one that is read clear which count for it too */
#define CHIP_MIN_LOAD 1e-3 /* mm2, smaller loads do not count as contact */

/* Index of sample i. */
static inline int slot_of(int i) { return i & (CHIP_SAMPLE_RING - 1); }

/* Slot of sample i; beyond the ends that of the nearest one. */
static inline __attribute__((always_inline)) int sample_slot(const struct chip_lookahead *lookahead, int i)
{
    int last = lookahead->first + lookahead->count - 1;
    return slot_of(i < lookahead->first ? lookahead->first : (i > last ? last : i));
}

static inline __attribute__((always_inline)) double sample_area(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->area[sample_slot(lookahead, i)];
}

static inline __attribute__((always_inline)) double sample_s(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->s[sample_slot(lookahead, i)];
}

static inline __attribute__((always_inline)) int is_corner(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->corner[sample_slot(lookahead, i)];
}

/* Number of the last sample the tool has passed; one less than the first if there is none. */
static inline int last_passed(const struct chip_lookahead *lookahead)
{
    int i = lookahead->first, last = lookahead->first + lookahead->count - 1;
    while (i <= last && lookahead->s[slot_of(i)] <= lookahead->at_s) i++;
    return i - 1;
}

/* Area met by a tool with stock all round, mm2: a full slot and a full plunge. */
static inline double full_area(const struct chip_tool *tool, const double dir[3], double depth)
{
    double plunge = dir[2] < 0.0 ? -dir[2] * CHIP_PI * tool->radius * tool->radius : 0.0;
    return 2.0 * tool->radius * depth * chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]) + plunge;
}

/* The load between sample i - 1 and sample i. */
static inline const struct chip_load_interval *interval_of(const struct chip_lookahead *lookahead, int i)
{
    return &lookahead->interval[slot_of(i)];
}

/* load_bound.c is part of the core; nothing outside calls these. */
#pragma GCC visibility push(hidden)

/* Load at the tool, mm2: the best estimate [3]; and the largest as far ahead as it travels before another command takes
 * effect, never too low [3] [6]. */
double chip_load_now(const struct chip_lookahead *lookahead);
double chip_load_bound_now(const struct chip_lookahead *lookahead, const struct chip_stock *stock);

/* Sample i has changed, or is the first or the last one now: forgets the intervals that depend on it. */
void chip_load_forget(struct chip_lookahead *lookahead, const struct chip_stock *stock, int i);

/* Computes the intervals that are not known: those of few samples change in a period. */
void chip_load_complete(struct chip_lookahead *lookahead, const struct chip_stock *stock);

/* Whether the tool has limits (tooth.h). */
static inline __attribute__((always_inline)) int limits_tooth(const struct chip_lookahead *lookahead)
{
    return lookahead->chip_weight + lookahead->power_weight + lookahead->force_weight > 0.0; /* none is negative */
}

/* tooth_profile.c, for a tool with limits: keeps the larger one of samples `from` and from + 1 for slot n, and puts
 * it there; notes what slot n has met; whether the tooth load jumps from
 * sample i - 1 to i; the largest between them; the largest at the tool and as far as it travels before another command takes effect;
 * that of a tool with stock all round. */
void chip_tooth_carry(struct chip_lookahead *lookahead, int from, int n);
void chip_tooth_carried(struct chip_lookahead *lookahead, int n);
void chip_tooth_sample(struct chip_lookahead *lookahead, int n, const struct chip_section *met);
int chip_tooth_jumps(const struct chip_lookahead *lookahead, int i);
struct chip_tooth_load chip_tooth_between(const struct chip_lookahead *lookahead, const struct chip_stock *stock,
                                          int i);
struct chip_tooth_load chip_tooth_now(const struct chip_lookahead *lookahead);
struct chip_tooth_load chip_tooth_worst(const struct chip_lookahead *lookahead, const struct chip_tool *tool,
                                        const double dir[3], double depth);

/* Whether the load jumps from sample i - 1 to i. */
int chip_load_jumps(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i);

#pragma GCC visibility pop

#endif
