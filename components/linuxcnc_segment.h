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

#define CHIP_PLANNER_CHORDS 16 /* chords an arc outside XY is read as; a blend arc has one less */

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

#endif
