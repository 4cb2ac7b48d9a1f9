/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section_band.c - the section area of one band of a tool that falls or rises: see section_parts.h and section.h; the
 * numbers in brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_FLAT_NODES 24 /* round a ring of a flat end at most: it has six rings */
#define CHIP_WHOLE 0.9999  /* of a band in contact counts as all of it */
/* inner over outer radius up to which a band's part always has its own radius [6] */
#define CHIP_NARROW_BAND 0.6

/* Height by which stock overlaps the band at the angle (c, s) from the heading [2]. In front
 * it is read at the same distance beside the path, a margin clear of the tool as it is now [4]. */
static double overlap(const struct chip_stock *stock, const struct chip_pose *at, struct chip_band *band, double c,
                      double s)
{
    double side = band->radius * s, ahead = band->radius * c;
    band->nodes++;
    if (c >= -1e-9 && band->margin > 0.0) {
        double outer = band->radius + band->margin, front = ahead;
        ahead = chip_max(front, chip_sqrt(outer * outer - side * side) - at->in_front);
        side += at->half_curvature * (ahead * ahead - front * front); /* the same distance beside a curved path */
    } else {
        ahead = band->outer * c;
        side = band->outer * s;
    }
    return between(stock, at, at->x + ahead * at->hx - side * at->hy, at->y + ahead * at->hy + side * at->hx, band->low,
                   band->high);
}

/* Mean radius of the lowest part u (0..1) of a band, over that of the whole band [6]. */
static double part_radius(const struct chip_tool_ring *ring, double u)
{
    double a = ring->inner, b = ring->outer, r;
    if (ring->straight) return (2.0 * a + u * (b - a)) / (a + b);
    r = chip_sqrt(a * a + u * (b * b - a * a));
    return (a * a + a * r + r * r) * (a + b) / ((a + r) * (a * a + a * b + b * b));
}

/* Cuts a band that reaches below the stock's bottom off there, with the mean radius
 * of the upper part [6]. */
void chip_band_raise_bottom(struct chip_band *band, double bottom)
{
    const struct chip_tool_ring *ring = band->ring;
    double u = (bottom - band->low) / ring->rise, a = ring->inner, b = ring->outer, from, radius;
    if (ring->straight) {
        radius = 0.5 * (a + u * (b - a) + b);
    } else {
        from = chip_sqrt(a * a + u * (b * b - a * a));
        radius = ring->radius * (from * from + from * b + b * b) * (a + b) / ((from + b) * (a * a + a * b + b * b));
        band->fall *= ring->radius / radius;
    }
    band->radius = radius;
    band->low = bottom;
    band->ring = 0;
}

/* What a column of height h in contact with the band sweeps at an angle with cosine c: (n . d)+
 * over the radial part of n, times h [1]; `even`: the stock beside it is as high [6]. */
static double swept(const struct chip_band *band, double c, double h, int even)
{
    double push = band->push * c, fall = band->fall;
    if (h <= 0.0) return 0.0;
    if (band->ring && h < CHIP_WHOLE * band->ring->rise
        && (even || band->ring->inner <= CHIP_NARROW_BAND * band->ring->outer)) {
        double part = part_radius(band->ring, h / band->ring->rise);
        push *= part;
        if (band->ring->straight) fall *= part;
    }
    return chip_max(0.0, push + fall) * h;
}

/* Whether the band faces ahead at an angle with cosine c. */
static int faces(const struct chip_band *band, double c) { return band->push * c + band->fall > 0.0; }

/* For the limits of the tooth: notes node `column` of `n`, from behind, at an angle with this cosine and sine; `face`: it faces ahead. Nodes in
 * front of the axis are points for the side force (tooth.h, 10). */
static __attribute__((noinline)) void note_node(const struct chip_pose *at, struct chip_band *band,
                                                const double turn[2], double h, int face, const int column[2])
{
    if (face) note_column(at->tooth, band, at->level, turn, h);
    if (turn[0] >= -1e-9)
        note_point(at->tooth, turn[1], h);
    else if (face)
        chip_force_behind(at->tooth, band, at->level, column[0], column[1], h);
}

/* Adds points to an interval whose ends differ much, so that a wall between
 * them is found; returns the interval's share of the integral (trapezia). */
static double refine(const struct chip_stock *stock, const struct chip_pose *at, struct chip_band *band,
                     const double from[2], const double heights[2], double step)
{
    double part = step / (CHIP_REFINE + 1), turn_c, turn_s;
    double c = from[0], s = from[1], h = heights[0];
    double last = swept(band, c, h, 0), sum = 0.0;
    int i;
    small_turn(part, &turn_c, &turn_s);
    for (i = 0; i <= CHIP_REFINE; i++) {
        double next_c = c * turn_c - s * turn_s, value;
        s = s * turn_c + c * turn_s;
        c = next_c;
        h = i < CHIP_REFINE ? overlap(stock, at, band, c, s) : heights[1];
        if (at->tooth && i < CHIP_REFINE && c >= -1e-9) note_point(at->tooth, s, h);
        value = swept(band, c, h, 0);
        sum += 0.5 * (last + value) * part;
        last = value;
    }
    return sum;
}

/* Integral over one band, mm2; raises *highest to the highest overlap (mm). Trapezia under
 * a cosine miss (step / 2) / tan(step / 2) of it, which `push` compensates. */
static double band_area(const struct chip_stock *stock, const struct chip_pose *at, struct chip_band *band,
                        double *highest)
{
    int n0 = node_count(stock, band->radius), n = n0, i;
    double step = 2.0 * CHIP_PI / n, turn_c, turn_s;
    double c = -1.0, s = 0.0; /* starts behind the tool */
    double sum = 0.0, last_h = 0.0, alike = band->ring ? CHIP_LEVEL_TOP * band->ring->rise : 0.0;
    int faced, column = 1;
    small_turn(step, &turn_c, &turn_s);
    if (band->fall <= 0.0) { /* or beside it: nothing behind can face ahead */
        c = 0.0;
        s = -1.0;
        n /= 2;
        column += n / 2;
    }
    band->push = at->level * turn_s / (1.0 + turn_c) / (0.5 * step);
    faced = faces(band, c) || n < n0;
    if (faced) last_h = overlap(stock, at, band, c, s);
    if (at->tooth) {
        at->tooth->points = 0;
        note_node(at, band, (const double[2]){ c, s }, last_h, 0, (const int[2]){ 0, n0 });
    }
    for (i = 0; i < n; i++) {
        double before[2] = { c, s }, h = 0.0, change;
        int face;
        c = before[0] * turn_c - before[1] * turn_s;
        s = before[1] * turn_c + before[0] * turn_s;
        face = faces(band, c);
        if (face || faced) h = overlap(stock, at, band, c, s);
        if (face && h > *highest) *highest = h;
        change = fabs(h - last_h);
        if (change > CHIP_JUMP * chip_max(h, last_h) && (face || faced))
            sum += refine(stock, at, band, before, (const double[2]){ last_h, h }, step);
        else
            sum += 0.5 * step * (swept(band, c, h, change <= alike) + swept(band, before[0], last_h, change <= alike));
        if (at->tooth) note_node(at, band, (const double[2]){ c, s }, h, face, (const int[2]){ column + i, n0 });
        last_h = h;
        faced = face;
    }
    return sum * band->radius;
}

/* A flat band sweeps only when the tool falls: area in contact times the fall [1]. */
double chip_band_flat_area(const struct chip_stock *stock, const struct chip_pose *at,
                           const struct chip_tool_ring *ring, double z, double fall, double slab, int *nodes)
{
    int max = node_count(stock, ring->radius), n = max < CHIP_FLAT_NODES ? max : CHIP_FLAT_NODES, i;
    double step = 2.0 * CHIP_PI / n, turn_c, turn_s;
    double c = 1.0, s = 0.0, sum = 0.0;
    struct chip_band band = { ring->radius, z,       1e301,   0.0, 0.0, 0.0, ring->radius, 0,  0,
                              0.0,          { 0.0 }, { 0.0 }, 0.0, 0.0, 0.0, 0.0,          0.0 };
    small_turn(step, &turn_c, &turn_s);
    for (i = 0; i < n; i++) {
        double next_c = c * turn_c - s * turn_s, part = chip_min(1.0, overlap(stock, at, &band, c, s) / slab);
        sum += part;
        if (at->tooth && at->tooth->force_weight > 0.0) chip_force_column(at->tooth, i, n, part * ring->run, fall);
        s = s * turn_c + c * turn_s;
        c = next_c;
    }
    *nodes += band.nodes;
    return sum * step * ring->radius * ring->run * fall;
}

/* Adds a band to the section; the highest contact above the tip is the depth. */
void chip_band_add(const struct chip_stock *stock, const struct chip_pose *at, struct chip_band *band, double tip_z,
                   struct chip_section *section)
{
    double highest = 0.0;
    band->nodes = 0;
    section->area += band_area(stock, at, band, &highest);
    section->nodes += band->nodes;
    if (at->tooth) chip_tooth_columns(at, band, 2.0 * CHIP_PI / node_count(stock, band->radius), section);
    if (highest > 0.0) section->depth = chip_max(section->depth, highest + band->low - tip_z);
}
