/* SPDX-License-Identifier: GPL-2.0-or-later */
/* clamp.c - clamps in force, bodies of the tool, distance: see clamp.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "chip_math.h"
#include "clamp.h"

#define CHIP_CLAMP_UNIT 1e-6 /* by which the squares of cosine and sine may differ from 1 in sum */

static int is_place(double mm) { return fabs(mm) <= CHIP_CLAMP_MOST_COORDINATE; }

static int is_size(double mm) { return mm > 0.0 && mm <= CHIP_CLAMP_MOST_COORDINATE; }

/* [8] Whether every number of a table can be one of a clamp. */
static int is_sound(const struct chip_clamp_table *table)
{
    uint64_t i;
    if (table->count > CHIP_CLAMPS || !(table->clearance >= 0.0 && table->clearance <= CHIP_CLAMP_MOST_CLEARANCE))
        return 0;
    for (i = 0; i < table->count; i++) {
        const struct chip_clamp *clamp = &table->clamp[i];
        double unit = clamp->cosine * clamp->cosine + clamp->sine * clamp->sine - 1.0;
        if (!is_place(clamp->x) || !is_place(clamp->y) || !is_place(clamp->top) || !is_size(clamp->half_x)
            || !is_size(clamp->half_y) || !(fabs(unit) <= CHIP_CLAMP_UNIT) || clamp->is_round > 1)
            return 0;
    }
    return 1;
}

void chip_clamps_begin(struct chip_clamps *clamps)
{
    uint64_t i;
    for (i = 0; i < clamps->table.count && i < CHIP_CLAMPS; i++)
        clamps->allowed[i][0] = clamps->allowed[i][1] = 2.0 * CHIP_CLAMP_UNSET;
}

int chip_clamps_take(struct chip_clamps *clamps, const struct chip_clamp_table *table)
{
    uint64_t generation = table ? table->generation : clamps->seen;
    if (generation == clamps->seen || generation % 2) return clamps->table.count != 0;
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    memcpy(&clamps->next, (const void *)table, sizeof clamps->next);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    if (table->generation != generation)
        return clamps->table.count != 0; /* it is being written: again in the next period */
    clamps->seen = generation;
    clamps->refused = !is_sound(&clamps->next) && !CHIP_FAULTY(CLAMPS_TRUSTED);
    if (clamps->refused) return clamps->table.count != 0;
    memcpy(&clamps->table, &clamps->next, sizeof clamps->table);
    chip_clamps_begin(clamps);
    return clamps->table.count != 0;
}

static void add_line(struct chip_clamp_body *body, double a, double b)
{
    if (body->lines >= CHIP_CLAMP_LINES) return;
    body->a[body->lines] = a;
    body->b[body->lines] = b;
    body->share[body->lines++] = 1.0 / (1.0 + b);
}

/* [1] Cutter and shank: the cylinder, tangents of the arc, the cone. */
static void build_cutter(struct chip_clamp_body *body, const struct chip_tool *tool)
{
    double half = tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0, corner = tool->corner;
    double flat = tool->slope > 0.0 ? 0.0 : tool->radius - corner;
    int k;
    body->begins = 0.0;
    body->radius = tool->radius;
    body->lines = 0;
    add_line(body, tool->radius, 0.0);
    for (k = tool->slope > 0.0 ? 0 : 1; k <= CHIP_CLAMP_TANGENTS; k++) { /* the first one is the cone */
        double angle = half + (0.5 * CHIP_PI - half) * k / (CHIP_CLAMP_TANGENTS + 1), steep = tan(angle);
        if (k > 0 && !(corner > 0.0)) break;
        add_line(body, flat + corner * (cos(angle) + sin(angle) * steep) - steep * corner, steep);
    }
}

void chip_clamps_build(struct chip_clamps *clamps, const struct chip_tool *tool, double stick_out,
                       double holder_diameter)
{
    double built[6] = { tool ? tool->radius : 0.0, tool ? tool->corner : 0.0,
                        tool ? tool->slope : 0.0,  stick_out,
                        holder_diameter,           0.0 };
    struct chip_clamp_body *holder = &clamps->body[1];
    if (clamps->bodies && !memcmp(built, clamps->built, sizeof built)) return;
    memcpy(clamps->built, built, sizeof built);
    clamps->bodies = 1;
    chip_clamps_begin(clamps);
    if (tool)
        build_cutter(&clamps->body[0], tool);
    else {
        clamps->body[0].begins = clamps->body[0].radius = 0.0;
        clamps->body[0].lines = 0;
        add_line(&clamps->body[0], 0.0, 0.0);
    }
    if (!(stick_out >= 0.0 && is_place(stick_out)) || !is_size(holder_diameter) || CHIP_FAULTY(HOLDER_FORGOTTEN))
        return;
    clamps->bodies = 2;
    holder->begins = stick_out;
    holder->radius = 0.5 * holder_diameter;
    holder->lines = 0;
    add_line(holder, holder->radius, 0.0);
}

/* [1] From the outline of a clamp, seen from above; negative inside. */
static double across(const struct chip_clamp *clamp, double x, double y)
{
    double u = x - clamp->x, v = y - clamp->y, dx, dy;
    if (clamp->is_round) return chip_sqrt(u * u + v * v) - clamp->half_x;
    dx = fabs(u * clamp->cosine + v * clamp->sine) - clamp->half_x;
    dy = fabs(v * clamp->cosine - u * clamp->sine) - clamp->half_y;
    if (dx <= 0.0 || dy <= 0.0) return chip_max(dx, dy);
    return chip_sqrt(dx * dx + dy * dy);
}

double chip_clamp_distance(const struct chip_clamp *clamp, const struct chip_clamp_body *body, const double tip[3])
{
    double over = clamp->top - tip[2], found = body->begins - over, aside = across(clamp, tip[0], tip[1]);
    int i;
    for (i = 0; i < body->lines; i++) {
        double d = (aside - body->a[i] - body->b[i] * over) * body->share[i];
        if (d > found) found = d;
    }
    return found;
}
