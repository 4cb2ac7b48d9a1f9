/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker.c - see tracker.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "motion_kind.h"
#include "tracker_map.h"

#define CHIP_MAX_VELOCITY 5000.0   /* mm/s, no mill is faster; a longer step is a jump */
#define CHIP_DEFAULT_HORIZON 20.0  /* mm looked ahead if the acceleration is unknown */
#define CHIP_MAX_POSITION 1e6      /* mm, beyond it nothing is a position */
#define CHIP_MAX_JERK_TRAVEL 200.0 /* mm, no braking takes more to build up */
#define CHIP_MAX_JERK_GAIN 200.0   /* mm/s, and no more is gained meanwhile */
#define CHIP_MARGIN_PERIODS 4.0    /* periods of travel looked ahead beyond braking */

void chip_tracker_init(struct chip_tracker *tracker)
{
    char *byte = (char *)tracker;
    unsigned i;
    for (i = 0; i < sizeof *tracker; i++) byte[i] = 0;
    tracker->tool_error = -1;
    tracker->work_percent = 100;
    forget_path(tracker);
    chip_guard_reset(&tracker->guard);
}

/* [1] Tip in mm; returns a chip_fault. Only the axes say whether the machine can have gone there. */
static int read_tip(const struct chip_tracker *tracker, const struct chip_tracker_in *in, double tip[3])
{
    double step2 = 0.0, most = CHIP_MAX_VELOCITY * in->period_s;
    int i;
    if (!(in->mu_per_mm >= CHIP_MIN_MU_PER_MM && in->mu_per_mm <= CHIP_MAX_MU_PER_MM)) return CHIP_FAULT_UNITS;
    for (i = 0; i < 3; i++) {
        double axis = in->pos_mu[i] / in->mu_per_mm, step = axis - tracker->axis[i];
        tip[i] = (in->pos_mu[i] - in->tool_offset_mu[i]) / in->mu_per_mm;
        if (!chip_finite(tip[i]) || fabs(tip[i]) > CHIP_MAX_POSITION || !(fabs(axis) <= CHIP_MAX_POSITION))
            return CHIP_FAULT_POSITION;
        if (tracker->tip_known) step2 += step * step;
    }
    return step2 > most * most ? CHIP_FAULT_JUMP : CHIP_FAULT_NONE;
}

/* [1] Another tool offset: the tip is elsewhere without having travelled there. The axes' motion in this period
 * belongs to the offset before; everything after begins at the new tip. */
static void change_offset(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3])
{
    double end[3];
    int i, cuts = in->is_enabled && tracker->state == CHIP_TRACKER_CUTTING && tracker->sweep.known;
    for (i = 0; i < 3; i++) end[i] = (in->pos_mu[i] - tracker->offset_mu[i]) / in->mu_per_mm;
    if (cuts) chip_sweep_to(&tracker->sweep, end);
    lose_position(tracker);
    for (i = 0; i < 3; i++) tracker->start[i] = tip[i];
    tracker->has_start = in->is_enabled;
}

/* [1] Notes what the next period is compared with. */
static void note_position(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) {
        tracker->tip[i] = tip[i];
        tracker->axis[i] = in->pos_mu[i] / in->mu_per_mm;
        tracker->offset_mu[i] = in->tool_offset_mu[i];
    }
    tracker->tip_known = 1;
}

/* [3] Builds the tool when its numbers changed. Another tool begins at the position of the one before, and cuts
 * nothing there: its numbers come some periods after its length. */
static void serve_tool(struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    const double size[4] = { in->tool_diameter_mu / in->mu_per_mm, in->tool_corner_radius_mu / in->mu_per_mm,
                             in->tool_tip_angle_deg, in->tool_flute_length_mu / in->mu_per_mm };
    int i, same = tracker->tool_error >= 0;
    for (i = 0; i < 4; i++)
        if (!(size[i] == tracker->built[i])) same = 0;
    if (same) return;
    if (tracker->tool_error >= 0 && !tracker->has_start && tracker->tip_known) {
        for (i = 0; i < 3; i++) tracker->start[i] = tracker->tip[i];
        tracker->has_start = in->is_enabled;
    }
    tracker->tool_error = chip_tool_init(&tracker->tool, size[0], size[1], size[2], size[3]);
    for (i = 0; i < 4; i++) tracker->built[i] = size[i];
    tracker->sweep.known = 0;
    tracker->sweep.waiting = 0;
    forget_path(tracker);
    chip_guard_reset(&tracker->guard);
}

/* Velocity, mm/s, that a jerk-limited planner may still gain before it can begin to brake. */
static double jerk_gain(const struct chip_tracker_in *in)
{
    double jerk = in->max_jerk_mu_s3 / in->mu_per_mm, accel = in->acceleration_mu_s2 / in->mu_per_mm;
    if (!chip_finite(jerk) || !(jerk > 0.0) || !chip_finite(accel) || !(accel > 0.0)) return 0.0;
    return chip_min(0.5 * accel * accel / jerk, CHIP_MAX_JERK_GAIN);
}

/* Travel, mm, while it stops accelerating and builds up its braking. */
static double jerk_travel(const struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    double more = jerk_gain(in);
    if (!(more > 0.0)) return 0.0;
    return chip_min(2.0 * (tracker->lookahead.predicted.speed + more) * in->acceleration_mu_s2 / in->max_jerk_mu_s3,
                    CHIP_MAX_JERK_TRAVEL);
}

/* How far to look: braking distance and some periods of travel; at least as far as lets
 * points be read before the tool touches them, and the tool's radius, mm. */
double chip_tracker_horizon(const struct chip_tracker *tracker, const struct chip_stock *stock,
                            const struct chip_tracker_in *in)
{
    double least = chip_section_reach(stock, &tracker->tool) + 2.0 * chip_lookahead_spacing(stock, &tracker->tool);
    double speed = tracker->lookahead.predicted.speed + jerk_gain(in), accel = in->acceleration_mu_s2 / in->mu_per_mm;
    double braking = CHIP_DEFAULT_HORIZON;
    if (chip_finite(accel) && accel > 0.0) braking = speed * speed / accel;
    return chip_max(braking + jerk_travel(tracker, in) + CHIP_MARGIN_PERIODS * speed * in->period_s,
                    chip_max(chip_max(least, tracker->tool.radius), 1.5 * tracker->clamps.window));
}

/* Removal rate over the window, mm3/min. */
static double rate(struct chip_tracker *tracker, double removed, const struct chip_tracker_in *in)
{
    double wanted = chip_finite(in->mrr_window_s) ? in->mrr_window_s / in->period_s : 1.0;
    int slots = (int)chip_clamp(wanted, 1.0, CHIP_RATE_SLOTS - 1.0), then;
    double before;
    if (slots > tracker->rate_filled) slots = tracker->rate_filled;
    then = (tracker->rate_next - slots + CHIP_RATE_SLOTS) % CHIP_RATE_SLOTS;
    before = slots ? tracker->rate_log[then] : removed;
    tracker->rate_log[tracker->rate_next] = removed;
    tracker->rate_next = (tracker->rate_next + 1) % CHIP_RATE_SLOTS;
    if (tracker->rate_filled < CHIP_RATE_SLOTS - 1) tracker->rate_filled++;
    return slots ? chip_max(0.0, (removed - before) / (slots * in->period_s) * 60.0) : 0.0;
}

/* The limits of the tooth: what the samples have not been read for is read again. */
static void follow_limits(struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    struct chip_tooth_weights weights = { in->chip_weight_per_mm, in->power_weight_per_mm, in->force_weight_per_mm,
                                          in->force_exponent_mc, in->flutes };
    int change = chip_tooth_set((tracker->tool.tooth = &tracker->tooth), &weights);
    if (change == CHIP_TOOTH_BEGUN) chip_lookahead_reset(&tracker->lookahead);
    if (change != CHIP_TOOTH_SAME) chip_tooth_follow(&tracker->lookahead, &tracker->tooth);
}

/* Finds the place at which feeds above the stock, which are free, have to be slower; `pace` stays unknown if nothing makes them free. */
static void find_pace(const struct chip_tracker *tracker, const struct chip_stock *stock,
                      const struct chip_tracker_in *in, double horizon, struct chip_pace *pace)
{
    if (in->is_air_free && !tracker->is_uncertain && in->air_clearance_mu > 0.0) {
        struct chip_pace_in asked = { stock->z_max + in->air_clearance_mu / in->mu_per_mm, in->ceiling_of_f,
                                      tracker->lookahead.latency_travel, chip_override(in->feed_override_share),
                                      horizon };
        *pace = chip_path_pace(&tracker->path, &asked);
    }
}

/* [5] Looks ahead and fills the outputs that depend on it. */
static void update_load(struct chip_tracker *tracker, const struct chip_stock *stock, const struct chip_tracker_in *in,
                        const double tip[3], long work, struct chip_tracker_out *out)
{
    double far = chip_tracker_horizon(tracker, stock, in);
    follow_limits(tracker, in);
    if (tracker->tip_known) {
        int a_node = chip_tool_is_flat(&tracker->tool) ? CHIP_WORK_A_NODE : CHIP_WORK_A_ROUND_NODE;
        double nodes = (double)((chip_tracker_bound(tracker, CHIP_WORK_PER_PERIOD) - work) / a_node);
        chip_lookahead_step(&tracker->lookahead, &tracker->path, stock, &tracker->tool, tracker->tip, tip, in->period_s,
                            far, (int)chip_max(1.0, nodes));
        chip_path_mark_read(&tracker->path);
    }
    tracker->lookahead.jerk_travel = jerk_travel(tracker, in);
    tracker->lookahead.jerk_gain = jerk_gain(in);
    chip_lookahead_profile(&tracker->lookahead, &tracker->path, stock, &tracker->tool, far, &out->load);
    out->section_area_mm2 = out->load.area;
    out->depth_mm = out->load.depth;
    out->dir_z = tracker->lookahead.predicted.known ? tracker->lookahead.predicted.last_dir_z : 0.0;
    out->descent_mm = chip_path_descent(&tracker->path, &out->descent_accel_mm_s2);
    find_pace(tracker, stock, in, far, &out->pace);
}

/* [5] The guards of traverse and shank; returns the work so far. */
static long run_guards(struct chip_tracker *tracker, const struct chip_stock *stock, const struct chip_tracker_in *in,
                       const double tip[3], long work, struct chip_tracker_out *out)
{
    struct chip_guard_in motion;
    int i, hit;
    if (!tracker->tip_known) {
        chip_guard_reset(&tracker->guard);
        return work;
    }
    for (i = 0; i < 3; i++) {
        motion.from[i] = tracker->tip[i];
        motion.to[i] = tip[i];
        motion.axis_acceleration_mm_s2[i] = in->axis_acceleration_mu_s2[i] / in->mu_per_mm;
    }
    motion.period_s = in->period_s;
    motion.acceleration_mm_s2 = in->acceleration_mu_s2 / in->mu_per_mm;
    motion.max_jerk_mm_s3 = in->max_jerk_mu_s3 / in->mu_per_mm;
    motion.distance_to_go_mm = in->distance_to_go_mu / in->mu_per_mm;
    motion.start_is_cut = tracker->sweep.start_is_cut && chip_tracker_feeds_are_cut(tracker);
    motion.path = tracker->path.known ? &tracker->path : 0;
    hit = in->motion == CHIP_MOTION_TRAVERSE
       && chip_guard_traverse(&tracker->guard, stock, &tracker->tool, &motion, CHIP_WORK_PER_PERIOD, &work);
    if (in->motion != CHIP_MOTION_TRAVERSE) chip_guard_reset_line(&tracker->guard);
    out->has_rapid_contact = hit;
    out->rapid_distance_mm = tracker->guard.distance;
    out->has_flute_excess = tracker->guard.excess;
    return work;
}

static void clear(struct chip_tracker_out *out)
{
    int i;
    out->has_stock = out->is_ready = out->has_fault = out->fault_number = 0;
    out->section_area_mm2 = out->depth_mm = out->buried_depth_mm = out->mrr_mm3_min = out->dir_z = 0.0;
    out->has_flute_excess = out->has_rapid_contact = out->is_held = out->is_certain = 0;
    out->rapid_distance_mm = out->descent_accel_mm_s2 = 0.0;
    out->descent_mm = -1.0;
    out->pace.distance = CHIP_PACE_UNKNOWN;
    out->pace.vel = out->pace.accel = 0.0;
    out->load.steps = out->load.tooth_steps = 0;
    out->load.chip = out->load.power = out->load.force = out->load.force_mean = 0.0;
    for (i = 0; i < CHIP_LOAD_STEPS; i++)
        out->load.step[i].distance = out->load.step[i].area = out->load.step[i].accel = 0.0;
}

/* Whether every output is finite. */
static int all_finite(const struct chip_tracker_out *out)
{
    double sum = out->section_area_mm2 + out->depth_mm + out->buried_depth_mm + out->mrr_mm3_min + out->dir_z
               + out->rapid_distance_mm + out->removed_volume_mm3 + out->descent_mm + out->descent_accel_mm_s2
               + out->pace.distance + out->pace.vel + out->pace.accel;
    int i;
    for (i = 0; i < out->load.steps && i < CHIP_LOAD_STEPS; i++)
        sum += out->load.step[i].distance + out->load.step[i].area + out->load.step[i].accel;
    for (i = 0; i < out->load.tooth_steps && i < CHIP_LOAD_STEPS; i++)
        sum += out->load.tooth_step[i].distance + out->load.tooth_step[i].area + out->load.tooth_step[i].accel;
    return chip_finite(sum + out->load.chip + out->load.power + out->load.force + out->load.force_mean);
}

static int current_fault(const struct chip_tracker *tracker, const struct chip_tracker_in *in, int filled)
{
    if (in->watch_fault) return in->watch_fault;
    if (tracker->box_error) return tracker->box_error;
    if (in->is_turned && filled && !tracker->is_uncertain) return CHIP_FAULT_TURNED;
    if (tracker->tool_error > 0 && in->is_enabled) return 10 + tracker->tool_error;
    return tracker->fault;
}

/* [3] Whether the tool is not known to be the described one. */
static int tool_unknown(const struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    return in->tool_unknown || (in->tool_is_assumed && !tracker->is_uncertain);
}

/* [2] A period in which another program has the map; `bad`: fault of the position. */
static void held_period(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3], int bad,
                        struct chip_tracker_out *out)
{
    int moved = bad != CHIP_FAULT_NONE || chip_tracker_has_moved(tracker, in);
    tracker->held_moved |= moved && in->is_enabled;
    lose_position(tracker);
    tracker->sweep.known = 0;
    tracker->sweep.waiting = 0;
    if (bad == CHIP_FAULT_NONE || bad == CHIP_FAULT_JUMP) note_position(tracker, in, tip);
    tracker->tip_known = bad == CHIP_FAULT_NONE;
    out->is_held = 1;
    out->fault_number = in->watch_fault;
    out->has_fault = out->fault_number != CHIP_FAULT_NONE;
    out->removed_volume_mm3 = chip_max(0.0, tracker->held_mm3);
}

/* [4] [5] A period with stock and tool: cuts, guards, looks ahead. */
static void ready_period(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                         const double tip[3], struct chip_tracker_out *out)
{
    int cutting = in->is_enabled && !tool_unknown(tracker, in), guarded = cutting && !tracker->is_uncertain;
    long work = 0;
    CHIP_FAULT(GUARDED_BY_ASSUMPTION, guarded = cutting);
    if (!cutting) {
        tracker->state = CHIP_TRACKER_FLUSHING;
        chip_tracker_keep_start(tracker, in, tip);
    }
    if (tracker->state == CHIP_TRACKER_FLUSHING) work = chip_tracker_flush(tracker, stock);
    if (cutting && tracker->sweep.waiting == 0) tracker->state = CHIP_TRACKER_CUTTING;
    if (tracker->state == CHIP_TRACKER_CUTTING) work += chip_tracker_cut(tracker, stock, in, tip);
    out->buried_depth_mm = guarded ? tracker->buried_mm : 0.0;
    if (guarded)
        work = run_guards(tracker, stock, in, tip, work, out);
    else
        chip_guard_reset(&tracker->guard);
    update_load(tracker, stock, in, tip, work, out);
}

void chip_tracker_step(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                       struct chip_tracker_out *out)
{
    double tip[3] = { 0.0, 0.0, 0.0 };
    int bad = read_tip(tracker, in, tip), filled, ready;
    clear(out);
    chip_tracker_watch_clamps(tracker, in, tip, bad, out);
    if (tracker->state != CHIP_TRACKER_EXTERNAL_WRITER) chip_tracker_check_head(tracker, stock);
    if (chip_tracker_serve_hold(tracker, stock, in)) {
        held_period(tracker, in, tip, bad, out);
        return;
    }
    if (bad == CHIP_FAULT_NONE || bad == CHIP_FAULT_JUMP) chip_tracker_serve_request(tracker, stock, in);
    filled = chip_stock_fill(stock, chip_tracker_bound(tracker, CHIP_CELLS_PER_PERIOD));
    ready = filled && !in->is_turned;
    if (bad) {
        if (bad != CHIP_FAULT_JUMP || in->is_enabled) tracker->fault = bad;
        lose_position(tracker);
    } else if (tracker->tip_known && chip_tracker_offset_changed(tracker, in)) {
        change_offset(tracker, in, tip);
    }
    if (bad == CHIP_FAULT_NONE || bad == CHIP_FAULT_JUMP) {
        serve_tool(tracker, in);
        if (ready && tracker->tool_error == 0)
            ready_period(tracker, stock, in, tip, out);
        else {
            forget_path(tracker);
            if (!CHIP_FAULTY(UNDESCRIBED_STAYS)) chip_tracker_keep_start(tracker, in, tip);
        }
        note_position(tracker, in, tip);
    }
    out->removed_volume_mm3 = stock->removed;
    out->mrr_mm3_min = rate(tracker, stock->removed, in);
    if (!all_finite(out)) {
        chip_tracker_give_up_map(tracker, stock);
        clear(out);
        out->removed_volume_mm3 = 0.0;
        filled = ready = 0;
    }
    out->removed_volume_mm3 =
        chip_max(0.0, out->removed_volume_mm3); /* a rim cell may round up a thousandth of a mm3 at its first cut */
    chip_tracker_own_map(tracker, stock);
    out->fault_number = current_fault(tracker, in, filled);
    out->has_fault = out->fault_number != CHIP_FAULT_NONE;
    out->has_stock = ready;
    out->is_certain = ready && !tracker->is_uncertain;
    out->is_ready = ready && tracker->tool_error == 0 && !bad && !tool_unknown(tracker, in) && !in->watch_fault;
}
