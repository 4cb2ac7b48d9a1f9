# SPDX-License-Identifier: GPL-2.0-or-later
"""The picture of a plan: blank, part, what each step's tool does, and what stays.  Called by cli/turn.py."""

from html import escape

from chipwise.errors import printable
from chipwise.turning.blocks import controlled
from chipwise.turning.profile_function import clip, value

WIDTH, EDGE, LINE = 1000.0, 40.0, 18.0
BLANK, PART, LEFT_OVER, RAPID, BARRIER = "#e4e1da", "#9db4c8", "#c0392b", "#8a8a8a", "#5b4a72"
COLOURS = ("#1f6fb2", "#c8641b", "#2a8a4a", "#8a3fa0", "#b03060", "#4a7f86", "#7a6a1a", "#444444")


class View:
    """From mm (z, radius) to pixels: Z to the right, X up; the axis is at the bottom."""

    def __init__(self, plan):
        order = plan.order
        zs = [order.part.z0, order.part.z1, order.blank.z0, order.blank.z1]
        self.z0, self.z1 = min(zs) - 2.0, max(plan.safe[0], *zs) + 2.0
        self.top = plan.safe[1] + 2.0
        self.scale = min((WIDTH - 2 * EDGE) / (self.z1 - self.z0), 560.0 / self.top)
        self.axis = EDGE + self.scale * self.top
        needed = sum(s.needed for s in plan.steps)
        self.height = self.axis + EDGE + LINE * (needed + 2)

    def at(self, z, x):
        return f"{EDGE + self.scale * (z - self.z0):.2f} {self.axis - self.scale * x:.2f}"

    def graph(self, graph, sign=1.0):
        """Points of a graph from left to right; arcs as chords of 0.02 mm sag at most."""
        points = []
        for p in graph:
            count = 1 if p.r == 0.0 else 24
            points += [
                self.at(z, max(sign * value(p, z), 0.0))
                for z in (p.z0 + (p.z1 - p.z0) * k / count for k in range(count + 1))
            ]
        return points

    def section(self, outside, bore, colour):
        """The half section between outside and bore."""
        if not outside:
            return ""
        low = self.graph(bore, -1.0) if bore else []
        z0, z1 = outside[0].z0, outside[-1].z1
        blind = bool(bore) and bore[0].z0 > z0  # its end is a wall, and solid from there to the left
        inner = [*reversed(low), *([self.at(bore[0].z0, 0.0)] if blind else [])] if low else [self.at(z1, 0.0)]
        inner += [self.at(z0, 0.0)] if blind or not low else []
        return (
            f'<path d="M{"L".join([*self.graph(outside), *inner])}Z" fill="{colour}" stroke="#555" stroke-width="0.8"/>'
        )


def svg(plan, title):
    """Text of the picture."""
    view, order = View(plan), plan.order
    made = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:.0f}" height="{view.height:.0f}" '
        f'font-family="sans-serif" font-size="13">',
        f'<rect width="{WIDTH:.0f}" height="{view.height:.0f}" fill="white"/>',
        view.section(clip(order.blank.outside, view.z0, view.z1), clip(order.blank.bore, view.z0, view.z1), BLANK),
    ]
    for z0, z1, x0, x1 in order.barriers:
        a, b = max(z0, view.z0), min(z1, view.z1)
        corners = [view.at(a, x0), view.at(b, x0), view.at(b, min(x1, view.top)), view.at(a, min(x1, view.top))]
        made.append(f'<path d="M{"L".join(corners)}Z" fill="{BARRIER}" fill-opacity="0.35" stroke="{BARRIER}"/>')
    made.append(view.section(order.part.outside, order.part.bore, PART))
    legend = []
    for k, step in enumerate(s for s in plan.steps if s.needed):
        colour = COLOURS[k % len(COLOURS)]
        made += _paths(view, step, colour)
        legend.append((colour, f"{step.name}, T{step.tool.number}: {step.direction}"))
    made += [_residue(view, r, plan, order) for r in plan.residue]
    made.append(f'<path d="M{view.at(view.z0, 0)}L{view.at(view.z1, 0)}" stroke="#333" stroke-dasharray="12 4 2 4"/>')
    y = view.axis + EDGE
    for colour, text in [*legend, (LEFT_OVER, f"residue: {len(plan.residue)}")]:
        made.append(
            f'<rect x="{EDGE}" y="{y - 9:.1f}" width="22" height="4" fill="{colour}"/>'
            f'<text x="{EDGE + 30}" y="{y:.1f}">{escape(printable(text))}</text>'
        )
        y += LINE
    made.append(f'<text x="{EDGE}" y="24" font-size="16">{escape(printable(title))}</text></svg>')
    return "\n".join(made) + "\n"


def _paths(view, step, colour):
    """Feeds as lines in the step's colour, rapids thin: the controlled point."""
    z, x = step.start
    here = (z + step.tool.tip[0], (-x if step.tool.inside else x) + step.tool.tip[1])
    rapid, feed, last = "", "", None
    for m in step.moves:
        there = controlled(step, m.z, m.x)
        kind = "rapid" if m.kind == "rapid" else "feed"
        text = "" if last == kind else f"M{view.at(*here)}"
        if m.kind == "arc":
            r = view.scale * ((m.z - m.centre[0]) ** 2 + (m.x - m.centre[1]) ** 2) ** 0.5
            text += f"A{r:.2f} {r:.2f} 0 0 {int(m.ccw == step.tool.inside)} {view.at(*there)}"
        else:
            text += f"L{view.at(*there)}"
        rapid, feed = (rapid + text, feed) if kind == "rapid" else (rapid, feed + text)
        here, last = there, kind
    return [
        f'<path d="{rapid or "M0 0"}" fill="none" stroke="{RAPID}" stroke-width="0.4" stroke-dasharray="4 3"/>',
        f'<path d="{feed or "M0 0"}" fill="none" stroke="{colour}" stroke-width="1.1"/>',
    ]


def _residue(view, r, plan, order):
    """The area between stock and part of one residue."""
    sign = -1.0 if r.inside else 1.0
    wanted = order.part.bore if r.inside else order.part.outside
    edge = [
        *view.graph(clip(plan.stock[r.inside], r.z0, r.z1), sign),
        *reversed(view.graph(clip(wanted, r.z0, r.z1), sign)),
    ]
    return f'<path d="M{"L".join(edge)}Z" fill="{LEFT_OVER}" stroke="{LEFT_OVER}" stroke-width="0.6"/>'
