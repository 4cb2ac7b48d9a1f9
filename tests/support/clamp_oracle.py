# SPDX-License-Identifier: GPL-2.0-or-later
"""How near a tool comes to clamps: a sampled sweep, written apart from chipwise.clamps.  Called by
tests/check/test_check_clamps.py and tests/core/test_clamp_guard.py.

Places of the tip every STEP mm, the tool as discs, the clamps as polygons or circles with a top.  mm, radians, machine
coordinates.
"""

import math

import numpy as np

STEP = 0.05  # mm, of the path and of the discs' heights
ARC_DISCS = 200  # of a rounded end
FAR = 3.0  # mm, what is farther is not measured


def tool_radius(tool, height):
    """Radius of the cutter and its shank at a height above the tip.  tool: dict shape, diameter, corner_radius,
    tip_angle."""
    radius, shape = tool["diameter"] / 2, tool["shape"]
    half = math.radians(tool.get("tip_angle", 0)) / 2
    if shape == "flat":
        return radius
    if shape == "vee":
        return min(radius, height * math.tan(half))
    if shape == "tapered-ball":
        corner = tool["corner_radius"]
        if height < corner * (1 - math.sin(half)):
            return math.sqrt(height * (2 * corner - height))
        return min(radius, corner * math.cos(half) + (height - corner * (1 - math.sin(half))) * math.tan(half))
    corner = radius if shape == "ball" else tool["corner_radius"]
    return radius if height >= corner else radius - corner + math.sqrt(height * (2 * corner - height))


def discs(tool, part, highest):
    """(heights (n,), radii (n,)) of a part of the tool, "tool" or "holder", up to a height above the tip."""
    if part == "holder":
        heights = np.append(np.arange(tool["stick_out"], highest, STEP), tool["stick_out"])
        return heights, np.full(len(heights), tool["holder_diameter"] / 2)
    round_end = tool["diameter"] / 2 * (1 - np.cos(np.linspace(0, math.pi / 2, ARC_DISCS)))
    heights = np.concatenate((np.arange(0.0, max(highest, STEP), STEP), round_end, round_end / 20))
    return heights, np.array([tool_radius(tool, h) for h in heights])


def outline_distance(clamp, x, y):
    """(n,) from a clamp seen from above, 0 inside.  clamp: dict with corners [(x, y) x 4] in order, or middle and
    diameter; and top."""
    if "diameter" in clamp:
        return np.maximum(np.hypot(x - clamp["middle"][0], y - clamp["middle"][1]) - clamp["diameter"] / 2, 0.0)
    found, inside = np.full(len(x), np.inf), np.ones(len(x), bool)
    corners = clamp["corners"]
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
        dx, dy = bx - ax, by - ay
        t = np.clip(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0, 1)
        found = np.minimum(found, np.hypot(x - ax - t * dx, y - ay - t * dy))
        inside &= dx * (y - ay) - dy * (x - ax) >= 0
    return np.where(inside, 0.0, found)


def line(start, end):
    """Places (n, 3) of a straight move."""
    count = max(2, math.ceil(math.dist(start, end) / STEP))
    return np.asarray(start) + np.linspace(0, 1, count)[:, None] * (np.asarray(end) - np.asarray(start))


def nearest(tool, part, clamp, places):
    """mm by which the clamp has to grow at its sides and top until a tool along places (n, 3) meets it; FAR if it is
    farther."""
    across, z = outline_distance(clamp, places[:, 0], places[:, 1]), places[:, 2]
    widest = (tool["holder_diameter"] if part == "holder" else tool["diameter"]) / 2
    begins = tool["stick_out"] if part == "holder" else 0.0
    close = (across < widest + FAR) & (z + begins < clamp["top"] + FAR)
    if not close.any():
        return FAR
    heights, radii = discs(tool, part, clamp["top"] + FAR - z[close].min())
    least = FAR
    for a, b in zip(across[close], z[close]):
        least = min(least, float(np.maximum(a - radii, b + heights - clamp["top"]).min()))
    return least


def radius_at(tool, height):
    """As tool_radius(), of heights (n,) above the tip that are not negative."""
    radius, shape = tool["diameter"] / 2, tool["shape"]
    half = math.radians(tool.get("tip_angle", 0)) / 2
    corner = radius if shape == "ball" else tool.get("corner_radius", 0.0)
    with np.errstate(invalid="ignore"):
        arc = np.sqrt(height * (2 * corner - height))
    if shape == "flat":
        return np.full(len(height), radius)
    if shape == "vee":
        return np.minimum(radius, height * math.tan(half))
    if shape == "tapered-ball":
        joint = corner * (1 - math.sin(half))
        return np.where(
            height < joint, arc, np.minimum(radius, corner * math.cos(half) + (height - joint) * math.tan(half))
        )
    return np.where(height >= corner, radius, radius - corner + arc)


def grown(tool, part, clamp, places, least=-60.0):
    """(n,) mm by which the clamp has to grow at its sides and its top until it touches the part at each of the places
    (n, 3); FAR if more.  By halving."""
    across, z = outline_distance(clamp, places[:, 0], places[:, 1]), places[:, 2]
    begins = tool["stick_out"] if part == "holder" else 0.0
    close = (across < (tool["holder_diameter"] if part == "holder" else tool["diameter"]) / 2 + FAR) & (
        z + begins < clamp["top"] + FAR
    )
    if not close.all():
        found = np.full(len(z), FAR)
        found[close] = grown(tool, part, clamp, places[close], least) if close.any() else ()
        return found
    low, high = np.full(len(z), least), np.full(len(z), FAR)
    for _ in range(44):
        middle = (low + high) / 2
        over = clamp["top"] + middle - z
        radius = (
            np.full(len(z), tool["holder_diameter"] / 2) if part == "holder" else radius_at(tool, np.maximum(over, 0.0))
        )
        touches = (over > begins) & (across < radius + middle)
        low, high = np.where(touches, low, middle), np.where(touches, middle, high)
    return high
