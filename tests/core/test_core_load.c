/* SPDX-License-Identifier: GPL-2.0-or-later */
/* test_core_load.c - section area, look-ahead and feed law of the C core against closed forms and hostile input,
 * without Python.
 *
 * Who calls it: `make test`, tests/core/test_sabotage.py with the flags of the realtime build, and
 * tests/core/test_sanitized.py. Prints every failure and one closing line; leaves with 1 when
 * something failed. Lengths mm, volumes mm3.
 */
#include "../../components/core/feed.h"
#include "../../components/core/lookahead.h"
#include "../../components/core/section.h"
#include "core_checks.h"

/* NaN, infinite or absurd positions are not cut and write nowhere. */
static void test_hostile_tips(void)
{
    const double bad[8] = { NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e18, -1e18, 3e9 };
    const double corner[3] = { 0, 1, 2 };
    int i, axis, kind;
    for (kind = 0; kind < 3; kind++)
        for (axis = 0; axis < 3; axis++)
            for (i = 0; i < 8; i++) {
                struct chip_stock *stock = stock_of(0.5, -5, -5, -5, 5, 5, 0);
                struct chip_tool tool = tool_of(4, corner[kind], 0);
                struct chip_sweep sweep = placed(0, 0, 1);
                double tip[3] = { 0, 0, 1 }, unit[3] = { 1, 0, 0 }, low[3] = { 0, 0, -1 };
                struct chip_section met;
                struct chip_lookahead lookahead;
                struct chip_load_profile profile;
                int k;
                tip[axis] = bad[i];
                chip_sweep_to(&sweep, tip);
                chip_sweep_run(&sweep, stock, &tool, ALL, NULL);
                CHECK(chip_stock_volume(stock) >= 0.0 && chip_stock_volume(stock) <= 500.001);
                cut_to(&sweep, stock, &tool, 1, 0, -1);
                CHECK(chip_finite(stock->removed) && stock->removed >= 0.0);
                met = chip_section_at(stock, &tool, tip, unit, 0.0, 0.0);
                CHECK(!(met.area < 0.0));
                memset(&lookahead, 0, sizeof lookahead);
                chip_lookahead_reset(&lookahead);
                chip_lookahead_step(&lookahead, 0, stock, &tool, low, tip, 0.001, 5.0, 1000);
                chip_lookahead_profile(&lookahead, 0, stock, &tool, 5.0, &profile);
                for (k = 0; k < 20; k++) { /* and on with a sound path */
                    double from[3] = { 0.02 * k, 0, -1 }, to[3] = { 0.02 * k + 0.02, 0, -1 };
                    chip_lookahead_step(&lookahead, 0, stock, &tool, from, to, 0.001, 5.0, 1000);
                }
                chip_lookahead_profile(&lookahead, 0, stock, &tool, 5.0, &profile);
                CHECK(chip_finite(profile.area) && profile.steps >= 1 && profile.steps <= CHIP_LOAD_STEPS);
                for (k = 0; k < profile.steps; k++)
                    CHECK(chip_finite(profile.step[k].area) && chip_finite(profile.step[k].distance));
                free(stock);
            }
}

/* Section areas with a closed form in fresh stock, 0.25 mm cells, within 1 %. */
static void test_sections(void)
{
    const double angle[5] = { 0, 17, 31, 45, 73 };
    struct chip_stock *stock = stock_of(0.25, -30, -30, -10, 30, 30, 0);
    struct {
        double d, corner, tip, z, want;
    } shape[] = {
        { 6, 0, 0, -2, 12 },              /* D x depth */
        { 6, 3, 0, -3, 14.1371669 },      /* half disc: pi R^2 / 2 */
        { 6, 3, 0, -5, 14.1371669 + 12 }, /* and D x (depth - R) above */
        { 10, 2, 0, -2, 18.2831853 },     /* 2 c^2 (1 - pi/4) less than D c */
        { 8, 0, 90, -3, 9 },              /* triangle h^2 */
    };
    size_t i;
    int n;
    for (i = 0; i < sizeof shape / sizeof *shape; i++)
        for (n = 0; n < 5; n++) {
            double a = angle[n] * CHIP_PI / 180.0, down[3] = { 0, 0, -1 };
            double dir[3] = { cos(a), sin(a), 0 }, tip[3] = { 0.37, -0.21, shape[i].z };
            struct chip_tool tool = tool_of(shape[i].d, shape[i].corner, shape[i].tip);
            struct chip_section met = chip_section_at(stock, &tool, tip, dir, 0.0, 0.0);
            NEAR(met.area, shape[i].want, 0.01 * shape[i].want);
            NEAR(met.depth, -shape[i].z, 0.03 * -shape[i].z);
            if (shape[i].corner == 0.0 && shape[i].tip == 0.0) {
                met = chip_section_at(stock, &tool, tip, down, 0.0, 0.0); /* plunge: the disc */
                NEAR(met.area, CHIP_PI * 9, 0.01 * CHIP_PI * 9);
            }
            tip[2] = 0.5;
            met = chip_section_at(stock, &tool, tip, dir, 0.0, 0.0); /* above the stock */
            NEAR(met.area, 0.0, 0);
        }
    free(stock);
}

static struct chip_feed_in calm(void)
{
    struct chip_feed_in in;
    memset(&in, 0, sizeof in);
    in.feed_mode = CHIP_FEED_LIMIT;
    in.mrr_target_mm3_s = 60.0;
    in.programmed_vel_mm_s = in.requested_vel_mm_s = 10.0;
    in.motion = CHIP_MOTION_FEED;
    in.acceleration_mm_s2 = 500.0;
    in.period_s = 0.001;
    in.is_trusted = 1;
    return in;
}

static void test_feed_law(void)
{
    struct chip_feed_in in = calm();
    in.section_area_mm2 = 12.0; /* 60 / 12 = 5 mm/s of 10 */
    NEAR(chip_feed(&in, 1.0).scale, 0.5, 1e-12);
    CHECK(chip_feed(&in, 1.0).limit == CHIP_LIMIT_STOCK_HERE);
    in.section_area_mm2 = 3.0; /* 20 mm/s allowed: F stays */
    NEAR(chip_feed(&in, 1.0).scale, 1.0, 0);
    in.section_area_mm2 = 0.0;
    in.load_area_mm2[3] = 60.0;    /* 1 mm/s in 0.02 + 0.05 mm: sqrt(1 + 500 x 0.05) */
    in.load_distance_mm[3] = 0.07; /* 0.02 = two periods at 10 mm/s */
    NEAR(chip_feed(&in, 1.0).scale, 0.50990195, 1e-6);
    CHECK(chip_feed(&in, 1.0).limit == CHIP_LIMIT_STOCK_AHEAD);
    NEAR(chip_feed(&in, NAN).scale, 0.50990195, 1e-6); /* unknown: as if at full speed */
    in.mrr_target_mm3_s = NAN;
    NEAR(chip_feed(&in, 1.0).scale, 1.0, 0);
    CHECK(chip_feed(&in, 1.0).limit == CHIP_LIMIT_FALLBACK);
}

/* Whatever comes in, the scale is a number in [0, 1]. */
static void test_feed_hostile(void)
{
    const double odd[] = { NAN, INFINITY, -INFINITY, 0.0, -0.0, -1.0, 1.0, 60.0, 1e-9, 5e-324, 1e308, -1e308, 1e-308 };
    const int n = sizeof odd / sizeof *odd;
    struct chip_feed_easing easing = { 0.0, 0.0, 0 };
    int i, bad = 0;
    srand(20);
    for (i = 0; i < 300000; i++) {
        struct chip_feed_in in = calm();
        struct chip_feed_out out;
        double *field[20], last = 1.0;
        int k, hits = 1 + rand() % 9;
        field[0] = &in.mrr_target_mm3_s;
        field[1] = &in.mrr_lower_mm3_s;
        field[2] = &in.programmed_vel_mm_s;
        field[3] = &in.requested_vel_mm_s;
        field[4] = &in.acceleration_mm_s2;
        field[5] = &in.min_vel_mm_s;
        field[6] = &in.period_s;
        field[7] = &in.section_area_mm2;
        for (k = 8; k < 20; k++) field[k] = &in.tool_max_rate_mm3_s + (k - 8); /* the doubles to the end */
        in.section_area_mm2 = 12.0;
        in.feed_mode = rand() % 6 - 1;
        in.motion = rand() % 4;
        in.is_trusted = rand() % 8 != 0;
        for (k = 0; k < hits; k++) {
            int which = rand() % 23;
            double value = odd[rand() % n];
            if (which < 20)
                *field[which] = value;
            else if (which == 20)
                in.load_area_mm2[rand() % CHIP_FEED_LOAD_STEPS] = value;
            else if (which == 21)
                in.load_distance_mm[rand() % CHIP_FEED_LOAD_STEPS] = value;
            else
                last = value;
        }
        out = chip_feed(&in, last);
        if (!(out.scale >= 0.0 && out.scale <= 1.0)) bad++;
        if (out.limit < CHIP_LIMIT_NONE || out.limit > CHIP_LIMIT_FALLBACK) bad++;
        last = chip_feed_ease(&easing, &in, out, odd[rand() % n], odd[rand() % n]).scale;
        if (!(last >= 0.0 && last <= out.scale)) bad++;
    }
    CHECK(bad == 0);
}

int main(void)
{
    test_hostile_tips();
    test_sections();
    test_feed_law();
    test_feed_hostile();
    return report();
}
