/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth.c - the chip and the power of a strip of the tool: see tooth.h; the numbers in brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_WEIGHT_CHANGE                                                                                             \
    0.002 /* of a weight: less is not worth another look at the samples, and no limit is so exact */
/* of the highest contact of a strip: less has no chip of its own, it is a sliver that the cells invent [4] */
#define CHIP_LEAST_CONTACT 0.05
/* cells behind the first contact over which the edge of the stock is searched, as far as the map spreads it: read before the tool is
 * near, and clear of its cut; more hides a low shelf before a wall [4] */
#define CHIP_EDGE 1.0
#define CHIP_EDGE_CLEAR 2.0
#define CHIP_WALL_SPREAD 3.0 /* cells beside the path over which the cells spread a wall that is met at an angle [10] */
#define CHIP_RISING 1.001    /* times the highest point so far: more is higher */
#define CHIP_INNER_PART                                                                                                \
    0.35 /* of a rim, from its inside: there n . d has the mean of its weight, (1 - mc / 2)^(2 / mc) [3] */
#define CHIP_LEAST_FACE 1e-3 /* n . d of less has no chip */

/* Makes the tables of an exponent [3]: between two steps (1 - q)^(-mc / 2) is integrated and (1 + q)^(-mc / 2) is that of the middle. */
static void make_tables(struct chip_tooth *tooth)
{
    double half = 0.5 * tooth->exponent, sum = 0.0, last = 1.0;
    int i;
    for (i = 0; i <= CHIP_WEIGHTS; i++) {
        tooth->weight[i] = (float)sum;
        tooth->root[i] = (float)pow((double)i / CHIP_WEIGHTS, 1.0 - tooth->exponent);
        if (i < CHIP_WEIGHTS) {
            double next = pow(1.0 - (i + 1.0) / CHIP_WEIGHTS, 1.0 - half);
            sum += pow(1.0 + (i + 0.5) / CHIP_WEIGHTS, -half) * (last - next) / (1.0 - half);
            last = next;
        }
    }
    tooth->weight[CHIP_WEIGHTS + 1] = tooth->weight[CHIP_WEIGHTS];
    tooth->root[CHIP_WEIGHTS + 1] = tooth->root[CHIP_WEIGHTS];
    chip_force_tables(tooth);
    tooth->made = 1;
}

/* A weight that may be used; 0 for any other. */
static double weight_of(double given) { return chip_min(chip_setting(given), CHIP_MAX_TOOTH_LOAD); }

/* Whether a weight differs from the one in use. */
static int differs(double given, double used)
{
    return (given > 0.0) != (used > 0.0) || fabs(given - used) > CHIP_WEIGHT_CHANGE * used;
}

/* Whether the weights are those given last. */
static int is_given(const struct chip_tooth *tooth, const struct chip_tooth_weights *weights)
{
    const struct chip_tooth_weights *given = &tooth->given;
    return weights->chip == given->chip && weights->power == given->power && weights->force == given->force
        && weights->exponent == given->exponent && weights->edges == given->edges;
}

/* Tables of another exponent, and of another number of edges, if power or force are limited: then both are read anew. */
static void follow_tables(struct chip_tooth *tooth, double exponent, int edges)
{
    if (!tooth->made || exponent != tooth->exponent) {
        tooth->exponent = exponent;
        make_tables(tooth);
        tooth->power_weight = tooth->force_weight = 0.0;
        tooth->edges = 0;
    }
    if (edges != tooth->edges) {
        tooth->edges = edges;
        chip_force_slot(tooth);
        tooth->force_weight = 0.0;
    }
}

int chip_tooth_set(struct chip_tooth *tooth, const struct chip_tooth_weights *weights)
{
    double chip, power, force, edges, exponent = weights->exponent;
    int begins;
    if (is_given(tooth, weights)) return CHIP_TOOTH_SAME;
    tooth->given = *weights;
    chip = weight_of(weights->chip);
    power = weight_of(weights->power);
    force = weight_of(weights->force);
    edges = chip_min(chip_setting(weights->edges), CHIP_FORCE_EDGES);
    if (!chip_finite(exponent) || exponent < 0.0 || exponent > CHIP_MAX_EXPONENT) power = force = exponent = 0.0;
    if (edges < 1.0) force = 0.0;
    if (power > 0.0 || force > 0.0) follow_tables(tooth, exponent, force > 0.0 ? (int)(edges + 0.5) : tooth->edges);
    if (!differs(chip, tooth->chip_weight) && !differs(power, tooth->power_weight)
        && !differs(force, tooth->force_weight))
        return CHIP_TOOTH_SAME;
    begins = (chip > 0.0 && !(tooth->chip_weight > 0.0)) || (power > 0.0 && !(tooth->power_weight > 0.0))
          || (force > 0.0 && !(tooth->force_weight > 0.0));
    tooth->chip_weight = chip;
    tooth->power_weight = power;
    tooth->force_weight = force;
    return begins ? CHIP_TOOTH_BEGUN : CHIP_TOOTH_CHANGED;
}

double chip_tooth_full_area(const struct chip_tool *tool, const double dir[3], double depth)
{
    const struct chip_tooth *tooth = tool->tooth;
    double level = chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]);
    double slot = 2.0 * tool->radius * depth * tooth->weight[CHIP_WEIGHTS] * in_table(tooth->root, level);
    return slot + (dir[2] < 0.0 ? CHIP_PI * tool->radius * tool->radius * in_table(tooth->root, -dir[2]) : 0.0);
}

/* Sine of the angle between the tool's surface at r and its axis, 1: a wall. */
static double lean_at(const struct chip_tool *tool, double r)
{
    double slope = chip_tool_slope(tool, r);
    return slope / chip_sqrt(1.0 + slope * slope);
}

/* [4] Sine of the angle where the stock begins on one side (step -1: right, 1: left) of the heading, which is point `middle`; 1: nothing
 * is met. `low`: set if there is contact before that is too low. */
static double edge_on(const struct chip_tooth *tooth, int middle, int step, double least, double window, int *low)
{
    double sum = 0.0, top = 0.0, to_top = 1.0, begin = -1.0, last_s = fabs(tooth->side[middle]),
           last = tooth->height[middle];
    int i;
    i = middle + step;
    while (i >= 0 && i < tooth->points && tooth->height[i] == 0.0f && last == 0.0) i += step;
    if (i < 0 || i >= tooth->points) return 1.0;
    last_s = fabs(tooth->side[i - step]);
    for (; i >= 0 && i < tooth->points; i += step) {
        double s = fabs(tooth->side[i]), h = tooth->height[i];
        if (begin < 0.0 && h > least) {
            begin = s;
            *low |= sum > 0.0;
        }
        sum += 0.5 * (h + last) * (s - last_s);
        if (h > CHIP_RISING * top) {
            top = h;
            to_top = s - sum / h;
        }
        CHIP_FAULT(CHIP_WHERE_TOUCHED, to_top = 0.0);
        if (begin >= 0.0 && s >= begin + window) break;
        last = h;
        last_s = s;
    }
    if (begin >= 0.0) return chip_min(1.0, chip_max(begin, to_top));
    *low |= sum > 0.0;
    return 1.0;
}

/* The point in the heading. */
static int find_middle(const struct chip_tooth *tooth)
{
    int middle = tooth->points / 2;
    while (middle > 0 && tooth->side[middle] > 1e-6f) middle--;
    while (middle + 1 < tooth->points && tooth->side[middle] < -1e-6f) middle++;
    return middle;
}

/* [4] The highest point as it is seen along the path: times its n . d. */
static double highest_ahead(const struct chip_tooth *tooth)
{
    float most2 = 0.0f;
    int i;
    for (i = 0; i < tooth->points; i++) {
        float s = tooth->side[i], h = tooth->height[i], seen2 = h * h * (1.0f - s * s);
        if (seen2 > most2) most2 = seen2;
    }
    return chip_sqrt(most2);
}

/* [1] [4] Largest n . d of the points, over that at the heading of a wall of this radius. */
static double chip_of_points(const struct chip_tooth *tooth, const struct chip_pose *at, const struct chip_strip *strip,
                             double highest)
{
    double least = chip_max(CHIP_MIN_CONTACT, CHIP_LEAST_CONTACT * highest), edge = 1.0;
    double window = (strip->margin > 0.0 ? CHIP_EDGE_CLEAR : CHIP_EDGE) / (at->per_cell * strip->inner);
    int middle = find_middle(tooth), is_wall = strip->inner >= strip->ended, k;
    for (k = 0; k < 2; k++) {
        int low = tooth->height[middle] > CHIP_MIN_CONTACT;
        if (tooth->height[middle] > least) return 1.0;
        edge = chip_min(edge, edge_on(tooth, middle, -1, least, window, &low));
        edge = chip_min(edge, edge_on(tooth, middle, 1, least, window, &low));
        if (!low || !is_wall) break;
        /* `highest` may be of a wall beside the path, which has hardly any chip: then a low floor counts; bands are low themselves */
        least = chip_max(CHIP_MIN_CONTACT, CHIP_LEAST_CONTACT * highest_ahead(tooth));
    }
    edge *= strip->inner / strip->outer;
    return chip_sqrt(chip_max(0.0, 1.0 - edge * edge));
}

/* [3] The weight's integral from the heading to point i, on a surface whose radius is the strip's inner one over `scale`. */
static double weight_at(const struct chip_tooth *tooth, int i, double scale)
{
    double q = scale * tooth->side[i], w = in_table(tooth->weight, fabs(q));
    return q < 0.0 ? -w : w;
}

/* [3] The area of the points, weighted: mm2, for a surface of radius r. Between points of one height the weight's integral is all it
 * takes. */
static double power_of_points(const struct chip_tooth *tooth, double inner, double r)
{
    double sum = 0.0, scale = inner / r, begin = weight_at(tooth, 0, scale);
    const float *height = tooth->height;
    int i, last = tooth->points - 1;
    for (i = 1; i <= last; i++) {
        double h = height[i - 1], w;
        if (height[i] == height[i - 1] && i < last) continue;
        if (h != height[i] && i > 1) { /* up to the point before the height is h */
            w = weight_at(tooth, i - 1, scale);
            sum += 2.0 * h * (w - begin);
            begin = w;
        }
        w = weight_at(tooth, i, scale);
        sum += (h + height[i]) * (w - begin);
        begin = w;
    }
    return 0.5 * r * sum;
}

void chip_tooth_strip(const struct chip_pose *at, const struct chip_tool *tool, const struct chip_strip *strip,
                      double highest, struct chip_section *section)
{
    struct chip_tooth *tooth = at->tooth;
    int is_wall = strip->inner >= strip->ended;
    if (!(highest > CHIP_MIN_CONTACT)) return;
    if (tooth->chip_weight > 0.0) {
        double lean = is_wall ? 1.0 : lean_at(tool, strip->outer);
        section->chip = chip_max(section->chip, at->level * lean * chip_of_points(tooth, at, strip, highest));
    }
    if (tooth->power_weight > 0.0 || tooth->force_weight > 0.0) {
        double run = strip->outer - strip->inner, rise = chip_min(strip->high - strip->low, chip_max(highest, 1e-6)),
               lean = 1.0, face;
        double r =
            chip_max(strip->outer < strip->ended ? 0.5 * (strip->inner + strip->outer) : strip->middle, strip->inner);
        if (!is_wall) lean = chip_max(rise / chip_sqrt(rise * rise + run * run), CHIP_LEAST_FACE);
        face = (is_wall ? 1.0 : in_table(tooth->root, lean) / lean)
             * (at->level < 1.0 ? in_table(tooth->root, at->level) : 1.0);
        if (tooth->power_weight > 0.0) section->power_area += power_of_points(tooth, strip->inner, r) * face;
        if (tooth->force_weight > 0.0)
            chip_force_strip(tooth, find_middle(tooth), strip->inner / r, face, CHIP_WALL_SPREAD / (at->per_cell * r));
    }
}

void chip_tooth_rim(const struct chip_pose *at, const struct chip_tool *tool, const struct chip_strip *strip,
                    double nearest, double power, struct chip_section *section)
{
    section->power_area += at->level * power;
    if (at->tooth->chip_weight > 0.0 && nearest < strip->outer) {
        double q = nearest / strip->outer;
        section->chip = chip_max(section->chip, at->level * lean_at(tool, strip->outer) * chip_sqrt(1.0 - q * q));
    }
}

double chip_tooth_rim_power(const struct chip_tooth *tooth, double lean, double side, double outer)
{
    double wide = CHIP_INNER_PART * (outer - side), face;
    face = chip_max(CHIP_LEAST_FACE, lean * chip_sqrt(wide * (2.0 * side + wide)) / (side + wide));
    return in_table(tooth->root, face) / face;
}

void chip_tooth_columns(const struct chip_pose *at, const struct chip_band *band, double step,
                        struct chip_section *section)
{
    double steepest = chip_max(at->level * band->ahead * band->lean_edge[0] + band->down * band->flat_edge[0],
                               at->level * band->ahead * band->lean_edge[1] + band->down * band->flat_edge[1]);
    if (band->ahead < -1.0) return;
    if (at->tooth->force_weight > 0.0)
        chip_force_band(at->tooth, band, at->level, find_middle(at->tooth),
                        CHIP_WALL_SPREAD / (at->per_cell * band->radius));
    section->power_area += band->roots / band->lean * step * band->radius;
    at->tooth->push[0] += band->push_ahead / band->lean * step;
    at->tooth->push[1] += band->push_aside / band->lean * step;
    section->chip = chip_max(section->chip, chip_clamp(steepest, 0.0, 1.0));
}

void chip_tooth_band(const struct chip_tool *tool, const struct chip_tool_ring *ring, double down,
                     struct chip_band *band)
{
    /* just outside of the inner edge: a point in the axis has the slope of its cone there, a ball none [5] */
    double inner = chip_max(ring->inner * (1.0 + 1e-9), ring->outer * 1e-9);
    band->lean = ring->rise / chip_sqrt(ring->rise * ring->rise + ring->run * ring->run);
    band->lean_edge[0] = lean_at(tool, inner);
    band->lean_edge[1] = lean_at(tool, ring->outer * (1.0 - 1e-9));
    band->flat_edge[0] = chip_sqrt(chip_max(0.0, 1.0 - band->lean_edge[0] * band->lean_edge[0]));
    band->flat_edge[1] = chip_sqrt(chip_max(0.0, 1.0 - band->lean_edge[1] * band->lean_edge[1]));
    band->down = down;
    band->ahead = -2.0;
    band->roots = band->push_ahead = band->push_aside = 0.0;
}

void chip_tooth_end(const struct chip_pose *at, double contact, double fall, struct chip_section *section)
{
    if (!(contact > 0.0)) return;
    section->power_area += at->tooth->power_weight > 0.0 ? contact * in_table(at->tooth->root, fall) : 0.0;
    section->chip = chip_max(section->chip, fall);
}
