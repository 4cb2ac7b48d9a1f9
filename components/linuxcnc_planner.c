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

#define CHIP_PLANNER_KEY 100    /* DEFAULT_SHMEM_KEY of motion */
#define CHIP_PLANNER_CHORDS 16  /* chords an arc outside XY is read as; a blend arc has one less */
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

/* Axis position -> tip, mm. */
static void tip_of(const struct chip_tracker_in *in, const PmCartesian *at, double tip[3])
{
    tip[0] = (at->x - in->tool_offset_mu[0]) / in->mu_per_mm;
    tip[1] = (at->y - in->tool_offset_mu[1]) / in->mu_per_mm;
    tip[2] = (at->z - in->tool_offset_mu[2]) / in->mu_per_mm;
}

/* Point on a circle at a share of its angle. */
static void point_on_circle(const PmCircle *circle, double share, PmCartesian *at)
{
    double c = cos(share * circle->angle), s = sin(share * circle->angle);
    double grow = circle->radius != 0.0 ? 1.0 + share * circle->spiral / circle->radius : 1.0;
    at->x = circle->center.x + grow * (c * circle->rTan.x + s * circle->rPerp.x) + share * circle->rHelix.x;
    at->y = circle->center.y + grow * (c * circle->rTan.y + s * circle->rPerp.y) + share * circle->rHelix.y;
    at->z = circle->center.z + grow * (c * circle->rTan.z + s * circle->rPerp.z) + share * circle->rHelix.z;
}

static int is_upright(const PmCartesian *normal) { return normal->z > 0.999999 || normal->z < -0.999999; }

/* Number of parts a segment of the queue is read as: chords of an arc outside XY or a spiral,
 * the straight beginning and the arc, or its chords, of a blend. */
static int part_count(const TC_STRUCT *tc)
{
    const PmCircle *circle = &tc->coords.circle.xyz;
    if (tc->motion_type == TC_SPHERICAL) return is_upright(&tc->coords.arc.xyz.binormal) ? 2 : CHIP_PLANNER_CHORDS;
    if (tc->motion_type != TC_CIRCULAR) return 1;
    if (is_upright(&circle->normal) && circle->spiral < 1e-3 && circle->spiral > -1e-3) return 1;
    return CHIP_PLANNER_CHORDS;
}

/* Point on a blend arc at a share of its angle (tp/spherical_arc.c, arcPoint). */
static void point_on_arc(const SphericalArc *arc, double share, PmCartesian *at)
{
    double p = sin((1.0 - share) * arc->angle) / arc->Sangle, q = sin(share * arc->angle) / arc->Sangle;
    at->x = arc->center.x + p * arc->rStart.x + q * arc->rEnd.x;
    at->y = arc->center.y + p * arc->rStart.y + q * arc->rEnd.y;
    at->z = arc->center.z + p * arc->rStart.z + q * arc->rEnd.z;
}

/* Blend arc: part 0 is its straight beginning, which ends at `start`; then the arc, outside XY in chords. */
static int arc_blend_part(const SphericalArc *arc, int part, const struct chip_tracker_in *in,
                          struct chip_segment *segment)
{
    PmCartesian from = arc->start, to;
    double a[3], b[3], centre[3];
    if (part == 0) {
        from.x -= arc->line_length * arc->uTan.x;
        from.y -= arc->line_length * arc->uTan.y;
        from.z -= arc->line_length * arc->uTan.z;
        tip_of(in, &from, a);
        tip_of(in, &arc->start, b);
        return chip_segment_line(segment, a, b);
    }
    if (!is_upright(&arc->binormal)) {
        point_on_arc(arc, (part - 1.0) / (CHIP_PLANNER_CHORDS - 1), &from);
        point_on_arc(arc, part / (CHIP_PLANNER_CHORDS - 1.0), &to);
        tip_of(in, &from, a);
        tip_of(in, &to, b);
        return chip_segment_line(segment, a, b);
    }
    tip_of(in, &arc->start, a);
    tip_of(in, &arc->end, b);
    tip_of(in, &arc->center, centre);
    return chip_segment_arc(segment, centre, a, arc->binormal.z > 0.0 ? arc->angle : -arc->angle, b[2] - a[2]);
}

/* A part of a segment of the queue -> core; 0 if it has no length or cannot be used. */
static int segment_of(const TC_STRUCT *tc, int part, const struct chip_tracker_in *in, struct chip_segment *segment)
{
    const PmCircle *circle = &tc->coords.circle.xyz;
    int parts = part_count(tc);
    double a[3], b[3], centre[3];
    PmCartesian from, to;
    if (tc->motion_type == TC_SPHERICAL) return arc_blend_part(&tc->coords.arc.xyz, part, in, segment);
    if (tc->motion_type == TC_LINEAR) {
        from = tc->coords.line.xyz.start;
        to = tc->coords.line.xyz.end;
    } else if (tc->motion_type == TC_CIRCULAR) {
        point_on_circle(circle, (double)part / parts, &from);
        point_on_circle(circle, (double)(part + 1) / parts, &to);
    } else {
        return 0;
    }
    tip_of(in, &from, a);
    tip_of(in, &to, b);
    if (tc->motion_type == TC_LINEAR || parts > 1) return chip_segment_line(segment, a, b);
    tip_of(in, &circle->center, centre);
    return chip_segment_arc(segment, centre, a, circle->normal.z > 0.0 ? circle->angle : -circle->angle, b[2] - a[2]);
}

/* Acceleration the planner may brake with along a segment, machine units/s2, as
 * tcGetTangentialMaxAccel (tp/tc.c) computes it. */
static double braking_accel(const TC_STRUCT *tc)
{
    double share = 1.0 - chip_max(tc->kink_accel_reduce, tc->kink_accel_reduce_prev);
    if (tc->blend_prev || tc->term_cond == TC_TERM_COND_PARABOLIC) share *= 0.5;
    if (tc->motion_type == TC_CIRCULAR || tc->motion_type == TC_SPHERICAL) share *= tc->acc_ratio_tan;
    return tc->maxaccel * share;
}

/* How the end of a part of a segment is left. */
static int join_of(const TC_STRUCT *tc, int part)
{
    if (part + 1 < part_count(tc) || tc->term_cond == TC_TERM_COND_TANGENT) return CHIP_JOIN_TANGENT;
    return tc->term_cond == TC_TERM_COND_PARABOLIC ? CHIP_JOIN_PARABOLIC : CHIP_JOIN_STOP;
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

    note_heartbeat(planner);
    tp = checked_planner(planner, in->pos_mu, in->period_s);
    if (!tp || tp->queue._len == 0 || !present_part(tp, in, &segment, &part, &progress)) {
        chip_path_reset(path);
        planner->tentative = 0;
        return;
    }
    for (; planner->tentative > 0; planner->tentative--) chip_path_retract(path);
    chip_path_follow(path, key_of(tp, 0, part), segment.length, progress);
    extend_path(planner, tp, in, horizon, path);
    if (path->count > 0) path->segment[path->first].join = join_of(queue_item(tp, 0), part);
    read_parabola(tp, in, &path->blend);
}
