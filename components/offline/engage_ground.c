/* SPDX-License-Identifier: GPL-2.0-or-later */
/* engage_ground.c - see engage.h: segments, the grid over them, what is cleared, and engagement [1, 2]. */
#include <stdlib.h>
#include <string.h>

#include "engage_state.h"

#define FRONT 60      /* parts of the front half circle that are looked at */
#define HALVINGS 9    /* of a part at the end of stock */
#define RIM 64        /* parts of the whole circle */
#define STRAIGHT 1e-9 /* rad: an arc that turns less is a line */

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

static void enter(struct chip_engage *e, struct chip_engage_square *s, double gap)
{
    struct chip_engage_grid *g = &e->ground;
    double half = CHIP_ENGAGE_WHOLE * g->size;
    if (s->count < 0 || gap > e->radius + half) return;
    if (gap < e->radius * (1.0 - CHIP_ENGAGE_SLACK) - half) {
        free(s->segment);
        memset(s, 0, sizeof *s);
        s->count = -1;
    } else if (chip_engage_list(s, g->count)) {
        e->failed = 1;
    }
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
    long i, j, near[4];
    if (one_more(g)) {
        e->failed = 1;
        return;
    }
    g->segment[g->count] = *p;
    chip_engage_near(g, p, e->radius, near);
    for (j = near[1]; j <= near[3]; j++)
        for (i = near[0]; i <= near[2]; i++) {
            double x = g->x0 + ((double)i + 0.5) * g->size, y = g->y0 + ((double)j + 0.5) * g->size;
            enter(e, &g->square[j * g->columns + i], chip_sqrt(chip_engage_gap2(p, x, y)));
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

/* Whether no segment is as near to a point as `within`, whose square is given: the last ones are asked first. */
int chip_engage_uncut(const struct chip_engage *e, double x, double y, double within2)
{
    const struct chip_engage_square *s = chip_engage_square_at(&e->ground, x, y);
    int32_t k;
    if (!s) return 1;
    for (k = s->count - 1; k >= 0; k--)
        if (chip_engage_gap2(&e->ground.segment[s->segment[k]], x, y) < within2) return 0;
    return s->count >= 0;
}

/* A circle that is asked where it is uncut, and the segment that covered the last place: it mostly covers the next one, too. */
struct rim {
    const struct chip_engage *e;
    double x, y, radius, within2;
    int32_t covering;
};

static struct rim rim_of(const struct chip_engage *e, struct chip_engage_pose p)
{
    double within = e->radius * (1.0 - CHIP_ENGAGE_SLACK);
    return (struct rim){ e, p.x, p.y, e->radius, within * within, -1 };
}

/* Whether the rim is uncut in the direction of a unit vector. */
static int uncut_toward(struct rim *rim, double c, double s)
{
    double x = rim->x + rim->radius * c, y = rim->y + rim->radius * s;
    const struct chip_engage_grid *g = &rim->e->ground;
    const struct chip_engage_square *square = chip_engage_square_at(g, x, y);
    int32_t k;
    if (!square) return 1;
    if (square->count <= 0) return square->count == 0;
    CHIP_FAULT(COVER_UNASKED, if (rim->covering >= 0) return 0)
    if (rim->covering >= 0 && chip_engage_gap2(&g->segment[rim->covering], x, y) < rim->within2) return 0;
    for (k = square->count - 1; k >= 0; k--)
        if (chip_engage_gap2(&g->segment[square->segment[k]], x, y) < rim->within2) {
            rim->covering = square->segment[k];
            return 0;
        }
    return 1;
}

/* The angle between `from` and `to` at which what is uncut begins or ends. */
static double border(struct rim *rim, double from, double to, int uncut_from)
{
    int k;
    for (k = 0; k < HALVINGS; k++) {
        double middle = 0.5 * (from + to);
        if (uncut_toward(rim, cos(middle), sin(middle)) == uncut_from)
            from = middle;
        else
            to = middle;
    }
    return 0.5 * (from + to);
}

/* How far from 90 degrees aside a circle still lies within its own slot, less the slack. */
static double aside(void) { return 1.4 * acos(1.0 - CHIP_ENGAGE_SLACK); }

/* Turns a unit vector (c, s) by the angle of another. */
static void turn(double *c, double *s, double by_c, double by_s)
{
    double old = *c;
    *c = old * by_c - *s * by_s;
    *s = old * by_s + *s * by_c;
}

/* Engagement; once it is above `enough`, only that it is. */
static double front_to(const struct chip_engage *e, struct chip_engage_pose p, double enough)
{
    double edge = aside(), first = p.heading - 0.5 * CHIP_PI + edge, part = (CHIP_PI - 2.0 * edge) / FRONT;
    double sum = 0.0, last = first, c = cos(first), s = sin(first), part_c = cos(part), part_s = sin(part);
    struct rim rim = rim_of(e, p);
    int before = uncut_toward(&rim, c, s), k;
    if (before) sum += edge;
    for (k = 1; k <= FRONT && sum <= enough; k++) {
        double angle = first + part * k;
        int now;
        turn(&c, &s, part_c, part_s);
        now = uncut_toward(&rim, c, s);
        if (now && before) sum += part;
        if (now != before) {
            double end = border(&rim, last, angle, before);
            sum += before ? end - last : angle - end;
        }
        before = now;
        last = angle;
    }
    CHIP_FAULT(ENGAGEMENT_LESS, sum *= 0.8)
    return before ? sum + edge : sum;
}

double chip_engage_front(const struct chip_engage *e, struct chip_engage_pose p) { return front_to(e, p, 1e9); }

int chip_engage_above(const struct chip_engage *e, struct chip_engage_pose p, double limit)
{
    return front_to(e, p, limit) > limit;
}

/* Whether anything of the front half circle is uncut, and the direction of the leftmost such place [3]. */
int chip_engage_leftmost(const struct chip_engage *e, struct chip_engage_pose p, double *toward)
{
    double left = p.heading + 0.5 * CHIP_PI, last = left, c = cos(left), s = sin(left);
    double part_c = cos(CHIP_PI / FRONT), part_s = -sin(CHIP_PI / FRONT);
    struct rim rim = rim_of(e, p);
    int k;
    for (k = 0; k <= FRONT; k++) {
        double angle = left - CHIP_PI * k / FRONT;
        if (uncut_toward(&rim, c, s)) {
            *toward = k ? border(&rim, angle, last, 1) : angle;
            return 1;
        }
        last = angle;
        turn(&c, &s, part_c, part_s);
    }
    return 0;
}

void chip_engage_at(struct chip_engage *e, long n, const double (*pose)[3], double *angle)
{
    long k;
    for (k = 0; k < n; k++)
        angle[k] = chip_engage_front(e, (struct chip_engage_pose){ pose[k][0], pose[k][1], pose[k][2] });
}

void chip_engage_rim(struct chip_engage *e, long n, const double (*point)[2], double less, uint8_t *cleared)
{
    double r = e->radius - less, within = e->radius * (1.0 - CHIP_ENGAGE_SLACK), rim[RIM][2];
    long k;
    int a;
    for (a = 0; a < RIM; a++) {
        double angle = 2.0 * CHIP_PI * a / RIM;
        rim[a][0] = r * cos(angle);
        rim[a][1] = r * sin(angle);
    }
    for (k = 0; k < n; k++) {
        for (a = 0; a < RIM; a++)
            if (chip_engage_uncut(e, point[k][0] + rim[a][0], point[k][1] + rim[a][1], within * within)) break;
        cleared[k] = a == RIM;
    }
}
