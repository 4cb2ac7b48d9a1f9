/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_force.c - the side force on the edges of a section: see tooth.h; the numbers in brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_FORCE_FIRST (CHIP_FORCE_NODES / 4)    /* the angle that is beside the path on the right, */
#define CHIP_FORCE_AHEAD (CHIP_FORCE_NODES / 2)    /* the heading, */
#define CHIP_FORCE_LAST (3 * CHIP_FORCE_NODES / 4) /* and beside the path on the left */
#define CHIP_FORCE_FRONT CHIP_FORCE_FIRST          /* angles from the heading to beside the path */
#define CHIP_MOST_BRINKS 3                         /* walls at which an edge is looked at, on each side */
#define CHIP_RIM_SHARE 0.55                        /* of a rim's contact is met at once, at its mean radius */
#define CHIP_RIM_PART 0.35                         /* of a rim, from its inside: its mean angle (tooth.c) */

void chip_force_tables(struct chip_tooth *tooth)
{
    double mc = tooth->exponent, sum = 0.0;
    int i;
    for (i = 0; i <= CHIP_WEIGHTS; i++) {
        double q = (double)i / CHIP_WEIGHTS, middle = (i + 0.5) / CHIP_WEIGHTS;
        tooth->ahead[i] = (float)sum;
        tooth->aside[i] = (float)((1.0 - pow(1.0 - q * q, 1.0 - 0.5 * mc)) / (2.0 - mc));
        if (i < CHIP_WEIGHTS) sum += pow(1.0 - middle * middle, 0.5 - 0.5 * mc) / CHIP_WEIGHTS;
    }
    tooth->ahead[CHIP_WEIGHTS + 1] = tooth->ahead[CHIP_WEIGHTS];
    tooth->aside[CHIP_WEIGHTS + 1] = tooth->aside[CHIP_WEIGHTS];
    tooth->node[CHIP_WEIGHTS + 1] = CHIP_FORCE_FRONT;
    for (i = 0; i <= CHIP_WEIGHTS; i++) {
        int k = 0;
        while (k < CHIP_FORCE_FRONT && sin(k * CHIP_FORCE_STEP * CHIP_PI / 180.0) < (double)i / CHIP_WEIGHTS) k++;
        tooth->node[i] = (unsigned char)k;
    }
    for (i = 0; i < CHIP_FORCE_NODES; i++) {
        double angle = (i - CHIP_FORCE_AHEAD) * CHIP_FORCE_STEP * CHIP_PI / 180.0;
        int front = i > CHIP_FORCE_FIRST && i < CHIP_FORCE_LAST;
        tooth->sine[i] = (float)sin(angle);
        tooth->cosine[i] = (float)cos(angle);
        tooth->part[i] = front ? (float)in_table(tooth->root, cos(angle)) : 0.0f;
    }
}

/* The largest vector sum of all edges over a turn, mm, squared, of what is kept at the angles [9]. */
static double largest_sum(const struct chip_tooth *tooth)
{
    double step = (double)CHIP_FORCE_NODES / tooth->edges, most = 0.0;
    int begin = tooth->is_round ? 0 : CHIP_FORCE_FIRST, end = tooth->is_round ? CHIP_FORCE_NODES : CHIP_FORCE_LAST, i,
        j;
    for (i = begin; i < begin + step && i < end; i++) {
        double x = 0.0, y = 0.0;
        int k = i;
        for (j = 1; k < end; j++) {
            double f = tooth->force[k];
            x += f * tooth->cosine[k];
            y += f * tooth->sine[k];
            if (j == tooth->edges) break;
            k = i + (int)(j * step + 0.5);
        }
        most = chip_max(most, x * x + y * y);
    }
    return most;
}

void chip_force_slot(struct chip_tooth *tooth)
{
    int i;
    if (tooth->edges < 1) return;
    for (i = 0; i < CHIP_FORCE_NODES; i++) tooth->force[i] = tooth->part[i];
    tooth->is_round = 0;
    tooth->slot = (float)chip_sqrt(largest_sum(tooth));
}

void chip_force_begin(struct chip_tooth *tooth)
{
    int i;
    for (i = 0; i <= CHIP_FORCE_FRONT; i++) tooth->rise[0][i] = tooth->rise[1][i] = 0.0f;
    tooth->is_round = tooth->has_more = tooth->brinks[0] = tooth->brinks[1] = 0;
    tooth->push[0] = tooth->push[1] = 0.0;
}

/* Adds f to one of the angles. */
static void add_more(struct chip_tooth *tooth, int k, double f)
{
    int i;
    for (i = 0; i < CHIP_FORCE_NODES && !tooth->has_more; i++) tooth->more[i] = 0.0f;
    tooth->has_more = 1;
    tooth->more[k] += (float)f;
}

/* The number of the first angle from the heading whose sine is q or more. */
static int node_from(const struct chip_tooth *tooth, double q)
{
    int k = tooth->node[(int)(CHIP_WEIGHTS * chip_clamp(q, 0.0, 1.0))];
    while (k < CHIP_FORCE_FRONT && tooth->sine[CHIP_FORCE_AHEAD + k] < q) k++;
    return k;
}

/* Notes that f, over the power of the cosine, changes by `amount` at an angle whose sine is `at`, on the right (0) or on the left (1). */
static void note_brink(struct chip_tooth *tooth, int left, double at, double amount)
{
    struct chip_brink_force *brink;
    if (tooth->brinks[left] >= CHIP_FORCE_BRINKS || !(at < 1.0)) return;
    brink = &tooth->brink[left][tooth->brinks[left]++];
    brink->at = (float)at;
    brink->amount = (float)amount;
}

/* One step of the stock's height, of what the cells make of it over some points. */
struct step {
    double change, moment; /* mm; the same times the sine */
    double from;           /* sine of where it begins */
};

/* Ends a step: it is where it has as much area beside it as the points. */
static void end_step(struct chip_tooth *tooth, int left, double face, struct step *step, double sum[2])
{
    double q;
    if (step->change == 0.0) return;
    q = chip_clamp(step->moment / step->change, 0.0, 1.0);
    sum[0] += step->change * (tooth->ahead[CHIP_WEIGHTS] - in_table(tooth->ahead, q));
    sum[1] += (left ? step->change : -step->change) * (tooth->aside[CHIP_WEIGHTS] - in_table(tooth->aside, q));
    tooth->rise[left][node_from(tooth, q)] += (float)(face * step->change);
    note_brink(tooth, left, q, face * step->change);
    step->change = step->moment = 0.0;
}

/* Adds the points of one side (1: left) of the heading, which is point `middle`: they are stairs, each of whose steps goes on outwards. A
 * step is as wide as `width` at most, which the cells make of a wall. Beside the path the band is as high as where its points end, or it
 * touches nothing there. Returns the sums over `face` with cosine and sine. */
static void add_side(struct chip_tooth *tooth, int middle, int left, double scale, double face, double width,
                     double sum[2])
{
    struct step step = { 0.0, 0.0, 0.0 };
    double last = tooth->height[middle], last_q = 0.0;
    int i, next = left ? 1 : -1;
    sum[0] += last * tooth->ahead[CHIP_WEIGHTS];
    sum[1] += next * last * tooth->aside[CHIP_WEIGHTS];
    tooth->rise[left][0] += (float)(face * last);
    if (last > 0.0) note_brink(tooth, left, 0.0, face * last);
    for (i = middle + next; i >= 0 && i < tooth->points; i += next) {
        double change = tooth->height[i] - last, q = scale * fabs(tooth->side[i]);
        if (change * step.change <= 0.0 || q - step.from > width) end_step(tooth, left, face, &step, sum);
        if (change != 0.0) {
            if (step.change == 0.0) step.from = last_q;
            step.change += change;
            step.moment += 0.5 * change * (q + last_q);
            last = tooth->height[i];
        }
        last_q = q;
    }
    end_step(tooth, left, face, &step, sum);
}

void chip_force_strip(struct chip_tooth *tooth, int middle, double scale, double face, double width)
{
    double sum[2] = { 0.0, 0.0 };
    if (tooth->points < 2) return;
    add_side(tooth, middle, 0, scale, face, width, sum);
    add_side(tooth, middle, 1, scale, face, width, sum);
    tooth->push[0] += face * sum[0];
    tooth->push[1] += face * sum[1];
}

void chip_force_add(struct chip_tooth *tooth, double from, double to, double f)
{
    int k;
    tooth->is_round = 1;
    for (k = (int)ceil(from); k < to; k++)
        add_more(tooth, k < CHIP_FORCE_NODES ? (k < 0 ? 0 : k) : (k - CHIP_FORCE_NODES) % CHIP_FORCE_NODES, f);
}

void chip_force_column(struct chip_tooth *tooth, int i, int n, double length, double fall)
{
    double f = length * in_table(tooth->root, fall), step = (double)CHIP_FORCE_NODES / n;
    chip_force_add(tooth, CHIP_FORCE_AHEAD + (i - 0.5) * step, CHIP_FORCE_AHEAD + (i + 0.5) * step, f);
}

/* Adds a band that touches stock from `beside` mm beside the path outwards, `amount` what its contact counts for in the heading, to the
 * angles. Where it does so at its tip it does everywhere on that side. */
static void add_rim(struct chip_tooth *tooth, int left, double beside, double outer, double amount)
{
    int k;
    for (k = CHIP_FORCE_LAST - 1; k > CHIP_FORCE_AHEAD && tooth->sine[k] * outer > beside; k--) {
        double share = beside > 0.0 ? (outer - beside / tooth->sine[k]) / (outer - beside) : 1.0;
        add_more(tooth, left ? k : 2 * CHIP_FORCE_AHEAD - k, amount * share * tooth->part[k]);
    }
    if (!(beside > 0.0)) add_more(tooth, CHIP_FORCE_AHEAD, 0.5 * amount); /* half from each side */
    note_brink(tooth, left, beside / (0.5 * (beside + outer)), beside > 0.0 ? CHIP_RIM_SHARE * amount : amount);
}

void chip_force_rim(const struct chip_pose *at, const struct chip_strip *strip, double lean, double side, double width,
                    double height, int is_first)
{
    struct chip_tooth *tooth = at->tooth;
    int left = side > 0.0, end = strip->inner > 0.0 ? (left ? tooth->points - 1 : 0) : -1;
    double beside = fabs(side), r, q, c, face, root, sum, from;
    if (end >= 0 && tooth->height[end] > CHIP_MIN_CONTACT) return;
    r = beside + CHIP_RIM_PART * (strip->outer - beside);
    q = beside / r;
    c = chip_sqrt(1.0 - q * q);
    face = chip_max(1e-3, lean * c);
    sum = height * in_table(tooth->root, face) / face * width / r;
    tooth->push[0] += sum * c;
    tooth->push[1] += left ? sum * q : -sum * q;
    if (!is_first) return;
    root = in_table(tooth->root, lean) / lean;
    from = strip->inner + width * floor((beside - strip->inner) / width);
    if (!(from > 0.0)) height = chip_min(strip->high - strip->low, height * strip->outer / (strip->outer - beside));
    add_rim(tooth, left, from, strip->outer, height * root);
}

/* f at an angle, in steps from behind, mm. */
static double kept_at(const struct chip_tooth *tooth, double u)
{
    int k;
    if (u >= CHIP_FORCE_NODES) u -= CHIP_FORCE_NODES;
    k = (int)u;
    if (k < 0 || k >= CHIP_FORCE_NODES) return 0.0;
    return tooth->force[k] + (u - k) * (tooth->force[k + 1 < CHIP_FORCE_NODES ? k + 1 : 0] - tooth->force[k]);
}

/* [10] The vector sum, squared, with one edge at a brink. */
static double sum_at_brink(const struct chip_tooth *tooth, int left, int number)
{
    double q = tooth->brink[left][number].at, c = chip_sqrt(1.0 - q * q), f = 0.0, x, y, angle;
    int i;
    for (i = 0; i < tooth->brinks[left]; i++)
        if (tooth->brink[left][i].at < q || (tooth->brink[left][i].at == q && tooth->brink[left][i].amount > 0.0f))
            f += tooth->brink[left][i].amount;
    f *= in_table(tooth->root, c);
    x = f * c;
    y = left ? f * q : -f * q;
    angle = CHIP_FORCE_AHEAD + (left ? 1.0 : -1.0) * asin(q) * 180.0 / (CHIP_PI * CHIP_FORCE_STEP);
    for (i = 1; i < tooth->edges; i++) {
        double u = angle + (double)i * CHIP_FORCE_NODES / tooth->edges, g, phi;
        if (u >= CHIP_FORCE_NODES) u -= CHIP_FORCE_NODES;
        g = kept_at(tooth, u);
        if (!(g > 0.0)) continue;
        phi = (u - CHIP_FORCE_AHEAD) * CHIP_FORCE_STEP * CHIP_PI / 180.0;
        x += g * cos(phi);
        y += g * sin(phi);
    }
    return x * x + y * y;
}

/* [10] The largest one with an edge at a brink of one side; the CHIP_MOST_BRINKS strongest are looked at. */
static double largest_at_brinks(const struct chip_tooth *tooth, int left)
{
    double most = 0.0, bound = 1e300;
    int i, k;
    for (k = 0; k < CHIP_MOST_BRINKS; k++) {
        double next = 0.0;
        int best = -1;
        for (i = 0; i < tooth->brinks[left]; i++) {
            const struct chip_brink_force *brink = &tooth->brink[left][i];
            double f = brink->at > 0.0f ? brink->amount * (1.0 - brink->at) : 0.0;
            if (f > next && f < bound) {
                next = f;
                best = i;
            }
        }
        if (best < 0) break;
        bound = next;
        most = chip_max(most, sum_at_brink(tooth, left, best));
    }
    return most;
}

/* [10] Sums the stairs up, from the heading outwards. */
static void fill_angles(struct chip_tooth *tooth)
{
    int side, k;
    for (k = 0; k < CHIP_FORCE_FIRST && tooth->is_round; k++) {
        tooth->force[k] = tooth->more[k];
        tooth->force[CHIP_FORCE_NODES - 1 - k] = tooth->more[CHIP_FORCE_NODES - 1 - k];
    }
    for (side = 0; side < 2; side++) {
        double sum = 0.0;
        for (k = 0; k <= CHIP_FORCE_FRONT; k++) {
            int at = side ? CHIP_FORCE_AHEAD + k : CHIP_FORCE_AHEAD - k;
            sum += tooth->rise[side][k];
            if (!k && side) sum = 0.5 * (sum + tooth->rise[0][0]);
            tooth->force[at] = (float)(sum * tooth->part[at]) + (tooth->has_more ? tooth->more[at] : 0.0f);
            if (!k && side) sum = tooth->rise[1][0];
        }
    }
}

void chip_force_end(struct chip_tooth *tooth, struct chip_section *section)
{
    double most;
    fill_angles(tooth);
    most = chip_max(largest_at_brinks(tooth, 0), largest_at_brinks(tooth, 1));
    CHIP_FAULT(NO_BRINKS, most = 0.0);
    section->side_force = chip_sqrt(chip_max(most, largest_sum(tooth)));
    section->mean_force =
        tooth->edges * chip_sqrt(tooth->push[0] * tooth->push[0] + tooth->push[1] * tooth->push[1]) / (2.0 * CHIP_PI);
}

double chip_force_full(const struct chip_tool *tool, const double dir[3], double depth)
{
    const struct chip_tooth *tooth = tool->tooth;
    double level = chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]);
    double end =
        dir[2] < 0.0 ? tool->radius * in_table(tooth->root, -dir[2]) * chip_max(1.0, tooth->edges / CHIP_PI) : 0.0;
    return depth * tooth->slot * in_table(tooth->root, level) + end;
}
