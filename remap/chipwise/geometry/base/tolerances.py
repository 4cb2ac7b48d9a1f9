# SPDX-License-Identifier: GPL-2.0-or-later
"""Every tolerance of the geometry kernel, with its unit and its reason.

Read by all modules of this package and by nothing else.  The kernel works in double
precision on coordinates up to about 10 m and radii up to about 100 m, where a distance
is exact to some 1e-11 mm; every tolerance below stands well above that.
"""

import math

# Two points closer than this are one node.  Above the error of an intersection of
# elements that cross at a shallow angle, below the 1e-6 mm the round trip may deviate.
NODE_MM = 1e-7

# A slice of the raw offset may lie this much deeper than the tool radius in the contour.
# It keeps slices that only touch (tangent neighbours, walls exactly two radii apart).
DEPTH_MM = 1e-7

# Up to this depth a slice belongs to the true offset beyond doubt: rounding only.
# Slices between STRONG_MM and DEPTH_MM are kept only where they close a path.
STRONG_MM = 2e-9

# An element of the finish shape shorter than this is dropped: it has no direction.
SHORT_MM = 1e-6

# Start and end of neighbouring elements may lie this far apart and still count as
# connected: one unit of the third decimal, as post-processors round it.
CONNECT_MM = 1.5e-3

# An open contour whose end and start lie nearer than this was meant to be closed: no profile has
# ends so near, and any tool's kerf would free the piece inside.
NEARLY_CLOSED_MM = 0.5

# LinuxCNC 2.9 accepts a centre-format arc whose two radii differ by this much
# (interp_internal.hh, CENTER_ARC_RADIUS_TOLERANCE_MM) ...
ARC_RADII_MM = 2 * 0.01 * math.sqrt(2)
# ... or by this share of the radius (SPIRAL_RELATIVE_TOLERANCE); same rule here.
ARC_RADII_SHARE = 0.001

# An arc whose end is this near to its start is a full circle, as in LinuxCNC (geometry/base/arc_sweep.py).
FULL_CIRCLE_MM = 1e-8

# A contour that crosses itself and comes back within this length of contour is a
# rounding artefact of a corner (corners of nearly tangent arcs), not a shape.
SELF_LOOP_MM = 5e-3

# A rolling arc goes where extending its neighbours instead strays by no more than this, to
# the safe side: half of the 1e-6 mm the round trip may deviate.
SLIGHT_CORNER_MM = 5e-7

# Path arcs shorter than this become lines.  A rolling arc then strays length^2 / (8 radius),
# below 1e-7 mm for tools of 0.025 mm and more; an arc of tiny radius strays to the safe side.
SHORT_ARC_MM = 1e-4

# Positions nearer than this where the tool just fits are one position.
POINT_CONTACT_MM = 1e-3

# Slices with a dead end are forgotten up to this length: doubles of one another at corners of
# nearly tangent elements.
LOOSE_MM = 1e-3

# Two directions closer than this are parallel when paths part at a node.
ANGLE_RAD = 1e-6

# Sine of the angle below which two lines have no intersection worth computing; what they
# share where they lie on one another is found by their ends.
PARALLEL = 1e-15

# Cosine above which a rolling arc leaves its neighbour tangentially: 1e-5 rad against the
# 1e-8 rad, the resolution of a cosine near 1.
COLLINEAR = 1.0 - 5e-11

# A turn this near to half a circle is a cusp, whose tangents do not give the side; and
# a turn smaller than this to the wrong side is rounding.
CUSP_RAD = 1e-3

# Sweep up to which an arc counts as at most a half circle.
HALF_TURN_RAD = math.pi * (1.0 + 1e-9)

# A finish element this near to the edge of a tool that fits at one point touches it.
NEAR_MM = 1e-5

# Feet nearer than this along the contour are one: ten times the node tolerance.
SAME_FOOT_MM = 1e-6

# A foot may fall back behind the last one by this much where the path runs over a corner of
# nearly tangent elements, within the depth tolerance; such a joint is not a corner either.
BACK_MM = 1e-2

# Pieces of the finish shape shorter than this are points: no element of the rough shape.
SOLID_MM = 1e-9

# Inaccessible regions smaller than this are rounding between touching elements.
REGION_MM2 = 1e-9


def slight_corner_gap(radius):
    """Widest gap (mm) that a concave corner may tear into the raw offset of `radius` while
    its middle stays within DEPTH_MM: depth = gap^2 / (8 radius)."""
    return 2.0 * math.sqrt(8.0 * radius * DEPTH_MM)
