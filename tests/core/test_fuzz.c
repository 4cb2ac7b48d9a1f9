/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Hostile numbers on every input of the tracker, the feed law and the watches, at random and one at a time.
 *
 * A tool wanders through a stock; again and again some inputs are NaN, infinite or absurd for a while, the box and the tool too.
 * In every period: no output that is not a finite number of the right sign, `ready` only with a sound position and tool, a
 * fault code just where there is a fault, an override in 0..1, no access outside the map (pages behind it cannot be
 * touched), no period that takes LONGEST_S of the processor. When the inputs are sound again and the stock is defined anew the
 * tracker is ready.
 *
 * CHIPWISE_RANDOM_COUNT episodes (default 300), CHIPWISE_SEED; a failure prints seed, episode, period and what.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "core/feed.h"
#include "core/watchdog.h"
#include "core/tool_watch.h"
#include "core/load_watch.h"
#include "core/feed_hold.h"
#include "core/tracker.h"
#include "hostile_law.h"
#include "random_numbers.h"

#define PERIODS 250 /* of an episode */
#define SETTLE 60   /* until a map of this size is filled again */
#define LONGEST_S 0.05

static long episode, period;
static struct chip_stock *stock;
static uint32_t capacity;
static struct chip_tracker tracker;
static struct chip_tracker_in sound, in;
static struct chip_tracker_out out;
static struct chip_feed_easing easing;
static struct chip_watchdog watchdog;
static struct chip_tool_watch watch;
static struct chip_load_watch load_watch;
static struct chip_feed_hold feed_hold;
static long failures, hostile_periods, ready_periods;

static void expect(int good, const char *what, double value)
{
    if (good || failures++ > 20) return;
    printf("CHIPWISE_SEED=%lu episode %ld period %ld: %s: %g (ready %d, fault %d, axis %g %g %g, unit %g, tool %g %g "
           "%g %g)\n",
           start_seed, episode, period, what, value, out.is_ready, out.fault_number, in.pos_mu[0], in.pos_mu[1],
           in.pos_mu[2], in.mu_per_mm, in.tool_diameter_mu, in.tool_corner_radius_mu, in.tool_tip_angle_deg,
           in.tool_flute_length_mu);
}

static void in_range(const char *what, double value, double low, double high)
{
    expect(value >= low && value <= high, what, value);
}

/* A map whose last byte is followed by a page that cannot be touched. */
static void make_map(double cell)
{
    long page = sysconf(_SC_PAGESIZE);
    size_t bytes, room;
    char *block;
    capacity = chip_stock_cells(cell, 62.0, 42.0);
    bytes = (chip_stock_bytes(capacity) + 7) / 8 * 8;
    room = (bytes + page - 1) / page * page;
    block = mmap(0, room + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    mprotect(block + room, page, PROT_NONE);
    stock = (struct chip_stock *)(block + room - bytes);
    chip_stock_init_finer(stock, cell, chance() < 0.5 ? chance() * cell : hostile(), capacity);
}

static void drop_map(void)
{
    long page = sysconf(_SC_PAGESIZE);
    size_t bytes = (chip_stock_bytes(capacity) + 7) / 8 * 8, room = (bytes + page - 1) / page * page;
    munmap((char *)stock + bytes - room, room + page);
}

static void begin(void)
{
    int i;
    memset(&sound, 0, sizeof sound);
    sound.mu_per_mm = chance() < 0.3 ? 1.0 / 25.4 : 1.0;
    sound.period_s = 0.001;
    sound.mrr_window_s = 0.02;
    sound.acceleration_mu_s2 = 500.0 * sound.mu_per_mm;
    sound.is_enabled = 1;
    sound.motion = 2;
    sound.tool_diameter_mu = 6.0 * sound.mu_per_mm;
    sound.tool_flute_length_mu = 12.0 * sound.mu_per_mm;
    for (i = 0; i < 3; i++) sound.axis_acceleration_mu_s2[i] = sound.acceleration_mu_s2;
    sound.box_min_mu[2] = -10.0 * sound.mu_per_mm;
    sound.box_max_mu[0] = 60.0 * sound.mu_per_mm;
    sound.box_max_mu[1] = 40.0 * sound.mu_per_mm;
    sound.pos_mu[0] = 30.0 * sound.mu_per_mm;
    sound.pos_mu[1] = 20.0 * sound.mu_per_mm;
    chip_tracker_init(&tracker);
    memset(&easing, 0, sizeof easing);
    memset(&watchdog, 0, sizeof watchdog);
    memset(&watch, 0, sizeof watch);
    make_map(chance() < 0.5 ? 0.25 : 0.1 + chance());
    chip_tracker_own_map(&tracker, stock);
}

/* One step of the tool's walk: it stays near the stock. */
static void walk(void)
{
    static double heading, dive;
    int i;
    if (chance() < 0.02) heading = 6.3 * chance();
    if (chance() < 0.02) dive = chance() - 0.5;
    if (chance() < 0.01) sound.motion = pick(4);
    sound.pos_mu[0] += 0.1 * cos(heading) * sound.mu_per_mm;
    sound.pos_mu[1] += 0.1 * sin(heading) * sound.mu_per_mm;
    sound.pos_mu[2] += 0.05 * dive * sound.mu_per_mm;
    for (i = 0; i < 3; i++) {
        double most = (i == 0 ? 70.0 : i == 1 ? 50.0 : 10.0) * sound.mu_per_mm, least = -12.0 * sound.mu_per_mm;
        if (sound.pos_mu[i] > most || sound.pos_mu[i] < least)
            heading += 3.0, dive = -dive, sound.pos_mu[i] = fmin(fmax(sound.pos_mu[i], least), most);
    }
}

/* The numbers of `in` by number; -> how many there are. */
static int number(int which, double **place)
{
    double *all[] = { &in.pos_mu[0],
                      &in.pos_mu[1],
                      &in.pos_mu[2],
                      &in.tool_offset_mu[0],
                      &in.tool_offset_mu[1],
                      &in.tool_offset_mu[2],
                      &in.mu_per_mm,
                      &in.tool_diameter_mu,
                      &in.tool_corner_radius_mu,
                      &in.tool_tip_angle_deg,
                      &in.tool_flute_length_mu,
                      &in.box_min_mu[0],
                      &in.box_min_mu[1],
                      &in.box_min_mu[2],
                      &in.box_max_mu[0],
                      &in.box_max_mu[1],
                      &in.box_max_mu[2],
                      &in.box_turn_deg,
                      &in.distance_to_go_mu,
                      &in.acceleration_mu_s2,
                      &in.axis_acceleration_mu_s2[0],
                      &in.axis_acceleration_mu_s2[1],
                      &in.axis_acceleration_mu_s2[2],
                      &in.max_jerk_mu_s3,
                      &in.mrr_window_s };
    if (place) *place = all[which];
    return COUNT(all);
}

static void check_tracker(void)
{
    int i, sane = 1;
    in_range("section area", out.section_area_mm2, 0.0, 1e12);
    in_range("depth", out.depth_mm, 0.0, 1e12);
    in_range("rate", out.mrr_mm3_min, 0.0, 1e15);
    in_range("direction", out.dir_z, -1.0, 1.0);
    in_range("removed", out.removed_volume_mm3, 0.0, 62.0 * 42.0 * 2e6 * 1.01);
    in_range("rapid distance", out.rapid_distance_mm, 0.0, 1e12);
    in_range("levels", out.load.steps, 0, CHIP_LOAD_STEPS);
    for (i = 0; i < out.load.steps && i < CHIP_LOAD_STEPS; i++) {
        in_range("distance ahead", out.load.step[i].distance, 0.0, 1e15);
        in_range("area ahead", out.load.step[i].area, 0.0, 1e15);
        in_range("acceleration ahead", out.load.step[i].accel, 0.0, INFINITY);
    }
    expect(out.has_fault == (out.fault_number != 0), "fault without a code, or the other way", out.fault_number);
    for (i = 0; i < 3; i++) sane &= isfinite(in.pos_mu[i]) && isfinite(in.tool_offset_mu[i]);
    sane &= isfinite(in.mu_per_mm) && in.mu_per_mm > 0.0 && isfinite(in.tool_diameter_mu) && in.tool_diameter_mu > 0.0
         && isfinite(in.tool_corner_radius_mu) && isfinite(in.tool_tip_angle_deg) && isfinite(in.tool_flute_length_mu)
         && !in.tool_unknown && !in.watch_fault && !in.external_writer;
    expect(sane || !out.is_ready, "ready with inputs that cannot be", out.is_ready);
    expect((in.mu_per_mm > 0.0 && isfinite(in.mu_per_mm)) || out.has_fault || in.external_writer,
           "no fault for the units", in.mu_per_mm);
    ready_periods += out.is_ready;
}

/* The watchdog on the law and what it has said. */
static void check_watchdog(const struct chip_feed_in *law, double override_share, int spoilt)
{
    struct chip_watchdog_in seen;
    memset(&seen, 0, sizeof seen);
    seen.feed_mode = law->feed_mode;
    seen.motion = law->motion;
    seen.programmed_vel_mm_s = law->programmed_vel_mm_s;
    seen.requested_vel_mm_s = law->requested_vel_mm_s;
    seen.override_share = override_share;
    seen.current_vel_mm_s = spoilt ? hostile() : 20.0;
    seen.blend_vel_mm_s = spoilt ? hostile() : 0.0;
    seen.braking_mm_s2 = spoilt ? hostile() : 0.0;
    seen.acceleration_mm_s2 = law->acceleration_mm_s2;
    seen.max_override_share = spoilt ? hostile() : 1.0;
    seen.period_s = law->period_s;
    chip_watchdog_step(&watchdog, &seen);
    in_range("explained", watchdog.explained_mm_s, 0.0, 1e300);
}

static void check_tool_watch(int spoilt)
{
    struct chip_tool_watch_in beat;
    beat.tool_in_spindle_number = spoilt ? hostile_whole() : 1;
    beat.tool_followed_number = 1;
    beat.heartbeat_count = spoilt ? hostile_whole() : (int)period;
    beat.monitor_timeout_s = spoilt ? hostile() : 5.0;
    beat.period_s = spoilt ? hostile() : 0.001;
    beat.since_last_s = spoilt ? hostile() : 0.001;
    chip_tool_watch_step(&watch, &beat);
    in_range("silent", watch.silent_s, 0.0, 1e6);
    in_range("changed", watch.changed_s, 0.0, 1e6);
    in_range("stood", watch.stopped_s, 0.0, 1e6);
    expect(!watch.is_awaited || watch.is_unknown, "a known tool is awaited", watch.is_awaited);
    expect(beat.tool_in_spindle_number == 1 || watch.is_unknown, "an unknown tool", beat.tool_in_spindle_number);
}

/* The watch over the load; what it says. */
static int check_load_watch(int spoilt)
{
    struct chip_load_watch_in seen;
    int i, was_known = load_watch.is_known, lost;
    seen.is_ready = out.is_ready;
    seen.is_unwatched = spoilt && chance() < 0.3;
    seen.stock_changes = spoilt && chance() < 0.1;
    seen.is_decided = spoilt && chance() < 0.05;
    seen.tool_in_spindle_number = spoilt && chance() < 0.2 ? hostile_whole() : 1;
    for (i = 0; i < CHIP_LOAD_WATCH_SIZES; i++) seen.tool_mu[i] = spoilt && chance() < 0.2 ? hostile() : 5.0;
    lost = chip_load_watch_step(&load_watch, &seen);
    expect(!lost || was_known, "lost what was never known", lost);
    expect(!lost || !seen.is_decided, "lost in spite of a decision", lost);
    return lost;
}

/* The law on what the tracker says, with hostile settings too; then both watches. */
static void check_feed(int spoilt)
{
    struct chip_feed_in law;
    struct chip_feed_out said;
    double recover = 0.0, band = 0.0, over;
    set_law(&law, in.motion, &out);
    if (spoilt) {
        spoil_law(&law);
        if (chance() < 0.3) recover = hostile();
        if (chance() < 0.3) band = hostile();
    }
    said = chip_feed(&law, spoilt && chance() < 0.2 ? hostile() : 1.0);
    in_range("override of the law", said.scale, 0.0, 1.0);
    in_range("limited-by", said.limit, 0, 8);
    expect(law.is_trusted || said.limit == 5 || said.limit == 0, "a law without trust", said.limit);
    said = chip_feed_ease(&easing, &law, said, recover, band);
    in_range("override eased", said.scale, 0.0, 1.0);
    over = said.scale;
    said = chip_feed_hold_step(&feed_hold, &law, check_load_watch(spoilt), said);
    in_range("override held", said.scale, 0.0, over);
    over = chip_feed_override(&law, said.scale);
    in_range("override", over, 0.0, 1.0);
    over = chip_feed_target(&law);
    in_range("target", over, 0.0, 1.7976931348623157e308);
    check_watchdog(&law, said.scale, spoilt);
    check_tool_watch(spoilt);
}

static double cpu_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

static void run_episode(void)
{
    int spoilt[4], left = 0, count = 0, i;
    double value[4] = { 0.0 };
    begin();
    sound.define_request = 1;
    for (period = 0; period < PERIODS + 2 * SETTLE; period++) {
        double *place, before;
        walk();
        if (period == 1 || period == PERIODS + 1) sound.define_request = 0;
        if (period == PERIODS + 2) sound.motion = 2, sound.define_request = 1; /* sound again, defined again */
        in = sound;
        if (period < PERIODS) {
            if (left == 0 && chance() < 0.05) {
                left = 1 + pick(chance() < 0.5 ? 3 : 40);
                count = 1 + pick(4);
                for (i = 0; i < count; i++) {
                    spoilt[i] = pick(number(0, 0));
                    value[i] = hostile();
                }
            }
            if (left > 0) {
                left--;
                hostile_periods++;
                for (i = 0; i < count; i++) {
                    number(spoilt[i], &place);
                    *place = value[i];
                }
                if (chance() < 0.2) in.motion = hostile_whole();
                if (chance() < 0.1) in.box_shape = hostile_whole();
                if (chance() < 0.05) in.define_request = !in.define_request;
                if (chance() < 0.02) in.external_writer = 1;
                if (chance() < 0.05) in.tool_unknown = 1;
                if (chance() < 0.02) in.watch_fault = 16;
                if (chance() < 0.05) in.is_enabled = !in.is_enabled;
                if (chance() < 0.05) in.is_turned = 1;
            }
        }
        before = cpu_s();
        chip_tracker_horizon(&tracker, stock, &in);
        chip_tracker_step(&tracker, stock, &in, &out);
        expect(cpu_s() - before < LONGEST_S, "seconds in a period", cpu_s() - before);
        check_tracker();
        check_feed(chance() < 0.5);
    }
    expect(out.is_ready && out.fault_number == 0, "ready when all is sound and the stock is new", out.is_ready);
    expect(!memcmp(tracker.own_head, stock, sizeof *stock) && stock->capacity == capacity, "the map's own head",
           stock->cell);
    drop_map();
}

int main(void)
{
    long episodes = random_begin(300);
    for (episode = 0; episode < episodes; episode++) run_episode();
    printf("%ld episodes, %ld hostile periods, %ld ready, %ld failures\n", episodes, hostile_periods, ready_periods,
           failures);
    return failures != 0 || ready_periods == 0 || (episodes > 100 && hostile_periods == 0);
}
