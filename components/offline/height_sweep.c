/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_sweep.c - see height_sweep.h. Compiled for speed, without traps and errno: the loops over a row become
 * vectors. */
#include <string.h>

#include "core/chip_math.h"
#include "core/tool.h"
#include "height_sweep.h"
#include "needles.h"

#define ROW_MOST 4096     /* cells of a row whose old heights are kept for [4] */
#define MARGIN_MOST 0.6   /* cells, at most added to a depth [4] */
#define STEADY 3.0        /* cells: a larger difference from needle to needle is a wall */
#define STEP_DOWN 0.2     /* cells, from stamp to stamp in Z [2] */
#define STEP_PLUNGE 0.125 /* the same for a plunge, where all the stock below the tool seems equally deep */
#define LAG CHIP_HEIGHT_LAG
#define STILL CHIP_HEIGHT_STILL
#define STEPS_MOST 100000000.0

/* Wider vectors where the processor has them. */
#if defined(__x86_64__) && defined(__gnu_linux__)
#define CLONES __attribute__((target_clones("avx2", "default"))) static
#else
#define CLONES static
#endif

enum profile { FLAT, ROUND, ANY };

struct shape {
    float reach2, probe2; /* mm2, squares of the radius that cuts and the one that probes */
    float r_flat, corner, corner2, inner2, r_arc, arc_top, slope, skin;
};

struct stamp {
    double volume;         /* sum of heights, not yet times the cell's area */
    float top;             /* highest needle met */
    int row, first, width; /* where, and which needles `old` holds */
    const float *old;
};


static struct shape make_shape(const struct chip_height_tool *tool)
{
    struct shape s;
    struct chip_tool profile;
    double inner = chip_max(tool->radius - CHIP_HEIGHT_SKIN, 0.0);
    s.reach2 = (float)((tool->radius + CHIP_HEIGHT_RIDGE) * (tool->radius + CHIP_HEIGHT_RIDGE));
    s.probe2 = (float)(inner * inner);
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0);
    s.corner = (float)tool->corner;
    s.corner2 = (float)(tool->corner * tool->corner);
    inner = chip_max(tool->corner - CHIP_HEIGHT_SKIN, 0.0);
    s.inner2 = (float)(inner * inner);
    s.slope = (float)tool->slope;
    s.r_flat = (float)profile.r_flat;
    s.r_arc = (float)profile.r_arc;
    s.arc_top = (float)profile.arc_top;
    s.skin = (float)(CHIP_HEIGHT_SKIN * sqrt(1.0 + tool->slope * tool->slope));
    return s;
}

/* Heights of the profile above the tip at the distance whose square is d2: the cutting and the probing one. */
static inline __attribute__((always_inline)) void profile_at(const struct shape *s, enum profile kind, float d2,
                                                             float *cut, float *probe)
{
    float r, t, under, inner;
    if (kind == FLAT) {
        *cut = 0.0f;
        *probe = (float)CHIP_HEIGHT_SKIN;
        return;
    }
    if (kind == ROUND) {
        t = d2;
    } else {
        r = sqrtf(d2);
        t = r > s->r_flat ? r - s->r_flat : 0.0f;
        t *= t;
    }
    under = s->corner2 - t;
    under = under > 0.0f ? under : 0.0f;
    inner = s->inner2 - t;
    inner = inner > 0.0f ? inner : 0.0f;
    *cut = s->corner - sqrtf(under);
    *probe = s->corner - sqrtf(inner);
    if (kind == ANY && s->slope > 0.0f) {
        float cone = s->arc_top + s->slope * (r - s->r_arc);
        *cut = r > s->r_arc ? cone : *cut;
        *probe = (r > s->r_arc ? cone : *cut) + s->skin;
    }
    if (kind == ANY && s->corner <= (float)CHIP_HEIGHT_SKIN) *probe = *cut + s->skin;
}

/* One row of needles: cuts it, with the probing profile if `spare`; returns the sum of the removed heights, *top: the
 * highest needle met. */
static inline __attribute__((always_inline)) float cut_row(const struct shape *s, enum profile kind, int spare, int n,
                                                           float *height, const float *x, const float *y, float dx,
                                                           float dy, float z, float floor, float *top)
{
    float sum = 0.0f, highest = -3e38f, reach2 = spare ? s->probe2 : s->reach2;
    int i;
    for (i = 0; i < n; i++) {
        float u = x[i] + dx, v = y[i] + dy, d2 = u * u + v * v, cut, probe, old = height[i], low, seen;
        profile_at(s, kind, d2, &cut, &probe);
        low = z + (spare ? probe : cut);
        low = low > floor ? low : floor;
        low = d2 < reach2 ? low : 3e38f;
        low = low < old ? low : old;
        sum += old - low;
        height[i] = low;
        probe += z;
        probe = probe > floor ? probe : floor + (float)CHIP_HEIGHT_SKIN;
        probe = d2 < s->probe2 ? probe : 3e38f;
        seen = old > probe ? old : -3e38f;
        highest = seen > highest ? seen : highest;
    }
    *top = highest;
    return sum;
}

static inline int clamp(double v, int low, int high) { return v < low ? low : v > high ? high : (int)v; }

/* Rows and columns whose needles may lie within `radius` of a position; 0 if there are none. */
static inline int rows_within(const struct chip_height_map *map, double y, double radius, int *first, int *end)
{
    *first = clamp(floor((y - radius - map->y0) / map->cell) - 1.0, 0, map->ny);
    *end = clamp(ceil((y + radius - map->y0) / map->cell) + 1.0, 0, map->ny);
    return *first < *end;
}

static inline int columns_within(const struct chip_height_map *map, int row, double x, double y, double radius,
                                 int *first, int *end)
{
    double below = y - (map->y0 + row * map->cell), off = below < 0.0 ? -below : chip_max(below - map->cell, 0.0), half;
    if (off >= radius) return 0;
    half = sqrt(radius * radius - off * off);
    *first = clamp(floor((x - half - map->x0 - map->shift_x[row]) / map->cell), 0, map->nx);
    *end = clamp(ceil((x + half - map->x0 - map->shift_x[row]) / map->cell) + 1.0, 0, map->nx);
    return *first < *end;
}

/* One stamp of the tool, which cuts with the probing profile if `spare`; keep: room for old heights, NULL: only the volume counts. */
static inline __attribute__((always_inline)) void cut_rows(const struct chip_height_map *map, const struct shape *s,
                                                           enum profile kind, int spare, double radius,
                                                           const double tip[3], float keep[2][ROW_MOST],
                                                           struct stamp *stamp)
{
    int row, end, first, last, side = 0;
    stamp->volume = 0.0;
    stamp->top = -3e38f;
    stamp->row = stamp->first = stamp->width = 0;
    stamp->old = 0;
    if (!rows_within(map, tip[1], radius, &row, &end)) return;
    for (; row < end; row++) {
        float *height = map->height + (long)row * map->nx, top;
        int width;
        if (!columns_within(map, row, tip[0], tip[1], radius, &first, &last)) continue;
        width = last - first;
        if (keep && width <= ROW_MOST) memcpy(keep[side], height + first, sizeof(float) * (unsigned)width);
        last = first + ((width + 7) & ~7); /* whole vectors */
        if (last > map->nx) last = map->nx;
        stamp->volume += cut_row(s, kind, spare, last - first, height + first, map->x + first, map->shift_y + first,
                                 (float)(map->x0 + map->shift_x[row] - tip[0]),
                                 (float)(map->y0 + row * map->cell - tip[1]), (float)tip[2], (float)map->z_min, &top);
        if (keep && top > stamp->top) {
            stamp->top = top;
            stamp->row = row;
            stamp->first = first;
            stamp->width = width <= ROW_MOST ? width : 0;
            stamp->old = keep[side];
            side = !side;
        }
    }
}

/* A stamp of one kind, for each of the vectors. */
#define STAMP(name, kind, spare)                                                                                       \
    CLONES void name(const struct chip_height_map *map, const struct shape *s, double radius, const double tip[3],     \
                     float keep[2][ROW_MOST], struct stamp *stamp)                                                     \
    {                                                                                                                  \
        cut_rows(map, s, kind, spare, radius, tip, keep, stamp);                                                       \
    }

STAMP(cut_flat, FLAT, 0)
STAMP(cut_round, ROUND, 0)
STAMP(cut_any, ANY, 0)
/* The same with the smaller shape [3]. */
STAMP(spare_flat, FLAT, 1)
STAMP(spare_round, ROUND, 1)
STAMP(spare_any, ANY, 1)

typedef void (*stamp_function)(const struct chip_height_map *, const struct shape *, double, const double[3],
                               float[2][ROW_MOST], struct stamp *);

/* How much the stock rises steadily from the highest needle a stamp has met to those beside it [4]. */
static double margin(const struct chip_height_map *map, const struct stamp *stamp)
{
    double rise = 0.0;
    int i, j, k;
    if (!stamp->width) return MARGIN_MOST * map->cell;
    for (i = 0; i < stamp->width; i++) {
        if (stamp->old[i] != stamp->top) continue;
        for (j = stamp->row - 1; j <= stamp->row + 1; j++)
            for (k = stamp->first + i - 1; k <= stamp->first + i + 1; k++) {
                int own = j == stamp->row && k >= stamp->first && k < stamp->first + stamp->width;
                double more;
                if (j < 0 || j >= map->ny || k < 0 || k >= map->nx) continue;
                more = fabs((own ? stamp->old[k - stamp->first] : map->height[(long)j * map->nx + k])
                            - (double)stamp->top);
                if (more <= STEADY * map->cell) rise = chip_max(rise, more);
            }
    }
    return chip_min(rise, MARGIN_MOST * map->cell);
}

/* The highest needle within the holder's radius, mm above its lower end; 0 if there is none. */
static double holder_meets(const struct chip_height_map *map, double radius, double z, const double tip[3])
{
    int row, end, first, last, i;
    float top = (float)z, r2 = (float)(radius * radius);
    if (map->z_max <= z || !rows_within(map, tip[1], radius, &row, &end)) return 0.0;
    for (; row < end; row++) {
        const float *height = map->height + (long)row * map->nx;
        float dx = (float)(map->x0 + map->shift_x[row] - tip[0]), dy = (float)(map->y0 + row * map->cell - tip[1]);
        if (!columns_within(map, row, tip[0], tip[1], radius, &first, &last)) continue;
        for (i = first; i < last; i++) {
            float u = map->x[i] + dx, v = map->shift_y[i] + dy, h = u * u + v * v < r2 ? height[i] : -3e38f;
            top = h > top ? h : top;
        }
    }
    return (double)top - z;
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
    if (tool->slope > 0.0) return 0.25 * map->cell;
    return chip_min(sqrt(8.0 * tool->radius * CHIP_HEIGHT_RIDGE), 4.0 * map->cell);
}

/* Stamps one after the other; those that are nearer to each other than LAG spare the tool's skin [3]. */
struct chain {
    const struct chip_height_tool *tool;
    const struct shape *s;
    stamp_function cut, spare;
    int spared;     /* the last stamp has spared the skin */
    double mark[3]; /* where the next stamp of the whole tool is due, */
    double gone;    /* mm in XY from there */
};

static double stamp_whole(const struct chip_height_map *map, const struct chain *chain, const double tip[3])
{
    struct stamp stamp;
    chain->cut(map, chain->s, chain->tool->radius + CHIP_HEIGHT_RIDGE, tip, 0, &stamp);
    return stamp.volume;
}

/* Cuts what the last stamps have spared, where the tool is now; returns the volume. */
static double cut_spared(const struct chip_height_map *map, struct chain *chain, const double tip[3])
{
    if (!chain->spared) return 0.0;
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
    float keep[2][ROW_MOST];
    struct stamp stamp;
    int spare = spares(map, chain, tip, advance, volume);
    double here;
    (spare ? chain->spare : chain->cut)(map, chain->s, chain->tool->radius + CHIP_HEIGHT_RIDGE, tip, keep, &stamp);
    *volume += stamp.volume;
    if (stamp.top <= -1e38f) return 0;
    here = (double)stamp.top - lowest + margin(map, &stamp);
    if (here <= *depth) return 0;
    *depth = here;
    return 1;
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
        count = chip_min(ceil(high * steps), steps);
        for (k = chip_max(floor(low * steps), 1.0); k <= count; k++) {
            double t = k / steps, tip[3], lowest;
            int i;
            for (i = 0; i < 3; i++) tip[i] = a[i] + t * (b[i] - a[i]);
            lowest = flat < map->cell ? tip[2] : chip_max(tip[2] - STEP_DOWN * map->cell, chip_min(a[2], b[2]));
            if (stamp_at(map, chain, tip, flat / steps, lowest, &volume, &depth)) met->at = (float)t;
        }
        if (count < steps) { /* out of the stock */
            double t = chip_max(count, 0.0) / steps, tip[3];
            int i;
            for (i = 0; i < 3; i++) tip[i] = a[i] + t * (b[i] - a[i]);
            volume += cut_spared(map, chain, tip);
        }
    }
    met->volume = (float)(volume * map->cell * map->cell);
    met->depth = (float)depth;
    if (tool->holder_radius > 0.0 && clip(map, a, b, tool->holder_radius, tool->stick_out, &low, &high)) {
        steps = ceil(chip_max(hypot(flat, b[2] - a[2]) * (high - low) / map->cell, 1.0));
        for (k = 0.0; k <= steps; k++) {
            double t = low + (high - low) * k / steps, tip[3], over;
            int i;
            for (i = 0; i < 3; i++) tip[i] = a[i] + t * (b[i] - a[i]);
            over = holder_meets(map, tool->holder_radius, tip[2] + tool->stick_out, tip);
            if (over <= met->holder) continue;
            met->holder = (float)over;
            if (!(depth > 0.0)) met->at = (float)t;
        }
    }
}

double chip_height_sweep(const struct chip_height_map *map, const struct chip_height_tool *tool, const double from[3],
                         const double (*to)[3], long n, struct chip_height_met *met)
{
    struct shape s = make_shape(tool);
    struct chip_tool profile;
    struct chain chain = { tool, &s, cut_any, spare_any, 0, { 0.0, 0.0, 0.0 }, 0.0 };
    double sum = 0.0;
    long i;
    if (tool->slope <= 0.0 && tool->corner <= 0.0) {
        chain.cut = cut_flat;
        chain.spare = spare_flat;
    } else if (tool->slope <= 0.0 && tool->corner >= tool->radius) {
        chain.cut = cut_round;
        chain.spare = spare_round;
    }
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0);
    for (i = 0; i < n; i++) {
        memset(&met[i], 0, sizeof met[i]);
        cut_move(map, &chain, i ? to[i - 1] : from, to[i], &met[i]);
        if (i == n - 1) met[i].volume += (float)(cut_spared(map, &chain, to[i]) * map->cell * map->cell);
        if (map->needles) chip_needles_cut(map, &profile, i ? to[i - 1] : from, to[i], &met[i]);
        sum += met[i].volume;
    }
    return sum;
}
