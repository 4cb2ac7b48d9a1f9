/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Figures of the core and the offline files to the last bit, a line each: what every processor has to compute alike. Volumes of the offline
 * sweep are sums whose order is the compiler's (-fassociative-math): their lines begin with `about`.
 *
 * Who calls it: tests/install/test_cross.py, once built for this processor and once for another. */
#include <math.h>

#include "../core/one_tracker.h"
#include "../core/random_numbers.h"
#include "core/feed.h"
#include "offline/depth_proof.h"
#include "offline/height_sweep.h"

#define CUTS 4    /* of each tool */
#define MOVES 40  /* of each offline program */
#define CELLS 160 /* a side of the offline map */
#define CELL 0.25 /* mm */
#define FOUND 400

static const double TOOLS[][3] = { { 6.0, 0.0, 0.0 }, { 6.0, 3.0, 0.0 }, { 10.0, 1.5, 0.0 }, { 8.0, 0.0, 60.0 } };

/* What the feed law makes of the tracker's load. */
static double scale_after(double last)
{
    struct chip_feed_in law;
    int i;
    memset(&law, 0, sizeof law);
    law.feed_mode = CHIP_FEED_CONSTANT;
    law.mrr_target_mm3_s = 60.0;
    law.requested_vel_mm_s = 80.0;
    law.programmed_vel_mm_s = 10.0;
    law.motion = 2;
    law.acceleration_mm_s2 = 500.0;
    law.period_s = 0.001;
    law.is_trusted = 1;
    law.section_area_mm2 = out.section_area_mm2;
    law.max_chip_thickness_mm = 0.05;
    law.flutes = 2.0;
    law.spindle_speed_rps = 150.0;
    law.tool_diameter_mm = 6.0;
    law.depth_mm = out.depth_mm;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS && i < out.load.steps; i++) {
        law.load_distance_mm[i] = out.load.step[i].distance;
        law.load_area_mm2[i] = out.load.step[i].area;
    }
    return chip_feed(&law, last).scale;
}

/* Cuts in all directions, level and on ramps. */
static void track(const double tool[3])
{
    const double size[3] = { 60.0, 40.0, 12.0 }, at[3] = { 5.0, 5.0, 5.0 };
    double scale = 1.0;
    int cut, i, k;
    define(CELL, size, tool[0], at);
    in.tool_corner_radius_mu = tool[1];
    in.tool_tip_angle_deg = tool[2];
    for (cut = 0; cut < CUTS; cut++) {
        double from[3], to[3] = { 60.0 * chance(), 40.0 * chance(), -8.0 * chance() }, length = 0.0;
        int count;
        memcpy(from, in.pos_mu, sizeof from);
        for (i = 0; i < 3; i++) length += (to[i] - from[i]) * (to[i] - from[i]);
        count = (int)ceil(sqrt(length) / 0.08);
        for (k = 1; k <= count; k++) {
            for (i = 0; i < 3; i++) in.pos_mu[i] = from[i] + (to[i] - from[i]) * k / count;
            periods(1);
            scale = scale_after(scale);
            if (k % 16 == 0)
                printf("%d %d %a %a %a %a\n", cut, k, out.removed_volume_mm3, out.section_area_mm2, out.depth_mm,
                       scale);
        }
    }
}

/* A program in a height map: volume and depth of each move, then the heights. */
static void sweep(const double tool[3], const double (*place)[3])
{
    static float height[CELLS * CELLS], x[CELLS], shift_x[CELLS], shift_y[CELLS];
    static struct chip_height_met met[MOVES];
    struct chip_height_map map = { 0.0, 0.0, CELL, -20.0, 0.0, CELLS, CELLS, height, x, shift_x, shift_y,
                                   0,   0,   0,    0,     0.0, 0.0,   0.0,   0.0,    0, 0 };
    struct chip_height_tool shape = { 0.5 * tool[0], tool[1], tool[2] > 0.0 ? 1.75 : 0.0, 12.0, 8.0 };
    int i;
    for (i = 0; i < CELLS; i++) {
        x[i] = (float)(i * CELL);
        shift_x[i] = (float)(fmod(i * 0.41421356, 1.0) * CELL);
        shift_y[i] = (float)(fmod(i * 0.61803399, 1.0) * CELL);
    }
    memset(height, 0, sizeof height);
    memset(met, 0, sizeof met);
    printf("about %a\n", chip_height_sweep(&map, &shape, place[0], place + 1, MOVES, met, 0));
    for (i = 0; i < MOVES; i++)
        printf("about %a\n%d %a %a %a\n", (double)met[i].volume, i, (double)met[i].depth, (double)met[i].at,
               (double)met[i].holder);
    for (i = 0; i < CELLS * CELLS; i += 97) printf("%d %a\n", i, (double)height[i]);
}

/* The same program's depths, proved. */
static void prove(const double tool[3], const double (*place)[3])
{
    static struct chip_proof_found found[FOUND];
    static int32_t number[MOVES];
    struct chip_proof_stock box = { 20.0, 20.0, 20.0, 20.0, 1.0, 0.0, -20.0, 0.0, 0, 0 };
    struct chip_proof_tool own = { 0.5 * tool[0], tool[1], tool[2] * 3.14159265358979 / 360.0, 6.0, -1.0 };
    struct chip_proof_path path = { place[0], place[1], number, MOVES };
    int64_t squares = 60000;
    long i, count = chip_prove_depths(&box, &own, 1, &path, 1.0, &squares, found, FOUND);
    for (i = 0; i < count; i++)
        printf("%ld %ld %a %a %a %a\n", (long)found[i].move, (long)found[i].segment, found[i].x, found[i].y,
               found[i].height, found[i].at);
}

int main(void)
{
    static double place[MOVES + 1][3];
    int k, i;
    random_begin(0);
    for (k = 0; k < COUNT(TOOLS); k++) {
        track(TOOLS[k]);
        for (i = 0; i <= MOVES; i++) {
            place[i][0] = 44.0 * chance() - 2.0;
            place[i][1] = 44.0 * chance() - 2.0;
            place[i][2] = 2.0 - 14.0 * chance();
        }
        sweep(TOOLS[k], (const double(*)[3])place);
        prove(TOOLS[k], (const double(*)[3])place);
    }
    return failures != 0;
}
