/* SPDX-License-Identifier: GPL-2.0-or-later */
/* linuxcnc_segment.h - a segment of the motion planner's queue as the core's line, arc or chords, and how fast the planner
 * goes on it.
 *
 * Who calls it: linuxcnc_planner.c, which has checked the planner before.
 * Source: LinuxCNC src/emc/tp/tc_types.h, tc.c, spherical_arc.c, read as linuxcnc_planner.h says.
 */
#ifndef CHIPWISE_LINUXCNC_SEGMENT_H
#define CHIPWISE_LINUXCNC_SEGMENT_H

#include <motion.h>
#include <tc_types.h>

#include "core/chip_math.h"
#include "core/tracker.h"

#define CHIP_BLEND_OVERRIDE 2.0 /* times F, of a parabolic blend at most */
#define CHIP_PLANNER_CHORDS 16  /* chords an arc outside XY is read as; a blend arc has one less */

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

/* Angle of a point on a circle `progress` along it (tp/blendmath.c, pmCircleAngleFromProgress). */
static double angle_on_circle(const TC_STRUCT *tc, double progress)
{
    const PmCircle *circle = &tc->coords.circle.xyz;
    const SpiralArcLengthFit *fit = &tc->coords.circle.fit;
    double share = tc->target > 0.0 ? progress / tc->target : 0.0, left, angle;
    if (!(circle->spiral > 1e-9 || circle->spiral < -1e-9)) return share * circle->angle;
    left = (fit->spiral_in ? 1.0 - share : share) * fit->total_planar_length;
    angle = 2.0 * left / (fit->b1 + sqrt(chip_max(fit->b1 * fit->b1 + 4.0 * fit->b0 * left, 0.0)));
    return fit->spiral_in ? circle->angle - angle : angle;
}

/* Axis position `progress` along a segment, machine units (tp/tc.c, tcGetPosReal); of a tap where it begins. 0 if it is of another
 * kind. */
static int planned_at(const TC_STRUCT *tc, double progress, PmCartesian *at)
{
    const PmCartesian *from = &tc->coords.line.xyz.start, *to = &tc->coords.line.xyz.end;
    const SphericalArc *arc = &tc->coords.arc.xyz;
    double share = tc->target > 0.0 ? progress / tc->target : 0.0, beyond;
    if (tc->motion_type == TC_LINEAR) {
        at->x = from->x + share * (to->x - from->x);
        at->y = from->y + share * (to->y - from->y);
        at->z = from->z + share * (to->z - from->z);
        return 1;
    }
    if (tc->motion_type == TC_CIRCULAR) {
        point_on_circle(&tc->coords.circle.xyz, angle_on_circle(tc, progress) / tc->coords.circle.xyz.angle, at);
        return 1;
    }
    if (tc->motion_type == TC_RIGIDTAP) *at = tc->coords.rigidtap.xyz.start;
    if (tc->motion_type != TC_SPHERICAL) return tc->motion_type == TC_RIGIDTAP;
    beyond = progress - arc->line_length;
    if (beyond > 0.0 || !(arc->line_length > 0.0)) {
        point_on_arc(arc, beyond / (arc->radius * arc->angle), at);
        return 1;
    }
    at->x = arc->start.x + beyond * arc->uTan.x;
    at->y = arc->start.y + beyond * arc->uTan.y;
    at->z = arc->start.z + beyond * arc->uTan.z;
    return 1;
}

static int is_from_to(double value, double low, double high) { return value >= low && value <= high; }

/* The halves of two numbers, read as one, are mostly huge or next to nothing. */
static int is_number(double value, double least)
{
    return is_from_to(value, least, 1e9) && (value == 0.0 || !is_from_to(value, -1e-60, 1e-60));
}

static double dot(const PmCartesian *a, const PmCartesian *b) { return a->x * b->x + a->y * b->y + a->z * b->z; }

/* a x b . c */
static double volume(const PmCartesian *a, const PmCartesian *b, const PmCartesian *c)
{
    return (a->y * b->z - a->z * b->y) * c->x + (a->z * b->x - a->x * b->z) * c->y + (a->x * b->y - a->y * b->x) * c->z;
}

/* Within `share` of it, or a thousandth of a unit. */
static int is_about(double value, double of, double share)
{
    return is_from_to(value - of, -1e-3 - share * of, 1e-3 + share * of);
}

/* Whether the members of a line, circle or blend arc say the same: radii, axes, angle and length. A blend arc may have radii
 * that differ a little (tp/blendmath.c). */
static int is_one_shape(const TC_STRUCT *tc)
{
    const PmCartLine *line = &tc->coords.line.xyz;
    const PmCircle *circle = &tc->coords.circle.xyz;
    const SphericalArc *arc = &tc->coords.arc.xyz;
    PmCartesian span = { line->end.x - line->start.x, line->end.y - line->start.y, line->end.z - line->start.z };
    double r;
    if (tc->motion_type == TC_LINEAR) {
        double length = sqrt(dot(&span, &span));
        return length <= 1e-3 || is_about(tc->target, length, 1e-6); /* else along A B C U V W */
    }
    if (tc->motion_type == TC_CIRCULAR) {
        double length = tc->coords.circle.fit.total_planar_length;
        r = circle->radius;
        if (!is_from_to(circle->spiral, -1e-9, 1e-9) || !(length > 0.0)) length = r * circle->angle;
        return is_from_to(r, 1e-9, 1e12) && is_about(sqrt(dot(&circle->rTan, &circle->rTan)), r, 1e-6)
            && is_about(sqrt(dot(&circle->rPerp, &circle->rPerp)), r, 1e-6)
            && is_about(volume(&circle->rTan, &circle->rPerp, &circle->normal) / r, r, 1e-6)
            && is_about(tc->target, sqrt(length * length + dot(&circle->rHelix, &circle->rHelix)), 1e-3);
    }
    if (tc->motion_type != TC_SPHERICAL) return 1;
    r = arc->radius;
    span.x = arc->start.x - arc->center.x - arc->rStart.x;
    span.y = arc->start.y - arc->center.y - arc->rStart.y;
    span.z = arc->start.z - arc->center.z - arc->rStart.z;
    return is_from_to(r, 1e-9, 1e12) && is_about(sqrt(dot(&arc->rStart, &arc->rStart)), r, 0.02)
        && is_about(sqrt(dot(&arc->rEnd, &arc->rEnd)), r, 0.02) && is_about(sin(arc->angle), arc->Sangle, 0.0)
        && is_from_to(dot(&span, &span), 0.0, 1e-6) && is_about(tc->target, arc->line_length + r * arc->angle, 0.02)
        && (is_about(volume(&arc->rStart, &arc->rEnd, &arc->binormal) / r, r * arc->Sangle, 0.04));
}

/* Whether every value that is read of a segment, and some of those between, are such that a segment can have them; the
 * numbers are those of the headers. */
static int is_plausible(const TC_STRUCT *tc)
{
    if (!is_from_to(tc->motion_type, TC_LINEAR, TC_SPHERICAL)) return 0;
    if (!is_from_to(tc->canon_motion_type, EMC_MOTION_TYPE_TRAVERSE, EMC_MOTION_TYPE_INDEXROTARY)) return 0;
    if (!is_from_to(tc->term_cond, TC_TERM_COND_STOP, TC_TERM_COND_TANGENT)) return 0;
    if (!is_from_to(tc->blending_next, 0, 1) || !is_from_to(tc->blend_prev, 0, 1)) return 0;
    if (!is_from_to(tc->active, 0, 1) || !is_from_to(tc->finalized, 0, 1) || !is_from_to(tc->splitting, 0, 1)) return 0;
    if (!is_from_to(tc->remove, 0, 1) || !is_from_to(tc->indexer_jnum, -1, EMCMOT_MAX_JOINTS)) return 0;
    if (!is_number(tc->target, 0.0) || !is_number(tc->progress, 0.0) || tc->progress > tc->target + 1e-3) return 0;
    if (!is_number(tc->maxaccel, 1e-9) || !is_number(tc->acc_ratio_tan, 0.0) || tc->acc_ratio_tan > 1.0) return 0;
    if (!is_from_to(tc->kink_accel_reduce, 0.0, 1.0) || !is_from_to(tc->kink_accel_reduce_prev, 0.0, 1.0)) return 0;
    if (!is_number(tc->currentvel, -1e9) || !is_number(tc->blend_vel, 0.0) || !is_number(tc->tolerance, 0.0)) return 0;
    return is_number(tc->vel_at_blend_start, -1e9) && is_one_shape(tc);
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

/* LinuxCNC 2.10 brakes with half of the acceleration only while two segments overlap (tp/tc.c, tcGetCycleMaxAccel), 2.9 along the
 * whole of both (tcGetTangentialMaxAccel). tools/motion_headers finds which one it is. */
#ifndef CHIP_HALF_IN_OVERLAP
#define CHIP_HALF_IN_OVERLAP 0
#endif

static int has_parabola(const TC_STRUCT *tc) { return tc->blend_prev || tc->term_cond == TC_TERM_COND_PARABOLIC; }

/* Acceleration the planner may brake with along a segment, machine units/s2; in a blend of 2.10 it is half of it. */
static double braking_accel(const TC_STRUCT *tc)
{
    double share = 1.0 - chip_max(tc->kink_accel_reduce, tc->kink_accel_reduce_prev);
    if (!CHIP_HALF_IN_OVERLAP && has_parabola(tc)) share *= 0.5;
    if (tc->motion_type == TC_CIRCULAR || tc->motion_type == TC_SPHERICAL) share *= tc->acc_ratio_tan;
    return tc->maxaccel * share;
}

/* mm at the beginning (0) or end (1) of a part of a segment in which it may overlap with another one. The blend begins where the
 * segment has fallen to the blend's velocity, at most that of the segment; a feed override may be up to CHIP_BLEND_OVERRIDE. The
 * other one is slower meanwhile, and a blend takes half of a segment at most. */
static double overlap_of(const TC_STRUCT *tc, int part, int end, const struct chip_tracker_in *in)
{
    double vel = chip_min(tc->maxvel, CHIP_BLEND_OVERRIDE * tc->reqvel), accel = braking_accel(tc), most;
    int last = part_count(tc) - 1;
    if (!CHIP_HALF_IN_OVERLAP || part != (end ? last : 0)) return 0.0;
    if (!(end ? tc->term_cond == TC_TERM_COND_PARABOLIC : tc->blend_prev)) return 0.0;
    most = 0.5 * tc->target;
    if (accel > 0.0 && vel >= 0.0) most = chip_min(most, 0.5 * vel * vel / accel + 2.0 * vel * in->period_s);
    return chip_max(0.0, most / in->mu_per_mm);
}

/* How the end of a part of a segment is left. */
static int join_of(const TC_STRUCT *tc, int part)
{
    if (part + 1 < part_count(tc) || tc->term_cond == TC_TERM_COND_TANGENT) return CHIP_JOIN_TANGENT;
    return tc->term_cond == TC_TERM_COND_PARABOLIC ? CHIP_JOIN_PARABOLIC : CHIP_JOIN_STOP;
}

#endif
