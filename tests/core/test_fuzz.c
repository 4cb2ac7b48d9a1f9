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
#include "core/obey.h"
#include "core/tool_watch.h"
#include "core/tracker.h"

#define PERIODS 250             /* of an episode */
#define SETTLE 60               /* until a map of this size is filled again */
#define LONGEST_S 0.05

static const double HOSTILE[] = { 0.0, -0.0, 1.0, -1.0, 4.9e-324, 1e-300, -1e-300, 1e-12, 1e-6, 0.25, 180.0, 1e5, 999999.0, 1e6, -1e6, 1.1e6, 1e9, 2147483647.0,
    2147483648.0, -2147483649.0, 1e18, 1e150, -1e150, 1e300, 1.7976931348623157e308, -1.7976931348623157e308, INFINITY, -INFINITY, NAN };
#define COUNT(array) ((int)(sizeof (array) / sizeof *(array)))

static unsigned long seed, start_seed;
static long episode, period;
static struct cw_stock *stock;
static uint32_t capacity;
static struct cw_tracker tracker;
static struct cw_tracker_in sound, in;
static struct cw_tracker_out out;
static struct cw_feed_easing easing;
static struct cw_obey obey;
static struct chip_tool_watch watch;
static long failures, hostile_periods, ready_periods;

static double chance(void)
{
    seed = seed * 6364136223846793005ul + 1442695040888963407ul;
    return (double)(seed >> 11) / 9007199254740992.0;
}

static int pick(int count) { return (int)(chance() * count); }

static double hostile(void)
{
    double value = HOSTILE[pick(COUNT(HOSTILE))];
    if (chance() < 0.3) value *= 1.0 + chance();
    if (chance() < 0.1) { uint64_t bits = 0; int i; for (i = 0; i < 8; i++) bits = bits << 8 | (uint64_t)pick(256); memcpy(&value, &bits, 8); }
    return value;
}

static int hostile_whole(void)
{
    static const int some[] = { 0, 1, 2, 3, 4, 5, 8, -1, 16, 255, 2147483647, -2147483647 - 1 };
    return some[pick(COUNT(some))];
}

static void expect(int good, const char *what, double value)
{
    if (good || failures++ > 20) return;
    printf("CHIPWISE_SEED=%lu episode %ld period %ld: %s: %g (ready %d, fault %d, axis %g %g %g, unit %g, tool %g %g %g %g)\n", start_seed, episode, period,
           what, value, out.is_ready, out.code, in.axis[0], in.axis[1], in.axis[2], in.unit, in.tool_size[0], in.tool_size[1], in.tool_size[2],
           in.tool_size[3]);
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
    capacity = cw_stock_cells(cell, 62.0, 42.0);
    bytes = (cw_stock_bytes(capacity) + 7) / 8 * 8;
    room = (bytes + page - 1) / page * page;
    block = mmap(0, room + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    mprotect(block + room, page, PROT_NONE);
    stock = (struct cw_stock *)(block + room - bytes);
    cw_stock_init(stock, cell, capacity);
}

static void drop_map(void)
{
    long page = sysconf(_SC_PAGESIZE);
    size_t bytes = (cw_stock_bytes(capacity) + 7) / 8 * 8, room = (bytes + page - 1) / page * page;
    munmap((char *)stock + bytes - room, room + page);
}

static void begin(void)
{
    int i;
    memset(&sound, 0, sizeof sound);
    sound.unit = chance() < 0.3 ? 1.0 / 25.4 : 1.0;
    sound.period = 0.001;
    sound.window = 0.02;
    sound.accel = 500.0 * sound.unit;
    sound.cutting = 1;
    sound.motion = 2;
    sound.tool_size[0] = 6.0 * sound.unit;
    sound.tool_size[3] = 12.0 * sound.unit;
    for (i = 0; i < 3; i++) sound.axis_accel[i] = sound.accel;
    sound.box_min[2] = -10.0 * sound.unit;
    sound.box_max[0] = 60.0 * sound.unit;
    sound.box_max[1] = 40.0 * sound.unit;
    sound.axis[0] = 30.0 * sound.unit;
    sound.axis[1] = 20.0 * sound.unit;
    cw_tracker_init(&tracker);
    memset(&easing, 0, sizeof easing);
    memset(&obey, 0, sizeof obey);
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
    sound.axis[0] += 0.1 * cos(heading) * sound.unit;
    sound.axis[1] += 0.1 * sin(heading) * sound.unit;
    sound.axis[2] += 0.05 * dive * sound.unit;
    for (i = 0; i < 3; i++) {
        double most = (i == 0 ? 70.0 : i == 1 ? 50.0 : 10.0) * sound.unit, least = -12.0 * sound.unit;
        if (sound.axis[i] > most || sound.axis[i] < least) heading += 3.0, dive = -dive, sound.axis[i] = fmin(fmax(sound.axis[i], least), most);
    }
}

/* The numbers of `in` by number; -> how many there are. */
static int number(int which, double **place)
{
    double *all[] = { &in.axis[0], &in.axis[1], &in.axis[2], &in.offset[0], &in.offset[1], &in.offset[2], &in.unit, &in.tool_size[0], &in.tool_size[1],
        &in.tool_size[2], &in.tool_size[3], &in.box_min[0], &in.box_min[1], &in.box_min[2], &in.box_max[0], &in.box_max[1], &in.box_max[2],
        &in.box_turn, &in.to_go, &in.accel, &in.axis_accel[0], &in.axis_accel[1], &in.axis_accel[2], &in.jerk, &in.window };
    if (place) *place = all[which];
    return COUNT(all);
}

static void check_tracker(void)
{
    int i, sane = 1;
    in_range("section area", out.here, 0.0, 1e12);
    in_range("depth", out.deepest, 0.0, 1e12);
    in_range("rate", out.rate, 0.0, 1e15);
    in_range("direction", out.upward, -1.0, 1.0);
    in_range("removed", out.removed_mm3, 0.0, 62.0 * 42.0 * 2e6 * 1.01);
    in_range("rapid distance", out.rapid_mm, 0.0, 1e12);
    in_range("levels", out.view.levels, 0, CW_AHEAD_LEVELS);
    for (i = 0; i < out.view.levels && i < CW_AHEAD_LEVELS; i++) {
        in_range("distance ahead", out.view.level[i].distance, 0.0, 1e15);
        in_range("area ahead", out.view.level[i].area, 0.0, 1e15);
        in_range("acceleration ahead", out.view.level[i].accel, 0.0, INFINITY);
    }
    expect(out.has_fault == (out.code != 0), "fault without a code, or the other way", out.code);
    for (i = 0; i < 3; i++) sane &= isfinite(in.axis[i]) && isfinite(in.offset[i]);
    sane &= isfinite(in.unit) && in.unit > 0.0 && isfinite(in.tool_size[0]) && in.tool_size[0] > 0.0 && isfinite(in.tool_size[1])
        && isfinite(in.tool_size[2]) && isfinite(in.tool_size[3]) && !in.tool_unknown && !in.watch_fault && !in.foreign;
    expect(sane || !out.is_ready, "ready with inputs that cannot be", out.is_ready);
    expect((in.unit > 0.0 && isfinite(in.unit)) || out.has_fault || in.foreign, "no fault for the units", in.unit);
    ready_periods += out.is_ready;
}

/* The law on what the tracker says, with hostile settings too. */
static void check_feed(int spoilt)
{
    struct cw_feed_in law;
    struct cw_obey_in seen;
    struct chip_tool_watch_in beat;
    struct cw_feed_out said;
    double *first = &law.tool_target, *numbers[] = { &law.target, &law.lower, &law.programmed, &law.requested, &law.accel, &law.floor, &law.dt, &law.area,
        &law.next_distance[3], &law.next_area[0], &law.next_accel[1], first, &law.most, &law.floor_share, &law.most_share, &law.air, &law.plunge, &law.upward, &law.chip,
        &law.teeth, &law.turns, &law.tool_width, &law.stock_height, &law.knob, &law.jerk, &law.speed, &law.gain };
    double recover = 0.0, band = 0.0, over;
    int i;
    memset(&law, 0, sizeof law);
    law.kind = pick(5) - 1;
    law.motion = in.motion;
    law.target = 60.0;
    law.lower = 20.0;
    law.programmed = 20.0;
    law.requested = 50.0;
    law.accel = 500.0;
    law.dt = 0.001;
    law.trusted = out.is_ready && !out.has_fault;
    law.area = out.here;
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        int used = i < out.view.levels;
        law.next_distance[i] = used ? out.view.level[i].distance : 0.0;
        law.next_area[i] = used ? out.view.level[i].area : 0.0;
        law.next_accel[i] = used ? out.view.level[i].accel : 0.0;
    }
    law.knob = 1.0;
    if (spoilt) {
        for (i = pick(4); i >= 0; i--) *numbers[pick(COUNT(numbers))] = hostile();
        if (chance() < 0.3) law.kind = hostile_whole();
        if (chance() < 0.3) law.motion = hostile_whole();
        if (chance() < 0.3) recover = hostile();
        if (chance() < 0.3) band = hostile();
    }
    said = cw_feed(&law, spoilt && chance() < 0.2 ? hostile() : 1.0);
    in_range("override of the law", said.scale, 0.0, 1.0);
    in_range("limited-by", said.by, 0, 5);
    expect(law.trusted || said.by == 5 || said.by == 0, "a law without trust", said.by);
    said = cw_feed_ease(&easing, &law, said, recover, band);
    in_range("override eased", said.scale, 0.0, 1.0);
    over = cw_feed_override(&law, said.scale);
    in_range("override", over, 0.0, 1.0);
    over = cw_feed_target(&law);
    in_range("target", over, 0.0, 1.7976931348623157e308);
    memset(&seen, 0, sizeof seen);
    seen.kind = law.kind;
    seen.motion = law.motion;
    seen.programmed = law.programmed;
    seen.requested = law.requested;
    seen.scale = said.scale;
    seen.actual = spoilt ? hostile() : 20.0;
    seen.accel = law.accel;
    seen.most_override = spoilt ? hostile() : 1.0;
    seen.dt = law.dt;
    cw_obey_step(&obey, &seen);
    in_range("explained", obey.explained, 0.0, 1e300);
    beat.machine_tool = spoilt ? hostile_whole() : 1;
    beat.followed_tool = 1;
    beat.beats = spoilt ? hostile_whole() : (int)period;
    beat.limit_s = spoilt ? hostile() : 5.0;
    beat.period_s = spoilt ? hostile() : 0.001;
    chip_tool_watch_step(&watch, &beat);
    in_range("silent", watch.silent_s, 0.0, 1e6);
    in_range("changed", watch.changed_s, 0.0, 1e6);
    expect(beat.machine_tool == 1 || watch.is_unknown, "an unknown tool", beat.machine_tool);
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
    sound.request = 1;
    for (period = 0; period < PERIODS + 2 * SETTLE; period++) {
        double *place, before;
        walk();
        if (period == 1 || period == PERIODS + 1) sound.request = 0;
        if (period == PERIODS + 2) sound.motion = 2, sound.request = 1;         /* sound again, defined again */
        in = sound;
        if (period < PERIODS) {
            if (left == 0 && chance() < 0.05) {
                left = 1 + pick(chance() < 0.5 ? 3 : 40);
                count = 1 + pick(4);
                for (i = 0; i < count; i++) { spoilt[i] = pick(number(0, 0)); value[i] = hostile(); }
            }
            if (left > 0) {
                left--;
                hostile_periods++;
                for (i = 0; i < count; i++) { number(spoilt[i], &place); *place = value[i]; }
                if (chance() < 0.2) in.motion = hostile_whole();
                if (chance() < 0.1) in.form = hostile_whole();
                if (chance() < 0.05) in.request = !in.request;
                if (chance() < 0.02) in.foreign = 1;
                if (chance() < 0.05) in.tool_unknown = 1;
                if (chance() < 0.02) in.watch_fault = 16;
                if (chance() < 0.05) in.cutting = !in.cutting;
                if (chance() < 0.05) in.other_moved = 1;
            }
        }
        before = cpu_s();
        cw_tracker_horizon(&tracker, stock, &in);
        cw_tracker_step(&tracker, stock, &in, &out);
        expect(cpu_s() - before < LONGEST_S, "seconds in a period", cpu_s() - before);
        check_tracker();
        check_feed(chance() < 0.5);
    }
    expect(out.is_ready && out.code == 0, "ready when all is sound and the stock is new", out.is_ready);
    expect(!memcmp(tracker.own_head, stock, sizeof *stock) && stock->capacity == capacity, "the map's own head", stock->cell);
    drop_map();
}

int main(void)
{
    const char *count = getenv("CHIPWISE_RANDOM_COUNT"), *from = getenv("CHIPWISE_SEED");
    long episodes = count && *count ? atol(count) : 300;
    start_seed = seed = from && *from ? strtoul(from, 0, 10) : 7134;
    for (episode = 0; episode < episodes; episode++) run_episode();
    printf("%ld episodes, %ld hostile periods, %ld ready, %ld failures\n", episodes, hostile_periods, ready_periods, failures);
    return failures != 0 || ready_periods == 0 || (episodes > 100 && hostile_periods == 0);
}
