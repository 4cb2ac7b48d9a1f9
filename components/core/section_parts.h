/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section_parts.h - the parts of a section area: where its stock is read, bands and strips.
 *
 * Internal: section.c divides a tool into bands or strips, section_band.c integrates over bands, section_strip.c over
 * strips. The numbers in brackets are those of the principle in section.h. */
#ifndef CHIPWISE_SECTION_PARTS_H
#define CHIPWISE_SECTION_PARTS_H

#include "chip_math.h"
#include "pair.h"
#include "section.h"

#define CHIP_MIN_NODES 24 /* round a band; multiples of 4, so that nodes lie on the sides */
#define CHIP_MAX_NODES 96
#define CHIP_NODE_CELLS 2.0   /* distance of nodes, in cells */
#define CHIP_REFINE 3         /* points inserted into an interval in which the stock jumps */
#define CHIP_JUMP 0.2         /* change from node to node, of the larger, that is a jump */
#define CHIP_WALL_JUMP 0.02   /* the same beside a wall of the stock, whose height the map knows */
#define CHIP_LEVEL_TOP 0.02   /* of a band's rise: columns this similar belong to a level top [6] */
#define CHIP_EDGE_CELLS 1.5   /* cells from a band's edge within which stock beyond it would be read [8] */
#define CHIP_MIN_CONTACT 1e-4 /* mm, smaller contact is ignored */

struct chip_pose {         /* the tool's position and heading */
    double x, y;           /* mm, axis */
    double hx, hy;         /* horizontal part of the direction, normalised */
    double level;          /* length of the horizontal part, 0..1 */
    double in_front;       /* mm, horizontally, in front of where the tool is now; 0: or its cut does not matter [4] */
    double beside_cut;     /* mm from the cut where stock is read there as well [4] */
    double half_curvature; /* half the curvature of the path, 1/mm */
    double per_cell;       /* 1/mm, cells per mm */
    double edge;           /* mm from a band's edge within which stock beyond it would be read [8] */
    struct chip_tooth *tooth; /* null: the tool has no limits, and nothing is summed for them */
};

/* The share of a cell that is cut; it is not on the rim of the stock. */
static inline __attribute__((always_inline)) double cut_share(const struct chip_cell *cell)
{
    CHIP_FAULT(CELLS_WHOLE, return cell->cut > CHIP_FULL / 2);
    return cell->cut * (1.0 / CHIP_FULL);
}

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
    return uncut + cut_share(cell) * (rest - uncut);
}

/* The same of a cell that is not cut, or as a whole. */
static inline __attribute__((always_inline)) double whole_between(const struct chip_cell *cell, double low, double high)
{
    double top = cell->top;
    return top <= low ? 0.0 : (top < high ? top : high) - low;
}

struct two_cells {  /* two cells: */
    pair top, rest; /* heights above `low`, mm, of their uncut and their cut part, */
    pair share;     /* the share that is cut, */
    pair mean;      /* and the mean height */
};

/* The mean heights of two cells one by one, for the rim of the stock. */
static __attribute__((noinline, unused)) pair mean_of_rim(const struct chip_stock *stock, const struct chip_cell *a,
                                                          const struct chip_cell *b, double low, double high)
{
    return (pair){ cell_between(stock, a, low, high), cell_between(stock, b, low, high) };
}

/* Reads two cells between two heights; on the rim of the stock only `mean` is right. */
static inline __attribute__((always_inline)) struct two_cells
read_two(const struct chip_stock *stock, const struct chip_cell *a, const struct chip_cell *b, double low, double high)
{
    pair top = { a->top, b->top }, drop = { a->drop, b->drop };
    struct two_cells two;
    two.top = pair_between(top, low, high);
    two.rest = pair_between(top - drop * stock->drop_unit, low, high);
    two.share = (pair){ cut_share(a), cut_share(b) };
    two.mean = two.top + two.share * (two.rest - two.top);
    if ((a->drop | b->drop) & CHIP_RIM) two.mean = mean_of_rim(stock, a, b, low, high);
    return two;
}

/* The mean heights of two cells; most are not cut, or as a whole. */
static inline __attribute__((always_inline)) pair mean_of_two(const struct chip_stock *stock, const struct chip_cell *a,
                                                              const struct chip_cell *b, double low, double high)
{
    if (!(a->cut | b->cut)) return pair_between((pair){ a->top, b->top }, low, high);
    return read_two(stock, a, b, low, high).mean;
}

struct chip_corners {             /* the four cells round a point */
    const struct chip_cell *cell; /* the first of them, */
    int ix, iy;                   /* its numbers, the ring's cell is number 0, */
    double fx, fy;                /* and where the point lies from its middle, in cells */
};

/* Finds them; 0 if the point is not on the map. */
static inline __attribute__((always_inline)) int find_corners(const struct chip_stock *stock,
                                                              const struct chip_pose *at, double x, double y,
                                                              struct chip_corners *corners)
{
    double fx = (x - stock->x0) * at->per_cell + 0.5, fy = (y - stock->y0) * at->per_cell + 0.5;
    if (!(fx >= 0.0 && fy >= 0.0 && fx < stock->nx + 1.0 && fy < stock->ny + 1.0)) return 0;
    corners->ix = (int)fx;
    corners->iy = (int)fy;
    corners->fx = fx - corners->ix;
    corners->fy = fy - corners->iy;
    corners->cell = stock->cells + (long)corners->iy * (stock->nx + 2) + corners->ix;
    return 1;
}

/* The height at the point, from the mean heights of the two cells with the lower Y and of the two others. */
static inline __attribute__((always_inline)) double interpolated(const struct chip_corners *corners, pair a, pair b)
{
    double h0 = a[0] + corners->fx * (a[1] - a[0]), h1 = b[0] + corners->fx * (b[1] - b[0]);
    return h0 + corners->fy * (h1 - h0);
}

/* Stock between low and high, mm above low, interpolated between the four cells, which are read once for both heights. Cells
 * without a part are different in few places, so there branches take less time than a pair. */
static inline __attribute__((always_inline)) double
between_corners(const struct chip_stock *stock, const struct chip_corners *corners, double low, double high)
{
    const struct chip_cell *a = corners->cell, *b = a + stock->nx + 2;
    if (a[0].cut | a[1].cut | b[0].cut | b[1].cut)
        return interpolated(corners, read_two(stock, a, a + 1, low, high).mean,
                            read_two(stock, b, b + 1, low, high).mean);
    return interpolated(corners, (pair){ whole_between(a, low, high), whole_between(a + 1, low, high) },
                        (pair){ whole_between(b, low, high), whole_between(b + 1, low, high) });
}

/* The same at a point. */
static inline __attribute__((always_inline)) double between(const struct chip_stock *stock, const struct chip_pose *at,
                                                            double x, double y, double low, double high)
{
    struct chip_corners corners;
    return find_corners(stock, at, x, y, &corners) ? between_corners(stock, &corners, low, high) : 0.0;
}

/* Sine and cosine of a step between nodes, at most 2 pi / CHIP_MIN_NODES: to 1e-15, at a
 * fraction of the library's cost. */
static inline void small_turn(double angle, double *c, double *s)
{
    double q = angle * angle;
    *s = angle
       * (1.0
          - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0 * (1.0 - q / 156.0))))));
    *c = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0)))));
}

/* Nodes round a circle. */
static inline int node_count(const struct chip_stock *stock, double radius)
{
    double n = 0.25 * 2.0 * CHIP_PI * radius / (CHIP_NODE_CELLS * stock->cell);
    n = 4.0 * ceil(n);
    return (int)chip_clamp(n, CHIP_MIN_NODES, CHIP_MAX_NODES);
}

struct chip_band {                     /* what the integral needs of one band, at one position */
    double radius;                     /* mm */
    double low, high;                  /* mm, machine Z of its edges */
    double margin;                     /* mm outside the tool's present outline where its stock is read [4] */
    double push;                       /* the horizontal part of the direction, see band_area */
    double fall;                       /* direction cosine a falling tool adds: -dz * run / rise */
    double outer;                      /* mm, radius of the outer edge [5] */
    const struct chip_tool_ring *ring; /* null: a wall or a flat end */
    int nodes;                         /* read so far */
    /* for the limits of the tooth: sine of the angle between normal and axis, of the band and at its edges, cosine at its edges, and the
     * downward part of the direction */
    double lean, lean_edge[2], flat_edge[2], down;
    double ahead,
        roots; /* of the columns that touch: largest cosine of their angle, -2: none; sum of height times (n . d)^(1 - mc) */
    double push_ahead, push_aside; /* the same with cosine and sine */
};


/* [7] A band of a tool that moves level: what is in front of it at one distance beside the path. */
struct chip_strip {
    double inner, outer; /* mm, radii of its edges */
    double middle;       /* mm, radius at which its stock is read, if the tool has not cut there [4] */
    double low, high;    /* mm, machine Z of its edges */
    double margin;       /* mm outside `outer`, where the tool is now, at which its stock is read; 0: see middle */
    double ended;        /* mm, `outer` of the whole band, where the stock may be lower than its upper edge */
    int edged;           /* its edge is like a wall's [8] */
    int nodes;           /* read so far */
    int walled;          /* the point read last is near a wall of the stock, or its rim [10] */
};

struct chip_point {     /* where the stock in front of a strip is read, mm */
    double x, y;        /* machine coordinates */
    double front, side; /* the strip's own circle there: before the axis, and beside it */
};

/* Functions of the core's own; nothing outside calls them. */
#pragma GCC visibility push(hidden)

/* Cuts a band that reaches below the stock's bottom off there, with the mean radius of the upper part [6]. */
void chip_band_raise_bottom(struct chip_band *band, double bottom);

/* Adds a band to the section; the highest contact above the tip is the depth. */
void chip_band_add(const struct chip_stock *stock, const struct chip_pose *at, struct chip_band *band, double tip_z,
                   struct chip_section *section);

/* A flat band sweeps only when the tool falls: area in contact times the fall [1]. */
double chip_band_flat_area(const struct chip_stock *stock, const struct chip_pose *at,
                           const struct chip_tool_ring *ring, double z, double fall, double slab, int *nodes);

/* Adds a band of a tool that moves level, or the wall of any tool. */
void chip_strip_add(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                    double tip, struct chip_strip *strip, struct chip_section *section);

/* [8] [10] Stock between low and the strip's upper edge, at a point of a strip whose edge is like a wall's, mm. */
double chip_wall_between(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_point *point,
                         struct chip_strip *strip, double low);

/* tooth.c: adds the chip and the power of a strip, whose points are in at->tooth; of its rim, which is touched from
 * `nearest` mm beside the path and has the power of `power` mm2; of the columns of a band of a tool that falls or rises, each of `step` rad; of a flat end that falls, with stock under `contact` mm2. */
void chip_tooth_strip(const struct chip_pose *at, const struct chip_tool *tool, const struct chip_strip *strip,
                      double highest, struct chip_section *section);
void chip_tooth_rim(const struct chip_pose *at, const struct chip_tool *tool, const struct chip_strip *strip,
                    double nearest, double power, struct chip_section *section);

/* What an area of a rim counts for, `side` mm beside the path; lean: sine of the angle between its normal and the axis. */
double chip_tooth_rim_power(const struct chip_tooth *tooth, double lean, double side, double outer);

void chip_tooth_columns(const struct chip_pose *at, const struct chip_band *band, double step,
                        struct chip_section *section);
void chip_tooth_end(const struct chip_pose *at, double contact, double fall, struct chip_section *section);

/* Sets what they need of a band. */
void chip_tooth_band(const struct chip_tool *tool, const struct chip_tool_ring *ring, double down,
                     struct chip_band *band);

/* Of a table of tooth.h, at x from 0 to 1. */
static inline __attribute__((always_inline)) double in_table(const float *table, double x)
{
    double u = CHIP_WEIGHTS * chip_clamp(x, 0.0, 1.0);
    int i = (int)u;
    return table[i] + (u - i) * (table[i + 1] - table[i]);
}

#define CHIP_FORCE_AHEAD (CHIP_FORCE_NODES / 2)    /* the angle of the heading, */
#define CHIP_FORCE_FIRST (CHIP_FORCE_NODES / 4)    /* beside the path on the right, */
#define CHIP_FORCE_LAST (3 * CHIP_FORCE_NODES / 4) /* and on the left */

/* What a height that touches counts for at an angle with cosine c: `unit` times (scale c + off)^(1 - mc); `ahead`: in the heading. */
struct chip_face {
    double unit, scale, off, ahead;
};

/* tooth_force.c, for a tool whose side force is limited: begins a section; adds a strip whose points are in the tooth, the one in the heading `middle`, `scale` its inner
 * radius over the one that cuts, `face` what a height in the heading counts for, `width` the sine over which cells spread a wall; the same of a band of a tool that
 * falls or rises; column `i` of `n` of such a band, from behind, behind the axis, with `height` mm in stock; adds a point of a rim `side` mm beside the path, of
 * `width` mm and `height` mm, `is_first`: nothing is met nearer to the path; adds column `i` of `n` of a flat end, from ahead, that falls with `length` mm in
 * stock; ends the section. */
void chip_force_begin(struct chip_tooth *tooth);
void chip_force_strip(struct chip_tooth *tooth, int middle, double scale, double face, double width);
void chip_force_band(struct chip_tooth *tooth, const struct chip_band *band, double level, int middle, double width);
void chip_force_behind(struct chip_tooth *tooth, const struct chip_band *band, double level, int i, int n,
                       double height);
void chip_force_column(struct chip_tooth *tooth, int i, int n, double length, double fall);
void chip_force_rim(const struct chip_pose *at, const struct chip_strip *strip, double lean, double side, double width,
                    double height, int is_first);
void chip_force_end(struct chip_tooth *tooth, struct chip_section *section);

/* tooth_brink.c: notes that f changes by what `height` counts for at an angle whose sine is `at`, on the right (0) or on the left (1); the largest
 * vector sum, squared, with an edge at a brink [10]. */
void chip_brink_note(struct chip_tooth *tooth, int left, double at, double height, const struct chip_face *face);
double chip_brink_largest(const struct chip_tooth *tooth);

/* What a face counts for at an angle with this cosine. */
static inline __attribute__((always_inline)) double face_at(const struct chip_tooth *tooth, double scale, double off,
                                                            double cosine)
{
    return in_table(tooth->root, scale * cosine + off);
}

/* The number of the first angle from the heading whose sine is q or more. */
static inline __attribute__((always_inline)) int chip_force_node_from(const struct chip_tooth *tooth, double q)
{
    int k = tooth->node[(int)(CHIP_WEIGHTS * chip_clamp(q, 0.0, 1.0))];
    while (k < CHIP_FORCE_NODES / 4 && tooth->sine[CHIP_FORCE_AHEAD + k] < q) k++;
    return k;
}

/* Notes a column of a band at an angle with this cosine and sine. */
static inline __attribute__((always_inline)) void note_column(struct chip_tooth *tooth, struct chip_band *band,
                                                              double level, const double turn[2], double height)
{
    double c = turn[0], root;
    if (height <= CHIP_MIN_CONTACT) return;
    if (c > band->ahead) band->ahead = c;
    if (!(tooth->power_weight > 0.0 || tooth->force_weight > 0.0)) return;
    root = height * in_table(tooth->root, (level * c + band->fall) * band->lean);
    band->roots += root;
    if (!(tooth->force_weight > 0.0)) return;
    band->push_ahead += root * c;
    band->push_aside += root * turn[1];
}

/* Notes a point of a strip: sine of its angle, and the height of the stock, mm. */
static inline __attribute__((always_inline)) void note_point(struct chip_tooth *tooth, double side, double height)
{
    if (!tooth || tooth->points >= CHIP_ARC_POINTS) return;
    tooth->side[tooth->points] = (float)side;
    tooth->height[tooth->points++] = (float)height;
}

/* The wall above the tool's end. */
void chip_strip_add_wall(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                         double tip, double margin, struct chip_section *section);

#pragma GCC visibility pop

#endif
