# SPDX-License-Identifier: GPL-2.0-or-later
"""The base line of a Partition and the spokes from it to every corner.

Called by concentric.py.  Source: the abstract on area machining by convex polygons, with its symbols:
base line BL through the centroids Wi of the convex polygons PGi and the middle points Mi of the edges
Bi they share; lines L from each Wi to the apexes of PGi, and from each Mi to the ends of Bi.  Those
lines are called spokes here.

1. Walking round a contour, the spokes to its corners follow one another as a fan.  Between two
   neighbours lies a triangle: over an edge of the contour it has its tip at Wi, where an edge Bi
   meets the contour its base on the base line, from Wi to Mi.  All points at the same share of the
   spokes make one closed path of the contour; within a triangle it runs parallel to its base.
2. So the distance between closed paths is the triangle's height divided by the number of parts.
3. With holes the base line has a ring about each of them, and every contour its own closed paths on
   its own side of the base line.  The abstract's figure has no holes; nothing else changes.
4. Departure: the abstract divides every spoke in the same number of parts, which crowds the paths
   in narrow positions.  Here every contour has its own number, and a branch of the machinable region that hangs on
   one edge Bi keeps only every q-th closed path, where the distance allows it; the others turn back
   along Bi.
"""

import heapq
import math
from dataclasses import dataclass

import numpy as np

from chipwise.geometry.pocket.convex_cuts import centroid, height


@dataclass(frozen=True, eq=False)
class Fan:
    """The n spokes of one contour, in its order, the polygon on the left: base, tip (n, 2) mm;
    node (n,) int: node of the base line at the base."""

    base: np.ndarray
    tip: np.ndarray
    node: np.ndarray

    def heights(self):
        """Height (n,) mm of the triangle between each spoke and the next."""
        tip, base = np.roll(self.tip, -1, axis=0), np.roll(self.base, -1, axis=0)
        corner = (self.node == np.roll(self.node, -1))[:, None]  # over a contour edge
        along = np.where(corner, tip - self.tip, base - self.base)
        off = self.tip - self.base
        return np.abs(along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]) / np.maximum(np.hypot(*along.T), 1e-12)

    def area(self):
        """Signed area mm2 of the contour."""
        x, y = (self.tip - self.tip[0]).T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


class BaseLine:
    """Base line and fans of a Partition: node (k, 2) mm: centroids first, then middle points;
    neighbours: list per node of neighbouring nodes; polygons: how many."""

    def __init__(self, partition):
        self.partition = partition
        self.edges = {
            (a, polygon[(k + 1) % len(polygon)][0]): (n, k)
            for n, polygon in enumerate(partition.polygons)
            for k, (a, _) in enumerate(polygon)
        }
        corners = [partition.corners(polygon) for polygon in partition.polygons]
        points = partition.points
        nodes = self._centres(corners)
        self.polygons = len(nodes)
        self.middle, self.neighbours = {}, [[] for _ in nodes]
        for (a, b), (n, k) in self.edges.items():
            if partition.polygons[n][k][1] and a < b:
                m = self.middle[a, b] = self.middle[b, a] = len(nodes)
                nodes.append(0.5 * (np.array(points[a]) + np.array(points[b])))
                other = self.edges[b, a][0]
                self.neighbours.append([n, other])
                self.neighbours[n].append(m)
                self.neighbours[other].append(m)
        self.node = np.array(nodes)

    def _centres(self, corners):
        """[centre (2,) mm]: centres of gravity, or halfway between the middles of two shared edges
        where the base line runs straighter so and no more paths are needed."""
        inner = [[f for _, f in q] for q in self.partition.polygons]
        tallest = max(height(p, f)[0] for p, f in zip(corners, inner))
        nodes = [centroid(p) for p in corners]
        for n, (p, shared) in enumerate(zip(corners, inner)):
            if sum(shared) == 2:
                ends = [q for k, f in enumerate(shared) if f for q in (p[k], p[(k + 1) % len(p)])]
                halfway = sum(x for x, _ in ends) / 4.0, sum(y for _, y in ends) / 4.0
                if height(p, shared, halfway)[0] <= tallest:
                    nodes[n] = halfway
        return nodes

    def fans(self):
        """A Fan of every contour, the outline last."""
        fans, seen = [], set()
        for start, (n, k) in self.edges.items():
            if self.partition.polygons[n][k][1] or start in seen:
                continue
            spokes, edge = [], start
            while edge not in seen:
                seen.add(edge)
                edge = self._round_corner(edge, spokes)
            corner, base = np.array(spokes).T
            fans.append(Fan(self.node[base], np.array(self.partition.points)[corner], base))
        return sorted(fans, key=Fan.area)

    def _round_corner(self, edge, spokes):
        """Adds the spokes to the end of a contour edge; returns the contour's next edge."""
        n, k = self.edges[edge]
        spokes.append((edge[1], n))
        while True:
            polygon = self.partition.polygons[n]
            k = (k + 1) % len(polygon)
            here, there = polygon[k][0], polygon[(k + 1) % len(polygon)][0]
            if not polygon[k][1]:
                return here, there
            spokes.append((here, self.middle[here, there]))
            n, k = self.edges[there, here]
            spokes.append((here, n))

    def divided(self, fan, gap):
        """(parts, every (n,) int): in how many parts to divide the spokes of a fan, and which closed
        paths each of them keeps: every q-th, counted from the contour.

        The polygons hang together from the fan's tallest one.  A branch that hangs on one shared edge
        keeps every q-th path of those that the polygon before it keeps."""
        heights, tall = fan.heights(), np.zeros(self.polygons)
        for node in (fan.node, np.roll(fan.node, -1)):
            own = node < self.polygons
            np.maximum.at(tall, node[own], heights[own])
        parts = max(1, math.ceil(float(tall.max()) / gap - 1e-9))
        least = np.clip(parts * gap / np.maximum(tall, 1e-9) + 1e-9, 1, parts).astype(int)
        order, parent, low = self._depth_first(int(np.argmax(tall)))
        rank = {n: k for k, n in enumerate(order)}
        for n in reversed(order[1:]):
            least[parent[n]] = min(least[parent[n]], least[n])
        every = np.ones(len(self.node), int)
        for n in order[1:]:
            every[n] = kept = every[parent[n]]
            if low[n] >= rank[n]:  # hangs on the edge to its parent alone
                every[n] = kept * max(1, least[n] // kept)
        for m in range(self.polygons, len(every)):
            every[m] = every[min(self.neighbours[m], key=lambda n: rank[n])]
        return parts, every[fan.node]

    def _depth_first(self, root):
        """(polygons in order, parent, lowest rank reached from below) of a walk over shared edges."""
        order, parent, rank, low = [], {root: None}, {}, {}
        stack = [(root, None, iter(self.neighbours[root]))]
        rank[root] = low[root] = 0
        order.append(root)
        while stack:
            n, through, middles = stack[-1]
            m = next(middles, None)
            if m is None:
                stack.pop()
                if stack:
                    low[stack[-1][0]] = min(low[stack[-1][0]], low[n])
                continue
            other = sum(self.neighbours[m]) - n
            if m == through:
                continue
            if other in rank:
                low[n] = min(low[n], rank[other])
                continue
            parent[other] = n
            rank[other] = low[other] = len(order)
            order.append(other)
            stack.append((other, m, iter(self.neighbours[other])))
        return order, parent, low

    def walks(self, travel):
        """The base line as walks [(nodes, cutting)] over each of its lines once: cutting False on
        lines done before, which the tool follows back for at most `travel` mm."""
        left = [set(neighbours) for neighbours in self.neighbours]
        here = min(range(len(left)), key=lambda n: (len(left[n]) != 1, n))
        walks, nodes, cutting = [], [here], []
        while True:
            if left[here]:
                there = min(left[here])
                left[here].discard(there)
                left[there].discard(here)
                nodes.append(there)
                cutting.append(True)
                here = there
                continue
            back = self._route_back(here, left)
            if back is None:
                return walks + [(nodes, cutting)]
            length, path = back
            if length <= travel:
                nodes += path[1:]
                cutting += [False] * (len(path) - 1)
            else:
                walks.append((nodes, cutting))
                nodes, cutting = [path[-1]], []
            here = path[-1]

    def _route_back(self, here, left):
        """(length mm, nodes) to the nearest node with lines left, along lines done; or None."""
        heap, came = [(0.0, here, None)], {}
        while heap:
            length, n, before = heapq.heappop(heap)
            if n in came:
                continue
            came[n] = before
            if left[n]:
                path = [n]
                while came[path[-1]] is not None:
                    path.append(came[path[-1]])
                return length, path[::-1]
            for other in self.neighbours[n]:
                if other not in came:
                    step = float(np.hypot(*(self.node[other] - self.node[n])))
                    heapq.heappush(heap, (length + step, other, n))
        return None
