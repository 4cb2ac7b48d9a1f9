/* SPDX-License-Identifier: GPL-2.0-or-later */
/* section_strip.c - the section area of one band of a tool that moves level, or of its wall: see section_parts.h and
 * section.h; the numbers in brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_GAUSS_CELLS 2.5     /* width of a band, in cells, for which a pair of points is enough [7] */
#define CHIP_GAUSS_PARTS 4       /* pairs at most */
#define CHIP_POINTS_AHEAD 8      /* points between the one that is read and the one that is prefetched */
#define CHIP_LARGE_MAP (1 << 20) /* cells: 8 MB, more than the processor keeps near */

/* The point `ahead` mm before the axis and `lateral` mm beside it; `front`, `side`: the band's own circle there. */
static inline __attribute__((always_inline)) struct chip_point point_before(const struct chip_pose *at, double ahead,
                                                                            double lateral, double front, double side)
{
    struct chip_point point;
    point.x = at->x + ahead * at->hx - lateral * at->hy;
    point.y = at->y + ahead * at->hy + lateral * at->hx;
    point.front = front;
    point.side = side;
    return point;
}

/* [7] How far before the axis a band is read `side` mm beside the path. */
static inline __attribute__((always_inline)) double own_front(const struct chip_strip *strip, double side)
{
    double front2 = strip->middle * strip->middle - side * side;
    return front2 > 0.0 ? chip_sqrt(front2) : 0.0;
}

/* [4] How far before the axis that is clear of the cut. */
static inline __attribute__((always_inline)) double clear_front(const struct chip_pose *at,
                                                                const struct chip_strip *strip, double side)
{
    double outer = strip->outer + strip->margin;
    return chip_sqrt(outer * outer - side * side) - at->in_front;
}

/* [7] Where the stock in front of a band is read `side` mm beside the path; `front`: how far before the axis the band's own circle is
 * there, in mm. */
static inline __attribute__((always_inline)) struct chip_point
place_of(const struct chip_pose *at, const struct chip_strip *strip, double side, double front)
{
    double own = own_front(strip, side), ahead;
    if (!(strip->margin > 0.0)) return point_before(at, own, side, own, side);
    ahead = clear_front(at, strip, side);
    if (ahead <= own) return point_before(at, own, side, own, side);
    /* the same distance beside a curved path */
    return point_before(at, ahead, side + at->half_curvature * (ahead * ahead - front * front), front, side);
}

/* [7] Stock between low and the band's upper edge at a point, mm. */
static inline __attribute__((always_inline)) double met_at(const struct chip_stock *stock, const struct chip_pose *at,
                                                           struct chip_strip *strip, const struct chip_point *point,
                                                           double low)
{
    strip->nodes++;
    if (strip->edged && !CHIP_FAULTY(EDGE_SMEARED)) return chip_wall_between(stock, at, point, strip, low);
    return between(stock, at, point->x, point->y, low, strip->high);
}

/* [4] The same where a wall's stock is as well, if that is outside the cut: a wall thinner than the detour is seen there. */
static __attribute__((noinline)) double met_before(const struct chip_stock *stock, const struct chip_pose *at,
                                                   struct chip_strip *strip, double side, double low, double h)
{
    double own = own_front(strip, side), axis = own + at->in_front, outside = strip->outer + at->beside_cut;
    struct chip_point point = point_before(at, own, side, own, side);
    int walled = strip->walled;
    if (axis * axis + side * side < outside * outside || clear_front(at, strip, side) <= own) return h;
    h = chip_max(h, met_at(stock, at, strip, &point, low));
    strip->walled |= walled;
    return h;
}

/* [7] Stock between low and the band's upper edge in front of it, mm. */
static double met(const struct chip_stock *stock, const struct chip_pose *at, struct chip_strip *strip, double side,
                  double front, double low)
{
    struct chip_point point = place_of(at, strip, side, front);
    double h = met_at(stock, at, strip, &point, low);
    return strip->edged && at->in_front > 0.0 ? met_before(stock, at, strip, side, low, h) : h;
}

/* Whether the cells of the points are prefetched. Each point of a wall is in other rows, and the rows of a large map are in cache
 * lines and pages of their own. The bands of a round end read the same cells one after the other. */
static int needs_fetch(const struct chip_stock *stock, const struct chip_strip *strip)
{
    return strip->inner >= strip->outer && (long)stock->nx * stock->ny > CHIP_LARGE_MAP;
}

/* The point of a band's circle that is prefetched next, some points before the one that is read. */
struct fetch {
    double c, s; /* cosine and sine of its angle from the heading */
    int left;    /* points from there on */
};

/* Prefetches the four cells round it. */
static void fetch_next(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_strip *strip,
                       double turn_c, double turn_s, struct fetch *fetch)
{
    double c = fetch->c, s = fetch->s, r = strip->inner;
    struct chip_point point = place_of(at, strip, r * s, r * c);
    struct chip_corners corners;
    fetch->left--;
    fetch->c = c * turn_c - s * turn_s;
    fetch->s = s * turn_c + c * turn_s;
    if (!find_corners(stock, at, point.x, point.y, &corners)) return;
    __builtin_prefetch(corners.cell);
    __builtin_prefetch(corners.cell + stock->nx + 2);
}

/* [7] The band where it has its full height, between its inner edges: mm2, trapezia across the path. Where the stock
 * jumps points are inserted. `tooth`: gets the points; null: nothing asks for them. */
static inline __attribute__((always_inline)) double middle_points(const struct chip_stock *stock,
                                                                  const struct chip_pose *at, struct chip_strip *strip,
                                                                  double *highest, struct chip_tooth *tooth)
{
    int n = node_count(stock, strip->inner) / 2, i, k;
    double step = CHIP_PI / n, r = strip->inner, turn_c, turn_s, fine_c, fine_s, sum = 0.0;
    double c = 0.0, s = -1.0, last;
    struct fetch fetch = { c, s, needs_fetch(stock, strip) ? n + 1 : 0 };
    int walled;
    small_turn(step, &turn_c, &turn_s);
    small_turn(step / (CHIP_REFINE + 1), &fine_c, &fine_s);
    for (i = 0; i < CHIP_POINTS_AHEAD && fetch.left; i++) fetch_next(stock, at, strip, turn_c, turn_s, &fetch);
    last = met(stock, at, strip, -r, 0.0, strip->low);
    walled = strip->walled;
    *highest = last;
    if (tooth) tooth->points = 0;
    note_point(tooth, s, last);
    for (i = 0; i < n; i++) {
        double x = c, y = s, h;
        int was_walled = walled;
        if (fetch.left) fetch_next(stock, at, strip, turn_c, turn_s, &fetch);
        c = x * turn_c - y * turn_s;
        s = y * turn_c + x * turn_s;
        h = met(stock, at, strip, r * s, r * c, strip->low);
        if (h > *highest) *highest = h;
        walled = strip->walled;
        if (fabs(h - last) > (walled || was_walled ? CHIP_WALL_JUMP : CHIP_JUMP) * chip_max(h, last)) {
            for (k = 0; k < CHIP_REFINE; k++) {
                double next = x * fine_c - y * fine_s, side = y, before = last;
                y = y * fine_c + x * fine_s;
                x = next;
                last = met(stock, at, strip, r * y, r * x, strip->low);
                sum += (before + last) * (y - side);
                note_point(tooth, y, last);
            }
            sum += (last + h) * (s - y);
        } else {
            sum += (last + h) * (s - y);
        }
        note_point(tooth, s, h);
        last = h;
    }
    return 0.5 * r * sum;
}

/* The same, for a tool with limits and for one without: compiled apart, so that the limits cost nothing where none is asked for. */
static double middle_area(const struct chip_stock *stock, const struct chip_pose *at, struct chip_strip *strip,
                          double *highest)
{
    return at->tooth ? middle_points(stock, at, strip, highest, at->tooth)
                     : middle_points(stock, at, strip, highest, 0);
}

/* [7] If the stock is no higher than the lower part of a band, the band ends there. `highest`: contact of its
 * middle. */
static void end_at_top(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                       double tip, struct chip_strip *strip, double highest)
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

/* Sine of the angle between the normal of a band and the axis. */
static double lean_of(const struct chip_strip *strip)
{
    double rise = strip->high - strip->low, run = strip->ended - strip->inner;
    return rise / chip_sqrt(rise * rise + run * run);
}

/* [7] The band's two sides, between its inner and its outer edges: pairs of Gauss points, mm2. */
static double rim_area(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                       double tip, struct chip_strip *strip, double *highest, struct chip_section *section)
{
    double before[2] = { strip->inner, strip->inner }, nearest = strip->outer, power = 0.0, lean = 0.0;
    int parts = (int)chip_clamp(ceil((strip->outer - strip->inner) * at->per_cell / CHIP_GAUSS_CELLS), 1.0,
                                CHIP_GAUSS_PARTS),
        i, touched[2] = { 0, 0 };
    double width = (strip->outer - strip->inner) / parts, sum = 0.0;
    if (at->tooth) lean = lean_of(strip);
    for (i = 0; i < 4 * parts; i++) {
        double side = strip->inner + width * ((i >> 2) + (i & 2 ? 0.7886751345948129 : 0.21132486540518708));
        double low = chip_max(tip + chip_tool_height(tool, side), strip->low), h;
        CHIP_FAULT(CONE_AS_CYLINDERS, low = strip->low);
        if (low >= strip->high) continue;
        h = met(stock, at, strip, i & 1 ? -side : side, 0.0, low);
        if (at->tooth) {
            if (h > CHIP_MIN_CONTACT) nearest = chip_min(nearest, before[i & 1]);
            if (h > CHIP_MIN_CONTACT && at->tooth->force_weight > 0.0) {
                chip_force_rim(at, strip, lean, i & 1 ? -side : side, 0.5 * width, h, !touched[i & 1]);
                touched[i & 1] = 1;
            }
            if (h > CHIP_MIN_CONTACT && at->tooth->power_weight > 0.0)
                power += 0.5 * width * h * chip_tooth_rim_power(at->tooth, lean, side, strip->outer);
            before[i & 1] = side;
        }
        sum += 0.5 * width * h;
        if (h > 0.0) *highest = chip_max(*highest, h + low - strip->low);
    }
    if (at->tooth) chip_tooth_rim(at, tool, strip, nearest, power, section);
    return sum;
}

/* Adds a band of a tool that moves level, or the wall of any tool. */
void chip_strip_add(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                    double tip, struct chip_strip *strip, struct chip_section *section)
{
    double highest = 0.0, area = 0.0, middle;
    if (strip->high <= stock->z_min) return;
    strip->low = chip_max(strip->low, stock->z_min);
    if (strip->inner > 0.0) area = middle_area(stock, at, strip, &highest);
    middle = highest;
    if (strip->outer > strip->inner && highest < (1.0 - CHIP_LEVEL_TOP) * (strip->high - strip->low))
        end_at_top(stock, at, tool, tip, strip, highest);
    if (at->tooth && strip->inner > 0.0) chip_tooth_strip(at, tool, strip, middle, section);
    if (strip->outer > strip->inner) area += rim_area(stock, at, tool, tip, strip, &highest, section);
    section->area += area * at->level;
    section->nodes += strip->nodes;
    if (highest > 0.0) section->depth = chip_max(section->depth, highest + strip->low - tip);
}

/* The wall above the tool's end. */
void chip_strip_add_wall(const struct chip_stock *stock, const struct chip_pose *at, const struct chip_tool *tool,
                         double tip, double margin, struct chip_section *section)
{
    struct chip_strip strip = {
        tool->radius, tool->radius, tool->radius, tip + tool->shoulder, 1e301, margin, tool->radius, 1, 0, 0
    };
    if (strip.low < stock->z_max) chip_strip_add(stock, at, tool, tip, &strip, section);
}
