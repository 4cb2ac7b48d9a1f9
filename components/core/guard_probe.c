/* SPDX-License-Identifier: GPL-2.0-or-later */
/* guard_probe.c - see guard_probe.h and guard.h; the numbers in brackets are those of its principle. */
#include "guard_probe.h"

#define CHIP_GUARD_STEP 4.0     /* cells the probe advances at once, or */
#define CHIP_GUARD_RADII 0.0625 /* this share of the tool's radius: each step costs the tool's outline */
#define CHIP_GUARD_FINE 0.0625  /* cells to which the beginning of the stock is located */
#define CHIP_GUARD_STEPS 16     /* steps of the probe in a period, about */
#define CHIP_GUARD_HALVINGS 12  /* halvings of a step in a blend at most */

/* Share of blend->offset left when the tool is `s` mm on the line: the rest of the first segment falls with the
 * square of the time left, the speed on the line rises linearly. */
static double blend_share(const struct chip_guard_blend *blend, double s)
{
    double gone = s - blend->from, root, left;
    if (!blend->active || s >= blend->end || !(blend->time > 0.0)) return 0.0;
    if (gone <= 0.0) return 1.0;
    root = blend->speed + sqrt(blend->speed * blend->speed + 2.0 * blend->rise / blend->time * gone);
    left = root > 0.0 ? 1.0 - 2.0 * gone / (root * blend->time) : 0.0;
    return left > 0.0 ? left * left : 0.0;
}

void chip_guard_point_on_line(const struct chip_guard *guard, double s, double tip[3])
{
    double share = blend_share(&guard->blend, s);
    int i;
    for (i = 0; i < 3; i++) tip[i] = guard->origin[i] + s * guard->dir[i] + share * guard->blend.offset[i];
}

static void probe_point(const struct chip_probe_track *track, double s, double tip[3])
{
    double dir[3];
    if (track->path)
        chip_path_at(track->path, s, tip, dir);
    else
        chip_guard_point_on_line(track->guard, s, tip);
}

/* Whether the tool meets stock on a straight step `length` mm long. Before a plunge that leaves out a ring of the tool as wide
 * as the strip that is ignored: the tool may have passed here with its path blended, and where it turned a crescent
 * stands beside it. */
static int meets(const struct chip_stock *stock, const struct chip_tool *tool, const double a[3], const double b[3],
                 double length, long *work)
{
    double across = stands_above(stock, chip_min(a[2], b[2])), enough;
    struct chip_tool inner;
    if (plunges(a, b) && !CHIP_FAULTY(PLUNGE_AS_WIDE)) {
        inner = *tool;
        inner.radius = chip_max(tool->radius - ignored_strip(stock), 0.5 * tool->radius);
        inner.r_flat = chip_min(tool->r_flat, inner.radius);
        inner.r_arc = chip_min(tool->r_arc, inner.radius);
        inner.shoulder = chip_tool_height(tool, inner.radius);
        tool = &inner;
        across = chip_min(across, inner.radius);
    }
    enough = ignored(stock, across, length);
    return chip_sweep_meets(stock, tool, a, b, 1, enough, work) >= enough;
}

/* Halves the step in which stock was found. */
static void narrow(struct chip_guard_probe *probe, const struct chip_probe_track *track, const struct chip_stock *stock,
                   const struct chip_tool *tool, long *work)
{
    double a[3], b[3], middle = 0.5 * (probe->hit_near + probe->hit_far);
    probe_point(track, probe->hit_near, a);
    probe_point(track, middle, b);
    if (meets(stock, tool, a, b, middle - probe->hit_near, work))
        probe->hit_far = middle;
    else
        probe->hit_near = middle;
}

/* The next point of a probe, no farther from the last than a step. */
static double next_probe_point(const struct chip_probe_track *track, const struct chip_guard_probe *probe, double step,
                               double end, const double a[3], double b[3])
{
    double next = probe->clear + step;
    int i;
    if (end > probe->clear + CHIP_GUARD_MIN_CONTACT && end < next) next = end;
    for (i = 0; i < CHIP_GUARD_HALVINGS; i++) {
        double dx, dy, dz;
        probe_point(track, next, b);
        dx = b[0] - a[0];
        dy = b[1] - a[1];
        dz = b[2] - a[2];
        if (dx * dx + dy * dy + dz * dz <= 1.01 * step * step) break;
        next = 0.5 * (next + probe->clear); /* in a blend the tool travels farther than the line does */
    }
    return next;
}

/* Advances a probe by one step; one of its steps ends at `end`. */
static void send_on(struct chip_guard_probe *probe, const struct chip_probe_track *track,
                    const struct chip_stock *stock, const struct chip_tool *tool, double end, long *work)
{
    double step = chip_max(CHIP_GUARD_STEP * stock->cell, CHIP_GUARD_RADII * tool->radius);
    double a[3], b[3], next;
    probe_point(track, probe->clear, a);
    next = next_probe_point(track, probe, step, end, a, b);
    if (!misses(stock, tool->radius, a, b) && meets(stock, tool, a, b, next - probe->clear, work)) {
        probe->hit_near = probe->clear;
        probe->hit_far = next;
        return;
    }
    probe->clear = next;
}

/* [2] A probe's work in a period: ahead up to `wanted` mm, then to where the stock begins. */
void chip_guard_send(struct chip_guard_probe *probe, const struct chip_probe_track *track,
                     const struct chip_stock *stock, const struct chip_tool *tool, double wanted, double end,
                     long *work)
{
    int steps = CHIP_GUARD_STEPS;
    while (!found(probe) && probe->clear < wanted && *work < track->bound && steps-- > 0)
        send_on(probe, track, stock, tool, end, work);
    while (found(probe) && probe->hit_far - probe->hit_near > CHIP_GUARD_FINE * stock->cell && *work < track->bound)
        narrow(probe, track, stock, tool, work);
}
