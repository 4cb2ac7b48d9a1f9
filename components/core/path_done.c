/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_done.c - see path_done.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "chip_math.h"
#include "path_done.h"

/* [4] */
static void keep(struct chip_path_thinner *thinner, struct chip_path_done *done, const double point[3])
{
    memcpy(done->point[thinner->count % CHIP_PATH_DONE_POINTS], point, 3 * sizeof point[0]);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    done->count = ++thinner->count;
}

/* [1] The direction of the strip, as soon as the tip is far enough from its begin. */
static void aim(struct chip_path_thinner *thinner, const double travel[3])
{
    double length = chip_sqrt(travel[0] * travel[0] + travel[1] * travel[1] + travel[2] * travel[2]);
    int i;
    thinner->has_dir = length >= CHIP_PATH_DONE_LEAST;
    thinner->reach = length;
    for (i = 0; i < 3 && thinner->has_dir; i++) thinner->dir[i] = travel[i] / length;
}

/* [2] Whether the tip, `travel` from the strip's begin, is in it and goes on. */
static int goes_on(struct chip_path_thinner *thinner, const double travel[3])
{
    const double *dir = thinner->dir;
    double along = travel[0] * dir[0] + travel[1] * dir[1] + travel[2] * dir[2], across = 0.0;
    int i;
    for (i = 0; i < 3; i++) across += (travel[i] - along * dir[i]) * (travel[i] - along * dir[i]);
    CHIP_FAULT(CORNERS_CUT, across *= 1e-2);
    if (!(across <= CHIP_PATH_DONE_STRIP * CHIP_PATH_DONE_STRIP) || along < thinner->reach - CHIP_PATH_DONE_LEAST)
        return 0;
    thinner->reach = chip_max(thinner->reach, along);
    return 1;
}

void chip_path_done_lose(struct chip_path_thinner *thinner) { thinner->is_known = 0; }

void chip_path_done_step(struct chip_path_thinner *thinner, struct chip_path_done *done, const double tip[3])
{
    double travel[3];
    int i;
    if (!chip_finite(tip[0] + tip[1] + tip[2])) {
        chip_path_done_lose(thinner);
        return;
    }
    if (!thinner->is_known) {
        keep(thinner, done, tip);
        memcpy(thinner->from, tip, sizeof thinner->from);
        memcpy(thinner->at, tip, sizeof thinner->at);
        thinner->is_known = 1;
        thinner->has_dir = 0;
        return;
    }
    if (tip[0] == thinner->at[0] && tip[1] == thinner->at[1] && tip[2] == thinner->at[2]) return;
    for (i = 0; i < 3; i++) travel[i] = tip[i] - thinner->from[i];
    if (!thinner->has_dir) {
        aim(thinner, travel);
    } else if (!goes_on(thinner, travel)) { /* [3] */
        keep(thinner, done, thinner->at);
        memcpy(thinner->from, thinner->at, sizeof thinner->from);
        for (i = 0; i < 3; i++) travel[i] = tip[i] - thinner->from[i];
        aim(thinner, travel);
    }
    memcpy(thinner->at, tip, sizeof thinner->at);
}
