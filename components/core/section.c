/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section.c - see section.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "section.h"

#define CHIP_MIN_NODES 24       /* round a band; multiples of 4, so that nodes lie on the sides */
#define CHIP_MAX_NODES 96
#define CHIP_FLAT_NODES 24        /* round a ring of a flat end at most: it has six rings */
#define CHIP_NODE_CELLS 2.0       /* distance of nodes, in cells */
#define CHIP_REFINE 3             /* points inserted into an interval in which the stock jumps */
#define CHIP_JUMP 0.2             /* change from node to node, of the larger, that is a jump */
/* cells that keep a reading clear of the stock already cut [4]; smaller reads low beside the cut */
#define CHIP_CLEAR 1.5
#define CHIP_SINK 0.2             /* cells below itself at which a falling flat end looks for stock [5] */
#define CHIP_BEYOND 1.0           /* cells outside a falling band at which its stock is read [5] */
#define CHIP_WHOLE 0.9999         /* of a band in contact counts as all of it */
/* inner over outer radius up to which a band's part always has its own radius [6] */
#define CHIP_NARROW_BAND 0.6
#define CHIP_LEVEL_TOP 0.02            /* of a band's rise: columns this similar belong to a level top [6] */
#define CHIP_LEVEL_DIRECTION 1e-6           /* vertical part of the direction up to which the tool moves level [7] */
#define CHIP_EDGE_CELLS 1.5       /* cells from a band's edge within which stock beyond it would be read [8] */
#define CHIP_EDGE_NODES 3         /* cost of a point there, in points elsewhere */
/* a cell of which the tool covers less than a quarter counts less, down to nothing [8] */
#define CHIP_PARTLY_COVERED 4.0
#define CHIP_GAUSS_CELLS 2.5      /* width of a band, in cells, for which a pair of points is enough [7] */
#define CHIP_GAUSS_PARTS 4        /* pairs at most */
#define CHIP_STEEP 2.0            /* a band this much higher than wide has an edge like a wall's [8] */
/* width of a band's part, in cells: narrower ones read no more than the cells know [9] */
#define CHIP_PART_CELLS 1.5
#define CHIP_MIN_CONTACT 1e-4        /* mm, smaller contact is ignored */

struct band {                   /* what the integral needs of one band, at one position */
    double radius;              /* mm */
    double low, high;           /* mm, machine Z of its edges */
    double margin;              /* mm in front of the band where its stock is read [4] */
    double push;                /* the horizontal part of the direction, see band_area */
    double fall;                /* direction cosine a falling tool adds: -dz * run / rise */
    double outer;               /* mm, radius of the outer edge [5] */
    const struct chip_tool_ring *ring;    /* null: a wall or a flat end */
    int nodes;                  /* read so far */
};

struct pose {                  /* the tool's position and heading */
    double x, y;                /* mm, axis */
    double hx, hy;              /* horizontal part of the direction, normalised */
    double level;               /* length of the horizontal part, 0..1 */
    double half_curvature;                /* half the curvature of the path, 1/mm */
    double per_cell;            /* 1/mm, cells per mm */
};

/* Mean height of a cell's stock between low and high, above low. */
static inline __attribute__((always_inline)) double cell_between(const struct chip_stock *stock,
                                                                 const struct chip_cell *cell, double low, double high)
{
    double top = cell->top, uncut, rest;
    if (top <= low) return 0.0;
    uncut = (top < high ? top : high) - low;
    if (!cell->cut) return uncut;
    if (cell->drop & CHIP_RIM) return chip_rim_between(stock, cell, low, high);
    rest = top - cell->drop * stock->drop_unit;
    rest = rest <= low ? 0.0 : (rest < high ? rest : high) - low;
    CHIP_FAULT(CELLS_WHOLE, return cell->cut > CHIP_FULL / 2 ? rest : uncut);
    return uncut + (cell->cut * (1.0 / CHIP_FULL)) * (rest - uncut);
}

/* Stock between low and high at a point, mm above low, interpolated between the four cells around
 * it; the cells are read once for both heights. */
static inline __attribute__((always_inline)) double between(const struct chip_stock *stock, const struct pose *at,
                             double x, double y, double low, double high)
{
    double fx = (x - stock->x0) * at->per_cell + 0.5;   /* in cells; the ring's cell is number 0 */
    double fy = (y - stock->y0) * at->per_cell + 0.5;
    const struct chip_cell *a, *b;
    double h0, h1;
    int ix, iy;
    if (!(fx >= 0.0 && fy >= 0.0 && fx < stock->nx + 1.0 && fy < stock->ny + 1.0)) return 0.0;
    ix = (int)fx;
    iy = (int)fy;
    fx -= ix;
    fy -= iy;
    a = stock->cells + (long)iy * (stock->nx + 2) + ix;
    b = a + stock->nx + 2;
    h0 = cell_between(stock, a, low, high);
    h0 += fx * (cell_between(stock, a + 1, low, high) - h0);
    h1 = cell_between(stock, b, low, high);
    h1 += fx * (cell_between(stock, b + 1, low, high) - h1);
    return h0 + fy * (h1 - h0);
}

/* Height by which stock overlaps the band at the angle (c, s) from the heading [2]. In front
 * it is read at the same distance beside the path, a margin clear of the tool [4]. */
static double overlap(const struct chip_stock *stock, const struct pose *at,
                      struct band *band, double c, double s)
{
    double side = band->radius * s, ahead = band->radius * c;
    band->nodes++;
    if (c >= -1e-9 && band->margin > 0.0) {
        double outer = band->radius + band->margin;
        double front2 = ahead * ahead, ahead2 = outer * outer - side * side;
        ahead = chip_sqrt(ahead2);
        side += at->half_curvature * (ahead2 - front2);   /* the same distance beside a curved path */
    } else {
        ahead = band->outer * c;
        side = band->outer * s;
    }
    return between(stock, at, at->x + ahead * at->hx - side * at->hy,
                   at->y + ahead * at->hy + side * at->hx, band->low, band->high);
}

/* Sine and cosine of a step between nodes, at most 2 pi / CHIP_MIN_NODES: to 1e-15, at a
 * fraction of the library's cost. */
static void small_turn(double angle, double *c, double *s)
{
    double q = angle * angle;
    *s = angle * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0
                  * (1.0 - q / 110.0 * (1.0 - q / 156.0))))));
    *c = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0
                  * (1.0 - q / 90.0 * (1.0 - q / 132.0)))));
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
static void raise_bottom(struct band *band, double bottom)
{
    const struct chip_tool_ring *ring = band->ring;
    double u = (bottom - band->low) / ring->rise, a = ring->inner, b = ring->outer, from, radius;
    if (ring->straight) {
        radius = 0.5 * (a + u * (b - a) + b);
    } else {
        from = chip_sqrt(a * a + u * (b * b - a * a));
        radius = ring->radius * (from * from + from * b + b * b) * (a + b)
            / ((from + b) * (a * a + a * b + b * b));
        band->fall *= ring->radius / radius;
    }
    band->radius = radius;
    band->low = bottom;
    band->ring = 0;
}

/* What a column of height h in contact with the band sweeps at an angle with cosine c: (n . d)+
 * over the radial part of n, times h [1]; `even`: the stock beside it is as high [6]. */
static double swept(const struct band *band, double c, double h, int even)
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
static int faces(const struct band *band, double c)
{
    return band->push * c + band->fall > 0.0;
}

/* Adds points to an interval whose ends differ much, so that a wall between
 * them is found; returns the interval's share of the integral (trapezia). */
static double refine(const struct chip_stock *stock, const struct pose *at, struct band *band,
                     const double from[2], double h0, double h1, double step)
{
    double part = step / (CHIP_REFINE + 1), turn_c, turn_s;
    double c = from[0], s = from[1];
    double last = swept(band, c, h0, 0), sum = 0.0;
    int i;
    small_turn(part, &turn_c, &turn_s);
    for (i = 0; i <= CHIP_REFINE; i++) {
        double next_c = c * turn_c - s * turn_s, value;
        s = s * turn_c + c * turn_s;
        c = next_c;
        value = swept(band, c, i < CHIP_REFINE ? overlap(stock, at, band, c, s) : h1, 0);
        sum += 0.5 * (last + value) * part;
        last = value;
    }
    return sum;
}

static int node_count(const struct chip_stock *stock, double radius)
{
    double n = 0.25 * 2.0 * CHIP_PI * radius / (CHIP_NODE_CELLS * stock->cell);
    n = 4.0 * ceil(n);
    return (int)chip_clamp(n, CHIP_MIN_NODES, CHIP_MAX_NODES);
}

/* Integral over one band, mm2; raises *highest to the highest overlap (mm). Trapezia under
 * a cosine miss (step / 2) / tan(step / 2) of it, which `push` compensates. */
static double band_area(const struct chip_stock *stock, const struct pose *at,
                        struct band *band, double *highest)
{
    int n0 = node_count(stock, band->radius), n = n0, i;
    double step = 2.0 * CHIP_PI / n, turn_c, turn_s;
    double c = -1.0, s = 0.0;               /* starts behind the tool */
    double sum = 0.0, last_h = 0.0, alike = band->ring ? CHIP_LEVEL_TOP * band->ring->rise : 0.0;
    int faced;
    small_turn(step, &turn_c, &turn_s);
    if (band->fall <= 0.0) {                /* or beside it: nothing behind can face ahead */
        c = 0.0;
        s = -1.0;
        n /= 2;
    }
    band->push = at->level * turn_s / (1.0 + turn_c) / (0.5 * step);
    faced = faces(band, c) || n < n0;
    if (faced) last_h = overlap(stock, at, band, c, s);
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
            sum += refine(stock, at, band, before, last_h, h, step);
        else
            sum += 0.5 * step * (swept(band, c, h, change <= alike)
                                 + swept(band, before[0], last_h, change <= alike));
        last_h = h;
        faced = face;
    }
    return sum * band->radius;
}

/* [7] A band of a tool that moves level: what is in front of it at one distance beside the path. */
struct strip {
    double inner, outer;        /* mm, radii of its edges */
    double middle;              /* mm, radius at which its stock is read, if the tool has not cut there [4] */
    double low, high;           /* mm, machine Z of its edges */
    double margin;              /* mm outside `outer` where its stock is read; 0: see middle */
    double ended;               /* mm, `outer` of the whole band, where the stock may be lower than its upper edge */
    int edged;                  /* its edge is like a wall's [8] */
    int nodes;                  /* read so far */
};

/* [8] The part of a cell's stock between two heights that lies in the share k the tool is going to cover. */
static double inside(const struct chip_stock *stock, const struct chip_cell *cell, double k, double low, double high)
{
    double cut = cell->cut * (1.0 / CHIP_FULL), top, rest;
    if (!cell->cut || k >= 1.0) return cell_between(stock, cell, low, high);
    if (cell->drop & CHIP_RIM)
        return cell_between(stock, cell, low, high) / chip_max(1.0 - chip_cell_levels(stock, cell).gone, k);
    top = chip_clamp(cell->top, low, high) - low;
    rest = chip_clamp(cell->top - cell->drop * stock->drop_unit, low, high) - low;
    return k <= cut ? rest : top + cut / k * (rest - top);
}

/* [8] As between(), of the stock nearer to the path than `edge`; the point is `side` beside it, both mm. */
static double between_edges(const struct chip_stock *stock, const struct pose *at, double x, double y,
                            double side, double edge, double low, double high)
{
    double fx = (x - stock->x0) * at->per_cell + 0.5, fy = (y - stock->y0) * at->per_cell + 0.5;
    double nx = side < 0.0 ? at->hy : -at->hy, ny = side < 0.0 ? -at->hx : at->hx;      /* away from the path */
    double outside = (fabs(side) - edge) * at->per_cell, sum = 0.0, weights = 0.0;
    const struct chip_cell *cell;
    int ix, iy, i;
    if (!(fx >= 0.0 && fy >= 0.0 && fx < stock->nx + 1.0 && fy < stock->ny + 1.0)) return 0.0;
    ix = (int)fx;
    iy = (int)fy;
    fx -= ix;
    fy -= iy;
    cell = stock->cells + (long)iy * (stock->nx + 2) + ix;
    for (i = 0; i < 4; i++) {
        double dx = (i & 1) - fx, dy = (i >> 1) - fy;
        double k = chip_cell_covered(outside + dx * nx + dy * ny, nx, ny);
        double weight = (1.0 - fabs(dx)) * (1.0 - fabs(dy)) * chip_min(1.0, CHIP_PARTLY_COVERED * k);
        if (weight <= 0.0) continue;
        weights += weight;
        sum += weight * inside(stock, cell + (i & 1) + (i >> 1) * (long)(stock->nx + 2), k, low, high);
    }
    return weights > 1e-6 ? sum / weights : 0.0;
}

/* [7] Stock between low and the band's upper edge, in front of it `side` mm beside the path, mm; `front`: how far
 * before the axis the band's own circle is there. */
static double met(const struct chip_stock *stock, const struct pose *at, struct strip *strip,
                  double side, double front, double low)
{
    double ahead = front, lateral = side, x, y;
    strip->nodes++;
    if (strip->margin > 0.0) {
        double outer = strip->outer + strip->margin, ahead2 = outer * outer - side * side;
        ahead = chip_sqrt(ahead2);
        lateral += at->half_curvature * (ahead2 - front * front);     /* the same distance beside a curved path */
    } else {
        double ahead2 = strip->middle * strip->middle - side * side;
        ahead = ahead2 > 0.0 ? chip_sqrt(ahead2) : 0.0;
    }
    x = at->x + ahead * at->hx - lateral * at->hy;
    y = at->y + ahead * at->hy + lateral * at->hx;
    CHIP_FAULT(EDGE_SMEARED, return between(stock, at, x, y, low, strip->high));
    if (strip->edged && fabs(side) > strip->ended - CHIP_EDGE_CELLS / at->per_cell) {
        strip->nodes += CHIP_EDGE_NODES - 1;
        return between_edges(stock, at, x, y, side, strip->ended, low, strip->high);
    }
    return between(stock, at, x, y, low, strip->high);
}

/* [7] The band where it has its full height, between its inner edges: mm2, trapezia across the path. Where the stock
 * jumps points are inserted. */
static double middle_area(const struct chip_stock *stock, const struct pose *at, struct strip *strip, double *highest)
{
    int n = node_count(stock, strip->inner) / 2, i, k;
    double step = CHIP_PI / n, r = strip->inner, turn_c, turn_s, fine_c, fine_s, sum = 0.0;
    double c = 0.0, s = -1.0, last = met(stock, at, strip, -r, 0.0, strip->low);
    small_turn(step, &turn_c, &turn_s);
    small_turn(step / (CHIP_REFINE + 1), &fine_c, &fine_s);
    *highest = last;
    for (i = 0; i < n; i++) {
        double x = c, y = s, h;
        c = x * turn_c - y * turn_s;
        s = y * turn_c + x * turn_s;
        h = met(stock, at, strip, r * s, r * c, strip->low);
        if (h > *highest) *highest = h;
        if (fabs(h - last) > CHIP_JUMP * chip_max(h, last)) {
            for (k = 0; k < CHIP_REFINE; k++) {
                double next = x * fine_c - y * fine_s, side = y, before = last;
                y = y * fine_c + x * fine_s;
                x = next;
                last = met(stock, at, strip, r * y, r * x, strip->low);
                sum += (before + last) * (y - side);
            }
            sum += (last + h) * (s - y);
        } else {
            sum += (last + h) * (s - y);
        }
        last = h;
    }
    return 0.5 * r * sum;
}

/* [7] If the stock is no higher than the lower part of a band, the band ends there. `highest`: contact of its
 * middle. */
static void end_at_top(const struct chip_stock *stock, const struct pose *at, const struct chip_tool *tool, double tip,
                       struct strip *strip, double highest)
{
    double top = highest, h;
    int i;
    for (i = 0; i < 3; i++) {
        if (i == 2 && strip->inner > 0.0) break;
        h = met(stock, at, strip, (1 - i) * (i < 2 ? strip->outer : 0.0), 0.0, strip->low);
        if (h > top) top = h;
    }
    if (top + strip->low >= strip->high - CHIP_MIN_CONTACT) return;
    strip->outer = chip_clamp(chip_tool_reach(tool, strip->low + top - tip), strip->inner, strip->outer);
    strip->margin += strip->margin > 0.0 ? strip->ended - strip->outer : 0.0;
}

/* [7] The band's two sides, between its inner and its outer edges: pairs of Gauss points, mm2. */
static double rim_area(const struct chip_stock *stock, const struct pose *at, const struct chip_tool *tool, double tip,
                       struct strip *strip, double *highest)
{
    int parts = (int)chip_clamp(ceil((strip->outer - strip->inner) * at->per_cell / CHIP_GAUSS_CELLS), 1.0,
                                CHIP_GAUSS_PARTS),
        i;
    double width = (strip->outer - strip->inner) / parts, sum = 0.0;
    for (i = 0; i < 4 * parts; i++) {
        double side = strip->inner + width * ((i >> 2) + (i & 2 ? 0.7886751345948129 : 0.21132486540518708));
        double low = chip_max(tip + chip_tool_height(tool, side), strip->low), h;
        CHIP_FAULT(CONE_AS_CYLINDERS, low = strip->low);
        if (low >= strip->high) continue;
        h = met(stock, at, strip, i & 1 ? -side : side, 0.0, low);
        sum += 0.5 * width * h;
        if (h > 0.0) *highest = chip_max(*highest, h + low - strip->low);
    }
    return sum;
}

/* Adds a band of a tool that moves level, or the wall of any tool. */
static void add_strip(const struct chip_stock *stock, const struct pose *at, const struct chip_tool *tool, double tip,
                      struct strip *strip, struct chip_section *section)
{
    double highest = 0.0, area = 0.0;
    if (strip->high <= stock->z_min) return;
    strip->low = chip_max(strip->low, stock->z_min);
    if (strip->inner > 0.0) area = middle_area(stock, at, strip, &highest);
    if (strip->outer > strip->inner && highest < (1.0 - CHIP_LEVEL_TOP) * (strip->high - strip->low))
        end_at_top(stock, at, tool, tip, strip, highest);
    if (strip->outer > strip->inner) area += rim_area(stock, at, tool, tip, strip, &highest);
    section->area += area * at->level;
    section->nodes += strip->nodes;
    if (highest > 0.0) section->depth = chip_max(section->depth, highest + strip->low - tip);
}

/* The wall above the tool's end. */
static void add_wall(const struct chip_stock *stock, const struct pose *at, const struct chip_tool *tool, double tip,
                     double margin, struct chip_section *section)
{
    struct strip strip = {
        tool->radius, tool->radius, tool->radius, tip + tool->shoulder, 1e301, margin, tool->radius, 1, 0
    };
    if (strip.low < stock->z_max) add_strip(stock, at, tool, tip, &strip, section);
}

/* [9] Largest number of parts of a band: if few bands are below the stock's top, `reach` mm from the axis, each gets
 * more. */
static int max_parts(const struct chip_tool *tool, double reach)
{
    int i, met = 0;
    for (i = 0; i < tool->rings; i++) met += tool->ring[i].inner < reach;
    return met ? CHIP_TOOL_RINGS / met : 1;
}

/* [9] Number of parts in which a band is read, out to `reach`. */
static int band_parts(const struct chip_stock *stock, const struct chip_tool_ring *ring, double reach, int max)
{
    double width = chip_min(ring->outer, reach) - ring->inner;
    if (ring->rise <= CHIP_MIN_CONTACT) return 1;
    return (int)chip_clamp(ceil(width / (CHIP_PART_CELLS * stock->cell)), 1.0, (double)max);
}

/* Part k of n of a band. */
static struct chip_tool_ring band_part(const struct chip_tool *tool, const struct chip_tool_ring *ring, double reach,
                                       int n, int k)
{
    double outer = chip_max(ring->inner, chip_min(ring->outer, reach)), width = (outer - ring->inner) / n;
    struct chip_tool_ring part = *ring;
    if (n > 1 || outer < ring->outer)
        chip_tool_profile_part(tool, ring, ring->inner + k * width, k + 1 < n ? ring->inner + (k + 1) * width : outer,
                               &part);
    return part;
}

/* [7] The tool moves level: the area between its outline and the stock's top, seen along the path. */
static void level_section(const struct chip_stock *stock, const struct pose *at, const struct chip_tool *tool,
                          double tip, double clear, struct chip_section *section)
{
    double reach = chip_tool_reach(tool, stock->z_max - tip);
    int max = max_parts(tool, reach), i, k, n;
    for (i = 0; i < tool->rings && tool->ring[i].inner < reach; i++) {
        n = band_parts(stock, &tool->ring[i], reach, max);
        for (k = 0; k < n; k++) {
            struct chip_tool_ring ring = band_part(tool, &tool->ring[i], reach, n, k);
            double low = tip + ring.height - 0.5 * ring.rise;
            struct strip strip = { ring.inner, ring.outer, ring.radius, low, low + ring.rise, clear, ring.outer,
                                   ring.rise > CHIP_STEEP * (ring.outer - ring.inner), 0 };
            if (ring.rise > CHIP_MIN_CONTACT) add_strip(stock, at, tool, tip, &strip, section);
        }
    }
    add_wall(stock, at, tool, tip, clear, section);
}

/* A flat band sweeps only when the tool falls: area in contact times the fall [1]. */
static double flat_area(const struct chip_stock *stock, const struct pose *at,
                        const struct chip_tool_ring *ring, double z, double fall, double slab, int *nodes)
{
    int max = node_count(stock, ring->radius), n = max < CHIP_FLAT_NODES ? max : CHIP_FLAT_NODES, i;
    double step = 2.0 * CHIP_PI / n, turn_c, turn_s;
    double c = 1.0, s = 0.0, sum = 0.0;
    struct band band = { ring->radius, z, 1e301, 0.0, 0.0, 0.0, ring->radius, 0, 0 };
    small_turn(step, &turn_c, &turn_s);
    for (i = 0; i < n; i++) {
        double next_c = c * turn_c - s * turn_s;
        sum += chip_min(1.0, overlap(stock, at, &band, c, s) / slab);
        s = s * turn_c + c * turn_s;
        c = next_c;
    }
    *nodes += band.nodes;
    return sum * step * ring->radius * ring->run * fall;
}

/* Adds a band to the section; the highest contact above the tip is the depth. */
static void add_band(const struct chip_stock *stock, const struct pose *at,
                     struct band *band, double tip_z, struct chip_section *section)
{
    double highest = 0.0;
    band->nodes = 0;
    section->area += band_area(stock, at, band, &highest);
    section->nodes += band->nodes;
    if (highest > 0.0) section->depth = chip_max(section->depth, highest + band->low - tip_z);
}

/* The pose of a tool at `tip` (mm) that moves along the unit vector `dir`. */
static struct pose pose_of(const struct chip_stock *stock, const double tip[3], const double dir[3], double curvature)
{
    struct pose at;
    at.level = chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]);
    at.hx = at.level > 1e-9 ? dir[0] / at.level : 1.0;
    at.hy = at.level > 1e-9 ? dir[1] / at.level : 0.0;
    at.half_curvature = 0.5 * curvature;
    at.per_cell = 1.0 / stock->cell;
    at.x = tip[0];
    at.y = tip[1];
    return at;
}

double chip_section_clear(const struct chip_stock *stock)
{
    CHIP_FAULT(READ_IN_CUT, return 0.1 * stock->cell);
    return CHIP_CLEAR * stock->cell;
}

double chip_section_reach(const struct chip_stock *stock, const struct chip_tool *tool)
{
    double clear = chip_section_clear(stock);
    return chip_sqrt((2.0 * tool->radius + clear) * clear);
}

struct chip_section chip_section_at(const struct chip_stock *stock, const struct chip_tool *tool,
                                const double tip[3], const double dir[3], double clear,
                                double curvature)
{
    struct chip_section result = { 0.0, 0.0, 0 };
    double z = tip[2], fall = chip_max(0.0, -dir[2]), sink = fall * CHIP_SINK * stock->cell;
    struct pose at;
    struct band band;
    double reach;
    int max, i, k, n;

    if (tip[2] >= stock->z_max || tool->radius <= 0.0) return result;
    at = pose_of(stock, tip, dir, curvature);
    if (fabs(dir[2]) <= CHIP_LEVEL_DIRECTION) {
        level_section(stock, &at, tool, z, clear, &result);
        return result;
    }
    reach = chip_tool_reach(tool, stock->z_max - z);
    max = max_parts(tool, reach);
    for (i = 0; i < tool->rings; i++) {
        const struct chip_tool_ring *ring = &tool->ring[i];
        if (ring->rise <= CHIP_MIN_CONTACT) {
            double slab = chip_max(CHIP_MIN_CONTACT, 0.5 * sink), end = z + ring->height;
            if (fall > 0.0 && end > stock->z_min)
                result.area += flat_area(stock, &at, ring, chip_max(end - sink, stock->z_min), fall, slab,
                                         &result.nodes);
            continue;
        }
        if (ring->inner >= reach) break;        /* bands rise outwards */
        n = band_parts(stock, ring, reach, max);
        for (k = 0; k < n; k++) {
            struct chip_tool_ring part = band_part(tool, ring, reach, n, k);
            if (part.rise <= CHIP_MIN_CONTACT) continue;
            band.ring = &part;
            band.radius = part.radius;
            band.outer = part.radius + (clear > 0.0 ? 0.5 * part.run + CHIP_BEYOND * stock->cell : 0.0);
            band.margin = clear > 0.0 ? at.level * (clear + 0.5 * part.run) : 0.0;
            band.low = z + part.height - 0.5 * part.rise;
            band.high = band.low + part.rise;
            if (band.high <= stock->z_min) continue;
            band.fall = -dir[2] * part.run / part.rise;
            if (band.low < stock->z_min) raise_bottom(&band, stock->z_min);
            add_band(stock, &at, &band, tip[2], &result);
        }
    }
    if (tip[2] + tool->shoulder < stock->z_max && at.level > 1e-9)
        add_wall(stock, &at, tool, z, at.level * clear, &result);
    return result;
}
