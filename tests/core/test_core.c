/* test_core.c - the C core against closed forms and hostile input, without Python.
 *
 * Who calls it: tests/python/test_core_c.py and `make test`, in two builds: with the
 * sanitizers and with the flags of the realtime build. Prints every failure and one closing
 * line; leaves with 1 when something failed. Lengths mm, volumes mm3.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../components/core/ahead.h"
#include "../../components/core/cw_math.h"
#include "../../components/core/feed.h"
#include "../../components/core/section.h"
#include "../../components/core/stock.h"
#include "../../components/core/sweep.h"
#include "../../components/core/tool.h"

#define ALL (1 << 30)           /* cells of work: no bound */
#define EXACT 1e-6            /* closed forms of the profile */

static int passed, failed;

#define CHECK(condition) check((condition) != 0, __LINE__, #condition)
#define NEAR(value, want, tolerance) near_to((value), (want), (tolerance), __LINE__, #value)

static void check(int ok, int line, const char *text)
{
    if (ok) { passed++; return; }
    failed++;
    printf("test_core.c:%d: %s\n", line, text);
}

static void near_to(double value, double want, double tolerance, int line, const char *text)
{
    if (fabs(value - want) <= tolerance) { passed++; return; }
    failed++;
    printf("test_core.c:%d: %s is %.9g, should be %.9g within %.3g\n", line, text, value, want,
           tolerance);
}

static struct cw_tool tool_of(double diameter, double corner, double tip)
{
    struct cw_tool tool;
    CHECK(cw_tool_init(&tool, diameter, corner, tip, 0.0) == CW_TOOL_OK);
    return tool;
}

/* A filled box; the caller frees it. */
static struct cw_stock *stock_of(double cell, double x0, double y0, double z0,
                                 double x1, double y1, double z1)
{
    const double low[3] = { x0, y0, z0 }, high[3] = { x1, y1, z1 };
    uint32_t cells = cw_stock_cells(cell, x1 - x0, y1 - y0);
    struct cw_stock *stock = calloc(1, cw_stock_bytes(cells));
    cw_stock_init(stock, cell, cells);
    CHECK(cw_stock_define(stock, low, high) == CW_STOCK_OK);
    while (!cw_stock_fill(stock, ALL)) continue;
    CHECK(cw_stock_ready(stock));
    return stock;
}

static struct cw_sweep placed(double x, double y, double z)
{
    const double tip[3] = { x, y, z };
    struct cw_sweep sweep;
    memset(&sweep, 0, sizeof sweep);
    cw_sweep_place(&sweep, tip);
    return sweep;
}

static double cut_to(struct cw_sweep *sweep, struct cw_stock *stock, const struct cw_tool *tool,
                     double x, double y, double z)
{
    const double tip[3] = { x, y, z };
    cw_sweep_to(sweep, tip);
    return cw_sweep_run(sweep, stock, tool, ALL, NULL);
}

/* Heights of the profile, and the radius a height reaches, of every kind of tool. */
static void test_profiles(void)
{
    struct cw_tool flat = tool_of(6, 0, 0), ball = tool_of(6, 3, 0), bull = tool_of(10, 2, 0);
    struct cw_tool vee = tool_of(6, 0, 60), taper = tool_of(6, 0.5, 20);
    const struct cw_tool *each[5];
    int i, n;
    each[0] = &flat; each[1] = &ball; each[2] = &bull; each[3] = &vee; each[4] = &taper;

    NEAR(cw_tool_height(&flat, 0), 0.0, 0);
    NEAR(cw_tool_height(&flat, 3), 0.0, 0);
    NEAR(cw_tool_height(&ball, 2), 0.7639320, EXACT);         /* 3 - sqrt(9 - 4) */
    NEAR(cw_tool_height(&ball, 3), 3.0, EXACT);
    NEAR(cw_tool_height(&bull, 3), 0.0, 0);                     /* flat up to 5 - 2 */
    NEAR(cw_tool_height(&bull, 4), 0.2679492, EXACT);         /* 2 - sqrt(4 - 1) */
    NEAR(cw_tool_height(&bull, 5), 2.0, EXACT);
    NEAR(cw_tool_height(&vee, 2), 3.4641016, EXACT);          /* 2 / tan 30 */
    NEAR(vee.shoulder, 5.1961524, EXACT);                     /* 3 / tan 30 */
    NEAR(taper.r_arc, 0.4924039, EXACT);                      /* 0.5 cos 10 */
    NEAR(taper.arc_top, 0.4131759, EXACT);                    /* 0.5 (1 - sin 10) */
    NEAR(cw_tool_height(&taper, 3), 14.6344605, EXACT);       /* arc_top + (3 - r_arc) / tan 10 */
    NEAR(cw_tool_reach(&ball, 0.7639320), 2.0, EXACT);
    NEAR(cw_tool_reach(&flat, 0.0), 0.0, 0);
    NEAR(cw_tool_reach(&flat, 1e-9), 3.0, 0);
    CHECK(cw_tool_is_flat(&flat) && !cw_tool_is_flat(&ball) && !cw_tool_is_flat(&vee));

    for (n = 0; n < 5; n++) {
        double rise = 0.0, plan = 0.0, front = 0.0, mean = 0.0;
        for (i = 0; i < 100; i++) {
            double a = each[n]->radius * i / 100, b = each[n]->radius * (i + 1) / 100;
            CHECK(cw_tool_height(each[n], b) >= cw_tool_height(each[n], a));
            if (cw_tool_height(each[n], b) > 0.0)
                NEAR(cw_tool_reach(each[n], cw_tool_height(each[n], b)), b, 1e-6);
        }
        CHECK(each[n]->rings > 0 && each[n]->rings <= CW_TOOL_RINGS);
        for (i = 0; i < each[n]->rings; i++) {
            rise += each[n]->ring[i].rise;
            plan += 2.0 * each[n]->ring[i].radius * each[n]->ring[i].run;
            front += 2.0 * each[n]->ring[i].radius * each[n]->ring[i].rise;
        }
        for (i = 0; i < 20000; i++)             /* the same area, strip by strip in height */
            mean += cw_tool_reach(each[n], each[n]->shoulder * (i + 0.5) / 20000);
        NEAR(rise, each[n]->shoulder, 1e-9);    /* the bands are the whole end */
        NEAR(plan, each[n]->radius * each[n]->radius, 1e-9);
        NEAR(front, 2.0 * mean * each[n]->shoulder / 20000, 1e-4 * each[n]->radius);
    }
}

static void test_tool_errors(void)
{
    struct cw_tool tool;
    CHECK(cw_tool_init(&tool, 0, 0, 0, 0) == CW_TOOL_DIAMETER);
    CHECK(cw_tool_init(&tool, -1, 0, 0, 0) == CW_TOOL_DIAMETER);
    CHECK(cw_tool_init(&tool, NAN, 0, 0, 0) == CW_TOOL_DIAMETER);
    CHECK(cw_tool_init(&tool, INFINITY, 0, 0, 0) == CW_TOOL_DIAMETER);
    CHECK(cw_tool_init(&tool, 6, -1, 0, 0) == CW_TOOL_CORNER);
    CHECK(cw_tool_init(&tool, 6, 3.1, 0, 0) == CW_TOOL_CORNER);
    CHECK(cw_tool_init(&tool, 6, NAN, 0, 0) == CW_TOOL_CORNER);
    CHECK(cw_tool_init(&tool, 6, 0, 180, 0) == CW_TOOL_ANGLE);
    CHECK(cw_tool_init(&tool, 6, 0, -1, 0) == CW_TOOL_ANGLE);
    CHECK(cw_tool_init(&tool, 6, 0, NAN, 0) == CW_TOOL_ANGLE);
    CHECK(cw_tool_init(&tool, 6, 0, 0, -1) == CW_TOOL_FLUTE);
    CHECK(cw_tool_init(&tool, 6, 0, 0, INFINITY) == CW_TOOL_FLUTE);
    CHECK(tool.radius == 0.0 && tool.rings == 0);
}

/* A refused box leaves the stock, cuts and all, as it was. */
static void test_define_errors(void)
{
    struct cw_stock *stock = stock_of(0.5, 0, 0, -5, 10, 10, 0);
    struct cw_tool tool = tool_of(4, 0, 0);
    struct cw_sweep sweep = placed(2, 5, -2);
    const double good_low[3] = { 0, 0, -5 }, good_high[3] = { 10, 10, 0 };
    const double bad[5] = { NAN, INFINITY, -INFINITY, 1e308, -1e308 };
    uint64_t bytes = cw_stock_bytes(stock->capacity);
    struct cw_stock *before = malloc(bytes);
    int axis, side, i;

    CHECK(cut_to(&sweep, stock, &tool, 8, 5, -2) > 0.0);
    memcpy(before, stock, bytes);
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 2; side++)
            for (i = 0; i < 5; i++) {
                double low[3], high[3];
                int error;
                memcpy(low, good_low, sizeof low);
                memcpy(high, good_high, sizeof high);
                (side ? high : low)[axis] = bad[i];
                error = cw_stock_define(stock, low, high);
                if (i < 3) CHECK(error == CW_STOCK_NOT_FINITE);
                if (axis < 2) CHECK(error != CW_STOCK_OK);
                if (error) CHECK(memcmp(before, stock, bytes) == 0);
                else memcpy(stock, before, bytes);      /* a very high box is a box */
            }
    for (axis = 0; axis < 3; axis++) {
        double high[3];
        memcpy(high, good_high, sizeof high);
        high[axis] = good_low[axis];
        CHECK(cw_stock_define(stock, good_low, high) == CW_STOCK_EMPTY);
        high[axis] -= 1.0;
        CHECK(cw_stock_define(stock, good_low, high) == CW_STOCK_EMPTY);
    }
    {
        const double wide[3] = { 10.6, 10, 0 };
        CHECK(cw_stock_define(stock, good_low, wide) == CW_STOCK_TOO_LARGE);
    }
    CHECK(memcmp(before, stock, bytes) == 0);
    CHECK(cw_stock_cells(0.25, NAN, 1) == 0 && cw_stock_cells(0, 1, 1) == 0);
    CHECK(cw_stock_cells(-1, 1, 1) == 0 && cw_stock_cells(1e-9, 1, 1) == 0);
    CHECK(cw_stock_cells(0.5, 10, 10) == 22 * 22);
    free(before);
    free(stock);
}

/* Boxes that are no multiple of the cell, filled in small portions. */
static void test_box(void)
{
    const double low[3] = { -1.3, 2.7, -4.1 }, high[3] = { 6.04, 8.99, 0.35 };
    double volume = 7.34 * 6.29 * 4.45;
    uint32_t cells = cw_stock_cells(0.25, 7.34, 6.29);
    struct cw_stock *stock = calloc(1, cw_stock_bytes(cells));
    int calls = 0;
    cw_stock_init(stock, 0.25, cells);
    CHECK(!cw_stock_ready(stock));
    CHECK(!cw_stock_fill(stock, 10));           /* nothing defined */
    CHECK(cw_stock_define(stock, low, high) == CW_STOCK_OK);
    CHECK(!cw_stock_ready(stock));
    while (!cw_stock_fill(stock, 1)) CHECK(++calls < 100);
    CHECK(calls == stock->ny + 1);              /* one row a call, ring included */
    CHECK(stock->generation % 2 == 0);
    NEAR(cw_stock_volume(stock), volume, 1e-4 * volume);
    NEAR(cw_stock_above(stock, 2.0, 5.0, -4.1), 4.45, 1e-5);
    NEAR(cw_stock_above(stock, 2.0, 5.0, 0.35), 0.0, 1e-5);
    NEAR(cw_stock_above(stock, 200.0, 5.0, -4.1), 0.0, 0);
    NEAR(cw_stock_above(stock, NAN, 5.0, -4.1), 0.0, 0);
    NEAR(cw_stock_above(stock, -INFINITY, INFINITY, -4.1), 0.0, 0);
    free(stock);
}

/* Removed volume of moves with a closed form, 0.1 mm cells, within 0.1 %. */
static void test_volumes(void)
{
    const double pi = CW_PI;
    struct { double d, corner, tip, x0, z0, x1, z1, want; } move[] = {
        { 6, 0, 0, -6, -2, 6, -2, 2 * (6 * 12 + pi * 9) },              /* slot: depth x stadium */
        { 6, 0, 0, 0, 1, 0, -3, 3 * pi * 9 },                           /* plunge: cylinder */
        { 6, 0, 0, -6, 0, 6, -2, 3 * 2 * 12 + pi * 9 * 2 },             /* ramp: R d L + pi R^2 d */
        { 6, 3, 0, -6, -3, 6, -3, 4.5 * pi * 12 + 18 * pi },            /* half cylinder + half ball */
        { 6, 3, 0, 0, 1, 0, -1, pi * 8 / 3 },                           /* cap: pi h^2 (3R - h) / 3 */
        { 8, 0, 90, -6, -3, 6, -3, 9 * 12 + 9 * pi },                   /* h^2 L + pi h^3 / 3 */
        { 8, 0, 90, 0, 1, 0, -3, 9 * pi },                              /* cone */
    };
    size_t i;
    for (i = 0; i < sizeof move / sizeof *move; i++) {
        struct cw_stock *stock = stock_of(0.1, -10.03, -5.02, -5, 10.01, 5.04, 0);
        struct cw_tool tool = tool_of(move[i].d, move[i].corner, move[i].tip);
        struct cw_sweep sweep = placed(move[i].x0, 0.0, move[i].z0);
        double whole = cw_stock_volume(stock), removed;
        removed = cut_to(&sweep, stock, &tool, move[i].x1, 0.0, move[i].z1);
        NEAR(removed, move[i].want, 0.001 * move[i].want);
        NEAR(whole - cw_stock_volume(stock), removed, 1e-6 * whole);
        NEAR(stock->removed, removed, 1e-9 * whole);
        /* cutting the same again, and the way back, takes nothing */
        removed = cut_to(&sweep, stock, &tool, move[i].x0, 0.0, move[i].z0);
        NEAR(removed, 0.0, 1e-5 * move[i].want);
        removed = cut_to(&sweep, stock, &tool, move[i].x1, 0.0, move[i].z1);
        NEAR(removed, 0.0, 1e-5 * move[i].want);
        free(stock);
    }
}

/* One leg and the same way in 1200 legs. */
static void test_small_legs(void)
{
    const double corner[2] = { 0.0, 3.0 };
    int n, i;
    for (n = 0; n < 2; n++) {
        struct cw_stock *one = stock_of(0.25, -10, -10, -5, 10, 10, 0);
        struct cw_stock *many = stock_of(0.25, -10, -10, -5, 10, 10, 0);
        struct cw_tool tool = tool_of(6, corner[n], 0);
        struct cw_sweep a = placed(-6, -2, -2), b = placed(-6, -2, -2);
        double at_once = cut_to(&a, one, &tool, 6, 3, -2), sum = 0.0;
        for (i = 1; i <= 1200; i++)
            sum += cut_to(&b, many, &tool, -6 + 12.0 * i / 1200, -2 + 5.0 * i / 1200, -2);
        NEAR(sum, at_once, 0.003 * at_once);
        free(one);
        free(many);
    }
}

/* Work cut into calls of one cell each gives the very same map. */
static void test_bounded_work(void)
{
    const double tip[5][3] = { { 6, 3, -2 }, { 6, 3, -1 }, { -4, 5, -3 }, { -4, -5, -3 }, { 0, 0, 5 } };
    struct cw_stock *one = stock_of(0.25, -10, -10, -5, 10, 10, 0);
    struct cw_stock *split = stock_of(0.25, -10, -10, -5, 10, 10, 0);
    struct cw_tool tool = tool_of(5, 1, 0);
    struct cw_sweep a = placed(-6, -2, -2), b = placed(-6, -2, -2);
    double at_once, sum = 0.0;
    long most = 0, work_of_all = 0;
    int i, calls = 0;
    for (i = 0; i < 5; i++) { cw_sweep_to(&a, tip[i]); cw_sweep_to(&b, tip[i]); }
    at_once = cw_sweep_run(&a, one, &tool, ALL, &work_of_all);
    while (b.waiting) {
        long work = 0;
        sum += cw_sweep_run(&b, split, &tool, 1, &work);
        if (work > most) most = work;
        if (++calls > 1000000) break;
    }
    NEAR(sum, at_once, 1e-9 * at_once);
    CHECK(most <= 1100);                        /* one cell that is looked for along the leg, at four points */
    CHECK(memcmp(one->cells, split->cells, (size_t)82 * 82 * sizeof(struct cw_cell)) == 0);
    CHECK(work_of_all > 0 && one->generation % 2 == 0 && split->generation % 2 == 0);
    free(one);
    free(split);
}

/* More points than the queue takes: the last one is always reached. */
static void test_queue(void)
{
    struct cw_stock *stock = stock_of(0.5, -10, -10, -5, 10, 10, 0);
    struct cw_tool tool = tool_of(4, 0, 0);
    struct cw_sweep sweep = placed(-8, 0, -1);
    double tip[3] = { 0, 0, -1 };
    int i;
    for (i = 1; i <= 160; i++) {
        tip[0] = -8 + 0.1 * i;
        cw_sweep_to(&sweep, tip);
        CHECK(sweep.waiting <= CW_SWEEP_QUEUE);
    }
    cw_sweep_run(&sweep, stock, &tool, ALL, NULL);
    NEAR(sweep.at[0], 8.0, 1e-12);
    NEAR(stock->removed, 1 * (4 * 16 + CW_PI * 4), 0.005 * 76);     /* straight: nothing is lost */
    free(stock);
}

/* A position that is no number, or absurd, is not cut and writes nowhere. */
static void test_hostile_tips(void)
{
    const double bad[8] = { NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e18, -1e18, 3e9 };
    const double corner[3] = { 0, 1, 2 };
    int i, axis, kind;
    for (kind = 0; kind < 3; kind++)
        for (axis = 0; axis < 3; axis++)
            for (i = 0; i < 8; i++) {
                struct cw_stock *stock = stock_of(0.5, -5, -5, -5, 5, 5, 0);
                struct cw_tool tool = tool_of(4, corner[kind], 0);
                struct cw_sweep sweep = placed(0, 0, 1);
                double tip[3] = { 0, 0, 1 }, unit[3] = { 1, 0, 0 }, low[3] = { 0, 0, -1 };
                struct cw_section met;
                struct cw_ahead ahead;
                struct cw_ahead_view view;
                int k;
                tip[axis] = bad[i];
                cw_sweep_to(&sweep, tip);
                cw_sweep_run(&sweep, stock, &tool, ALL, NULL);
                CHECK(cw_stock_volume(stock) >= 0.0 && cw_stock_volume(stock) <= 500.001);
                cut_to(&sweep, stock, &tool, 1, 0, -1);
                CHECK(cw_finite(stock->removed) && stock->removed >= 0.0);
                met = cw_section_at(stock, &tool, tip, unit, cw_section_clear(stock), 0.0);
                CHECK(!(met.area < 0.0));
                memset(&ahead, 0, sizeof ahead);
                cw_ahead_reset(&ahead);
                cw_ahead_step(&ahead, stock, &tool, low, tip, 0.001, 5.0, 1000);
                cw_ahead_look(&ahead, stock, &tool, 5.0, &view);
                for (k = 0; k < 20; k++) {      /* and on with a sound way */
                    double from[3] = { 0.02 * k, 0, -1 }, to[3] = { 0.02 * k + 0.02, 0, -1 };
                    cw_ahead_step(&ahead, stock, &tool, from, to, 0.001, 5.0, 1000);
                }
                cw_ahead_look(&ahead, stock, &tool, 5.0, &view);
                CHECK(cw_finite(view.area) && view.levels >= 1 && view.levels <= CW_AHEAD_LEVELS);
                for (k = 0; k < view.levels; k++)
                    CHECK(cw_finite(view.level[k].area) && cw_finite(view.level[k].distance));
                free(stock);
            }
}

/* Section areas with a closed form in fresh stock, 0.25 mm cells, within 1 %. */
static void test_sections(void)
{
    const double angle[5] = { 0, 17, 31, 45, 73 };
    struct cw_stock *stock = stock_of(0.25, -30, -30, -10, 30, 30, 0);
    struct { double d, corner, tip, z, want; } shape[] = {
        { 6, 0, 0, -2, 12 },                            /* D x depth */
        { 6, 3, 0, -3, 14.1371669 },                    /* half disc: pi R^2 / 2 */
        { 6, 3, 0, -5, 14.1371669 + 12 },               /* and D x (depth - R) above */
        { 10, 2, 0, -2, 18.2831853 },                   /* 2 c^2 (1 - pi/4) less than D c */
        { 8, 0, 90, -3, 9 },                            /* triangle h^2 */
    };
    size_t i;
    int n;
    for (i = 0; i < sizeof shape / sizeof *shape; i++)
        for (n = 0; n < 5; n++) {
            double a = angle[n] * CW_PI / 180.0, down[3] = { 0, 0, -1 };
            double dir[3] = { cos(a), sin(a), 0 }, tip[3] = { 0.37, -0.21, shape[i].z };
            struct cw_tool tool = tool_of(shape[i].d, shape[i].corner, shape[i].tip);
            struct cw_section met = cw_section_at(stock, &tool, tip, dir, cw_section_clear(stock), 0.0);
            NEAR(met.area, shape[i].want, 0.01 * shape[i].want);
            NEAR(met.depth, -shape[i].z, 0.03 * -shape[i].z);
            if (shape[i].corner == 0.0 && shape[i].tip == 0.0) {
                met = cw_section_at(stock, &tool, tip, down, cw_section_clear(stock), 0.0);       /* plunge: the disc */
                NEAR(met.area, CW_PI * 9, 0.01 * CW_PI * 9);
            }
            tip[2] = 0.5;
            met = cw_section_at(stock, &tool, tip, dir, cw_section_clear(stock), 0.0);            /* above the stock */
            NEAR(met.area, 0.0, 0);
        }
    free(stock);
}

static struct cw_feed_in calm(void)
{
    struct cw_feed_in in;
    memset(&in, 0, sizeof in);
    in.kind = CW_FEED_LIMIT;
    in.target = 60.0;
    in.programmed = in.requested = 10.0;
    in.motion = CW_MOTION_FEED;
    in.accel = 500.0;
    in.dt = 0.001;
    in.trusted = 1;
    return in;
}

static void test_feed_law(void)
{
    struct cw_feed_in in = calm();
    in.area = 12.0;                             /* 60 / 12 = 5 mm/s of 10 */
    NEAR(cw_feed(&in, 1.0).scale, 0.5, 1e-12);
    CHECK(cw_feed(&in, 1.0).by == CW_BY_STOCK_HERE);
    in.area = 3.0;                              /* 20 mm/s allowed: F stays */
    NEAR(cw_feed(&in, 1.0).scale, 1.0, 0);
    in.area = 0.0;
    in.next_area[3] = 60.0;                    /* 1 mm/s in 0.02 + 0.05 mm: sqrt(1 + 500 x 0.05) */
    in.next_distance[3] = 0.07;                /* 0.02 = two periods at 10 mm/s */
    NEAR(cw_feed(&in, 1.0).scale, 0.50990195, 1e-6);
    CHECK(cw_feed(&in, 1.0).by == CW_BY_STOCK_AHEAD);
    NEAR(cw_feed(&in, NAN).scale, 0.50990195, 1e-6);        /* unknown: as if at full speed */
    in.target = NAN;
    NEAR(cw_feed(&in, 1.0).scale, 1.0, 0);
    CHECK(cw_feed(&in, 1.0).by == CW_BY_FALLBACK);
}

/* Whatever comes in, the scale is a number in [0, 1]. */
static void test_feed_hostile(void)
{
    const double odd[] = { NAN, INFINITY, -INFINITY, 0.0, -0.0, -1.0, 1.0, 60.0, 1e-9, 5e-324, 1e308,
                           -1e308, 1e-308 };
    const int n = sizeof odd / sizeof *odd;
    struct cw_feed_easing easing = { 0.0, 0.0, 0 };
    int i, bad = 0;
    srand(20);
    for (i = 0; i < 300000; i++) {
        struct cw_feed_in in = calm();
        struct cw_feed_out out;
        double *field[20], last = 1.0;
        int k, hits = 1 + rand() % 9;
        field[0] = &in.target; field[1] = &in.lower; field[2] = &in.programmed;
        field[3] = &in.requested; field[4] = &in.accel; field[5] = &in.floor;
        field[6] = &in.dt; field[7] = &in.area;
        for (k = 8; k < 20; k++) field[k] = &in.tool_target + (k - 8);  /* the doubles to the end */
        in.area = 12.0;
        in.kind = rand() % 6 - 1;
        in.motion = rand() % 4;
        in.trusted = rand() % 8 != 0;
        for (k = 0; k < hits; k++) {
            int which = rand() % 23;
            double value = odd[rand() % n];
            if (which < 20) *field[which] = value;
            else if (which == 20) in.next_area[rand() % CW_FEED_LEVELS] = value;
            else if (which == 21) in.next_distance[rand() % CW_FEED_LEVELS] = value;
            else last = value;
        }
        out = cw_feed(&in, last);
        if (!(out.scale >= 0.0 && out.scale <= 1.0)) bad++;
        if (out.by < CW_BY_NOTHING || out.by > CW_BY_FALLBACK) bad++;
        last = cw_feed_ease(&easing, &in, out, odd[rand() % n], odd[rand() % n]).scale;
        if (!(last >= 0.0 && last <= out.scale)) bad++;
    }
    CHECK(bad == 0);
}

int main(void)
{
    test_profiles();
    test_tool_errors();
    test_define_errors();
    test_box();
    test_volumes();
    test_small_legs();
    test_bounded_work();
    test_queue();
    test_hostile_tips();
    test_sections();
    test_feed_law();
    test_feed_hostile();
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}
