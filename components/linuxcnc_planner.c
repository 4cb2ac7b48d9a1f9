/* SPDX-License-Identifier: GPL-2.0-or-later */
/* linuxcnc_planner.c - see linuxcnc_planner.h; the numbers in brackets are those there. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* getresuid; LinuxCNC's flags define it as well */
#endif
#include <stdio.h>
#include <string.h>
#include <sys/shm.h>
#include <unistd.h>
#include <motion.h>
#include <motion_types.h>
#include <tc_types.h>
#include <tcq.h>

#include "core/chip_math.h"
#include "core/tracker.h"
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

/* [4] Whether a user is root or one of those this process is or has been. */
static int is_us(uid_t user)
{
    uid_t real, effective, saved;
    if (getresuid(&real, &effective, &saved) < 0) return 0;
    return user == real || user == effective || user == saved || user == 0;
}

int chip_planner_ours(const struct shmid_ds *about)
{
    return is_us(about->shm_perm.uid) && is_us(about->shm_perm.cuid) && (about->shm_perm.mode & 0077) == 0;
}

/* [1] Whether this process has mapped a block for writing, as motion in the same process has. Reads the rights and the
 * inode, which is the block's number, from /proc/self/maps. */
static int is_mapped(int id)
{
    char line[512], rights[8];
    unsigned long inode;
    int found = 0;
    FILE *maps = fopen("/proc/self/maps", "r");
    if (!maps) return 0;
    while (!found && fgets(line, sizeof line, maps))
        found = sscanf(line, "%*s %7s %*s %*s %lu", rights, &inode) == 2 && inode == (unsigned long)id
             && strstr(line, "/SYSV") && rights[1] == 'w';
    fclose(maps);
    return found;
}

void chip_planner_attach(struct chip_planner *planner)
{
    int id = shmget(CHIP_PLANNER_KEY, 0, 0);
    struct shmid_ds about;
    const char *block;
    planner->motion = 0;
    planner->looked = planner->runs = planner->last_command = 0;
    if (id < 0 || shmctl(id, IPC_STAT, &about) < 0) return;
    if (about.shm_segsz < sizeof(struct chip_motion_end)) return;
    if (!chip_planner_ours(&about) || !is_mapped(id)) return; /* [1] */
    block = shmat(id, 0, SHM_RDONLY);
    if (block == (void *)-1) return;
    planner->motion = (const struct emcmot_internal_t *)(block + about.shm_segsz - sizeof(struct emcmot_internal_t));
}

static int is_near(double a, double b) { return a - b < 1e-3 && b - a < 1e-3; }

/* [2] The planner if every check passes; otherwise null. */
static const TP_STRUCT *checked_planner(const struct chip_planner *planner, const double axis[3], double period)
{
    const TP_STRUCT *tp;
    if (!planner->motion || !planner->runs) return 0;
    tp = &planner->motion->coord_tp;
    if (tp->queue.size != DEFAULT_TC_QUEUE_SIZE || !tp->queue.queue) return 0;
    if (tp->queue._len < 0 || tp->queue._len > tp->queue.size) return 0;
    if (tp->queue.start < 0 || tp->queue.start >= tp->queue.size) return 0;
    if (!(tp->cycleTime > 0.5 * period && tp->cycleTime < 20.0 * period)) return 0;
    if (tp->reverse_run) return 0;
    if (!is_near(tp->currentPos.tran.x, axis[0])) return 0;
    if (!is_near(tp->currentPos.tran.y, axis[1])) return 0;
    if (!is_near(tp->currentPos.tran.z, axis[2])) return 0;
    return tp;
}

static const TC_STRUCT *queue_item(const TP_STRUCT *tp, int n)
{
    return &tp->queue.queue[(tp->queue.start + n) % tp->queue.size];
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
    planner->braking_mu_s2 = chip_min(planner->braking_mu_s2, braking_accel(next));
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

/* Appends the segments of the queue behind the known ones, up to the horizon. The queue's last
 * segment, unless the tool is on it, may still be changed for a blend: it is tentative. */
static void extend_path(struct chip_planner *planner, const TP_STRUCT *tp, const struct chip_tracker_in *in,
                        double horizon, struct chip_path *path)
{
    int reads, n = 0, part = 0;
    if (path->count > 0) {
        n = (planner->item - tp->queue.start + tp->queue.size) % tp->queue.size;
        part = planner->part;
    }
    for (reads = 0; reads < CHIP_PLANNER_READS && n < tp->queue._len; reads++) {
        const TC_STRUCT *tc = queue_item(tp, n);
        int tentative = n > 0 && n == tp->queue._len - 1;
        struct chip_segment segment;
        if (path->end_s - path->s > horizon + CHIP_PLANNER_MARGIN || path->count >= CHIP_PATH_SEGMENTS) return;
        if (tc->motion_type == TC_RIGIDTAP) return;
        if (part >= part_count(tc)) {
            n++;
            part = 0;
        } else {
            if (segment_of(tc, part, in, &segment)) {
                segment.accel = braking_accel(tc) / in->mu_per_mm;
                segment.rapid = tc->canon_motion_type == EMC_MOTION_TYPE_TRAVERSE;
                segment.join = tentative ? CHIP_JOIN_PARABOLIC : join_of(tc, part);
                chip_path_append(path, key_of(tp, n, part), &segment);
                planner->tentative += tentative;
            }
            part++;
        }
        if (!tentative) {
            planner->item = (tp->queue.start + n) % tp->queue.size;
            planner->part = part;
        }
    }
}

/* The state that motion shows to user space. */
static const volatile struct emcmot_status_t *motion_status(const struct chip_planner *planner)
{
    const char *end = (const char *)(planner->motion + 1);
    return &((const volatile struct chip_motion_end *)(end - sizeof(struct chip_motion_end)))->status;
}

int chip_planner_aborted(struct chip_planner *planner)
{
    const volatile struct emcmot_status_t *status;
    int number, is_new;
    if (!planner->motion) return 0;
    status = motion_status(planner);
    number = status->commandNumEcho;
    is_new = number != planner->last_command;
    planner->last_command = number;
    return is_new && status->commandEcho == EMCMOT_ABORT;
}

/* Notes whether motion-controller has run since the last period; the first period cannot tell. */
static void note_heartbeat(struct chip_planner *planner)
{
    uint64_t beat;
    if (!planner->motion) return;
    beat = motion_status(planner)->heartbeat;
    planner->runs = planner->looked && beat != planner->last_beat;
    planner->looked = 1;
    planner->last_beat = beat;
}

void chip_planner_follow(struct chip_planner *planner, const struct chip_tracker_in *in, double horizon,
                         struct chip_path *path)
{
    const TP_STRUCT *tp;
    struct chip_segment segment;
    double progress = 0.0;
    int part = 0;

    planner->blend_vel_mu_s = planner->braking_mu_s2 = 0.0;
    note_heartbeat(planner);
    tp = checked_planner(planner, in->pos_mu, in->period_s);
    if (!tp || tp->queue._len == 0 || !present_part(tp, in, &segment, &part, &progress)) {
        chip_path_reset(path);
        planner->tentative = 0;
        return;
    }
    read_pace(planner, tp);
    for (; planner->tentative > 0; planner->tentative--) chip_path_retract(path);
    chip_path_follow(path, key_of(tp, 0, part), segment.length, progress);
    extend_path(planner, tp, in, horizon, path);
    if (path->count > 0) path->segment[path->first].join = join_of(queue_item(tp, 0), part);
    read_parabola(tp, in, &path->blend);
}
