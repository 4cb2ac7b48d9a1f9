/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tooth_force.c - the side force on the edges of a section: see tooth.h; the numbers in brackets are those of its principle. */
#include "section_parts.h"

#define CHIP_FORCE_FRONT CHIP_FORCE_FIRST /* angles from the heading to beside the path */
#define CHIP_RIM_SHARE 0.55               /* of a rim's contact is met at once, at its mean radius */
#define CHIP_RIM_PART 0.35                /* of a rim, from its inside: its mean angle (tooth.c) */

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
    tooth->is_round = tooth->has_more = tooth->has_end = tooth->brinks[0] = tooth->brinks[1] = 0;
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

/* One step of the stock's height, of what the cells make of it over some points. */
struct step {
    double change, moment; /* mm; the same times the sine */
    double from;           /* sine of where it begins */
};

/* One side of the points: 1: left; what a height counts for there; what rises at the angles, over the unit of the face. */
struct stairs {
    int left;
    struct chip_face face;
    float *rise;
};

/* Ends a step: it is where it has as much area beside it as the points. */
static void end_step(struct chip_tooth *tooth, const struct stairs *stairs, struct step *step, double sum[2])
{
    double q;
    if (step->change == 0.0) return;
    q = chip_clamp(step->moment / step->change, 0.0, 1.0);
    sum[0] += step->change * (tooth->ahead[CHIP_WEIGHTS] - in_table(tooth->ahead, q));
    sum[1] += (stairs->left ? step->change : -step->change) * (tooth->aside[CHIP_WEIGHTS] - in_table(tooth->aside, q));
    stairs->rise[chip_force_node_from(tooth, q)] += (float)(stairs->face.unit * step->change);
    chip_brink_note(tooth, stairs->left, q, step->change, &stairs->face);
    step->change = step->moment = 0.0;
}

/* Adds the points of one side of the heading, which is point `middle`: they are stairs, each of whose steps goes on outwards. A
 * step is as wide as `width` at most, which the cells make of a wall. Beside the path the band is as high as where its points end, or it
 * touches nothing there. Adds to the sums, over the face, with cosine and sine. */
static void add_side(struct chip_tooth *tooth, int middle, const struct stairs *stairs, double scale, double width,
                     double sum[2])
{
    struct step step = { 0.0, 0.0, 0.0 };
    double last = tooth->height[middle], last_q = 0.0;
    int i, next = stairs->left ? 1 : -1;
    sum[0] += last * tooth->ahead[CHIP_WEIGHTS];
    sum[1] += next * last * tooth->aside[CHIP_WEIGHTS];
    stairs->rise[0] += (float)(stairs->face.unit * last);
    if (last > 0.0) chip_brink_note(tooth, stairs->left, 0.0, last, &stairs->face);
    for (i = middle + next; i >= 0 && i < tooth->points; i += next) {
        double change = tooth->height[i] - last, q = scale * fabs(tooth->side[i]);
        if (change * step.change <= 0.0 || q - step.from > width) end_step(tooth, stairs, &step, sum);
        if (change != 0.0) {
            if (step.change == 0.0) step.from = last_q;
            step.change += change;
            step.moment += 0.5 * change * (q + last_q);
            last = tooth->height[i];
        }
        last_q = q;
    }
    end_step(tooth, stairs, &step, sum);
}

void chip_force_strip(struct chip_tooth *tooth, int middle, double scale, double face, double width)
{
    struct stairs right = { 0, { face, 1.0, 0.0, face }, tooth->rise[0] },
                  left = { 1, { face, 1.0, 0.0, face }, tooth->rise[1] };
    double sum[2] = { 0.0, 0.0 };
    if (tooth->points < 2) return;
    add_side(tooth, middle, &right, scale, width, sum);
    add_side(tooth, middle, &left, scale, width, sum);
    tooth->push[0] += face * sum[0];
    tooth->push[1] += face * sum[1];
}

/* Adds one side of a band of a tool that falls or rises. */
static void add_band_side(struct chip_tooth *tooth, int middle, int side, const struct chip_face *face, double width)
{
    float rise[CHIP_FORCE_FRONT + 1] = { 0.0f };
    struct stairs stairs = { side, *face, rise };
    double unused[2] = { 0.0, 0.0 }, sum = 0.0;
    int k;
    add_side(tooth, middle, &stairs, 1.0, width, unused);
    for (k = 0; k <= CHIP_FORCE_FRONT; k++) {
        int at = CHIP_FORCE_AHEAD + (side ? k : -k);
        sum += rise[k];
        if (sum > 0.0)
            add_more(tooth, at, (k ? 1.0 : 0.5) * sum * face_at(tooth, face->scale, face->off, tooth->cosine[at]));
    }
}

void chip_force_band(struct chip_tooth *tooth, const struct chip_band *band, double level, int middle, double width)
{
    struct chip_face face = { 1.0 / band->lean, level * band->lean, band->fall * band->lean, 0.0 };
    if (tooth->points < 2) return;
    CHIP_FAULT(BANDS_SPREAD, width = 0.0);
    face.ahead = face.unit * face_at(tooth, face.scale, face.off, 1.0);
    tooth->is_round = 1;
    add_band_side(tooth, middle, 0, &face, width);
    add_band_side(tooth, middle, 1, &face, width);
}

/* Adds f in mm to the angles from `from` to `to`, in steps from behind the tool. */
static void add_span(struct chip_tooth *tooth, float f[CHIP_FORCE_NODES], double from, double to, double amount)
{
    int k;
    tooth->is_round = 1;
    for (k = (int)ceil(from); k < to; k++)
        f[k < CHIP_FORCE_NODES ? (k < 0 ? 0 : k) : (k - CHIP_FORCE_NODES) % CHIP_FORCE_NODES] += (float)amount;
}

void chip_force_behind(struct chip_tooth *tooth, const struct chip_band *band, double level, int i, int n,
                       double height)
{
    double from = (i - 0.5) * CHIP_FORCE_NODES / n, to = (i + 0.5) * CHIP_FORCE_NODES / n;
    int k;
    if (!(tooth->force_weight > 0.0) || height <= CHIP_MIN_CONTACT) return;
    tooth->is_round = 1;
    for (k = (int)ceil(from); k < to; k++) {
        int at = k < CHIP_FORCE_NODES ? (k < 0 ? 0 : k) : (k - CHIP_FORCE_NODES) % CHIP_FORCE_NODES;
        if (at >= CHIP_FORCE_FIRST && at <= CHIP_FORCE_LAST) continue;
        add_more(tooth, at,
                 height / band->lean * face_at(tooth, level * band->lean, band->fall * band->lean, tooth->cosine[at]));
    }
}

void chip_force_column(struct chip_tooth *tooth, int i, int n, double length, double fall)
{
    double f = length * in_table(tooth->root, fall), step = (double)CHIP_FORCE_NODES / n;
    int k;
    for (k = 0; k < CHIP_FORCE_NODES && !tooth->has_end; k++) tooth->end[k] = 0.0f;
    tooth->has_end = 1;
    add_span(tooth, tooth->end, CHIP_FORCE_AHEAD + (i - 0.5) * step, CHIP_FORCE_AHEAD + (i + 0.5) * step, f);
}

/* Adds a band that touches stock from `beside` mm beside the path outwards, `amount` what its contact counts for in the heading, to the
 * angles. Where it does so at its tip it does everywhere on that side. */
static void add_rim(struct chip_tooth *tooth, int left, double beside, double outer, double amount)
{
    const struct chip_face face = { 1.0, 1.0, 0.0, 1.0 };
    int k;
    for (k = CHIP_FORCE_LAST - 1; k > CHIP_FORCE_AHEAD && tooth->sine[k] * outer > beside; k--) {
        double share = beside > 0.0 ? (outer - beside / tooth->sine[k]) / (outer - beside) : 1.0;
        add_more(tooth, left ? k : 2 * CHIP_FORCE_AHEAD - k, amount * share * tooth->part[k]);
    }
    if (!(beside > 0.0)) add_more(tooth, CHIP_FORCE_AHEAD, 0.5 * amount); /* half from each side */
    chip_brink_note(tooth, left, beside / (0.5 * (beside + outer)), beside > 0.0 ? CHIP_RIM_SHARE * amount : amount,
                    &face);
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

/* [10] Sums the stairs up, from the heading outwards. */
static void fill_angles(struct chip_tooth *tooth)
{
    int side, k;
    for (k = 0; k < CHIP_FORCE_FIRST && tooth->is_round; k++) {
        tooth->force[k] = tooth->has_more ? tooth->more[k] : 0.0f;
        tooth->force[CHIP_FORCE_NODES - 1 - k] = tooth->has_more ? tooth->more[CHIP_FORCE_NODES - 1 - k] : 0.0f;
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
    for (k = 0; k < CHIP_FORCE_NODES && tooth->has_end; k++) tooth->force[k] += tooth->end[k];
}

void chip_force_end(struct chip_tooth *tooth, struct chip_section *section)
{
    double most;
    fill_angles(tooth);
    most = chip_brink_largest(tooth);
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
