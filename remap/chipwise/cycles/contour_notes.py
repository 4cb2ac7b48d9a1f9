# SPDX-License-Identifier: GPL-2.0-or-later
"""What the operator should know of a contour that is planned: notes for the CyclePlan.  Called by contour.py."""

import math

from chipwise.cycles.plan import Note
from chipwise.errors import Area
from chipwise.geometry.offset.necks import InaccessibleRegion

# A smaller inaccessible region is not worth a message. mm2
AREA = 0.01


def chop_notes(request, chop):
    """What the operator should know about the slug."""
    if not chop.too_small:
        return ()
    return (
        Note(
            "a tool of {d} leaves no piece below the chop size {h}, so the slug is cut to chips as a whole",
            {"h": request.chop_size, "d": 2 * request.tool_radius},
        ),
    )


def reach_notes(request, result):
    """What of the finish shape stays uncut by the finishing tool."""
    if not request.finish:
        return ()
    regions = [u for u in result.inaccessible if getattr(u, "area", AREA) >= AREA]
    corners = [u for u in regions if _is_corner(u, request.tool_radius)]
    regions = [u for u in regions if u not in corners]
    notes = ()
    if regions:
        area = sum(getattr(region, "area", 0.0) for region in regions)
        stay = "; {area} stays uncut" if area >= AREA else ""
        many = f"{len(regions)} places" if len(regions) > 1 else "one place"
        notes += (
            Note(
                f"the tool ({{d}}) does not fit in {many} (line {_listed(regions)}{stay}); use a smaller tool there",
                {"d": 2 * request.tool_radius, "area": Area(area)},
            ),
        )
    if corners:
        many = f"{len(corners)} inside corners keep" if len(corners) > 1 else "one inside corner keeps"
        notes += (Note(f"{many} the tool's radius of {{r}} (line {_listed(corners)})", {"r": request.tool_radius}),)
    return notes


def _is_corner(region, tool_radius):
    """Whether an inaccessible region is a sharp inside corner, in which any tool leaves something: two elements that no
    tool of this radius is too large for, and the tool's edge."""
    if not isinstance(region, InaccessibleRegion) or region.holes or len(region.boundary) != 3:
        return False
    arc_radii = region.boundary.radius[region.boundary.is_arc]
    return bool((arc_radii >= tool_radius * (1 - 1e-6)).all())


def _listed(regions):
    """Source lines of inaccessible regions, eight at most."""
    lines = sorted({line for region in regions for line in region.lines})
    return ", ".join(map(str, lines[:8])) + (", .." if len(lines) > 8 else "")


def open_notes(request, contour):
    """A piece that an open contour lets fall although it is to be chopped: its ends are nearer than the tool is
    wide."""
    e = contour.elements
    gap = math.dist(e.end[-1], e.start[0])
    if contour.closed or not request.finish or not request.chop_size or gap >= 2 * request.tool_radius:
        return ()
    return (
        Note(
            "the contour is open by {gap}, less than the tool ({d}), so what comes loose is not chopped; close the "
            "contour",
            {"gap": gap, "d": 2 * request.tool_radius},
        ),
    )


def lead_in_notes(request, paths):
    """Where the tool could not come in as asked."""
    plunges = [path.enter for path in paths if not path.enter.out and not path.enter.height and len(path.elements)]
    notes = ()
    if request.approach is not None and any(not path.enter.height for path in paths):
        lead_in = next(path.enter for path in paths if not path.enter.height)
        notes += (
            Note(
                "no clearance for the slanted approach of K{k} at X{x} Y{y}, so the tool plunges vertically",
                {"k": request.approach, "x": lead_in.point[0], "y": lead_in.point[1]},
            ),
        )
    if plunges and request.finish:
        notes += (
            Note(
                "no clearance for a lead-in at X{x} Y{y}, so the tool plunges at the finished wall",
                {"x": plunges[0].point[0], "y": plunges[0].point[1]},
            ),
        )
    return notes
