/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge of side force, power and chip: the edges of a cutter one by one, in the stock that the path before has left.
 *
 * Called by tests/support/judge_force.py.  Nothing of the product is in it; tool, blank, chords and stock are those of judge_stock.h.
 *
 *  1. At a place of the path an edge stands at each of ANGLES angles from the heading, 1 degree apart: straight, without run-out.
 *  2. It is a piece of the wall above the tip's profile and the elements of that profile.  Where an element touches stock its chip is
 *     fz (n . d), with n its outward normal, d the unit direction of the path in space, and it pushes with kc11 ds fz^(1 - mc)
 *     (n . d)^(1 - mc) against the edge's path, and with RADIAL of that along -n, whose part in the plane counts.
 *     Where contact begins or ends within an element is sought by halving.
 *  3. An edge turns clockwise, so it is pushed the other way round.  All edges of the cutter are summed up as vectors, for each angle of
 *     the first one; the longest sum and the length of the mean one are given, in mm: N over kc11 fz^(1 - mc).
 *  4. Between two angles where an edge comes to a wall its place is sought by halving, and the sum right beside it counts, too.
 *  5. The work of a turn is kc11 z fz^(1 - mc) A_mc, with A_mc the integral of r (n . d)^(1 - mc) ds over all angles, in mm2; the largest
 *     chip is fz times the largest n . d that touches.
 *
 * Units: mm, rad.  Numbers in brackets in the code are the ones above.
 */
#include "judge_stock.h"

#define ANGLES 360          /* [1] */
#define RADIAL 0.3          /* Tlusty and MacNeil 1975 */
#define LAG 0.02            /* mm of the path before now that do not count as history: the edge before has left that */
#define SKIN 5e-4           /* mm of stock above an element that do not count: a path that runs twice differs by less */
#define ARC 24              /* elements of a corner */
#define ELEMENT 0.2         /* mm, of a cone or of the end; at least LEAST of them */
#define LEAST 8
#define WALL 0.15           /* of the largest edge: two edges that differ by more have a wall between them [4] */

struct place {
    struct history *history;
    const struct tool *tool;
    double x, y, z;             /* tip */
    double ux, uy;              /* heading in the plane, unit */
    double across, down;        /* parts of the unit direction: in the plane, and its z */
    double power;               /* 1 - mc */
};

struct vector {
    double x, y;                /* ahead, to the left */
    double work;                /* of the edge: r (n . d)^(1 - mc) ds, mm2 [5] */
    double chip;                /* its largest n . d */
};

struct sums {
    double most, mean;          /* longest and mean sum of all edges, mm [3] */
    double chip, work;          /* largest n . d, A_mc [5] */
};

struct element {
    double r, length;           /* mm */
    double lean, under;         /* parts of n: in the plane, downwards */
};

/* Height of the stock at a point, or anything below `least` if it is below that: most points are found clear by the last chords. */
static double height_from(struct history *h, double qx, double qy, double least)
{
    const struct patch *p;
    double best = h->blank->high;
    int k;

    if (!inside(h->blank, qx, qy))
        return NONE;
    if (h->now_end > 0.0)
        best = fmin(best, swept(h->now, qx, qy, h->now_end, best));
    p = h->patches + (long)((qy - h->y0) / h->side) * h->wide + (long)((qx - h->x0) / h->side);
    for (k = p->count - 1; k >= 0 && best >= least; k--) {
        const struct chord *c = h->chords + p->chord[k];
        if (c->low < best)
            best = fmin(best, swept(c, qx, qy, 1.0, best));
    }
    return best;
}

/* Stock above the tool's surface at the heading angle whose cosine and sine are given, at the radius r; negative: clear. */
static double above(const struct place *p, double c, double s, double r, double z)
{
    double least = p->z + z, h;

    if (least < p->history->blank->low)
        return -FAR;
    if (least >= p->history->blank->high)
        return p->history->blank->high - least - SKIN;
    h = height_from(p->history, p->x + r * (c * p->ux - s * p->uy), p->y + r * (c * p->uy + s * p->ux), least);
    return h <= NONE ? -FAR : h - least - SKIN;
}

/* [2] [5] Adds a contact of an element at the heading angle whose cosine and sine are given. */
static void add(const struct place *p, double c, double s, struct element e, struct vector *sum)
{
    double chip = p->across * c * e.lean - p->down * e.under, force;

    if (chip <= 0.0 || e.length <= 0.0)
        return;
    force = e.length * pow(chip, p->power);
    sum->x += force * (-s - RADIAL * e.lean * c);      /* [3] */
    sum->y += force * (c - RADIAL * e.lean * s);
    sum->work += force * e.r;
    sum->chip = fmax(sum->chip, chip);
}

/* A point of a piece of the profile: 0 the end (by r), 1 the corner (by its angle), 2 the cone (by r). */
static double above_at(const struct place *p, int piece, double q, double c, double s)
{
    const struct tool *t = p->tool;
    double r = piece == 1 ? t->flat + t->corner * sin(q) : q;
    double z = piece == 0 ? 0.0 : piece == 1 ? t->corner * (1.0 - cos(q)) : t->arc_z + (q - t->arc_r) * t->slope;

    return above(p, c, s, fmin(r, t->radius - 2.0 * EDGE), z);
}

/* Where contact ends between a point that touches and one that does not. */
static double border(const struct place *p, int piece, double touching, double clear, double c, double s)
{
    int i;

    for (i = 0; i < 5; i++) {
        double middle = 0.5 * (touching + clear);
        if (above_at(p, piece, middle, c, s) > 0.0)
            touching = middle;
        else
            clear = middle;
    }
    return 0.5 * (touching + clear);
}

/* n . d of a point of a piece at the heading angle whose cosine is given. */
static double advance(const struct place *p, int piece, double q, double c)
{
    double slope = p->tool->slope, slant = sqrt(1.0 + slope * slope);
    double lean = piece == 0 ? 0.0 : piece == 1 ? sin(q) : slope / slant;
    double under = piece == 0 ? 1.0 : piece == 1 ? cos(q) : 1.0 / slant;

    return p->across * c * lean - p->down * under;
}

/* [2] Adds the elements of a piece of the profile from a to b. */
static void add_piece(const struct place *p, int piece, double a, double b, double c, double s, struct vector *sum)
{
    const struct tool *t = p->tool;
    double slant = sqrt(1.0 + t->slope * t->slope), step, last = a;
    int n = piece == 1 ? ARC : (int)fmax(LEAST, (b - a) / ELEMENT), i, touched;

    if (b - a < 1e-9)
        return;
    step = (b - a) / n;
    touched = advance(p, piece, a, c) > 0.0 && above_at(p, piece, a + 1e-6 * step, c, s) > 0.0;
    for (i = 1; i <= n; i++) {
        double q = a + step * i, from = last, to = q, middle;
        struct element e;
        int touches = advance(p, piece, q, c) > 0.0 && above_at(p, piece, q, c, s) > 0.0;
        if (touches && !touched)
            from = border(p, piece, q, last, c, s);
        if (touched && !touches)
            to = border(p, piece, last, q, c, s);
        middle = 0.5 * (from + to);
        e.r = piece == 1 ? t->flat + t->corner * sin(middle) : middle;
        e.length = (to - from) * (piece == 1 ? t->corner : piece == 2 ? slant : 1.0);
        e.lean = piece == 0 ? 0.0 : piece == 1 ? sin(middle) : t->slope / slant;
        e.under = piece == 0 ? 1.0 : piece == 1 ? cos(middle) : 1.0 / slant;
        if (touched || touches)
            add(p, c, s, e, sum);
        last = q;
        touched = touches;
    }
}

/* [2] What an edge at an angle from the heading pushes with. */
static struct vector edge(const struct place *p, double angle)
{
    const struct tool *t = p->tool;
    double c = cos(angle), s = sin(angle), top = fmax(profile(t, t->radius), p->history->blank->low - p->z);
    struct vector sum = { 0.0, 0.0, 0.0, 0.0 };

    if (c > 0.0 && p->across > 1e-9)
        add(p, c, s, (struct element){ t->radius, above(p, c, s, t->radius, top), 1.0, 0.0 }, &sum);
    if (c <= 0.0 && p->down >= 0.0)
        return sum;
    if (p->down < 0.0)
        add_piece(p, 0, 0.0, t->flat, c, s, &sum);
    if (t->corner > 0.0)
        add_piece(p, 1, 0.0, t->turn, c, s, &sum);
    if (t->slope > 0.0)
        add_piece(p, 2, t->arc_r, t->radius, c, s, &sum);
    return sum;
}

static double size(struct vector v) { return hypot(v.x, v.y); }

/* [3] The sum of all edges when the first one stands at an angle; `first`: what that one pushes with. */
static double all_edges(const struct place *p, double angle, struct vector first, int edges)
{
    int k;

    for (k = 1; k < edges; k++) {
        struct vector one = edge(p, angle + 2.0 * M_PI * k / edges);
        first.x += one.x;
        first.y += one.y;
    }
    return size(first);
}

/* [4] The sum right beside a wall between the angle i and the next one, on the side where the edge meets more; the work of each side
 * counts as far as the wall. */
static void add_wall(const struct place *p, int i, const struct vector *at, int edges, struct sums *sums)
{
    const struct vector *this = at + i, *next = at + (i + 1) % ANGLES, *high = size(*this) > size(*next) ? this : next;
    double step = 2.0 * M_PI / ANGLES, half = 0.5 * (size(*this) + size(*next)), part;
    double more = step * (high == this ? i : i + 1), less = step * (high == this ? i + 1 : i);
    struct vector best = *high;
    int k;

    for (k = 0; k < 5; k++) {
        struct vector middle = edge(p, 0.5 * (more + less));
        if (size(middle) > half) {
            more = 0.5 * (more + less);
            best = middle;
        } else {
            less = 0.5 * (more + less);
        }
    }
    part = 0.5 * (more + less) - step * i;
    sums->work += (part - 0.5 * step) * (this->work - next->work);
    sums->chip = fmax(sums->chip, best.chip);
    sums->most = fmax(sums->most, all_edges(p, more, best, edges));
}

/* [3] [4] [5] What the edges of a turn push with. */
static struct sums turn(const struct place *p, int edges)
{
    struct sums sums = { 0.0, 0.0, 0.0, 0.0 };
    struct vector at[ANGLES], whole = { 0.0, 0.0, 0.0, 0.0 };
    int apart = ANGLES / edges, i, k;
    double largest = 0.0, step = 2.0 * M_PI / ANGLES;

    for (i = 0; i < ANGLES; i++) {
        at[i] = edge(p, step * i);
        largest = fmax(largest, size(at[i]));
        whole.x += at[i].x;
        whole.y += at[i].y;
        sums.work += step * at[i].work;
        sums.chip = fmax(sums.chip, at[i].chip);
    }
    for (i = 0; i < apart; i++) {
        struct vector all = { 0.0, 0.0, 0.0, 0.0 };
        for (k = 0; k < edges; k++) {
            all.x += at[i + k * apart].x;
            all.y += at[i + k * apart].y;
        }
        sums.most = fmax(sums.most, size(all));
    }
    for (i = 0; i < ANGLES; i++)
        if (fabs(size(at[(i + 1) % ANGLES]) - size(at[i])) > WALL * largest)
            add_wall(p, i, at, edges, &sums);
    sums.mean = size(whole) / apart;
    return sums;
}

/* Where the tool is at `t` (0..1) of a chord. */
static struct place place_at(struct history *h, const struct chord *c, double t, double length, double exponent)
{
    double plane = sqrt(c->l2);
    struct place p;

    p.history = h;
    p.tool = c->tool;
    p.x = c->x + t * c->dx;
    p.y = c->y + t * c->dy;
    p.z = c->z + t * c->dz;
    p.across = plane / length;
    p.down = fabs(c->dz) < 1e-9 * length ? 0.0 : c->dz / length;
    p.ux = plane > 0.0 ? c->dx / plane : 1.0;
    p.uy = plane > 0.0 ? c->dy / plane : 0.0;
    p.power = 1.0 - exponent;
    h->now = c;
    h->now_end = fmax(t - LAG / length, 0.0);
    return p;
}

/* The sums at places `step` mm apart along the chords that are not in air.  edges: of each tool, a divisor of ANGLES; places: (room, 5) path (mm),
 * and the sums there.  -> number of places, -1: no room */
long judge_force(const double *blank, long tool_count, const double *sizes, const int *edges, double exponent, long count,
                 const double *ends, const int *tool_of, double step, long room, double *places)
{
    const struct blank *b = (const struct blank *)blank;
    struct run r = open_run(tool_count, sizes, count, ends, tool_of);
    struct history h;
    double path = 0.0, next = 0.0;
    long i, made = 0;

    open_history_of(&h, b, &r);
    for (i = 0; i < count && made >= 0; i++) {
        const struct chord *c = r.chords + i;
        double length = sqrt(c->l2 + c->dz * c->dz), t;
        int air = in_air(b, c);
        for (; !air && next < path + length; next += step) {
            struct place p;
            struct sums found;
            t = fmax(next - path, fmin(LAG, length)) / length;       /* what it has just left is not known before */
            if (made == room) {
                made = -1;
                break;
            }
            p = place_at(&h, c, t, length, exponent);
            found = turn(&p, edges[tool_of[i]]);
            places[5 * made] = path + t * length;
            memcpy(places + 5 * made + 1, &found, sizeof(found));
            made++;
        }
        path += length;
        next = fmax(next, air ? path : 0.0);
        if (!air)
            remember(&h, (int)i);
    }
    close_history(&h);
    close_run(&r);
    return made;
}
