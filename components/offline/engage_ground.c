/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_ground.c - see engage.h: segments, the grid over them, what is cleared [1]. */
#include <stdlib.h>
#include <string.h>

#include "engage_state.h"

#define RIM 64        /* parts of the whole circle */
#define STRAIGHT 1e-9 /* rad: an arc that turns less is a line */
#define MOST_TURN 2.0 /* rad: of an arc more than this nothing is said of which end is nearest */

struct chip_engage_segment chip_engage_segment_of(const double v[CHIP_ENGAGE_COLUMNS])
{
    struct chip_engage_segment p = { v[0], v[1], v[2], v[3], v[4], v[5], 0.0, 1.0, 0.0, -1.0, v[6] };
    double middle;
    if (v[6] == 0.0) return p;
    p.radius = hypot(v[0] - v[4], v[1] - v[5]);
    middle = atan2(v[1] - v[5], v[0] - v[4]) + 0.5 * v[6];
    p.mx = cos(middle);
    p.my = sin(middle);
    p.open = cos(chip_min(0.5 * fabs(v[6]), CHIP_PI));
    return p;
}

/* The arc from a to b that turns as the headings do. */
struct chip_engage_segment chip_engage_segment_between(struct chip_engage_pose a, struct chip_engage_pose b)
{
    double turn = remainder(b.heading - a.heading, 2.0 * CHIP_PI), dx = b.x - a.x, dy = b.y - a.y;
    double element[CHIP_ENGAGE_COLUMNS] = { a.x, a.y, b.x, b.y, 0.0, 0.0, 0.0 };
    if (fabs(turn) > STRAIGHT && hypot(dx, dy) > 1e-12) {
        double high = 0.5 / tan(0.5 * turn); /* of the centre over the chord, in chords */
        element[4] = 0.5 * (a.x + b.x) - high * dy;
        element[5] = 0.5 * (a.y + b.y) + high * dx;
        element[6] = turn;
    }
    return chip_engage_segment_of(element);
}

int chip_engage_grid_make(struct chip_engage_grid *g, const double box[4], double size)
{
    g->x0 = box[0];
    g->y0 = box[1];
    g->size = size;
    g->per_mm = 1.0 / size;
    g->columns = (long)((box[2] - box[0]) / size) + 1;
    g->rows = (long)((box[3] - box[1]) / size) + 1;
    g->square = calloc((size_t)(g->columns * g->rows), sizeof *g->square);
    return g->square ? 0 : -1;
}

void chip_engage_grid_free(struct chip_engage_grid *g)
{
    long k;
    for (k = 0; g->square && k < g->columns * g->rows; k++) free(g->square[k].segment);
    free(g->square);
    free(g->segment);
}

int chip_engage_list(struct chip_engage_square *s, long number)
{
    if (s->count == s->room) {
        int32_t room = s->room ? 2 * s->room : 8;
        int32_t *more = realloc(s->segment, sizeof *more * (size_t)room);
        if (!more) return -1;
        s->segment = more;
        s->room = room;
    }
    s->segment[s->count++] = (int32_t)number;
    return 0;
}

static int one_more(struct chip_engage_grid *g)
{
    if (g->count == g->room) {
        long room = g->room ? 2 * g->room : 1024;
        struct chip_engage_segment *more = realloc(g->segment, sizeof *more * (size_t)room);
        if (!more) return -1;
        g->segment = more;
        g->room = room;
    }
    return 0;
}

/* How far a square (middle, half a side) lies beyond a place in a direction, at least; in lengths of the direction. */
static double beyond(const double square[3], double x, double y, double dx, double dy)
{
    return (square[0] - x) * dx + (square[1] - y) * dy - square[2] * (fabs(dx) + fabs(dy));
}

/* Whether an end of a segment is its nearest place to all of a square: the square lies beyond the line across the segment at this
 * end, and on this side of the line of places to which both ends are as near. */
static int end_is_nearest(const struct chip_engage_segment *p, int at_end, const double square[3])
{
    double out = at_end ? 1.0 : -1.0, dx = out * (p->bx - p->ax), dy = out * (p->by - p->ay);
    double x = at_end ? p->bx : p->ax, y = at_end ? p->by : p->ay;
    if (p->radius == 0.0) return beyond(square, x, y, dx, dy) >= 0.0;
    if (fabs(p->turn) > MOST_TURN) return 0;
    if (beyond(square, 0.5 * (p->ax + p->bx), 0.5 * (p->ay + p->by), dx, dy) < 0.0) return 0;
    if (p->turn < 0.0) out = -out;
    return beyond(square, x, y, -out * (y - p->cy), out * (x - p->cx)) >= 0.0;
}

/* Enters a segment into a square. If it goes on from the last one, `before`, a square needs that of both which is nearer to all
 * of it: what the other covers there is covered by this one, too. */
static void enter(struct chip_engage *e, struct chip_engage_square *s, const double at[3],
                  const struct chip_engage_segment *before)
{
    struct chip_engage_grid *g = &e->ground;
    const struct chip_engage_segment *p = &g->segment[g->count];
    double half = CHIP_ENGAGE_WHOLE * g->size, gap;
    if (s->count < 0 || (before && end_is_nearest(p, 0, at))) return;
    CHIP_FAULT(NEXT_LEFT_OUT, if (before && s->count) return )
    gap = chip_sqrt(chip_engage_gap2(p, at[0], at[1]));
    if (gap > e->radius + half) return;
    if (gap < e->radius * (1.0 - CHIP_ENGAGE_SLACK) - half) {
        free(s->segment);
        memset(s, 0, sizeof *s);
        s->count = -1;
        return;
    }
    if (before && s->count && s->segment[s->count - 1] == g->count - 1 && end_is_nearest(before, 1, at)) s->count--;
    if (chip_engage_list(s, g->count)) e->failed = 1;
}

static void box_of(const struct chip_engage_segment *p, double box[4])
{
    box[0] = chip_min(p->ax, p->bx);
    box[1] = chip_min(p->ay, p->by);
    box[2] = chip_max(p->ax, p->bx);
    box[3] = chip_max(p->ay, p->by);
    if (p->radius > 0.0) { /* sagitta on every side: more than needed */
        double more = p->open > 0.0 ? p->radius * (1.0 - p->open) : 2.0 * p->radius;
        box[0] = chip_max(box[0] - more, p->cx - p->radius);
        box[1] = chip_max(box[1] - more, p->cy - p->radius);
        box[2] = chip_min(box[2] + more, p->cx + p->radius);
        box[3] = chip_min(box[3] + more, p->cy + p->radius);
    }
}

/* The squares (first column and row, last column and row) that may be within `reach` of a segment. */
void chip_engage_near(const struct chip_engage_grid *g, const struct chip_engage_segment *p, double reach, long near[4])
{
    double box[4];
    int k;
    box_of(p, box);
    for (k = 0; k < 4; k++) {
        double at = (box[k] + (k < 2 ? -reach : reach) - (k % 2 ? g->y0 : g->x0)) / g->size;
        near[k] = (long)chip_clamp(at, 0.0, (double)((k % 2 ? g->rows : g->columns) - 1));
    }
}

/* Clears along a segment. */
void chip_engage_put(struct chip_engage *e, const struct chip_engage_segment *p)
{
    struct chip_engage_grid *g = &e->ground;
    const struct chip_engage_segment *before = 0;
    long i, j, near[4];
    if (one_more(g)) {
        e->failed = 1;
        return;
    }
    g->segment[g->count] = *p;
    if (g->count && p->ax == g->segment[g->count - 1].bx && p->ay == g->segment[g->count - 1].by)
        before = &g->segment[g->count - 1];
    chip_engage_near(g, p, e->radius, near);
    for (j = near[1]; j <= near[3]; j++)
        for (i = near[0]; i <= near[2]; i++) {
            double at[3] = { g->x0 + ((double)i + 0.5) * g->size, g->y0 + ((double)j + 0.5) * g->size, 0.5 * g->size };
            enter(e, &g->square[j * g->columns + i], at, before);
        }
    g->count++;
}

void chip_engage_clear(struct chip_engage *e, long n, const double (*element)[CHIP_ENGAGE_COLUMNS])
{
    long k;
    for (k = 0; k < n; k++) {
        struct chip_engage_segment p = chip_engage_segment_of(element[k]);
        chip_engage_put(e, &p);
    }
}

/* Whether no segment is as near to a point as `within`: the last ones are asked first. */
int chip_engage_uncut(const struct chip_engage *e, double x, double y, double within)
{
    const struct chip_engage_square *s = chip_engage_square_at(&e->ground, x, y);
    int32_t k;
    if (!s) return 1;
    for (k = s->count - 1; k >= 0; k--)
        if (chip_engage_covers(&e->ground.segment[s->segment[k]], x, y, within)) return 0;
    return s->count >= 0;
}

void chip_engage_rim(struct chip_engage *e, long n, const double (*point)[2], double less, uint8_t *cleared)
{
    double r = e->radius - less, within = e->radius * (1.0 - CHIP_ENGAGE_SLACK), rim[RIM][2];
    long k;
    int a, looks = r > 0.0 ? RIM : 1, first = 0; /* where the last one was uncut, the next one is likely to be */
    for (a = 0; a < looks; a++) {
        double angle = 2.0 * CHIP_PI * a / RIM;
        rim[a][0] = r * cos(angle);
        rim[a][1] = r * sin(angle);
    }
    for (k = 0; k < n; k++) {
        for (a = 0; a < looks; a++) {
            const double *toward = rim[(first + a) % looks];
            if (chip_engage_uncut(e, point[k][0] + toward[0], point[k][1] + toward[1], within)) break;
        }
        cleared[k] = a == looks;
        if (a < looks) first = (first + a) % looks;
    }
}
