/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tool.h - the cutting shape of a rotating tool, as a profile z = g(r).
 *
 * Who calls it: sweep.c (what a move removes), section.c (the load), stock_tracker.comp.
 * Source: the APT cutter statement (diameter, corner radius, tip angle), reduced to
 * the shapes mills use; JP3131045 [0006] calls this "tool shape data TS".
 * Departs from APT: no lower-side angle below the tip and no undercut; the part
 * of the tool above the profile is a cylinder of the full diameter.
 *
 * The profile, from the axis outwards, in mm above the tip:
 *   r <= r_flat            flat end,            g = 0
 *   r_flat < r <= r_arc    corner arc of radius `corner`, tangent to what is before and after
 *   r_arc < r <= radius    cone of slope `slope` = 1 / tan(tip_angle / 2)
 *   at r = radius          vertical wall, starts at height `shoulder`
 */
#ifndef CHIPWISE_TOOL_H
#define CHIPWISE_TOOL_H

#include "tooth.h"

#define CHIP_TOOL_RINGS 12 /* bands the end of the tool is divided into for section.c */

#define CHIP_MIN_TOOL_DIAMETER 1e-3   /* mm, diameter */
#define CHIP_MAX_TOOL_DIAMETER 2000.0 /* mm, diameter */
#define CHIP_MIN_TIP_ANGLE 0.1        /* degrees; a sharper cone is a needle: its slope would be in the thousands */
#define CHIP_MAX_FLUTE_LENGTH 1e4     /* mm */

enum chip_tool_error {
    CHIP_TOOL_OK = 0,
    CHIP_TOOL_DIAMETER = 1, /* diameter not from CHIP_MIN_TOOL_DIAMETER to CHIP_MAX_TOOL_DIAMETER */
    CHIP_TOOL_CORNER = 2,   /* corner radius negative, not finite or larger than the tool's radius */
    CHIP_TOOL_ANGLE = 3,    /* tip angle neither 0 nor in [CHIP_MIN_TIP_ANGLE, 180) degrees */
    CHIP_TOOL_FLUTE = 4     /* flute length negative, not finite or above CHIP_MAX_FLUTE_LENGTH */
};

struct chip_tool_ring {  /* one band of the tool's end, seen as a surface of revolution */
    double radius;       /* mm, mean over the band's height: 2 radius rise is its area from the front */
    double height;       /* mm above the tip, of the band's middle */
    double rise;         /* mm, height of the band (0 on the flat end) */
    double run;          /* mm, radial width: 2 pi radius run is its area from below */
    double inner, outer; /* mm, radii of its edges */
    int straight;        /* part of the cone, not of the arc */
};

struct chip_tool {
    double radius;   /* mm */
    double corner;   /* mm, radius of the corner or tip arc */
    double slope;    /* mm rise per mm radius, of the cone; 0: no cone */
    double flute;    /* mm, 0 = unknown */
    double r_flat;   /* mm, end of the flat end */
    double r_arc;    /* mm, end of the corner arc */
    double arc_top;  /* mm, height of the profile at r_arc */
    double shoulder; /* mm, height of the profile at `radius` */
    /* the limits of its edges, and where their sums are made; null, as chip_tool_init leaves it: none */
    struct chip_tooth *tooth;
    int rings; /* bands in use; 0 only for an invalid tool */
    struct chip_tool_ring ring[CHIP_TOOL_RINGS];
};

/* Builds the profile. Lengths in mm, tip_angle the included angle in degrees (0: no
 * cone). Returns a chip_tool_error; on an error *tool has radius 0 and cuts nothing. */
int chip_tool_init(struct chip_tool *tool, double diameter, double corner_radius, double tip_angle,
                   double flute_length);

/* Sets the numbers of the profile only: mm, half the tip angle in rad (0: no cone). */
void chip_tool_set_profile(struct chip_tool *tool, double radius, double corner, double half_angle);

/* Height of the profile at distance r (mm, 0 <= r <= radius) from the axis, mm above the tip. */
double chip_tool_height(const struct chip_tool *tool, double r);

/* Slope dg/dr of the profile at r; large but finite where the arc is vertical. */
double chip_tool_slope(const struct chip_tool *tool, double r);

/* Along a line that passes the axis at a distance `aside` (mm), how far from there (mm) the profile is as steep as `slope` (mm per mm, not 0):
 * exact for a ball and a cone, a first guess where there is a flat end. */
double chip_tool_as_steep(const struct chip_tool *tool, double aside, double slope);

/* Largest r whose profile lies below `height` (mm above the tip), at most the radius. */
double chip_tool_reach(const struct chip_tool *tool, double height);

/* The part of a band between two radii (mm) within it. */
void chip_tool_profile_part(const struct chip_tool *tool, const struct chip_tool_ring *whole, double inner,
                            double outer, struct chip_tool_ring *part);

/* Whether the end is flat all over: every cell below it is cut to the same height. */
int chip_tool_is_flat(const struct chip_tool *tool);

#endif
