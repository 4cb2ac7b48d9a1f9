/* planner.h - reads the program's own way ahead from LinuxCNC's motion planner.
 *
 * Who calls it: stock_tracker.comp, once per servo period, before the core.
 * Source: LinuxCNC src/emc/motion/motion.h, src/emc/tp/{tp_types,tc_types,tcq}.h, read in
 * 2.9.0~pre1, 2.9.4, 2.9.5, 2.9.10 and master (2026-08): the planner's state is the last member of the
 * block of shared memory that motion makes; its queue lies in the memory of rtapi_app, where
 * this component lives too.
 *
 * Departs from good manners: these structures are no interface. They come from the headers
 * of the LinuxCNC this was compiled against, so:
 *  1. Only read, never written. The block is attached read-only, and only if motion has it: it belongs to us, nobody else may
 *     write it, and this process has it mapped for writing already. One that a killed LinuxCNC has left behind, or that
 *     another program has made, holds addresses that mean nothing here.
 *  2. Nothing is believed before it fits: motion-controller has run since the last period (its heartbeat;
 *     where motion has been unloaded its queue is gone), the queue's size, its counts, the planner's cycle
 *     time, and the planner's position, which must be the axes' to 0.001 units.
 *  3. Whatever does not fit, the way is unknown in this period and the core predicts it.
 */
#ifndef CHIPWISE_PLANNER_H
#define CHIPWISE_PLANNER_H

#include <stdio.h>
#include <string.h>
#include <sys/shm.h>
#include <unistd.h>
#include <motion.h>
#include <motion_types.h>
#include <tc_types.h>
#include <tcq.h>

#define CW_PLANNER_KEY 100      /* DEFAULT_SHMEM_KEY of motion */
#define CW_CHORDS 16            /* an arc outside XY is read as this many chords, a blend arc as one less */
#define CW_FURTHER 2.0          /* mm read beyond the horizon */
#define CW_READS 24             /* pieces read from the queue in a period at most */

struct cw_motion_end {          /* the end of motion's block (motion_struct.h, 2.9.0~pre1 to master) */
    struct emcmot_status_t status;
    struct emcmot_config_t config;
    struct emcmot_error_t error;
    struct emcmot_internal_t internal;
};

struct cw_planner {
    const struct emcmot_internal_t *motion;     /* null: not there */
    int item, part;             /* slot of the queue and part of it to be read next */
    int tentative;              /* parts of the way's end that are read again in every period */
    int looked, runs;           /* at motion's heartbeat; it has changed since the last period */
    uint64_t last_beat;
};

/* Whether a block is nobody's but ours: owner, creator, rights. */
static inline int cw_planner_ours(const struct shmid_ds *about)
{
    uid_t owner = about->shm_perm.uid, maker = about->shm_perm.cuid;
    return (owner == getuid() || owner == geteuid()) && (maker == getuid() || maker == geteuid() || maker == 0)
        && (about->shm_perm.mode & 0077) == 0;
}

/* Whether this process has a block mapped for writing: motion lives here too. Of /proc/self/maps the rights and the
 * inode, which is the block's number. */
static inline int cw_planner_mapped(int id)
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

/* Attaches motion's memory; called while loading, not in realtime. */
static inline void cw_planner_attach(struct cw_planner *planner)
{
    int id = shmget(CW_PLANNER_KEY, 0, 0);
    struct shmid_ds about;
    const char *block;
    planner->motion = 0;
    planner->looked = planner->runs = 0;
    if (id < 0 || shmctl(id, IPC_STAT, &about) < 0) return;
    if (about.shm_segsz < sizeof(struct cw_motion_end)) return;
    if (!cw_planner_ours(&about) || !cw_planner_mapped(id)) return;     /* [1] */
    block = shmat(id, 0, SHM_RDONLY);
    if (block == (void *)-1) return;
    planner->motion = (const struct emcmot_internal_t *)
        (block + about.shm_segsz - sizeof(struct emcmot_internal_t));
}

static int cw_planner_near(double a, double b)
{
    return a - b < 1e-3 && b - a < 1e-3;
}

/* [2] The planner, when everything about it fits; else null. */
static const TP_STRUCT *cw_planner_trusted(const struct cw_planner *planner,
                                           const double axis[3], double period)
{
    const TP_STRUCT *tp;
    if (!planner->motion || !planner->runs) return 0;
    tp = &planner->motion->coord_tp;
    if (tp->queue.size != DEFAULT_TC_QUEUE_SIZE || !tp->queue.queue) return 0;
    if (tp->queue._len < 0 || tp->queue._len > tp->queue.size) return 0;
    if (tp->queue.start < 0 || tp->queue.start >= tp->queue.size) return 0;
    if (!(tp->cycleTime > 0.5 * period && tp->cycleTime < 20.0 * period)) return 0;
    if (tp->reverse_run) return 0;
    if (!cw_planner_near(tp->currentPos.tran.x, axis[0])) return 0;
    if (!cw_planner_near(tp->currentPos.tran.y, axis[1])) return 0;
    if (!cw_planner_near(tp->currentPos.tran.z, axis[2])) return 0;
    return tp;
}

static const TC_STRUCT *cw_planner_item(const TP_STRUCT *tp, int n)
{
    return &tp->queue.queue[(tp->queue.start + n) % tp->queue.size];
}

/* Axis position -> tip, mm. */
static void cw_planner_tip(const struct cw_tracker_in *in, const PmCartesian *at, double tip[3])
{
    tip[0] = (at->x - in->offset[0]) / in->unit;
    tip[1] = (at->y - in->offset[1]) / in->unit;
    tip[2] = (at->z - in->offset[2]) / in->unit;
}

/* Place on a circle at a share of its angle. */
static void cw_planner_on_circle(const PmCircle *circle, double share, PmCartesian *at)
{
    double c = cos(share * circle->angle), s = sin(share * circle->angle);
    double grow = circle->radius != 0.0 ? 1.0 + share * circle->spiral / circle->radius : 1.0;
    at->x = circle->center.x + grow * (c * circle->rTan.x + s * circle->rPerp.x) + share * circle->rHelix.x;
    at->y = circle->center.y + grow * (c * circle->rTan.y + s * circle->rPerp.y) + share * circle->rHelix.y;
    at->z = circle->center.z + grow * (c * circle->rTan.z + s * circle->rPerp.z) + share * circle->rHelix.z;
}

static int cw_planner_upright(const PmCartesian *normal)
{
    return normal->z > 0.999999 || normal->z < -0.999999;
}

/* How many parts a piece of the queue is read as: chords of an arc outside XY or a spiral,
 * the straight beginning and the arc, or its chords, of a blend. */
static int cw_planner_parts(const TC_STRUCT *tc)
{
    const PmCircle *circle = &tc->coords.circle.xyz;
    if (tc->motion_type == TC_SPHERICAL) return cw_planner_upright(&tc->coords.arc.xyz.binormal) ? 2 : CW_CHORDS;
    if (tc->motion_type != TC_CIRCULAR) return 1;
    if (cw_planner_upright(&circle->normal) && circle->spiral < 1e-3 && circle->spiral > -1e-3)
        return 1;
    return CW_CHORDS;
}

/* Place on a blend arc at a share of its angle (tp/spherical_arc.c, arcPoint). */
static void cw_planner_on_arc(const SphericalArc *arc, double share, PmCartesian *at)
{
    double p = sin((1.0 - share) * arc->angle) / arc->Sangle, q = sin(share * arc->angle) / arc->Sangle;
    at->x = arc->center.x + p * arc->rStart.x + q * arc->rEnd.x;
    at->y = arc->center.y + p * arc->rStart.y + q * arc->rEnd.y;
    at->z = arc->center.z + p * arc->rStart.z + q * arc->rEnd.z;
}

/* Blend arc: part 0 its straight beginning, which ends at `start`; then the arc, outside XY in chords. */
static int cw_planner_blend(const SphericalArc *arc, int part, const struct cw_tracker_in *in,
                            struct cw_piece *piece)
{
    PmCartesian from = arc->start, to;
    double a[3], b[3], centre[3];
    if (part == 0) {
        from.x -= arc->line_length * arc->uTan.x;
        from.y -= arc->line_length * arc->uTan.y;
        from.z -= arc->line_length * arc->uTan.z;
        cw_planner_tip(in, &from, a);
        cw_planner_tip(in, &arc->start, b);
        return cw_piece_line(piece, a, b);
    }
    if (!cw_planner_upright(&arc->binormal)) {
        cw_planner_on_arc(arc, (part - 1.0) / (CW_CHORDS - 1), &from);
        cw_planner_on_arc(arc, part / (CW_CHORDS - 1.0), &to);
        cw_planner_tip(in, &from, a);
        cw_planner_tip(in, &to, b);
        return cw_piece_line(piece, a, b);
    }
    cw_planner_tip(in, &arc->start, a);
    cw_planner_tip(in, &arc->end, b);
    cw_planner_tip(in, &arc->center, centre);
    return cw_piece_arc(piece, centre, a, arc->binormal.z > 0.0 ? arc->angle : -arc->angle, b[2] - a[2]);
}

/* A part of a piece of the queue -> core; 0 when it has no length or cannot be used. */
static int cw_planner_piece(const TC_STRUCT *tc, int part, const struct cw_tracker_in *in,
                            struct cw_piece *piece)
{
    const PmCircle *circle = &tc->coords.circle.xyz;
    int parts = cw_planner_parts(tc);
    double a[3], b[3], centre[3];
    PmCartesian from, to;
    if (tc->motion_type == TC_SPHERICAL) return cw_planner_blend(&tc->coords.arc.xyz, part, in, piece);
    if (tc->motion_type == TC_LINEAR) {
        from = tc->coords.line.xyz.start;
        to = tc->coords.line.xyz.end;
    } else if (tc->motion_type == TC_CIRCULAR) {
        cw_planner_on_circle(circle, (double)part / parts, &from);
        cw_planner_on_circle(circle, (double)(part + 1) / parts, &to);
    } else {
        return 0;
    }
    cw_planner_tip(in, &from, a);
    cw_planner_tip(in, &to, b);
    if (tc->motion_type == TC_LINEAR || parts > 1) return cw_piece_line(piece, a, b);
    cw_planner_tip(in, &circle->center, centre);
    return cw_piece_arc(piece, centre, a, circle->normal.z > 0.0 ? circle->angle : -circle->angle,
                        b[2] - a[2]);
}

/* Acceleration the planner may brake with along a piece, machine units/s2: as its own
 * tcGetTangentialMaxAccel (tp/tc.c) has it. */
static double cw_planner_accel(const TC_STRUCT *tc)
{
    double share = 1.0 - cw_max(tc->kink_accel_reduce, tc->kink_accel_reduce_prev);
    if (tc->blend_prev || tc->term_cond == TC_TERM_COND_PARABOLIC) share *= 0.5;
    if (tc->motion_type == TC_CIRCULAR || tc->motion_type == TC_SPHERICAL) share *= tc->acc_ratio_tan;
    return tc->maxaccel * share;
}

/* How the end of a part of a piece is left. */
static int cw_planner_join(const TC_STRUCT *tc, int part)
{
    if (part + 1 < cw_planner_parts(tc) || tc->term_cond == TC_TERM_COND_TANGENT) return CW_JOIN_TANGENT;
    return tc->term_cond == TC_TERM_COND_PARABOLIC ? CW_JOIN_PARABOLIC : CW_JOIN_STOP;
}

/* The parabolic blend the tool is in, where it leads into a straight traverse (tp/tp.c, tpUpdateBlend: the
 * next piece is to have the share of its blend velocity that the first has lost of its own). */
static void cw_planner_corner(const TP_STRUCT *tp, const struct cw_tracker_in *in, struct cw_corner *corner)
{
    const TC_STRUCT *tc = cw_planner_item(tp, 0), *next = cw_planner_item(tp, 1);
    struct cw_piece line;
    double tip[3];
    corner->on = 0;
    if (tp->queue._len < 2 || !tc->blending_next || tc->term_cond != TC_TERM_COND_PARABOLIC) return;
    if (next->motion_type != TC_LINEAR || next->canon_motion_type != EMC_MOTION_TYPE_TRAVERSE) return;
    if (!(next->progress > 0.0 && next->progress < next->target) || !(tc->blend_vel > 0.0)) return;
    if (!cw_planner_piece(next, 0, in, &line)) return;
    cw_piece_at(&line, 0.0, corner->start, corner->dir);
    cw_piece_at(&line, line.length, tip, corner->dir);
    corner->length = line.length;
    corner->done = next->progress / in->unit;
    corner->speed = next->currentvel / in->unit;
    corner->top = next->blend_vel * (tc->vel_at_blend_start / tc->blend_vel) / in->unit;
    corner->left = (tc->target - tc->progress) / in->unit;
    corner->slow = tc->currentvel / in->unit;
    corner->on = 1;
}

static long cw_planner_key(const TP_STRUCT *tp, int n, int part)
{
    return (long)((tp->queue.start + n) % tp->queue.size) * CW_CHORDS + part;
}

/* The part of the queue's first piece the tool is on, and how far into it (mm); 0: none. */
static int cw_planner_here(const TP_STRUCT *tp, const struct cw_tracker_in *in,
                           struct cw_piece *piece, int *part, double *progress)
{
    const TC_STRUCT *tc = cw_planner_item(tp, 0), *next;
    int parts = cw_planner_parts(tc), usable = 0;
    double left = tc->progress / in->unit;
    struct cw_piece candidate;
    int i;
    for (i = 0; i < parts; i++) {
        if (!cw_planner_piece(tc, i, in, &candidate)) continue;
        *piece = candidate;
        *part = i;
        *progress = left;
        usable = 1;
        if (left <= candidate.length) break;
        left -= candidate.length;
    }
    if (!usable) return 0;
    *progress = cw_min(*progress, piece->length);
    if (tp->queue._len < 2) return 1;
    next = cw_planner_item(tp, 1);      /* a parabolic blend runs on two pieces at once */
    if (next->progress > 0.0 && next->progress < next->target) *progress += next->progress / in->unit;
    return 1;
}

/* Appends what the queue holds behind the pieces known, up to the horizon. The queue's last
 * piece, unless the tool is on it, may still be changed for a blend: it is tentative. */
static void cw_planner_extend(struct cw_planner *planner, const TP_STRUCT *tp,
                              const struct cw_tracker_in *in, double horizon, struct cw_way *way)
{
    int reads, n = 0, part = 0;
    if (way->count > 0) {
        n = (planner->item - tp->queue.start + tp->queue.size) % tp->queue.size;
        part = planner->part;
    }
    for (reads = 0; reads < CW_READS && n < tp->queue._len; reads++) {
        const TC_STRUCT *tc = cw_planner_item(tp, n);
        int tentative = n > 0 && n == tp->queue._len - 1;
        struct cw_piece piece;
        if (way->end - way->at > horizon + CW_FURTHER || way->count >= CW_WAY_PIECES) return;
        if (tc->motion_type == TC_RIGIDTAP) return;
        if (part >= cw_planner_parts(tc)) {
            n++;
            part = 0;
        } else {
            if (cw_planner_piece(tc, part, in, &piece)) {
                piece.accel = cw_planner_accel(tc) / in->unit;
                piece.rapid = tc->canon_motion_type == EMC_MOTION_TYPE_TRAVERSE;
                piece.join = tentative ? CW_JOIN_PARABOLIC : cw_planner_join(tc, part);
                cw_way_append(way, cw_planner_key(tp, n, part), &piece);
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

/* Notes whether motion-controller has run since the last period; the first period says nothing. */
static void cw_planner_look(struct cw_planner *planner)
{
    const volatile struct cw_motion_end *end;
    uint64_t beat;
    if (!planner->motion) return;
    end = (const volatile struct cw_motion_end *)((const char *)(planner->motion + 1) - sizeof *end);
    beat = end->status.heartbeat;
    planner->runs = planner->looked && beat != planner->last_beat;
    planner->looked = 1;
    planner->last_beat = beat;
}

/* Follows the planner's queue: `way` is known afterwards, or not [3]. */
static inline void cw_planner_follow(struct cw_planner *planner, const struct cw_tracker_in *in,
                                     double horizon, struct cw_way *way)
{
    const TP_STRUCT *tp;
    struct cw_piece piece;
    double progress = 0.0;
    int part = 0;

    cw_planner_look(planner);
    tp = cw_planner_trusted(planner, in->axis, in->period);
    if (!tp || tp->queue._len == 0 || !cw_planner_here(tp, in, &piece, &part, &progress)) {
        cw_way_reset(way);
        planner->tentative = 0;
        return;
    }
    for (; planner->tentative > 0; planner->tentative--) cw_way_retract(way);
    cw_way_follow(way, cw_planner_key(tp, 0, part), piece.length, progress);
    cw_planner_extend(planner, tp, in, horizon, way);
    if (way->count > 0) way->piece[way->first].join = cw_planner_join(cw_planner_item(tp, 0), part);
    cw_planner_corner(tp, in, &way->corner);
}

#endif
