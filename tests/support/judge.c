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
 * Units: mm, rad.  Numbers in brackets in the code are the ones above.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 1e-6          /* mm: a point this near the rim of an earlier cut is outside of it */
#define LAG 1e-3           /* mm of the path before now that do not count as history: no tie with the tool itself */
#define SKIN 1e-9          /* mm of stock that count as contact */
#define BACK 3e-5          /* mm: the log's rounding along the path (6 decimals, of an inch at worst) */
#define NONE (-1e30)
#define FAR 1e30

/* --- the tool ------------------------------------------------------------------------------- */

struct tool {
    double radius;              /* mm */
    double flat;                /* mm, radius of the flat at the tip */
    double corner;              /* mm, radius of the arc beside it */
    double turn;                /* rad, angle the arc goes through */
    double arc_r, arc_z;        /* mm, end of the arc */
    double slope;               /* of the cone from there to the radius */
};

/* diameter, corner radius, included tip angle (degrees, 0: no cone) -> tool */
static struct tool make_tool(const double *size)
{
    struct tool t;
    double R = 0.5 * size[0], corner = size[1], angle = size[2];

    t.radius = R;
    t.corner = corner;
    if (angle > 0.0) {
        t.slope = 1.0 / tan(angle * M_PI / 360.0);
        t.flat = 0.0;
        t.turn = atan(t.slope);
    } else {
        t.slope = 0.0;
        t.flat = R - corner;
        t.turn = 0.5 * M_PI;
    }
    t.arc_r = t.flat + corner * sin(t.turn);
    t.arc_z = corner * (1.0 - cos(t.turn));
    if (corner <= 0.0)
        t.arc_z = 0.0;
    return t;
}

/* height of the profile above the tip at radius r */
static double profile(const struct tool *t, double r)
{
    if (r <= t->flat)
        return 0.0;
    if (r < t->arc_r) {
        double x = r - t->flat;
        return t->corner - sqrt(fmax(t->corner * t->corner - x * x, 0.0));
    }
    return t->arc_z + (r - t->arc_r) * t->slope;
}

static double steepness(const struct tool *t, double r)
{
    if (r <= t->flat)
        return 0.0;
    if (r < t->arc_r) {
        double x = r - t->flat;
        return x / sqrt(fmax(t->corner * t->corner - x * x, 1e-18));
    }
    return t->slope;
}

/* --- the blank ------------------------------------------------------------------------------ */

struct blank {                  /* as tests/support/judge.py packs it */
    double round;               /* 0 box, 1 cylinder */
    double x, y;                /* centre */
    double half_x, half_y;      /* half the sides; of a cylinder the radius, twice */
    double cos_turn, sin_turn;
    double low, high;           /* z */
};

static int inside(const struct blank *b, double x, double y)
{
    double u = x - b->x, v = y - b->y;

    if (b->round > 0.5)
        return u * u + v * v < b->half_x * b->half_x;
    return fabs(b->cos_turn * u + b->sin_turn * v) < b->half_x && fabs(b->cos_turn * v - b->sin_turn * u) < b->half_y;
}

/* radius of a circle about the centre that holds the blank */
static double reach(const struct blank *b)
{
    return b->round > 0.5 ? b->half_x : sqrt(b->half_x * b->half_x + b->half_y * b->half_y);
}

/* --- (2) one chord ---------------------------------------------------------------------------- */

struct chord {
    double x, y, z, dx, dy, dz;
    double low;                 /* lower end's z */
    double l2;                  /* dx^2 + dy^2 */
    const struct tool *tool;
};

static double at(const struct chord *c, double t, double qx, double qy)
{
    double x = c->x + t * c->dx - qx, y = c->y + t * c->dy - qy;

    return c->z + t * c->dz + profile(c->tool, sqrt(x * x + y * y));
}

static double gain(const struct chord *c, double t, double qx, double qy)
{
    double x = c->x + t * c->dx - qx, y = c->y + t * c->dy - qy, r = sqrt(x * x + y * y);

    if (r < 1e-12)
        return c->dz;
    return c->dz + steepness(c->tool, r) * (x * c->dx + y * c->dy) / r;
}

/* Lowest the tool gets over (qx, qy) on the first `end` (0..1) of the chord, if below `best`; else FAR. */
static double swept(const struct chord *c, double qx, double qy, double end, double best)
{
    double px = qx - c->x, py = qy - c->y, R = c->tool->radius - EDGE, along, tn, ex, ey, d2, z, half, t0, t1, g0, g1;
    int i;

    along = c->l2 > 1e-18 ? (px * c->dx + py * c->dy) / c->l2 : 0.0;
    tn = along < 0.0 ? 0.0 : along > end ? end : along;
    ex = px - tn * c->dx;
    ey = py - tn * c->dy;
    d2 = ex * ex + ey * ey;
    if (d2 >= R * R)
        return FAR;
    z = profile(c->tool, sqrt(d2));
    if (fabs(c->dz) < 1e-9)
        return c->z + z;
    if (c->low + z >= best)
        return FAR;
    if (c->l2 <= 1e-18)
        return fmin(c->z, c->z + end * c->dz) + z;
    ex = px - along * c->dx;
    ey = py - along * c->dy;
    half = sqrt(fmax(R * R - ex * ex - ey * ey, 0.0) / c->l2);
    t0 = fmax(along - half, 0.0);
    t1 = fmin(along + half, end);
    if (t0 >= t1)
        return at(c, tn, qx, qy);
    g0 = gain(c, t0, qx, qy);
    if (g0 >= 0.0)
        return at(c, t0, qx, qy);
    g1 = gain(c, t1, qx, qy);
    if (g1 <= 0.0)
        return at(c, t1, qx, qy);
    for (i = 0; i < 60 && (t1 - t0) * fmin(-g0, g1) > 1e-9; i++) {      /* what is left to gain is less: g is convex */
        double mid = (i & 1) ? 0.5 * (t0 + t1) : t0 - g0 * (t1 - t0) / (g1 - g0), g;
        if (mid <= t0 || mid >= t1)
            mid = 0.5 * (t0 + t1);
        g = gain(c, mid, qx, qy);
        if (g > 0.0) {
            t1 = mid;
            g1 = g;
        } else {
            t0 = mid;
            g0 = g;
        }
    }
    return -g0 < g1 ? at(c, t0, qx, qy) : at(c, t1, qx, qy);
}

/* --- (2) all chords before now ------------------------------------------------------------------ */

struct patch {
    int count, room;
    int *chord;
};

struct history {
    const struct blank *blank;
    struct chord *chords;
    struct patch *patches;
    double x0, y0, side;
    int wide, high;
    const struct chord *now;    /* the chord being run, up to `now_end` of it */
    double now_end;
    long asked;
};

static void open_history(struct history *h, const struct blank *b, struct chord *chords, double side)
{
    double r = reach(b);

    memset(h, 0, sizeof *h);
    h->blank = b;
    h->chords = chords;
    h->side = side;
    h->x0 = b->x - r - side;
    h->y0 = b->y - r - side;
    h->wide = h->high = (int)(2.0 * (r + side) / side) + 2;
    h->patches = calloc((size_t)h->wide * h->high, sizeof *h->patches);
}

static void close_history(struct history *h)
{
    long i;

    for (i = 0; i < (long)h->wide * h->high; i++)
        free(h->patches[i].chord);
    free(h->patches);
}

static double gap(const struct chord *c, double qx, double qy)
{
    double px = qx - c->x, py = qy - c->y, t = c->l2 > 1e-18 ? (px * c->dx + py * c->dy) / c->l2 : 0.0;

    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return hypot(px - t * c->dx, py - t * c->dy);
}

static int limited(double value, int top)
{
    return value < 0.0 ? 0 : value > top ? top : (int)value;
}

static void remember(struct history *h, int number)
{
    const struct chord *c = h->chords + number;
    double R = c->tool->radius, x1 = c->x + c->dx, y1 = c->y + c->dy;
    int i0, i1, j0, j1, i, j;

    if (c->low >= h->blank->high)
        return;
    if (fmax(c->x, x1) + R < h->x0 || fmin(c->x, x1) - R > h->x0 + h->wide * h->side ||
        fmax(c->y, y1) + R < h->y0 || fmin(c->y, y1) - R > h->y0 + h->high * h->side)
        return;
    i0 = limited((fmin(c->x, x1) - R - h->x0) / h->side, h->wide - 1);
    i1 = limited((fmax(c->x, x1) + R - h->x0) / h->side, h->wide - 1);
    j0 = limited((fmin(c->y, y1) - R - h->y0) / h->side, h->high - 1);
    j1 = limited((fmax(c->y, y1) + R - h->y0) / h->side, h->high - 1);
    for (j = j0; j <= j1; j++) {
        for (i = i0; i <= i1; i++) {
            struct patch *p = h->patches + (long)j * h->wide + i;
            if (gap(c, h->x0 + (i + 0.5) * h->side, h->y0 + (j + 0.5) * h->side) > R + 0.7072 * h->side)
                continue;
            if (p->count == p->room) {
                p->room = p->room ? 2 * p->room : 16;
                p->chord = realloc(p->chord, (size_t)p->room * sizeof *p->chord);
            }
            p->chord[p->count++] = number;
        }
    }
}

/* height of the stock at a point; NONE outside the blank */
static double height(struct history *h, double qx, double qy)
{
    const struct patch *p;
    double best = h->blank->high, z;
    int k;

    if (!inside(h->blank, qx, qy))
        return NONE;
    h->asked++;
    if (h->now_end > 0.0) {
        z = swept(h->now, qx, qy, h->now_end, best);
        best = z < best ? z : best;
    }
    p = h->patches + (long)((qy - h->y0) / h->side) * h->wide + (long)((qx - h->x0) / h->side);
    for (k = p->count - 1; k >= 0; k--) {
        const struct chord *c = h->chords + p->chord[k];
        if (c->low >= best)
            continue;
        z = swept(c, qx, qy, 1.0, best);
        best = z < best ? z : best;
    }
    return best;
}

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

static int in_air(const struct blank *b, const struct chord *c)
{
    double r = reach(b) + c->tool->radius, u = b->x - c->x, v = b->y - c->y;
    double t = c->l2 > 1e-18 ? (u * c->dx + v * c->dy) / c->l2 : 0.0;

    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    return c->low >= b->high || hypot(u - t * c->dx, v - t * c->dy) > r;
}

static struct chord *make_chords(long count, const double *ends, const int *tool_of, const struct tool *tools)
{
    struct chord *made = calloc(count ? count : 1, sizeof *made);
    long i;

    for (i = 0; i < count; i++) {
        const double *e = ends + 6 * i;
        struct chord *c = made + i;
        c->x = e[0];
        c->y = e[1];
        c->z = e[2];
        c->dx = e[3] - e[0];
        c->dy = e[4] - e[1];
        c->dz = e[5] - e[2];
        c->low = fmin(e[2], e[5]);
        c->l2 = c->dx * c->dx + c->dy * c->dy;
        c->tool = tools + tool_of[i];
    }
    return made;
}

/* Section area in cells of at most `step` mm along the chords, longer for tools above 6 mm in proportion.
 * cells: (room, 2) path at the cell's end (mm), area in it (mm2).  -> number of cells, -1: no room */
long judge_areas(const double *blank, long tool_count, const double *sizes, long count, const double *ends,
                 const int *tool_of, double step, long room, double *cells)
{
    const struct blank *b = (const struct blank *)blank;
    struct tool *tools = calloc(tool_count, sizeof *tools);
    struct chord *chords;
    struct history h;
    double path = 0.0, widest = 0.0;
    long i, k, made = 0;

    for (i = 0; i < tool_count; i++) {
        tools[i] = make_tool(sizes + 3 * i);
        widest = fmax(widest, tools[i].radius);
    }
    chords = make_chords(count, ends, tool_of, tools);
    open_history(&h, b, chords, fmax(0.3, widest / 6.0));
    for (i = 0; i < count && made >= 0; i++) {
        const struct chord *c = chords + i;
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
    free(chords);
    free(tools);
    return made;
}

/* (4) The volume (mm3) gone at the end of every chord, by needles `spacing` apart on a grid turned by `turn`. */
int judge_needles(const double *blank, long tool_count, const double *sizes, long count, const double *ends,
                  const int *tool_of, double spacing, double turn, double *volume)
{
    const struct blank *b = (const struct blank *)blank;
    struct tool *tools = calloc(tool_count, sizeof *tools);
    double r = reach(b), co = cos(turn), si = sin(turn), gone = 0.0;
    int side = (int)(2.0 * r / spacing) + 3, i, j;
    float *needle = malloc((size_t)side * side * sizeof *needle);
    struct chord *chords;
    long k;

    if (!needle)
        return -1;
    for (k = 0; k < tool_count; k++)
        tools[k] = make_tool(sizes + 3 * k);
    chords = make_chords(count, ends, tool_of, tools);
    for (j = 0; j < side; j++) {
        for (i = 0; i < side; i++) {
            double u = (i - 0.5 * side + 0.237) * spacing, v = (j - 0.5 * side + 0.411) * spacing;
            needle[(long)j * side + i] = inside(b, b->x + co * u - si * v, b->y + si * u + co * v) ? (float)(b->high - b->low) : 0.0f;
        }
    }
    for (k = 0; k < count; k++) {
        const struct chord *c = chords + k;
        double R = c->tool->radius, u0, v0, u1, v1, z;
        int i0, i1, j0, j1;
        if (!in_air(b, c)) {
            u0 = co * (c->x - b->x) + si * (c->y - b->y);
            v0 = co * (c->y - b->y) - si * (c->x - b->x);
            u1 = u0 + co * c->dx + si * c->dy;
            v1 = v0 + co * c->dy - si * c->dx;
            j0 = limited((fmin(v0, v1) - R) / spacing + 0.5 * side - 0.411, side - 1);
            j1 = limited((fmax(v0, v1) + R) / spacing + 0.5 * side + 0.589, side - 1);
            for (j = j0; j <= j1; j++) {
                /* the chord's part that reaches this row bounds the columns */
                double v = (j - 0.5 * side + 0.411) * spacing, dv = v1 - v0, ta = 0.0, tb = 1.0;
                if (fabs(dv) > 1e-12) {
                    double p = (v - R - v0) / dv, q = (v + R - v0) / dv;
                    ta = fmax(fmin(p, q), 0.0);
                    tb = fmin(fmax(p, q), 1.0);
                    if (ta > tb)
                        continue;
                }
                double ua = u0 + ta * (u1 - u0), ub = u0 + tb * (u1 - u0);
                i0 = limited((fmin(ua, ub) - R) / spacing + 0.5 * side - 0.237, side - 1);
                i1 = limited((fmax(ua, ub) + R) / spacing + 0.5 * side + 0.763, side - 1);
                for (i = i0; i <= i1; i++) {
                    float *n = needle + (long)j * side + i;
                    double u = (i - 0.5 * side + 0.237) * spacing, old = *n;
                    if (old <= c->low - b->low || old <= 0.0)
                        continue;
                    z = swept(c, b->x + co * u - si * v, b->y + si * u + co * v, 1.0, old + b->low) - b->low;
                    if (z < 0.0)
                        z = 0.0;
                    if (z < old) {
                        gone += (old - (double)(float)z);
                        *n = (float)z;
                    }
                }
            }
        }
        volume[k] = gone * spacing * spacing;
    }
    free(needle);
    free(chords);
    free(tools);
    return 0;
}

/* --- (1) chords --------------------------------------------------------------------------------- */

/* whether samples a..b lie within `tolerance` of the chord from a to b, in order */
static int straight(const double *p, long a, long b, double tolerance)
{
    double d[3], l2 = 0.0, last = 0.0, back;
    long i;
    int k;

    for (k = 0; k < 3; k++) {
        d[k] = p[3 * b + k] - p[3 * a + k];
        l2 += d[k] * d[k];
    }
    if (l2 < 1e-18)
        return b == a + 1;
    back = BACK / sqrt(l2);
    for (i = a + 1; i < b; i++) {
        double t = 0.0, off = 0.0;
        for (k = 0; k < 3; k++)
            t += (p[3 * i + k] - p[3 * a + k]) * d[k];
        t /= l2;
        if (t < last - back || t > 1.0 + back)      /* turns back; BACK is the log's own rounding */
            return 0;
        last = fmax(t, last);
        for (k = 0; k < 3; k++) {
            double e = p[3 * i + k] - p[3 * a + k] - t * d[k];
            off += e * e;
        }
        if (off > tolerance * tolerance)
            return 0;
    }
    return 1;
}

/* Chords over the samples p (n, 3).  apart[i]: nothing is swept between i - 1 and i.
 * first, last (n,): sample numbers of the chord's ends; path (n,): mm travelled at each sample.  -> chords */
long judge_chords(long n, const double *p, const unsigned char *apart, double tolerance, long *first, long *last,
                  double *path)
{
    long a = 0, made = 0, i;
    double total = 0.0;

    path[0] = 0.0;
    while (a < n - 1) {
        long good = a + 1, top = n - 1, step = 1;
        double d[3], l2 = 0.0, length;
        int k;
        if (apart[a + 1]) {
            path[++a] = total;
            continue;
        }
        for (i = a + 1; i <= a + 8192 && i < n; i++)
            if (apart[i]) {
                top = i - 1;
                break;
            }
        if (top > a + 8192)
            top = a + 8192;
        while (good < top) {
            long next = good + step > top ? top : good + step;
            if (straight(p, a, next, tolerance)) {
                good = next;
                step *= 2;
            } else if (step == 1) {
                break;
            } else {
                step = step / 4 > 1 ? step / 4 : 1;
                top = next - 1;
            }
        }
        for (k = 0; k < 3; k++) {
            d[k] = p[3 * good + k] - p[3 * a + k];
            l2 += d[k] * d[k];
        }
        length = sqrt(l2);
        for (i = a + 1; i <= good; i++) {
            double t = 0.0;
            for (k = 0; k < 3; k++)
                t += (p[3 * i + k] - p[3 * a + k]) * d[k];
            path[i] = total + (l2 > 1e-18 ? t / length : 0.0);
            if (path[i] < path[i - 1])
                path[i] = path[i - 1];
        }
        total += length;
        if (l2 > 1e-18) {
            first[made] = a;
            last[made] = good;
            made++;
        } else {
            total -= length;
        }
        a = good;
    }
    return made;
}
