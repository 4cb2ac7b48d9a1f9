/* SPDX-License-Identifier: GPL-2.0-or-later */
/* test_core.c - tool, stock and sweep of the C core against closed forms and hostile input, without Python.
 *
 * Who calls it: `make test`, tests/core/test_sabotage.py with the flags of the realtime build, and
 * tests/core/test_sanitized.py. Prints every failure and one closing line; leaves with 1 when
 * something failed. Lengths mm, volumes mm3.
 */
#include "core_checks.h"

#define EXACT 1e-6 /* closed forms of the profile */

/* Heights of the profile, and the radius a height reaches, of every kind of tool. */
static void test_profiles(void)
{
    struct chip_tool flat = tool_of(6, 0, 0), ball = tool_of(6, 3, 0), bull = tool_of(10, 2, 0);
    struct chip_tool vee = tool_of(6, 0, 60), taper = tool_of(6, 0.5, 20);
    const struct chip_tool *each[5];
    int i, n;
    each[0] = &flat;
    each[1] = &ball;
    each[2] = &bull;
    each[3] = &vee;
    each[4] = &taper;

    NEAR(chip_tool_height(&flat, 0), 0.0, 0);
    NEAR(chip_tool_height(&flat, 3), 0.0, 0);
    NEAR(chip_tool_height(&ball, 2), 0.7639320, EXACT); /* 3 - sqrt(9 - 4) */
    NEAR(chip_tool_height(&ball, 3), 3.0, EXACT);
    NEAR(chip_tool_height(&bull, 3), 0.0, 0);           /* flat up to 5 - 2 */
    NEAR(chip_tool_height(&bull, 4), 0.2679492, EXACT); /* 2 - sqrt(4 - 1) */
    NEAR(chip_tool_height(&bull, 5), 2.0, EXACT);
    NEAR(chip_tool_height(&vee, 2), 3.4641016, EXACT);    /* 2 / tan 30 */
    NEAR(vee.shoulder, 5.1961524, EXACT);                 /* 3 / tan 30 */
    NEAR(taper.r_arc, 0.4924039, EXACT);                  /* 0.5 cos 10 */
    NEAR(taper.arc_top, 0.4131759, EXACT);                /* 0.5 (1 - sin 10) */
    NEAR(chip_tool_height(&taper, 3), 14.6344605, EXACT); /* arc_top + (3 - r_arc) / tan 10 */
    NEAR(chip_tool_reach(&ball, 0.7639320), 2.0, EXACT);
    NEAR(chip_tool_reach(&flat, 0.0), 0.0, 0);
    NEAR(chip_tool_reach(&flat, 1e-9), 3.0, 0);
    CHECK(chip_tool_is_flat(&flat) && !chip_tool_is_flat(&ball) && !chip_tool_is_flat(&vee));

    for (n = 0; n < 5; n++) {
        double rise = 0.0, plan = 0.0, front = 0.0, mean = 0.0;
        for (i = 0; i < 100; i++) {
            double a = each[n]->radius * i / 100, b = each[n]->radius * (i + 1) / 100;
            CHECK(chip_tool_height(each[n], b) >= chip_tool_height(each[n], a));
            if (chip_tool_height(each[n], b) > 0.0)
                NEAR(chip_tool_reach(each[n], chip_tool_height(each[n], b)), b, 1e-6);
        }
        CHECK(each[n]->rings > 0 && each[n]->rings <= CHIP_TOOL_RINGS);
        for (i = 0; i < each[n]->rings; i++) {
            rise += each[n]->ring[i].rise;
            plan += 2.0 * each[n]->ring[i].radius * each[n]->ring[i].run;
            front += 2.0 * each[n]->ring[i].radius * each[n]->ring[i].rise;
        }
        for (i = 0; i < 20000; i++) /* the same area, strip by strip in height */
            mean += chip_tool_reach(each[n], each[n]->shoulder * (i + 0.5) / 20000);
        NEAR(rise, each[n]->shoulder, 1e-9); /* the bands are the whole end */
        NEAR(plan, each[n]->radius * each[n]->radius, 1e-9);
        NEAR(front, 2.0 * mean * each[n]->shoulder / 20000, 1e-4 * each[n]->radius);
    }
}

static void test_tool_errors(void)
{
    struct chip_tool tool;
    CHECK(chip_tool_init(&tool, 0, 0, 0, 0) == CHIP_TOOL_DIAMETER);
    CHECK(chip_tool_init(&tool, -1, 0, 0, 0) == CHIP_TOOL_DIAMETER);
    CHECK(chip_tool_init(&tool, NAN, 0, 0, 0) == CHIP_TOOL_DIAMETER);
    CHECK(chip_tool_init(&tool, INFINITY, 0, 0, 0) == CHIP_TOOL_DIAMETER);
    CHECK(chip_tool_init(&tool, 6, -1, 0, 0) == CHIP_TOOL_CORNER);
    CHECK(chip_tool_init(&tool, 6, 3.1, 0, 0) == CHIP_TOOL_CORNER);
    CHECK(chip_tool_init(&tool, 6, NAN, 0, 0) == CHIP_TOOL_CORNER);
    CHECK(chip_tool_init(&tool, 6, 0, 180, 0) == CHIP_TOOL_ANGLE);
    CHECK(chip_tool_init(&tool, 6, 0, -1, 0) == CHIP_TOOL_ANGLE);
    CHECK(chip_tool_init(&tool, 6, 0, NAN, 0) == CHIP_TOOL_ANGLE);
    CHECK(chip_tool_init(&tool, 6, 0, 0, -1) == CHIP_TOOL_FLUTE);
    CHECK(chip_tool_init(&tool, 6, 0, 0, INFINITY) == CHIP_TOOL_FLUTE);
    CHECK(tool.radius == 0.0 && tool.rings == 0);
}

/* A refused box leaves the stock, cuts and all, as it was. */
static void test_define_errors(void)
{
    struct chip_stock *stock = stock_of(0.5, 0, 0, -5, 10, 10, 0);
    struct chip_tool tool = tool_of(4, 0, 0);
    struct chip_sweep sweep = placed(2, 5, -2);
    const double good_low[3] = { 0, 0, -5 }, good_high[3] = { 10, 10, 0 };
    const double bad[5] = { NAN, INFINITY, -INFINITY, 1e308, -1e308 };
    uint64_t bytes = chip_stock_bytes(stock->capacity);
    struct chip_stock *before = malloc(bytes);
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
                error = chip_stock_define(stock, low, high);
                if (i < 3) CHECK(error == CHIP_STOCK_NOT_FINITE);
                if (axis < 2) CHECK(error != CHIP_STOCK_OK);
                if (error)
                    CHECK(memcmp(before, stock, bytes) == 0);
                else
                    memcpy(stock, before, bytes); /* a very high box is a box */
            }
    for (axis = 0; axis < 3; axis++) {
        double high[3];
        memcpy(high, good_high, sizeof high);
        high[axis] = good_low[axis];
        CHECK(chip_stock_define(stock, good_low, high) == CHIP_STOCK_EMPTY);
        high[axis] -= 1.0;
        CHECK(chip_stock_define(stock, good_low, high) == CHIP_STOCK_EMPTY);
    }
    {
        const double wide[3] = { 10.6, 10, 0 };
        CHECK(chip_stock_define(stock, good_low, wide) == CHIP_STOCK_TOO_LARGE);
    }
    CHECK(memcmp(before, stock, bytes) == 0);
    CHECK(chip_stock_cells(0.25, NAN, 1) == 0 && chip_stock_cells(0, 1, 1) == 0);
    CHECK(chip_stock_cells(-1, 1, 1) == 0 && chip_stock_cells(1e-9, 1, 1) == 0);
    CHECK(chip_stock_cells(0.5, 10, 10) == 22 * 22);
    free(before);
    free(stock);
}

/* Boxes whose sizes are not multiples of the cell, filled in small portions. */
static void test_box(void)
{
    const double low[3] = { -1.3, 2.7, -4.1 }, high[3] = { 6.04, 8.99, 0.35 };
    double volume = 7.34 * 6.29 * 4.45;
    uint32_t cells = chip_stock_cells(0.25, 7.34, 6.29);
    struct chip_stock *stock = calloc(1, chip_stock_bytes(cells));
    int calls = 0;
    chip_stock_init(stock, 0.25, cells);
    CHECK(!chip_stock_ready(stock));
    CHECK(!chip_stock_fill(stock, 10)); /* nothing defined */
    CHECK(chip_stock_define(stock, low, high) == CHIP_STOCK_OK);
    CHECK(!chip_stock_ready(stock));
    while (!chip_stock_fill(stock, 1)) CHECK(++calls < 100);
    CHECK(calls == stock->ny + 1); /* one row a call, ring included */
    CHECK(stock->generation % 2 == 0);
    NEAR(chip_stock_volume(stock), volume, 1e-4 * volume);
    NEAR(chip_stock_above(stock, 2.0, 5.0, -4.1), 4.45, 1e-5);
    NEAR(chip_stock_above(stock, 2.0, 5.0, 0.35), 0.0, 1e-5);
    NEAR(chip_stock_above(stock, 200.0, 5.0, -4.1), 0.0, 0);
    NEAR(chip_stock_above(stock, NAN, 5.0, -4.1), 0.0, 0);
    NEAR(chip_stock_above(stock, -INFINITY, INFINITY, -4.1), 0.0, 0);
    free(stock);
}

/* Removed volume of moves with a closed form, 0.1 mm cells, within 0.1 %. */
static void test_volumes(void)
{
    const double pi = CHIP_PI;
    struct {
        double d, corner, tip, x0, z0, x1, z1, want;
    } move[] = {
        { 6, 0, 0, -6, -2, 6, -2, 2 * (6 * 12 + pi * 9) },   /* slot: depth x stadium */
        { 6, 0, 0, 0, 1, 0, -3, 3 * pi * 9 },                /* plunge: cylinder */
        { 6, 0, 0, -6, 0, 6, -2, 3 * 2 * 12 + pi * 9 * 2 },  /* ramp: R d L + pi R^2 d */
        { 6, 3, 0, -6, -3, 6, -3, 4.5 * pi * 12 + 18 * pi }, /* half cylinder + half ball */
        { 6, 3, 0, 0, 1, 0, -1, pi * 8 / 3 },                /* cap: pi h^2 (3R - h) / 3 */
        { 8, 0, 90, -6, -3, 6, -3, 9 * 12 + 9 * pi },        /* h^2 L + pi h^3 / 3 */
        { 8, 0, 90, 0, 1, 0, -3, 9 * pi },                   /* cone */
    };
    size_t i;
    for (i = 0; i < sizeof move / sizeof *move; i++) {
        struct chip_stock *stock = stock_of(0.1, -10.03, -5.02, -5, 10.01, 5.04, 0);
        struct chip_tool tool = tool_of(move[i].d, move[i].corner, move[i].tip);
        struct chip_sweep sweep = placed(move[i].x0, 0.0, move[i].z0);
        double whole = chip_stock_volume(stock), removed;
        removed = cut_to(&sweep, stock, &tool, move[i].x1, 0.0, move[i].z1);
        NEAR(removed, move[i].want, 0.001 * move[i].want);
        NEAR(whole - chip_stock_volume(stock), removed, 1e-6 * whole);
        NEAR(stock->removed, removed, 1e-9 * whole);
        /* cutting the same again, and the way back, takes nothing */
        removed = cut_to(&sweep, stock, &tool, move[i].x0, 0.0, move[i].z0);
        NEAR(removed, 0.0, 1e-5 * move[i].want);
        removed = cut_to(&sweep, stock, &tool, move[i].x1, 0.0, move[i].z1);
        NEAR(removed, 0.0, 1e-5 * move[i].want);
        free(stock);
    }
}

/* One straight move and the same in 1200 moves. */
static void test_small_legs(void)
{
    const double corner[2] = { 0.0, 3.0 };
    int n, i;
    for (n = 0; n < 2; n++) {
        struct chip_stock *one = stock_of(0.25, -10, -10, -5, 10, 10, 0);
        struct chip_stock *many = stock_of(0.25, -10, -10, -5, 10, 10, 0);
        struct chip_tool tool = tool_of(6, corner[n], 0);
        struct chip_sweep a = placed(-6, -2, -2), b = placed(-6, -2, -2);
        double at_once = cut_to(&a, one, &tool, 6, 3, -2), sum = 0.0;
        for (i = 1; i <= 1200; i++) sum += cut_to(&b, many, &tool, -6 + 12.0 * i / 1200, -2 + 5.0 * i / 1200, -2);
        NEAR(sum, at_once, 0.003 * at_once);
        free(one);
        free(many);
    }
}

/* Work cut into calls of one cell each gives the very same map. */
static void test_bounded_work(void)
{
    const double tip[5][3] = { { 6, 3, -2 }, { 6, 3, -1 }, { -4, 5, -3 }, { -4, -5, -3 }, { 0, 0, 5 } };
    struct chip_stock *one = stock_of(0.25, -10, -10, -5, 10, 10, 0);
    struct chip_stock *split = stock_of(0.25, -10, -10, -5, 10, 10, 0);
    struct chip_tool tool = tool_of(5, 1, 0);
    struct chip_sweep a = placed(-6, -2, -2), b = placed(-6, -2, -2);
    double at_once, sum = 0.0;
    long most = 0, work_of_all = 0;
    int i, calls = 0;
    for (i = 0; i < 5; i++) {
        chip_sweep_to(&a, tip[i]);
        chip_sweep_to(&b, tip[i]);
    }
    at_once = chip_sweep_run(&a, one, &tool, ALL, &work_of_all);
    while (b.waiting) {
        long work = 0;
        sum += chip_sweep_run(&b, split, &tool, 1, &work);
        if (work > most) most = work;
        if (++calls > 1000000) break;
    }
    NEAR(sum, at_once, 1e-9 * at_once);
    CHECK(most <= 1100); /* one cell that is looked for along the move, at four points */
    CHECK(memcmp(one->cells, split->cells, (size_t)82 * 82 * sizeof(struct chip_cell)) == 0);
    CHECK(work_of_all > 0 && one->generation % 2 == 0 && split->generation % 2 == 0);
    free(one);
    free(split);
}

/* More points than the queue takes: the last one is always reached. */
static void test_queue(void)
{
    struct chip_stock *stock = stock_of(0.5, -10, -10, -5, 10, 10, 0);
    struct chip_tool tool = tool_of(4, 0, 0);
    struct chip_sweep sweep = placed(-8, 0, -1);
    double tip[3] = { 0, 0, -1 };
    int i;
    for (i = 1; i <= 160; i++) {
        tip[0] = -8 + 0.1 * i;
        chip_sweep_to(&sweep, tip);
        CHECK(sweep.waiting <= CHIP_SWEEP_QUEUE);
    }
    chip_sweep_run(&sweep, stock, &tool, ALL, NULL);
    NEAR(sweep.at[0], 8.0, 1e-12);
    NEAR(stock->removed, 1 * (4 * 16 + CHIP_PI * 4), 0.005 * 76); /* straight: nothing is lost */
    free(stock);
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
    return report();
}
