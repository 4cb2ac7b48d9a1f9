/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge of whole runs: removal rate and volume from the logged path alone.
 *
 * Called by tests/support/judge.py.  Nothing of the product's core and nothing of fine_model.c is in it, and it
 * knows no cells: the stock at a point is worked out when it is asked for, from the path before.
 *
 *  1. chords    The samples become straight chords that stay within a tolerance of all of them.
 *  2. stock     Height at a point = top of the blank, lowered to the lower envelope of the tool's exact
 *               profile swept along every earlier chord: min over t of z(t) + f(|q - c(t)|).  f is convex,
 *               so each minimum has one candidate: an end of the range, or where the derivative is 0.
 *               Lists by square patches find the chords that reach the point.
 *  3. area      dV/ds = flux of stock through the front of the tool,
 *                  rim     int (h - z)+ (r.d)+ R dtheta                 on the cylinder above the tip
 *                  bottom  int (f'(r) r.d - d_z)+ [h > z_s] r dr dtheta on the tip's profile
 *               with d the unit direction, h from 2.  In theta by trapezoids halved where the integrand
 *               jumps, along the profile in closed form between the places where contact begins or ends.
 *  4. needles   A second path to the volume: points of a grid turned against the machine's axes, each
 *               lowered by every chord in turn; volume = sum of what they lost times the grid's area.
 *               3 and 4 share the tool's profile and the chords, and nothing else.
 *
 * 1 is judge_chords.c, 2 judge_stock.h, 4 judge_needles.c, and 3 is here.
 *
 * Units: mm, rad.  Numbers in brackets in the code are the ones above.
 */
#include "judge_stock.h"

#define LAG 1e-3           /* mm of the path before now that do not count as history: no tie with the tool itself */
#define SKIN 1e-9          /* mm of stock that count as contact */

/* --- (3) section area ------------------------------------------------------------------------- */

struct look {
    struct history *history;
    const struct tool *tool;
    double x, y, z;             /* tip */
    double ux, uy;              /* heading in the plane, unit */
    double across, down;        /* parts of the unit direction: in the plane, and its z */
    double tolerance;           /* mm3 per mm */
};

/* height of stock above the rim at heading angle theta */
static double on_rim(const struct look *l, double theta)
{
    double c = cos(theta), s = sin(theta), R = l->tool->radius;
    double z = fmax(l->z + profile(l->tool, R), l->history->blank->low);
    double h = height(l->history, l->x + R * (c * l->ux - s * l->uy), l->y + R * (c * l->uy + s * l->ux));

    return h > z ? h - z : 0.0;
}

static double rim_part(const struct look *l, double a, double ha, double b, double hb, int depth)
{
    double width = sin(b) - sin(a), mid = 0.5 * (a + b), hm;

    if (depth == 0 || fabs(ha - hb) * width * l->tool->radius < l->tolerance)
        return 0.5 * (ha + hb) * width;
    hm = on_rim(l, mid);
    return rim_part(l, a, ha, mid, hm, depth - 1) + rim_part(l, mid, hm, b, hb, depth - 1);
}

static double rim(const struct look *l)
{
    int n = (int)fmax(32.0, M_PI * l->tool->radius / 0.1), i;
    double sum = 0.0, a = -0.5 * M_PI, ha = on_rim(l, a);

    for (i = 1; i <= n; i++) {
        double b = -0.5 * M_PI + M_PI * i / n, hb = on_rim(l, b);
        sum += rim_part(l, a, ha, b, hb, 14);
        a = b;
        ha = hb;
    }
    return sum * l->tool->radius * l->across;
}

/* A piece of the profile: 0 flat (by r), 1 arc (by angle), 2 cone (by r). */
static void on_piece(const struct tool *t, int piece, double p, double *r, double *z)
{
    *r = piece == 1 ? t->flat + t->corner * sin(p) : p;
    *z = piece == 0 ? 0.0 : piece == 1 ? t->corner * (1.0 - cos(p)) : t->arc_z + (p - t->arc_r) * t->slope;
}

/* What goes through the tip per radian: `ahead` times across cos(theta), and `under` times -down. */
struct pair {
    double ahead, under;
};

/* Adds the integrals of f' r and of r over a piece from a to b, in closed form. */
static void add_flux(const struct tool *t, int piece, double a, double b, struct pair *sum)
{
    double c = t->corner, sa = sin(a), ka = cos(a), sb = sin(b), kb = cos(b);

    if (piece != 1) {
        double square = 0.5 * (b * b - a * a);
        sum->under += square;
        sum->ahead += piece == 2 ? t->slope * square : 0.0;
        return;
    }
    sum->ahead += c * (t->flat * (ka - kb) + 0.5 * c * (b - sb * kb - a + sa * ka));
    sum->under += c * (t->flat * (sb - sa) + 0.5 * c * (sb * sb - sa * sa));
}

static int touches(const struct look *l, int piece, double c, double s, double p)
{
    double r, z, h;

    on_piece(l->tool, piece, p, &r, &z);
    z += l->z;
    if (z <= l->history->blank->low)
        return 0;
    h = height(l->history, l->x + r * (c * l->ux - s * l->uy), l->y + r * (c * l->uy + s * l->ux));
    return h > z + SKIN;
}

/* flux through a range of a piece on which the tool advances all over */
static void range(const struct look *l, int piece, double c, double s, double a, double b, struct pair *sum)
{
    int n = piece == 1 ? 10 : (int)fmax(6.0, (b - a) / 0.4), i, j, was, is;
    double from = a, pa = a;

    if (b - a < 1e-9)
        return;
    was = touches(l, piece, c, s, a + 1e-7 * (b - a));
    for (i = 1; i <= n; i++) {
        double pb = a + (b - a) * i / n, lo = pa, hi = pb;
        is = touches(l, piece, c, s, i == n ? b - 1e-7 * (b - a) : pb);
        if (is != was) {
            for (j = 0; j < 9; j++) {
                double mid = 0.5 * (lo + hi);
                if (touches(l, piece, c, s, mid) == was)
                    lo = mid;
                else
                    hi = mid;
            }
            lo = 0.5 * (lo + hi);
            if (was)
                add_flux(l->tool, piece, from, lo, sum);
            from = lo;
        }
        was = is;
        pa = pb;
    }
    if (was)
        add_flux(l->tool, piece, from, b, sum);
}

/* flux per radian through the tip's profile at heading angle theta */
static struct pair on_meridian(const struct look *l, double theta)
{
    const struct tool *t = l->tool;
    double c = cos(theta), s = sin(theta), toward = l->across * c;
    struct pair sum = {0.0, 0.0};

    if (t->flat > 0.0 && l->down < 0.0)
        range(l, 0, c, s, 0.0, t->flat, &sum);
    if (t->corner > 0.0) {      /* advances where toward sin(p) > down cos(p): p from `turning` on, for half a turn */
        double turning = atan2(l->down, toward);
        if (turning >= 0.0)
            range(l, 1, c, s, fmin(turning, t->turn), t->turn, &sum);
        else
            range(l, 1, c, s, 0.0, fmin(turning + M_PI, t->turn), &sum);
    }
    if (t->slope > 0.0 && t->radius > t->arc_r && toward * t->slope > l->down)
        range(l, 2, c, s, t->arc_r, t->radius, &sum);
    sum.ahead *= l->across;
    sum.under *= -l->down;
    return sum;
}

static double bottom_part(const struct look *l, double a, struct pair ga, double b, struct pair gb, int depth)
{
    double forward = sin(b) - sin(a), mid;
    struct pair gm;

    if (depth == 0 || fabs(ga.ahead - gb.ahead) * fabs(forward) + fabs(ga.under - gb.under) * (b - a) < 20.0 * l->tolerance)
        return 0.5 * (ga.ahead + gb.ahead) * forward + 0.5 * (ga.under + gb.under) * (b - a);
    mid = 0.5 * (a + b);
    gm = on_meridian(l, mid);
    return bottom_part(l, a, ga, mid, gm, depth - 1) + bottom_part(l, mid, gm, b, gb, depth - 1);
}

static double bottom(const struct look *l)
{
    double from = l->down < 0.0 ? -M_PI : -0.5 * M_PI, to = -from, sum = 0.0, a = from;
    int n = 4 * (int)fmax(6.0, 0.25 * (to - from) * l->tool->radius / 0.35), i;
    struct pair ga;

    if (l->down >= 0.0 && l->tool->flat >= l->tool->radius)
        return 0.0;
    ga = on_meridian(l, a);
    for (i = 1; i <= n; i++) {
        double b = from + (to - from) * i / n;
        struct pair gb = on_meridian(l, b);
        sum += bottom_part(l, a, ga, b, gb, 6);
        a = b;
        ga = gb;
    }
    return sum;
}

/* mm2: stock met per mm of travel at `t` (0..1) of chord `number` */
static double area_at(struct history *h, int number, double t, double length)
{
    const struct chord *c = h->chords + number;
    struct look l;
    double plane = sqrt(c->l2);

    l.history = h;
    l.tool = c->tool;
    l.x = c->x + t * c->dx;
    l.y = c->y + t * c->dy;
    l.z = c->z + t * c->dz;
    l.across = plane / length;
    l.down = c->dz / length;
    if (fabs(l.down) < 1e-9)
        l.down = 0.0;
    l.ux = plane > 0.0 ? c->dx / plane : 1.0;
    l.uy = plane > 0.0 ? c->dy / plane : 0.0;
    l.tolerance = 3e-5 * fmax(h->blank->high - fmax(l.z, h->blank->low), 0.0) * c->tool->radius;
    if (l.tolerance <= 0.0)
        return 0.0;
    h->now = c;
    h->now_end = fmax(t - LAG / length, 0.0);
    return (l.across > 1e-9 ? rim(&l) : 0.0) + bottom(&l);
}

/* Section area in cells of at most `step` mm along the chords, longer for tools above 6 mm in proportion.
 * cells: (room, 2) path at the cell's end (mm), area in it (mm2).  -> number of cells, -1: no room */
long judge_areas(const double *blank, long tool_count, const double *sizes, long count, const double *ends,
                 const int *tool_of, double step, long room, double *cells)
{
    const struct blank *b = (const struct blank *)blank;
    struct run r = open_run(tool_count, sizes, count, ends, tool_of);
    struct history h;
    double path = 0.0;
    long i, k, made = 0;

    open_history_of(&h, b, &r);
    for (i = 0; i < count && made >= 0; i++) {
        const struct chord *c = r.chords + i;
        double length = sqrt(c->l2 + c->dz * c->dz);
        int air = in_air(b, c);
        long n = air ? 1 : (long)ceil(length / (step * fmax(1.0, c->tool->radius / 3.0)));
        n = n < 1 ? 1 : n;
        for (k = 0; k < n; k++) {
            if (made == room) {
                made = -1;
                break;
            }
            cells[2 * made] = path + length * (k + 1) / n;
            cells[2 * made + 1] = air || length <= 0.0 ? 0.0 : area_at(&h, (int)i, (k + 0.5) / n, length);
            made++;
        }
        path += length;
        if (!air)
            remember(&h, (int)i);
    }
    close_history(&h);
    close_run(&r);
    return made;
}
