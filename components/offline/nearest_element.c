/* SPDX-License-Identifier: GPL-2.0-or-later */
/* nearest_element.c - see nearest_element.h. */
#include <math.h>

#include "core/fault.h"
#include "nearest_element.h"

/* The square of a distance may be this much larger than by the boxes: rounding. As a share, and mm2 */
#define SLACK 1e-6
#define SLACK_MM2 1e-8

/* Boxes that wait: all but one of each level, and the topmost. */
#define MOST_WAITING (CHIP_TREE_LEVELS * CHIP_TREE_FAN)

struct box {
    double gap2; /* mm2, square of the distance from the point */
    int64_t index;
    int level;
};

struct search {
    const struct chip_element_tree *tree;
    double x, y;
    double gap;    /* mm, of the nearest element so far */
    double bound2; /* mm2: what is further than this is left out */
    int64_t nearest;
    int waiting;
    struct box wait[MOST_WAITING];
};

static double smaller(double a, double b) { return a < b ? a : b; }

/* elements.py: _line_distances */
static double line_gap(const struct chip_element_tree *tree, int64_t k, double x, double y)
{
    const double *s = tree->start + 2 * k, *e = tree->end + 2 * k;
    double along_x = e[0] - s[0], along_y = e[1] - s[1], length2 = along_x * along_x + along_y * along_y;
    double t = ((x - s[0]) * along_x + (y - s[1]) * along_y) / (length2 > 0.0 ? length2 : 1.0);
    CHIP_FAULT(CARRIER_MEASURED, return hypot(x - s[0] - along_x * t, y - s[1] - along_y * t))
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return hypot(x - s[0] - along_x * t, y - s[1] - along_y * t);
}

/* elements.py: _arc_distances */
static double arc_gap(const struct chip_element_tree *tree, int64_t k, double x, double y)
{
    const double *s = tree->start + 2 * k, *e = tree->end + 2 * k, *c = tree->centre + 2 * k, *m = tree->middle + 2 * k;
    double vx = x - c[0], vy = y - c[1], out = hypot(vx, vy);
    double ax = x - s[0], ay = y - s[1], bx = x - e[0], by = y - e[1];
    if (vx * m[0] + vy * m[1] >= out * tree->cos_half[k]) return fabs(out - tree->radius[k]);
    return sqrt(smaller(ax * ax + ay * ay, bx * bx + by * by));
}

static void measure(struct search *a, int64_t k)
{
    double gap = a->tree->is_arc[k] ? arc_gap(a->tree, k, a->x, a->y) : line_gap(a->tree, k, a->x, a->y);
    if (!(gap < a->gap)) return;
    a->gap = gap;
    a->nearest = k;
    a->bound2 = smaller(a->bound2, gap * gap * (1.0 + SLACK) + SLACK_MM2);
}

static double box_gap2(const struct search *a, int64_t at)
{
    const double *low = a->tree->low + 2 * at, *high = a->tree->high + 2 * at;
    double x = a->x < low[0] ? low[0] - a->x : a->x > high[0] ? a->x - high[0] : 0.0;
    double y = a->y < low[1] ? low[1] - a->y : a->y > high[1] ? a->y - high[1] : 0.0;
    return x * x + y * y;
}

/* Lets the boxes from..to of a level wait, the nearest last. */
static void open_boxes(struct search *a, int level, int64_t from, int64_t to)
{
    int begin = a->waiting, k;
    int64_t i;
    for (i = from; i < to && a->waiting < MOST_WAITING; i++) {
        struct box one = { box_gap2(a, a->tree->first[level] + i), i, level };
        if (!(one.gap2 < a->bound2)) continue;
        for (k = a->waiting++; k > begin && a->wait[k - 1].gap2 < one.gap2; k--) a->wait[k] = a->wait[k - 1];
        a->wait[k] = one;
    }
}

static void descend(struct search *a)
{
    const int64_t *first = a->tree->first;
    int top = (int)a->tree->levels - 1;
    open_boxes(a, top, 0, first[top + 1] - first[top]);
    while (a->waiting) {
        struct box one = a->wait[--a->waiting];
        int64_t count, to;
        if (!(one.gap2 < a->bound2)) continue;
        if (one.level == 0) {
            measure(a, one.index);
            CHIP_FAULT(FIRST_LEAF_ONLY, return )
            continue;
        }
        count = first[one.level] - first[one.level - 1];
        to = (one.index + 1) * CHIP_TREE_FAN;
        open_boxes(a, one.level - 1, one.index * CHIP_TREE_FAN, to < count ? to : count);
    }
}

void chip_nearest_gaps(const struct chip_element_tree *tree, long m, const double *point, const double *reach,
                       double *gap)
{
    struct search a = { .tree = tree, .nearest = -1 };
    long i;
    for (i = 0; i < m; i++) {
        gap[i] = INFINITY;
        if (tree->n < 1 || tree->levels < 1 || tree->levels > CHIP_TREE_LEVELS) continue;
        a.x = point[2 * i];
        a.y = point[2 * i + 1];
        a.gap = INFINITY;
        a.bound2 = reach[i] * reach[i] * (1.0 + SLACK) + SLACK_MM2;
        if (a.nearest >= 0) measure(&a, a.nearest);
        descend(&a);
        gap[i] = a.gap;
    }
}
