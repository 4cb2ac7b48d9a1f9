/* tracker.c - see tracker.h; the numbers in brackets are those of its principle. */
#include <string.h>
#include "cw_math.h"
#include "tracker.h"

#define CW_FASTEST 5000.0       /* mm/s, no mill is faster; a longer step is a jump */
#define CW_RAPID 1              /* motion.motion-type of a traverse */
#define CW_DEFAULT_HORIZON 20.0 /* mm looked ahead where the acceleration is not known */
#define CW_FARTHEST_TIP 1e6     /* mm, beyond it is no position */
#define CW_STILL 1e-6           /* mm, a step below this is none */
#define CW_BUILD_UP 200.0       /* mm, no braking takes more to build up, */
#define CW_GAINING 200.0        /* mm/s, nor is more gained before */
#define CW_MARGIN_PERIODS 4.0   /* periods of travel looked ahead beyond braking */

void cw_tracker_init(struct cw_tracker *tracker)
{
    char *byte = (char *)tracker;
    unsigned i;
    for (i = 0; i < sizeof *tracker; i++) byte[i] = 0;
    tracker->tool_error = -1;
    cw_ahead_reset(&tracker->ahead);
    cw_guard_reset(&tracker->guard);
}

/* Forgets where the tool was: the next position is a new start. What waits to be cut is cut all the same [4]. */
static void lose_place(struct cw_tracker *tracker)
{
    tracker->tip_known = 0;
    tracker->parted = 1;
    tracker->has_start = 0;
    cw_ahead_reset(&tracker->ahead);
    cw_guard_reset(&tracker->guard);
}

/* [1] Tip in mm; returns a cw_fault. Only the axes say whether the machine can have gone there. */
static int read_tip(const struct cw_tracker *tracker, const struct cw_tracker_in *in, double tip[3])
{
    double step2 = 0.0, most = CW_FASTEST * in->period;
    int i;
    if (!(in->unit >= CHIP_LEAST_UNIT && in->unit <= CHIP_MOST_UNIT)) return CW_FAULT_UNITS;
    for (i = 0; i < 3; i++) {
        double axis = in->axis[i] / in->unit, step = axis - tracker->axis[i];
        tip[i] = (in->axis[i] - in->offset[i]) / in->unit;
        if (!cw_finite(tip[i]) || fabs(tip[i]) > CW_FARTHEST_TIP || !(fabs(axis) <= CW_FARTHEST_TIP))
            return CW_FAULT_POSITION;
        if (tracker->tip_known) step2 += step * step;
    }
    return step2 > most * most ? CW_FAULT_JUMP : CW_FAULT_NONE;
}

int cw_tracker_offset_changed(const struct cw_tracker *tracker, const struct cw_tracker_in *in)
{
    int i;
    for (i = 0; i < 3; i++)
        if (!(in->offset[i] == tracker->offset[i])) return 1;
    return 0;
}

/* [1] Another tool offset: the tip is elsewhere and has gone no way there. What the axes have done in this period belongs to
 * the offset before; everything after begins at the new tip. */
static void change_offset(struct cw_tracker *tracker, const struct cw_tracker_in *in, const double tip[3])
{
    double end[3];
    int i, cuts = in->cutting && !tracker->parted && tracker->sweep.known;
    for (i = 0; i < 3; i++) end[i] = (in->axis[i] - tracker->offset[i]) / in->unit;
    if (cuts) cw_sweep_to(&tracker->sweep, end);
    lose_place(tracker);
    for (i = 0; i < 3; i++) tracker->start[i] = tip[i];
    tracker->has_start = in->cutting;
}

/* [1] What the next period is compared with. */
static void note_place(struct cw_tracker *tracker, const struct cw_tracker_in *in, const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) {
        tracker->tip[i] = tip[i];
        tracker->axis[i] = in->axis[i] / in->unit;
        tracker->offset[i] = in->offset[i];
    }
    tracker->tip_known = 1;
}

/* A stock nothing is known of but what the map says. */
static void start_over(struct cw_tracker *tracker)
{
    tracker->fault = CW_FAULT_NONE;
    tracker->rate_filled = 0;
    lose_place(tracker);
    tracker->sweep.known = 0;
    tracker->sweep.waiting = 0;
}

/* [2] Starts a new stock on a rising edge; an impossible box leaves the old one. */
static void serve_request(struct cw_tracker *tracker, struct cw_stock *stock,
                          const struct cw_tracker_in *in)
{
    int rising = in->request && !tracker->last_request;
    double low[3], high[3];
    int i;
    tracker->last_request = in->request;
    if (!rising) return;
    for (i = 0; i < 3; i++) {
        low[i] = in->box_min[i] / in->unit;
        high[i] = in->box_max[i] / in->unit;
    }
    tracker->box_error = cw_stock_define_turned(stock, low, high, in->form, in->box_turn * CW_PI / 180.0);
    if (!tracker->box_error) start_over(tracker);
}

void chip_tracker_own_map(struct cw_tracker *tracker, const struct cw_stock *stock)
{
    memcpy(tracker->own_head, (const void *)stock, sizeof *stock);
    tracker->own_known = 1;
}

static const struct cw_stock *own_head(const struct cw_tracker *tracker)
{
    return (const struct cw_stock *)(const void *)tracker->own_head;
}

/* [2] No stock is known: an empty map of the cell and the capacity it was made with. */
static void give_up_map(struct cw_tracker *tracker, struct cw_stock *stock)
{
    const struct cw_stock *own = own_head(tracker);
    tracker->box_error = CW_STOCK_UNSOUND;
    cw_stock_init(stock, own->cell, own->capacity);
    start_over(tracker);
}

/* [2] Sees to it that the head is as the tracker has left it: every index is made of its numbers. */
static void check_head(struct cw_tracker *tracker, struct cw_stock *stock)
{
    if (!tracker->own_known) chip_tracker_own_map(tracker, stock);
    if (memcmp(tracker->own_head, (const void *)stock, sizeof *stock)) give_up_map(tracker, stock);
}

/* Whether the machine went on in this period where it might have cut. */
static int went_on(const struct cw_tracker *tracker, const struct cw_tracker_in *in)
{
    double step = 0.0;
    int i;
    for (i = 0; i < 3; i++) step = cw_max(step, fabs(in->axis[i] / in->unit - tracker->axis[i]));
    return in->cutting && tracker->tip_known && step > CW_STILL;
}

/* [2] 1 while another program has the map. What it leaves there is the stock from then on; where it was
 * killed while writing, or a cut may be missing, no stock is known. */
static int serve_hold(struct cw_tracker *tracker, struct cw_stock *stock,
                      const struct cw_tracker_in *in)
{
    if (in->foreign && !tracker->held) {
        tracker->held_cut = 0;
        tracker->held_left = tracker->sweep.known && tracker->sweep.waiting > 0;
        tracker->held_generation = stock->generation;
        tracker->held_cell = own_head(tracker)->cell;
        tracker->held_capacity = own_head(tracker)->capacity;
        tracker->held_mm3 = stock->removed;
    }
    if (!in->foreign && tracker->held) {
        int lost = tracker->held_cut || (tracker->held_left && stock->generation == tracker->held_generation);
        int whole = stock->generation % 2 == 0 && (stock->nx == 0 || !lost);
        tracker->box_error = whole && cw_stock_sound(stock, tracker->held_cell, tracker->held_capacity)
            ? CW_STOCK_OK : CW_STOCK_UNSOUND;
        if (tracker->box_error) cw_stock_init(stock, tracker->held_cell, tracker->held_capacity);
        start_over(tracker);
    }
    return tracker->held = in->foreign != 0;
}

/* [3] Builds the tool when its numbers changed. Another tool begins where the one before stood, and cuts nothing there: its
 * numbers come some periods after its length. */
static void serve_tool(struct cw_tracker *tracker, const struct cw_tracker_in *in)
{
    double size[4];
    int i, same = tracker->tool_error >= 0;
    for (i = 0; i < 4; i++) {
        size[i] = in->tool_size[i] / (i == 2 ? 1.0 : in->unit);
        if (!(size[i] == tracker->built[i])) same = 0;
    }
    if (same) return;
    if (tracker->tool_error >= 0 && !tracker->has_start && tracker->tip_known) {
        for (i = 0; i < 3; i++) tracker->start[i] = tracker->tip[i];
        tracker->has_start = in->cutting;
    }
    tracker->tool_error = cw_tool_init(&tracker->tool, size[0], size[1], size[2], size[3]);
    for (i = 0; i < 4; i++) tracker->built[i] = size[i];
    tracker->sweep.known = 0;
    tracker->sweep.waiting = 0;
    cw_ahead_reset(&tracker->ahead);
    cw_guard_reset(&tracker->guard);
}

/* [4] Queues and cuts the way since the last period; returns the work it took. */
static long cut(struct cw_tracker *tracker, struct cw_stock *stock, const struct cw_tracker_in *in,
                const double tip[3])
{
    long work = 0;
    if (in->motion > CW_RAPID && tracker->tip_known)
        cw_guard_shank(&tracker->guard, stock, &tracker->tool, tracker->tip, tip,
                       tracker->sweep.known && tracker->sweep.trail, &work);
    else
        tracker->guard.excess = 0;
    if (!tracker->sweep.known) {
        cw_sweep_place(&tracker->sweep, tracker->has_start ? tracker->start : tracker->tip_known ? tracker->tip : tip);
        tracker->sweep.trail = tracker->has_start;      /* standing there it cuts nothing [1] */
    }
    tracker->has_start = 0;
    cw_sweep_to(&tracker->sweep, tip);
    cw_sweep_run(&tracker->sweep, stock, &tracker->tool, CW_WORK_TO_CUT, &work);
    return work;
}

/* [4] Nothing is to be cut any more: what waits is finished, then the place is forgotten. */
static long finish(struct cw_tracker *tracker, struct cw_stock *stock)
{
    long work = 0;
    cw_sweep_run(&tracker->sweep, stock, &tracker->tool, CW_WORK_TO_CUT, &work);
    if (!tracker->sweep.waiting) tracker->sweep.known = 0;
    return work;
}

/* What a planner that bounds the jerk may still gain in velocity, mm/s, before it can begin to brake. */
static double gaining(const struct cw_tracker_in *in)
{
    double jerk = in->jerk / in->unit, accel = in->accel / in->unit;
    if (!cw_finite(jerk) || !(jerk > 0.0) || !cw_finite(accel) || !(accel > 0.0)) return 0.0;
    return cw_min(0.5 * accel * accel / jerk, CW_GAINING);
}

/* Way gone while it stops speeding up and builds up its braking, mm. */
static double build_up(const struct cw_tracker *tracker, const struct cw_tracker_in *in)
{
    double more = gaining(in);
    if (!(more > 0.0)) return 0.0;
    return cw_min(2.0 * (tracker->ahead.course.speed + more) * in->accel / in->jerk, CW_BUILD_UP);
}

/* How far to look: braking distance and some periods of travel; never less than what lets
 * places be read before the tool touches them, and the tool's radius, mm. */
double cw_tracker_horizon(const struct cw_tracker *tracker, const struct cw_stock *stock,
                      const struct cw_tracker_in *in)
{
    double least = cw_section_reach(stock, &tracker->tool) + 2.0 * cw_ahead_gap(stock, &tracker->tool);
    double speed = tracker->ahead.course.speed + gaining(in), accel = in->accel / in->unit;
    double braking = CW_DEFAULT_HORIZON;
    if (cw_finite(accel) && accel > 0.0) braking = speed * speed / accel;
    return cw_max(braking + build_up(tracker, in) + CW_MARGIN_PERIODS * speed * in->period,
                  cw_max(least, tracker->tool.radius));
}

/* Removal rate over the window, mm3/min. */
static double rate(struct cw_tracker *tracker, double removed, const struct cw_tracker_in *in)
{
    double wanted = cw_finite(in->window) ? in->window / in->period : 1.0;
    int slots = (int)cw_clamp(wanted, 1.0, CW_RATE_SLOTS - 1.0), then;
    double before;
    if (slots > tracker->rate_filled) slots = tracker->rate_filled;
    then = (tracker->rate_next - slots + CW_RATE_SLOTS) % CW_RATE_SLOTS;
    before = slots ? tracker->rate_log[then] : removed;
    tracker->rate_log[tracker->rate_next] = removed;
    tracker->rate_next = (tracker->rate_next + 1) % CW_RATE_SLOTS;
    if (tracker->rate_filled < CW_RATE_SLOTS - 1) tracker->rate_filled++;
    return slots ? cw_max(0.0, (removed - before) / (slots * in->period) * 60.0) : 0.0;
}

/* [5] Looks ahead and fills what depends on it. */
static void look(struct cw_tracker *tracker, const struct cw_stock *stock,
                 const struct cw_tracker_in *in, const double tip[3], long work, struct cw_tracker_out *out)
{
    double far = cw_tracker_horizon(tracker, stock, in);
    if (tracker->tip_known)
        cw_ahead_step(&tracker->ahead, stock, &tracker->tool, tracker->tip, tip, in->period,
                      far, (int)cw_max(1.0, (double)((CW_WORK_PER_PERIOD - work) / CW_WORK_A_NODE)));
    tracker->ahead.build_up = build_up(tracker, in);
    tracker->ahead.gaining = gaining(in);
    cw_ahead_look(&tracker->ahead, stock, &tracker->tool, far, &out->view);
    out->here = out->view.area;
    out->deepest = out->view.depth;
    out->upward = tracker->ahead.course.known ? tracker->ahead.course.last_slope : 0.0;
}

/* [5] The guards: a traverse that meets stock, a shank that does; returns the work so far. */
static long guard(struct cw_tracker *tracker, const struct cw_stock *stock,
                  const struct cw_tracker_in *in, const double tip[3], long work, struct cw_tracker_out *out)
{
    struct cw_guard_in way;
    int i, hit;
    if (!tracker->tip_known) {
        cw_guard_reset(&tracker->guard);
        return work;
    }
    for (i = 0; i < 3; i++) {
        way.from[i] = tracker->tip[i];
        way.to[i] = tip[i];
        way.axis_accel[i] = in->axis_accel[i] / in->unit;
    }
    way.period = in->period;
    way.accel = in->accel / in->unit;
    way.jerk = in->jerk / in->unit;
    way.to_go = in->to_go / in->unit;
    way.trail = tracker->sweep.trail && !tracker->sweep.waiting;
    way.way = tracker->ahead.way.known ? &tracker->ahead.way : 0;
    hit = in->motion == CW_RAPID && cw_guard_traverse(&tracker->guard, stock, &tracker->tool, &way,
                                                      CW_WORK_PER_PERIOD, &work);
    if (in->motion != CW_RAPID) cw_guard_reset_line(&tracker->guard);
    out->rapid_hit = hit;
    out->rapid_mm = tracker->guard.distance;
    out->over_flute = tracker->guard.excess;
    return work;
}

static void clear(struct cw_tracker_out *out)
{
    int i;
    out->has_stock = out->is_ready = out->has_fault = out->code = 0;
    out->here = out->deepest = out->rate = out->upward = 0.0;
    out->over_flute = out->rapid_hit = out->is_held = 0;
    out->rapid_mm = 0.0;
    out->view.levels = 0;
    for (i = 0; i < CW_AHEAD_LEVELS; i++)
        out->view.level[i].distance = out->view.level[i].area = out->view.level[i].accel = 0.0;
}

/* Whether every number that goes out is one. */
static int all_finite(const struct cw_tracker_out *out)
{
    double sum = out->here + out->deepest + out->rate + out->upward + out->rapid_mm + out->removed_mm3;
    int i;
    for (i = 0; i < out->view.levels && i < CW_AHEAD_LEVELS; i++)
        sum += out->view.level[i].distance + out->view.level[i].area + out->view.level[i].accel;
    return cw_finite(sum);
}

static int current_fault(const struct cw_tracker *tracker, const struct cw_tracker_in *in, int filled)
{
    if (in->watch_fault) return in->watch_fault;
    if (tracker->box_error) return tracker->box_error;
    if (in->other_moved && filled) return CW_FAULT_TURNED;
    if (tracker->tool_error > 0 && in->cutting) return 10 + tracker->tool_error;
    return tracker->fault;
}

void cw_tracker_step(struct cw_tracker *tracker, struct cw_stock *stock,
                     const struct cw_tracker_in *in, struct cw_tracker_out *out)
{
    double tip[3] = { 0.0, 0.0, 0.0 };
    int bad = read_tip(tracker, in, tip), filled, ready;
    int cutting = in->cutting && !in->tool_unknown;

    clear(out);
    if (!tracker->held) check_head(tracker, stock);
    if (serve_hold(tracker, stock, in)) {
        int moved = bad != CW_FAULT_NONE || went_on(tracker, in);
        tracker->held_cut |= moved && in->cutting;
        lose_place(tracker);
        tracker->sweep.known = 0;
        tracker->sweep.waiting = 0;
        if (bad == CW_FAULT_NONE || bad == CW_FAULT_JUMP) note_place(tracker, in, tip);
        tracker->tip_known = bad == CW_FAULT_NONE;
        out->is_held = 1;
        out->code = in->watch_fault;
        out->has_fault = out->code != CW_FAULT_NONE;
        out->removed_mm3 = tracker->held_mm3;
        return;
    }
    if (bad == CW_FAULT_NONE || bad == CW_FAULT_JUMP) serve_request(tracker, stock, in);
    filled = cw_stock_fill(stock, CW_CELLS_PER_PERIOD);
    ready = filled && !in->other_moved;
    if (bad) {
        if (bad != CW_FAULT_JUMP || in->cutting) tracker->fault = bad;
        lose_place(tracker);
    } else if (tracker->tip_known && cw_tracker_offset_changed(tracker, in)) {
        change_offset(tracker, in, tip);
    }
    if (bad == CW_FAULT_NONE || bad == CW_FAULT_JUMP) {
        serve_tool(tracker, in);
        if (ready && tracker->tool_error == 0) {
            long work = 0;
            tracker->parted |= !cutting;
            tracker->has_start &= cutting;
            if (tracker->parted) work = finish(tracker, stock);
            tracker->parted &= !cutting || tracker->sweep.waiting > 0;
            if (!tracker->parted) work += cut(tracker, stock, in, tip);
            if (cutting) work = guard(tracker, stock, in, tip, work, out);
            else cw_guard_reset(&tracker->guard);
            look(tracker, stock, in, tip, work, out);
        } else {
            cw_ahead_reset(&tracker->ahead);
        }
        note_place(tracker, in, tip);
    }
    out->removed_mm3 = stock->removed;
    out->rate = rate(tracker, stock->removed, in);
    if (!all_finite(out)) {
        give_up_map(tracker, stock);
        clear(out);
        out->removed_mm3 = 0.0;
        filled = ready = 0;
    }
    chip_tracker_own_map(tracker, stock);
    out->code = current_fault(tracker, in, filled);
    out->has_fault = out->code != CW_FAULT_NONE;
    out->has_stock = ready;
    out->is_ready = ready && tracker->tool_error == 0 && !bad && !in->tool_unknown && !in->watch_fault;
}
