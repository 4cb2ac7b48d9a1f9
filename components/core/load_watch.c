/* SPDX-License-Identifier: GPL-2.0-or-later */
/* load_watch.c - see load_watch.h; the numbers in brackets are those of its principle. */
#include "fault.h"
#include "load_watch.h"

/* Whether the tool is the one of the last period with a known load. Sizes that are not a number are not the same. */
static int same_tool(const struct chip_load_watch *watch, const struct chip_load_watch_in *in)
{
    int i, same = in->tool_in_spindle_number == watch->tool_number;
    for (i = 0; i < CHIP_LOAD_WATCH_SIZES; i++)
        if (!(in->tool_mu[i] == watch->tool_mu[i])) same = 0;
    return same;
}

/* Notes what is known now. */
static void find(struct chip_load_watch *watch, const struct chip_load_watch_in *in)
{
    int i;
    watch->is_known = 1;
    watch->is_lost = watch->was_unwatched = watch->stock_changed = 0;
    watch->tool_number = in->tool_in_spindle_number;
    for (i = 0; i < CHIP_LOAD_WATCH_SIZES; i++) watch->tool_mu[i] = in->tool_mu[i];
}

int chip_load_watch_step(struct chip_load_watch *watch, const struct chip_load_watch_in *in)
{
    int changed;
    if (in->is_decided) watch->is_known = watch->is_lost = watch->was_unwatched = watch->stock_changed = 0;
    if (!in->is_ready && watch->is_known) watch->is_lost = 1;
    CHIP_FAULT(LOSS_NOT_SEEN, watch->is_lost = 0);
    if (watch->is_lost) {
        watch->was_unwatched |= in->is_unwatched != 0;
        watch->stock_changed |= in->stock_changes != 0;
    }
    changed = watch->stock_changed || !same_tool(watch, in);
    CHIP_FAULT(CHANGE_NOT_SEEN, changed = 0);
    if (in->is_ready && !(watch->is_lost && watch->was_unwatched && changed)) find(watch, in);
    return watch->is_lost;
}
