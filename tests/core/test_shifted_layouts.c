/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A LinuxCNC whose structures have other members: the reader of the motion planner (components/linuxcnc_planner.c) on 100,000
 * random layouts.
 *
 * A planner as the headers describe it, which runs, is copied into memory as another version would have it: members are
 * put in or taken out somewhere in the block, in the segments of the queue, or in both, or change places. The reader may know nothing, or the path that the planner has: never another one.
 * If bytes that were taken out are put in again nearby, only the number that says whether a segment ahead is a rapid may have
 * changed: it may be mistaken then, the path may not.
 * If members are put in or taken out at one place that something read depends on, it knows nothing. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "linuxcnc_planner.c"

#define TEST_FILE "test_shifted_layouts.c"
#include "fake_planner.h"
#include "random_numbers.h"

#define BLOCK ((int)sizeof(struct chip_motion_end))
#define ITEM ((int)sizeof(TC_STRUCT))
#define MOST 512 /* bytes put in or taken out at a place */
#define SLOTS 12 /* of the queue that are used */
#define PERIODS 4
/* The address that the queue is asked for: it is a part of the block, and so of what is shuffled. Half of another address may be one in
 * ASan's own memory, which may be read, but not with ASan. */
#define ITEMS_AT 0x5a0000000000ul
#define SAME 1e-3 /* mm: what the reader's own checks allow */

struct edit {
    int at, bytes; /* bytes put in (taken out if negative) at `at` */
    int fill;      /* with 0 zeros, 1 noise, 2 what lies behind */
};
struct layout {
    struct edit edit[2];
    int edits;
};

static char *block, *items; /* as the other version has them */
static struct chip_planner other;
static struct chip_path other_path;
static int may_mistake_rapids;

/* Writes `bytes` of `from` as the layout has them; -> how many they are. */
static int write_as(char *to, const char *from, int bytes, const struct layout *layout)
{
    int k, j, read = 0, written = 0;
    for (k = 0; k < layout->edits; k++) { /* in the order of their places */
        const struct edit *edit = &layout->edit[k];
        int plain = edit->at > read ? edit->at - read : 0;
        memcpy(to + written, from + read, plain);
        written += plain;
        read += plain;
        for (j = 0; j < edit->bytes; j++)
            to[written++] = (char)(edit->fill == 1 ? pick(256) : edit->fill == 2 ? from[(read + j) % bytes] : 0);
        if (edit->bytes < 0) read = read - edit->bytes < bytes ? read - edit->bytes : bytes;
    }
    memcpy(to + written, from + read, bytes - read);
    return written + bytes - read;
}

static int size_as(int bytes, const struct layout *layout)
{
    char *to = block; /* as large as any of them */
    return write_as(to, (const char *)&end, bytes, layout);
}

/* A place in the block where members lie that are read. */
static int busy_place(void)
{
    int status = offsetof(struct chip_motion_end, status.heartbeat) + 8,
        config = offsetof(struct chip_motion_end, config);
    int planner_at = offsetof(struct chip_motion_end, internal), last = planner_at + offsetof(TP_STRUCT, syncdio);
    return chance() < 0.3 ? status + 4 * pick((config - status) / 4) : planner_at + 4 * pick((last - planner_at) / 4);
}

/* Members put in or taken out at `places` places from `low` on; with two of them often the same number of bytes, which leaves
 * the size. */
static void choose(struct layout *layout, int places, int low, int bytes)
{
    int is_block = bytes == BLOCK;
    static const int steps[] = { 4, 8, 16, 24, 32, 64, 120, 256, MOST };
    int k;
    layout->edits = places;
    for (k = 0; k < places; k++) {
        struct edit *edit = &layout->edit[k];
        edit->bytes = chance() < 0.7 ? steps[pick(COUNT(steps))] : 4 * (1 + pick(MOST / 4));
        if (chance() < 0.5) edit->bytes = -edit->bytes;
        edit->at = is_block && chance() < 0.9 ? busy_place() : low + 4 * pick((bytes - low) / 4);
        if (edit->bytes < 0 && edit->at - edit->bytes > bytes) edit->bytes = edit->at - bytes;
        if (edit->bytes == 0) edit->bytes = 4;
        edit->fill = pick(3);
    }
    if (places == 2 && layout->edit[0].at > layout->edit[1].at) {
        struct edit first = layout->edit[1];
        layout->edit[1] = layout->edit[0];
        layout->edit[0] = first;
    }
    if (layout->edits == 2 && chance() < 0.5) layout->edit[1].bytes = -layout->edit[0].bytes;
    if (layout->edits == 2 && layout->edit[1].bytes < 0 && layout->edit[1].at - layout->edit[1].bytes > bytes)
        layout->edit[1].bytes = layout->edit[1].at - bytes;
}

/* A program of lines, arcs and helices that join, as the planner would have queued it. */
static void choose_program(void)
{
    int n = 1 + pick(6), i;
    PmCartesian at = point(10 * chance(), 10 * chance(), -chance());
    begin(1.0);
    tp()->queue.start = pick(4);
    for (i = 0; i < n; i++) {
        TC_STRUCT *tc;
        PmCartesian to = point(at.x + 1 + 9 * chance(), at.y + 10 * chance() - 5, chance() < 0.5 ? at.z : at.z - 1);
        if (chance() < 0.3) {
            tc = append_circle(0.5 + chance(), 1, 1.0);
            tc->coords.circle.xyz.center = point(at.x - 5, at.y, at.z);
            planned_at(tc, tc->target, &to);
        } else
            tc = append_line(at, to);
        tc->id = 10 + i;
        tc->term_cond = pick(4);
        tc->reqvel = tc->target_vel = tc->maxvel = tc->currentvel = 10 + 40 * chance();
        tc->nominal_length = tc->target;
        tc->tolerance = 0.01 + chance();
        tc->indexer_jnum = -1;
        tc->finalized = 1;
        tc->active = i == 0;
        tc->cycle_time = 0.001;
        at = to;
    }
    queue[tp()->queue.start].progress = queue[tp()->queue.start].target * 0.9 * chance();
    end.status.heartbeat = 1 + (uint64_t)pick(1 << 30);
    end.status.requested_vel = 20.0;
    end.status.current_vel = 10.0;
    end.status.id = 10;
    end.config.servoCycleTime = end.config.trajCycleTime = 0.001;
    end.config.limitVel = 100.0;
    tp()->queueSize = DEFAULT_TC_QUEUE_SIZE;
    tp()->vMax = tp()->vLimit = tp()->ini_maxvel = 50.0;
    tp()->aMax = tp()->aLimit = 400.0;
    tp()->depth = tp()->queue._len;
    tp()->activeDepth = 1;
}

/* Writes the other version's block so that it ends as `block` does. */
static void write_other(const struct layout *of_block, const struct layout *of_items, int stride, int bytes)
{
    int i;
    for (i = 0; i < SLOTS; i++) write_as(items + (size_t)i * stride, (const char *)&queue[i], ITEM, of_items);
    tp()->queue.queue = (TC_STRUCT *)items;
    write_as(block + BLOCK + 2 * MOST - bytes, (const char *)&end, BLOCK, of_block);
    tp()->queue.queue = queue;
}

/* Members that change places, up to 40 of 4 bytes, in the part that is read. */
static void mix(void)
{
    int n = 1 + pick(40);
    for (; n > 0; n--) {
        char *a = block + 2 * MOST + busy_place(), *b = block + 2 * MOST + busy_place(), kept[4];
        memcpy(kept, a, 4);
        memcpy(a, b, 4);
        memcpy(b, kept, 4);
    }
}

/* The largest difference of the two paths at the ends and in the middle of their segments, mm; 1e9: of another kind. */
static double difference(void)
{
    double worst = fabs(path.s - other_path.s);
    int i, k, axis;
    if (!path.known || path.count != other_path.count) return 1e9;
    for (i = 0; i < path.count; i++) {
        const struct chip_segment *a = &path.segment[chip_path_slot(&path, i)],
                                  *b = &other_path.segment[chip_path_slot(&other_path, i)];
        if (a->rapid != b->rapid && !may_mistake_rapids) return 1e9;
        for (k = 0; k < 3; k++) {
            double at[3], other_at[3], dir[3];
            chip_segment_at(a, 0.5 * k * a->length, at, dir);
            chip_segment_at(b, 0.5 * k * b->length, other_at, dir);
            for (axis = 0; axis < 3; axis++) worst = fmax(worst, fabs(at[axis] - other_at[axis]));
        }
    }
    return worst;
}

/* The periods of one layout; -> in how many of them the path is known to the reader; -1: it is another path. */
static int run(const struct layout *of_block, const struct layout *of_items, int is_mixed)
{
    int stride = size_as(ITEM, of_items), bytes = size_as(BLOCK, of_block), i, known = 0;
    unsigned long after, start = seed;
    for (i = 0; i < BLOCK + 2 * MOST; i++) block[i] = (char)(i * 37);
    memset(&other, 0, sizeof other);
    memset(&other_path, 0, sizeof other_path);
    chip_path_reset(&other_path);
    for (i = 0; i < PERIODS; i++) {
        TC_STRUCT *tc = &queue[tp()->queue.start];
        tc->progress = fmin(tc->target, tc->progress + 0.02);
        follow(30.0);
        after = seed;
        seed = start; /* the same noise in every period: members that nobody writes */
        write_other(of_block, of_items, stride, bytes);
        if (is_mixed) mix();
        seed = after;
        if (i == 0) other.refused = take_block(&other, block, BLOCK + 2 * MOST);
        chip_planner_aborted(&other);
        chip_planner_follow(&other, &in, 30.0, &other_path);
        known += other_path.known;
        if (other_path.known && !(difference() <= SAME)) return -1;
    }
    return known;
}

int main(void)
{
    static const char *const kinds[] = { "block", "segments", "both", "block at two places", "segments at two places",
                                         "mixed" };
    static const struct layout same;
    long count = random_begin(100000), n, known[COUNT(kinds)] = { 0 }, tried[COUNT(kinds)] = { 0 };
    int k, fail = 0;
    block = calloc(1, BLOCK + 2 * MOST);
    items = mmap((void *)ITEMS_AT, DEFAULT_TC_QUEUE_SIZE * (size_t)(ITEM + 2 * MOST), PROT_READ | PROT_WRITE,
                 MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    CHECK(items != MAP_FAILED);
    if (items == MAP_FAILED) return 1;
    choose_program();
    CHECK(run(&same, &same, 0) == PERIODS - 1); /* the layout of the headers is read, but for the first period */
    for (n = 0; n < count && !fail; n++) {
        struct layout of_block = same, of_items = same;
        int kind = pick(COUNT(kinds)), periods;
        choose_program();
        if (kind == 0 || kind == 2) choose(&of_block, 1, offsetof(struct chip_motion_end, status.heartbeat) + 8, BLOCK);
        if (kind == 3) choose(&of_block, 2, 0, BLOCK);
        if (kind == 1 || kind == 2) choose(&of_items, 1, 0, ITEM);
        if (kind == 4) choose(&of_items, 2, 0, ITEM);
        may_mistake_rapids = kind == 4;
        periods = run(&of_block, &of_items, kind == 5);
        tried[kind]++;
        known[kind] += periods > 0;
        fail = periods < 0 || (periods > 0 && (kind == 0 || kind == 2 || (kind == 1 && tp()->queue._len > 1)));
        if (fail)
            printf("%s: %s in layout %ld of seed %lu: block %d+%d, segments %d+%d, %d segments\n", TEST_FILE,
                   periods < 0 ? "another path" : "known", n, start_seed, of_block.edit[0].at, of_block.edit[0].bytes,
                   of_items.edit[0].at, of_items.edit[0].bytes, tp()->queue._len);
    }
    for (k = 0; k < COUNT(kinds); k++)
        printf("%s: %ld layouts, known, and right, in %ld\n", kinds[k], tried[k], known[k]);
    return fail || failures;
}
