/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path_watch.c - see path_watch.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "path_watch.h"

int chip_path_watch_step(struct chip_path_watch *watch, int refusal, int is_cutting, double period_s)
{
    double period = chip_finite(period_s) ? chip_clamp(period_s, 0.0, CHIP_PATH_PATIENCE_S) : 0.0;
    if (refusal > CHIP_REFUSAL_NONE && refusal < CHIP_REFUSAL_HEARTBEAT) return watch->code = refusal; /* [1] */
    if (watch->unknown_s <= 0.0) watch->code = CHIP_REFUSAL_NONE;                                      /* [3] */
    if (refusal == CHIP_REFUSAL_NONE)
        watch->unknown_s = chip_max(watch->unknown_s - period, 0.0);
    else if (is_cutting)
        watch->unknown_s = chip_min(watch->unknown_s + period, CHIP_PATH_PATIENCE_S);
    if (refusal != CHIP_REFUSAL_NONE && is_cutting && watch->unknown_s >= CHIP_PATH_PATIENCE_S) watch->code = refusal;
    if (watch->unknown_s <= 0.0) watch->code = CHIP_REFUSAL_NONE;
    return watch->code;
}
