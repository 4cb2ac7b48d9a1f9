/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_sweep.c - see height_sweep.h: moves as chains of stamps (height_stamp.h). */
#include <string.h>

#include "core/chip_math.h"
#include "core/fault.h"
#include "core/tool.h"
#include "height_clearance.h"
#include "height_stamp.h"
#include "height_sweep.h"
#include "needles.h"

#define STEP_DOWN 0.2     /* cells, from stamp to stamp in Z [2] */
#define STEP_PLUNGE 0.125 /* the same for a plunge, where all the stock below the tool seems equally deep */
#define LAG CHIP_HEIGHT_LAG
#define STILL CHIP_HEIGHT_STILL
#define STEPS_MOST 100000000.0

static void place_at(const double a[3], const double b[3], double t, double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) tip[i] = a[i] + t * (b[i] - a[i]);
}

/* Height (mm) of the highest needle within the holder's radius above the holder's lower end, at share t of a move; 0: there is none. */
static double holder_meets(const struct chip_height_map *map, const struct chip_height_tool *tool, const double a[3],
                           const double b[3], double t)
{
    double tip[3], z, radius = tool->holder_radius;
    int row, end, first, last, i;
    float top, r2 = (float)(radius * radius);
    place_at(a, b, t, tip);
    z = tip[2] + tool->stick_out;
    top = (float)z;
    if (map->z_max <= z || !chip_stamp_rows_within(map, tip[1], radius, &row, &end)) return 0.0;
    for (; row < end; row++) {
        const float *height = map->height + (long)row * map->nx;
        float dx = (float)(map->x0 + map->shift_x[row] - tip[0]), dy = (float)(map->y0 + row * map->cell - tip[1]);
        if (!chip_stamp_columns_within(map, row, tip[0], tip[1], radius, &first, &last)) continue;
        for (i = first; i < last; i++) {
            float u = map->x[i] + dx, v = map->shift_y[i] + dy, h = u * u + v * v < r2 ? height[i] : -3e38f;
            top = h > top ? h : top;
        }
    }
    CHIP_FAULT(HOLDER_NOT_MET, return 0.0)
    return top > (float)z ? (double)top - z : 0.0;
}

/* The part of a segment, shares low .. high, that may meet the map: within `radius` of it and below its top. */
static int clip(const struct chip_height_map *map, const double a[3], const double b[3], double radius, double above,
                double *low, double *high)
{
    const double least_at[3] = { map->x0 - radius, map->y0 - radius, -1e300 };
    const double most_at[3] = { map->x0 + map->nx * map->cell + radius, map->y0 + map->ny * map->cell + radius,
                                map->z_max - above };
    int i;
    *low = 0.0;
    *high = 1.0;
    for (i = 0; i < 3; i++) {
        double d = b[i] - a[i], u, v;
        if (fabs(d) < 1e-12) {
            if (a[i] < least_at[i] || a[i] > most_at[i]) return 0;
            continue;
        }
        u = (least_at[i] - a[i]) / d;
        v = (most_at[i] - a[i]) / d;
        *low = chip_max(*low, chip_min(u, v));
        *high = chip_min(*high, chip_max(u, v));
    }
    return *low <= *high;
}

/* Greatest distance of two stamps, mm in XY [2]. */
static double spacing(const struct chip_height_map *map, const struct chip_height_tool *tool)
{
    CHIP_FAULT(STAMPS_APART, return 2.0 * tool->radius)
    if (tool->slope > 0.0) return 0.25 * map->cell;
    return chip_min(sqrt(8.0 * tool->radius * CHIP_HEIGHT_RIDGE), 4.0 * map->cell);
}

/* Stamps one after the other; those that are nearer to each other than LAG spare the tool's skin [3]. */
struct chain {
    const struct chip_height_tool *tool;
    const struct chip_stamp_shape *s;
    struct chip_stamp_kind stamps;
    int spared;     /* the last stamp has spared the skin */
    double mark[3]; /* where the next stamp of the whole tool is due, */
    double gone;    /* mm in XY from there */
};

static double stamp_whole(const struct chip_height_map *map, const struct chain *chain, const double tip[3])
{
    struct chip_stamp stamp;
    chain->stamps.cut(map, chain->s, chain->tool->radius + CHIP_HEIGHT_RIDGE, tip, 0, &stamp);
    return stamp.volume;
}

/* Cuts what the last stamps have spared, where the tool is now; returns the volume. */
static double cut_spared(const struct chip_height_map *map, struct chain *chain, const double tip[3])
{
    if (!chain->spared || CHIP_FAULTY(SKIN_LEFT)) return 0.0;
    chain->spared = 0;
    return stamp_whole(map, chain, chain->mark) + stamp_whole(map, chain, tip);
}

/* Before a stamp `advance` mm behind the last one: whether it spares the skin. The whole tool follows LAG behind it, so
 * that nothing ahead is lost. */
static int spares(const struct chip_height_map *map, struct chain *chain, const double tip[3], double advance,
                  double *volume)
{
    if (advance >= LAG) return 0;
    chain->gone += advance;
    if (chain->spared && chain->gone < LAG) return 1;
    if (chain->spared) *volume += stamp_whole(map, chain, chain->mark);
    chain->spared = 1;
    chain->gone = 0.0;
    memcpy(chain->mark, tip, sizeof chain->mark);
    return 1;
}

/* One stamp of a move: its volume is added, *depth raised. Returns 1 if that is the move's deepest. */
static int stamp_at(const struct chip_height_map *map, struct chain *chain, const double tip[3], double advance,
                    double lowest, double *volume, double *depth)
{
    float keep[2][CHIP_STAMP_ROW_MOST];
    struct chip_stamp stamp;
    int spare = spares(map, chain, tip, advance, volume);
    double here;
    (spare ? chain->stamps.spare : chain->stamps.cut)(map, chain->s, chain->tool->radius + CHIP_HEIGHT_RIDGE, tip, keep,
                                                      &stamp);
    *volume += stamp.volume;
    if (stamp.top <= -1e38f) return 0;
    here = (double)stamp.top - lowest + chip_stamp_margin(map, &stamp);
    if (here <= *depth) return 0;
    *depth = here;
    return 1;
}

/* Of the stamps *first .. *last of a move straight along the axis, those that may meet anything [5]. */
static void in_contact(const struct chip_height_map *map, struct chain *chain, const double a[3], const double b[3],
                       double steps, double *first, double *last)
{
    double tip[3], volume = 0.0, end = *last + 1.0, middle;
    place_at(a, b, *first / steps, tip);
    (void)spares(map, chain, tip, 0.0, &volume); /* marks the first, whether or not it is stamped */
    if (b[2] > a[2]) {
        *last = *first;
        return;
    }
    for (middle = *last; *first < end; middle = floor((*first + end) / 2.0)) {
        place_at(a, b, middle / steps, tip);
        if (chain->stamps.meets(map, chain->s, chain->tool->radius + CHIP_HEIGHT_RIDGE, tip))
            end = middle;
        else
            *first = middle + 1.0;
    }
}

static void cut_move(const struct chip_height_map *map, struct chain *chain, const double a[3], const double b[3],
                     struct chip_height_met *met)
{
    const struct chip_height_tool *tool = chain->tool;
    double low, high, flat = hypot(b[0] - a[0], b[1] - a[1]), steps, k, count, volume = 0.0, depth = 0.0;
    if (flat >= LAG || flat < STILL) volume = cut_spared(map, chain, a);
    steps = fabs(b[2] - a[2]) / ((flat < map->cell ? STEP_PLUNGE : STEP_DOWN) * map->cell);
    steps = ceil(chip_max(chip_max(flat / spacing(map, tool), steps), 1.0));
    if (steps > STEPS_MOST) steps = STEPS_MOST;
    if (clip(map, a, b, tool->radius, 0.0, &low, &high)) {
        double last;
        count = last = chip_min(ceil(high * steps), steps);
        k = chip_max(floor(low * steps), 1.0);
        if (flat == 0.0 && k < last) in_contact(map, chain, a, b, steps, &k, &last);
        for (; k <= last; k++) {
            double t = k / steps, tip[3], lowest;
            place_at(a, b, t, tip);
            lowest = flat < map->cell ? tip[2] : chip_max(tip[2] - STEP_DOWN * map->cell, chip_min(a[2], b[2]));
            if (stamp_at(map, chain, tip, flat / steps, lowest, &volume, &depth)) met->at = (float)t;
        }
        if (count < steps) { /* out of the stock */
            double tip[3];
            place_at(a, b, chip_max(count, 0.0) / steps, tip);
            volume += cut_spared(map, chain, tip);
        }
    }
    met->volume = (float)(volume * map->cell * map->cell);
    met->depth = (float)depth;
    if (tool->holder_radius > 0.0 && clip(map, a, b, tool->holder_radius, tool->stick_out, &low, &high)) {
        int nothing = flat == 0.0 && holder_meets(map, tool, a, b, b[2] < a[2] ? high : low) <= 0.0; /* [5] */
        steps = ceil(chip_max(hypot(flat, b[2] - a[2]) * (high - low) / map->cell, 1.0));
        for (k = 0.0; k <= steps && !nothing; k++) {
            double t = low + (high - low) * k / steps, over = holder_meets(map, tool, a, b, t);
            if (over <= met->holder) continue;
            met->holder = (float)over;
            if (!(depth > 0.0)) met->at = (float)t;
        }
    }
}

/* [6] */
static void measure(const struct chip_height_map *map, const struct chip_tool *tool, double clearance,
                    const double a[3], const double b[3], struct chip_height_met *met)
{
    double at, distance = chip_clearance_of(map, tool, clearance, a, b, CHIP_CLEAR_AHEAD, &at);
    if (distance >= CHIP_CLEAR_NONE) return;
    met->beside = (float)distance;
    met->beside_at = (float)at;
}

double chip_height_sweep(const struct chip_height_map *map, const struct chip_height_tool *tool, const double from[3],
                         const double (*to)[3], long n, struct chip_height_met *met,
                         const struct chip_height_traverses *traverses)
{
    struct chip_stamp_shape s = chip_stamp_make_shape(tool);
    struct chip_tool profile;
    struct chain chain = { tool, &s, chip_stamp_of(tool), 0, { 0.0, 0.0, 0.0 }, 0.0 };
    double sum = 0.0;
    long i;
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0);
    for (i = 0; i < n; i++) {
        memset(&met[i], 0, sizeof met[i]);
        met[i].beside = -1.0f;
        if (traverses && traverses->judged[i])
            measure(map, &profile, traverses->clearance, i ? to[i - 1] : from, to[i], &met[i]);
        cut_move(map, &chain, i ? to[i - 1] : from, to[i], &met[i]);
        if (i == n - 1) met[i].volume += (float)(cut_spared(map, &chain, to[i]) * map->cell * map->cell);
        if (map->needles) chip_needles_cut(map, &profile, i ? to[i - 1] : from, to[i], &met[i]);
        sum += met[i].volume;
    }
    return sum;
}
