/* SPDX-License-Identifier: GPL-2.0-or-later */
/* linuxcnc_planner.c - see linuxcnc_planner.h; the numbers in brackets are those there. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* getresuid; LinuxCNC's flags define it as well */
#endif
#include <motion.h>
#include <motion_types.h>
#include <tc_types.h>
#include <tcq.h>

#include "core/chip_math.h"
#include "core/path_watch.h"
#include "core/tracker.h"
#include "linuxcnc_block.h"
#include "linuxcnc_planner.h"
#include "linuxcnc_segment.h"

#define CHIP_PLANNER_KEY 100    /* DEFAULT_SHMEM_KEY of motion */
#define CHIP_PLANNER_MARGIN 2.0 /* mm read beyond the horizon */
#define CHIP_PLANNER_READS 24   /* segments read from the queue in a period at most */

struct chip_motion_end { /* the end of motion's block (motion_struct.h, 2.9.0~pre1 to master) */
    struct emcmot_status_t status;
    struct emcmot_config_t config;
    struct emcmot_error_t error;
    struct emcmot_internal_t internal;
};

int chip_planner_ours(const struct shmid_ds *about)
{
    return is_us(about->shm_perm.uid) && is_us(about->shm_perm.cuid) && (about->shm_perm.mode & 0077) == 0;
}

/* [6] The planner at the end of a block that is motion's. -> chip_path_refusal. */
static int take_block(struct chip_planner *planner, const char *block, size_t bytes)
{
    const struct emcmot_internal_t *motion = (const void *)(block + bytes - sizeof(struct emcmot_internal_t));
    const TC_QUEUE_STRUCT *queue = &motion->coord_tp.queue;
    if (queue->size != DEFAULT_TC_QUEUE_SIZE || (uintptr_t)queue->queue % sizeof(double)) return CHIP_REFUSAL_NO_QUEUE;
    if (!is_in_memory(queue->queue, DEFAULT_TC_QUEUE_SIZE * sizeof(TC_STRUCT))) return CHIP_REFUSAL_NO_QUEUE;
    planner->motion = motion;
    planner->queue = queue->queue;
    return CHIP_REFUSAL_NONE;
}

static int attach(struct chip_planner *planner)
{
    int id = shmget(CHIP_PLANNER_KEY, 0, 0), refusal;
    struct shmid_ds about;
    const char *block;
    if (id < 0 || shmctl(id, IPC_STAT, &about) < 0) return CHIP_REFUSAL_NO_BLOCK;
    if (about.shm_segsz < sizeof(struct chip_motion_end)) return CHIP_REFUSAL_TOO_SMALL;
    if (!chip_planner_ours(&about)) return CHIP_REFUSAL_NOT_OURS;
    if (!is_mapped(id)) return CHIP_REFUSAL_NOT_MAPPED; /* [1] */
    block = shmat(id, 0, SHM_RDONLY);
    if (block == (void *)-1) return CHIP_REFUSAL_NO_BLOCK;
    refusal = take_block(planner, block, about.shm_segsz);
    if (refusal != CHIP_REFUSAL_NONE) shmdt(block);
    return refusal;
}

void chip_planner_attach(struct chip_planner *planner)
{
    memset(planner, 0, sizeof *planner);
    planner->refused = planner->refusal = attach(planner);
}

static int is_near(double a, double b) { return a - b < 1e-3 && b - a < 1e-3; }

static const TC_STRUCT *queue_item(const TP_STRUCT *tp, int n)
{
    return &tp->queue.queue[(tp->queue.start + n) % tp->queue.size];
}

/* The state that motion shows to user space. */
static const volatile struct emcmot_status_t *motion_status(const struct chip_planner *planner)
{
    const char *end = (const char *)(planner->motion + 1);
    return &((const volatile struct chip_motion_end *)(end - sizeof(struct chip_motion_end)))->status;
}

/* [7] Whether motion's pins say what is read in its block: what a pin shows is of this period, or of the one before. */
static int do_pins_agree(struct chip_planner *planner, const struct chip_tracker_in *in)
{
    const volatile struct emcmot_status_t *status = motion_status(planner);
    int kind = status->motionType, last_kind = planner->last_kind;
    double to_go = status->distance_to_go, last_to_go = planner->last_to_go;
    planner->last_kind = kind;
    planner->last_to_go = to_go;
    if (in->motion != kind && in->motion != last_kind) return 0;
    return !(in->distance_to_go_mu > 0.0) || in->distance_to_go_mu == to_go || in->distance_to_go_mu == last_to_go;
}

static int is_at(const PmCartesian *at, const double place[3])
{
    return is_near(at->x, place[0]) && is_near(at->y, place[1]) && is_near(at->z, place[2]);
}

/* [8] Whether the first segment, and the second one in a parabolic blend, leads through the planner's position. -> chip_path_refusal. */
static int judge_station(struct chip_planner *planner, const TP_STRUCT *tp)
{
    const TC_STRUCT *tc = queue_item(tp, 0), *next = queue_item(tp, 1);
    double place[3] = { tp->currentPos.tran.x, tp->currentPos.tran.y, tp->currentPos.tran.z };
    int before = planner->last_canon, is_blend;
    int is_next = planner->last_start != tp->queue.start; /* than in the last period */
    PmCartesian at, from;
    if (!is_plausible(tc)) return CHIP_REFUSAL_SEGMENT;
    planner->last_canon = tc->canon_motion_type;
    planner->last_start = tp->queue.start;
    if (tc->motion_type == TC_RIGIDTAP) return CHIP_REFUSAL_NONE; /* it is not read */
    is_blend = tp->queue._len > 1 && next->progress > 0.0;
    if (is_blend) {
        if (!is_plausible(next)) return CHIP_REFUSAL_SEGMENT;
        if (!planned_at(next, next->progress, &at) || !planned_at(next, 0.0, &from)) return CHIP_REFUSAL_NONE;
        place[0] -= at.x - from.x;
        place[1] -= at.y - from.y;
        place[2] -= at.z - from.z;
    }
    if (!planned_at(tc, tc->progress, &at) || !is_at(&at, place)) return CHIP_REFUSAL_STATION;
    if (tp->motionType == tc->canon_motion_type || (is_next && tp->motionType == before)) return CHIP_REFUSAL_NONE;
    return is_blend && tp->motionType == next->canon_motion_type ? CHIP_REFUSAL_NONE : CHIP_REFUSAL_SEGMENT;
}

/* [2] Every check of what is read of the planner, but for the segments ahead. -> chip_path_refusal. */
static int judge_planner(struct chip_planner *planner, const struct chip_tracker_in *in)
{
    const TP_STRUCT *tp;
    const double *axis = in->pos_mu;
    int agree;
    if (!planner->motion) return planner->refused;
    agree = do_pins_agree(planner, in);
    if (!planner->runs) return CHIP_REFUSAL_HEARTBEAT;
    if (!agree) return CHIP_REFUSAL_PINS;
    tp = &planner->motion->coord_tp;
    if (tp->queue.size != DEFAULT_TC_QUEUE_SIZE || tp->queue.queue != planner->queue) return CHIP_REFUSAL_COUNTS;
    if (tp->queue._len < 0 || tp->queue._len > tp->queue.size) return CHIP_REFUSAL_COUNTS;
    if (tp->queue.start < 0 || tp->queue.start >= tp->queue.size) return CHIP_REFUSAL_COUNTS;
    if ((tp->queue.start + tp->queue._len) % tp->queue.size != tp->queue.end) return CHIP_REFUSAL_COUNTS;
    if (!(tp->cycleTime > 0.5 * in->period_s && tp->cycleTime < 20.0 * in->period_s)) return CHIP_REFUSAL_COUNTS;
    if (tp->reverse_run) return CHIP_REFUSAL_REVERSED;
    if (!is_at(&tp->currentPos.tran, axis)) return CHIP_REFUSAL_POSITION;
    return tp->queue._len == 0 ? CHIP_REFUSAL_EMPTY : judge_station(planner, tp);
}

/* The parabolic blend the tool is in, if it leads into a straight traverse (tp/tp.c, tpUpdateBlend: the
 * next segment gets the share of its blend velocity that the first has lost of its own). */
static void read_parabola(const TP_STRUCT *tp, const struct chip_tracker_in *in, struct chip_blend *blend)
{
    const TC_STRUCT *tc = queue_item(tp, 0), *next = queue_item(tp, 1);
    struct chip_segment line;
    double tip[3];
    blend->active = 0;
    if (tp->queue._len < 2 || !tc->blending_next || tc->term_cond != TC_TERM_COND_PARABOLIC) return;
    if (next->motion_type != TC_LINEAR || next->canon_motion_type != EMC_MOTION_TYPE_TRAVERSE) return;
    if (!(next->progress > 0.0 && next->progress < next->target) || !(tc->blend_vel > 0.0)) return;
    if (!segment_of(next, 0, in, &line)) return;
    chip_segment_at(&line, 0.0, blend->start, blend->dir);
    chip_segment_at(&line, line.length, tip, blend->dir);
    blend->length = line.length;
    blend->travelled = next->progress / in->mu_per_mm;
    blend->speed = next->currentvel / in->mu_per_mm;
    blend->end_speed = next->blend_vel * (tc->vel_at_blend_start / tc->blend_vel) / in->mu_per_mm;
    blend->first_left = (tc->target - tc->progress) / in->mu_per_mm;
    blend->first_speed = tc->currentvel / in->mu_per_mm;
    blend->active = 1;
}

/* The pace of the segment the tool is on, or of the two of a parabolic blend [5]. */
static void read_pace(struct chip_planner *planner, const TP_STRUCT *tp)
{
    const TC_STRUCT *tc = queue_item(tp, 0), *next = queue_item(tp, 1);
    planner->braking_mu_s2 = braking_accel(tc);
    planner->blend_vel_mu_s = 0.0;
    if (tp->queue._len < 2 || !tc->blending_next || tc->term_cond != TC_TERM_COND_PARABOLIC) return;
    planner->braking_mu_s2 = (CHIP_HALF_IN_OVERLAP ? 0.5 : 1.0) * chip_min(planner->braking_mu_s2, braking_accel(next));
    planner->blend_vel_mu_s = chip_max(0.0, chip_min(tc->currentvel, next->currentvel));
}

static long key_of(const TP_STRUCT *tp, int n, int part)
{
    return (long)((tp->queue.start + n) % tp->queue.size) * CHIP_PLANNER_CHORDS + part;
}

/* The part of the queue's first segment the tool is on, and how far into it (mm); 0 without one. */
static int present_part(const TP_STRUCT *tp, const struct chip_tracker_in *in, struct chip_segment *segment, int *part,
                        double *progress)
{
    const TC_STRUCT *tc = queue_item(tp, 0), *next;
    int parts = part_count(tc), usable = 0;
    double left = tc->progress / in->mu_per_mm;
    struct chip_segment candidate;
    int i;
    for (i = 0; i < parts; i++) {
        if (!segment_of(tc, i, in, &candidate)) continue;
        *segment = candidate;
        *part = i;
        *progress = left;
        usable = 1;
        if (left <= candidate.length) break;
        left -= candidate.length;
    }
    if (!usable) return 0;
    *progress = chip_min(*progress, segment->length);
    if (tp->queue._len < 2) return 1;
    next = queue_item(tp, 1); /* a parabolic blend runs on two segments at once */
    if (next->progress > 0.0 && next->progress < next->target) *progress += next->progress / in->mu_per_mm;
    return 1;
}

/* [8] Whether a segment begins where the one before it in the queue, read already, has ended; `end` becomes its own end. */
static int does_join(const TC_STRUCT *tc, int is_first, double end[3])
{
    PmCartesian from, to;
    if (!is_plausible(tc) || !planned_at(tc, 0.0, &from) || !planned_at(tc, tc->target, &to)) return 0;
    if (!is_first && !is_at(&from, end)) return 0;
    end[0] = to.x;
    end[1] = to.y;
    end[2] = to.z;
    return 1;
}

/* F of the program on a segment, machine units/s, if it was `before` on the one before it [9]. */
static double feed_on(const TC_STRUCT *tc, const struct chip_tracker_in *in, double before)
{
    int output = in->f_output;
    if (output < 0 || output >= EMCMOT_MAX_AIO) return 0.0;
    if (!tc->syncdio.anychanged || !(tc->syncdio.aio_mask >> output & 1)) return before;
    return chip_setting(tc->syncdio.aios[output]);
}

/* Appends the segments of the queue behind the known ones, up to the horizon. The queue's last
 * segment, unless the tool is on it, may still be changed for a blend: it is tentative. -> chip_path_refusal. */
static int extend_path(struct chip_planner *planner, const TP_STRUCT *tp, const struct chip_tracker_in *in,
                       double horizon, struct chip_path *path)
{
    int reads, n = 0, part = 0;
    double end[3] = { planner->end_mu[0], planner->end_mu[1], planner->end_mu[2] };
    double feed = path->count > 0 ? planner->feed_mu_s : chip_setting(in->programmed_vel_mu_s);
    if (path->count > 0) {
        n = (planner->item - tp->queue.start + tp->queue.size) % tp->queue.size;
        part = planner->part;
    }
    for (reads = 0; reads < CHIP_PLANNER_READS && n < tp->queue._len; reads++) {
        const TC_STRUCT *tc = queue_item(tp, n);
        int tentative = n > 0 && n == tp->queue._len - 1;
        struct chip_segment segment;
        if (path->end_s - path->s > horizon + CHIP_PLANNER_MARGIN || path->count >= CHIP_PATH_SEGMENTS)
            return CHIP_REFUSAL_NONE;
        if (part == 0 && !does_join(tc, n == 0, end)) return CHIP_REFUSAL_CHAIN;
        if (tc->motion_type == TC_RIGIDTAP) return CHIP_REFUSAL_NONE;
        feed = feed_on(tc, in, feed);
        if (part >= part_count(tc)) {
            n++;
            part = 0;
        } else {
            if (segment_of(tc, part, in, &segment)) {
                segment.accel = braking_accel(tc) / in->mu_per_mm;
                segment.overlap[0] = overlap_of(tc, part, 0, in);
                segment.overlap[1] = overlap_of(tc, part, 1, in);
                segment.feed = feed / in->mu_per_mm;
                segment.rapid = tc->canon_motion_type == EMC_MOTION_TYPE_TRAVERSE;
                segment.join = tentative ? CHIP_JOIN_PARABOLIC : join_of(tc, part);
                chip_path_append(path, key_of(tp, n, part), &segment);
                planner->tentative += tentative;
            } else if (tc->motion_type == TC_CIRCULAR)
                return CHIP_REFUSAL_SEGMENT; /* a line may move other axes only, a blend arc begin at once */
            part++;
        }
        if (!tentative) {
            planner->item = (tp->queue.start + n) % tp->queue.size;
            planner->part = part;
            planner->feed_mu_s = feed;
            memcpy(planner->end_mu, end, sizeof end);
        }
    }
    return CHIP_REFUSAL_NONE;
}

/* [7] Notes whether motion's counter has counted one since the last period; the first period cannot tell. */
static void note_heartbeat(struct chip_planner *planner)
{
    uint64_t beat = motion_status(planner)->heartbeat;
    planner->runs = planner->looked && beat - planner->last_beat == 1;
    planner->looked = 1;
    planner->last_beat = beat;
}

int chip_planner_aborted(struct chip_planner *planner)
{
    const volatile struct emcmot_status_t *status;
    int number, is_new;
    if (!planner->motion) return 0;
    note_heartbeat(planner);
    status = motion_status(planner);
    number = status->commandNumEcho;
    is_new = number != planner->last_command;
    planner->last_command = number;
    return is_new && planner->runs && status->commandEcho == EMCMOT_ABORT;
}

/* Reads the queue, which has been judged. -> chip_path_refusal. */
static int read_queue(struct chip_planner *planner, const struct chip_tracker_in *in, double horizon,
                      struct chip_path *path)
{
    const TP_STRUCT *tp = &planner->motion->coord_tp;
    struct chip_segment segment;
    double progress = 0.0;
    int part = 0, refusal;
    if (!present_part(tp, in, &segment, &part, &progress)) { /* a tap, or X Y Z at rest */
        chip_path_reset(path);
        planner->tentative = 0;
        return CHIP_REFUSAL_NONE;
    }
    read_pace(planner, tp);
    for (; planner->tentative > 0; planner->tentative--) chip_path_retract(path);
    chip_path_follow(path, key_of(tp, 0, part), segment.length, progress);
    refusal = extend_path(planner, tp, in, horizon, path);
    if (path->count > 0) path->segment[path->first].join = join_of(queue_item(tp, 0), part);
    read_parabola(tp, in, &path->blend);
    return refusal;
}

void chip_planner_follow(struct chip_planner *planner, const struct chip_tracker_in *in, double horizon,
                         struct chip_path *path)
{
    planner->blend_vel_mu_s = planner->braking_mu_s2 = 0.0;
    planner->refusal = judge_planner(planner, in);
    if (planner->refusal == CHIP_REFUSAL_NONE) planner->refusal = read_queue(planner, in, horizon, path);
    if (planner->refusal == CHIP_REFUSAL_NONE) return;
    chip_planner_unread(planner, path);
}

void chip_planner_unread(struct chip_planner *planner, struct chip_path *path)
{
    planner->blend_vel_mu_s = planner->braking_mu_s2 = 0.0;
    planner->tentative = 0;
    chip_path_reset(path);
}
