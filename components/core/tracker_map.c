/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_map.c - see tracker_map.h and tracker.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "chip_math.h"
#include "tracker_map.h"

/* The stock is new: only the map is known of it. A tip that only its length had placed in the stock before is where it was,
 * and has cut nothing of this one. */
static void start_over(struct chip_tracker *tracker)
{
    tracker->fault = CHIP_FAULT_NONE;
    tracker->rate_filled = 0;
    lose_position(tracker);
    tracker->has_start = tracker->buried_mm > 0.0;
    CHIP_FAULT(BURIED_LOST, tracker->has_start = 0);
    tracker->sweep.known = 0;
    tracker->sweep.waiting = 0;
}

/* [2] Starts a new stock on a rising edge; an impossible box leaves the old one. */
void chip_tracker_serve_request(struct chip_tracker *tracker, struct chip_stock *stock,
                                const struct chip_tracker_in *in)
{
    int rising = in->define_request && !tracker->last_request;
    double low[3], high[3];
    int i;
    tracker->last_request = in->define_request;
    if (!rising) return;
    for (i = 0; i < 3; i++) {
        low[i] = in->box_min_mu[i] / in->mu_per_mm;
        high[i] = in->box_max_mu[i] / in->mu_per_mm;
    }
    tracker->box_error = chip_stock_define_turned(stock, low, high, in->box_shape, in->box_turn_deg * CHIP_PI / 180.0);
    if (tracker->box_error) return;
    tracker->is_uncertain = 0;
    start_over(tracker);
}

void chip_tracker_own_map(struct chip_tracker *tracker, const struct chip_stock *stock)
{
    memcpy(tracker->own_head, (const void *)stock, sizeof *stock);
    tracker->own_known = 1;
}

static const struct chip_stock *own_head(const struct chip_tracker *tracker)
{
    return (const struct chip_stock *)(const void *)tracker->own_head;
}

/* [2] The stock is unknown: an empty map with the numbers it was made with. */
void chip_tracker_give_up_map(struct chip_tracker *tracker, struct chip_stock *stock)
{
    const struct chip_stock *own = own_head(tracker);
    uint64_t before = own->definitions;
    tracker->box_error = CHIP_STOCK_UNSOUND;
    chip_stock_init_finer(stock, own->coarsest, own->finest, own->capacity);
    stock->definitions = before + 1;
    start_over(tracker);
}

/* [2] Checks that the head is as the tracker has left it: every index is computed from its numbers. */
void chip_tracker_check_head(struct chip_tracker *tracker, struct chip_stock *stock)
{
    if (!tracker->own_known) chip_tracker_own_map(tracker, stock);
    if (memcmp(tracker->own_head, (const void *)stock, sizeof *stock)) chip_tracker_give_up_map(tracker, stock);
}

/* [2] Whether another program may take the map: not to put an assumption in the place of a certain stock. */
static int may_take(const struct chip_tracker *tracker, const struct chip_stock *stock,
                    const struct chip_tracker_in *in)
{
    CHIP_FAULT(ASSUMED_OVER_CERTAIN, return 1);
    return !in->is_assumed || tracker->is_uncertain || stock->nx == 0;
}

/* [2] 1 while another program has the map. Its content afterwards is the stock; if the writer was
 * killed while writing, or a cut may be missing, the stock is unknown. */
int chip_tracker_serve_hold(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in)
{
    int held = tracker->state == CHIP_TRACKER_EXTERNAL_WRITER;
    if (in->external_writer && !held) {
        if (!may_take(tracker, stock, in)) return 0;
        tracker->held_assumed = in->is_assumed;
        tracker->held_moved = 0;
        tracker->held_waiting = tracker->sweep.known && tracker->sweep.waiting > 0;
        tracker->held_generation = stock->generation;
        tracker->held_coarsest = own_head(tracker)->coarsest;
        tracker->held_finest = own_head(tracker)->finest;
        tracker->held_capacity = own_head(tracker)->capacity;
        tracker->held_mm3 = stock->removed;
        tracker->held_definitions = own_head(tracker)->definitions;
    }
    if (!in->external_writer && held) {
        int lost = tracker->held_moved || (tracker->held_waiting && stock->generation == tracker->held_generation);
        int whole = stock->generation % 2 == 0 && (stock->nx == 0 || !lost);
        tracker->box_error =
            whole && chip_stock_sound(stock, tracker->held_coarsest, tracker->held_finest, tracker->held_capacity)
                ? CHIP_STOCK_OK
                : CHIP_STOCK_UNSOUND;
        if (tracker->box_error) {
            chip_stock_init_finer(stock, tracker->held_coarsest, tracker->held_finest, tracker->held_capacity);
            stock->definitions = tracker->held_definitions + 2; /* the writer may have counted one */
        }
        tracker->is_uncertain = tracker->held_assumed;
        if (tracker->is_uncertain) tracker->box_error = CHIP_STOCK_OK; /* an assumption is given up in silence */
        tracker->state = CHIP_TRACKER_FLUSHING;
        start_over(tracker);
    }
    if (in->external_writer) tracker->state = CHIP_TRACKER_EXTERNAL_WRITER;
    return in->external_writer != 0;
}
