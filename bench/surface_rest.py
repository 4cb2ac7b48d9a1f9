# SPDX-License-Identifier: GPL-2.0-or-later
"""Levels, and what a smaller tool cuts where a larger one has left stock: feed in air, time of the links.  Called by
bench_surface.py."""

import dataclasses
import tempfile

import numpy as np

import roots  # noqa: F401  sys.path
from chipwise.clib.height_map import Shape
from chipwise.cycles.surface import surface_plan
from rows import row
from support import link_judge, surface_cases, surface_judge

START, FEED = (-30.0, -30.0, 30.0), 1500.0


def link_seconds(plan):
    return sum(map(link_judge.seconds, link_judge.links_of(plan.moves, START)))


def grooves():
    """Three vee grooves along X, 90 degrees, on 25 x 24 mm."""
    y = np.linspace(0, 24, 97)
    return surface_cases.terrain(np.linspace(0, 25, 3), y, np.repeat(np.abs((y + 4) % 8 - 4)[:, None] - 4, 3, axis=1))


PARTS = {
    "vee grooves": grooves,
    "hills": lambda: surface_cases.waves(30, 25.0),
    "step": lambda: np.concatenate(
        [surface_cases.box((0, 0, -5), (25, 20, 0)), surface_cases.box((6, 6, 0), (15.3, 14.1, 4))]
    ),
}


def fine_rest(small, needles, top):
    """feed_figures() of the rest with one-way cuts, a small relief and small cells."""
    levels, finish, fine = (
        dataclasses.replace(r, cell=0.1, earlier=())
        for r in (*small.earlier, dataclasses.replace(small, relief=0.1, link=1))
    )
    needles.height[:] = top
    for r in (levels, dataclasses.replace(finish, earlier=(levels,))):
        surface_judge.feed_figures(needles, surface_plan(r).moves, START, r.tool)
    return surface_judge.feed_figures(
        needles, surface_plan(dataclasses.replace(fine, earlier=(levels, finish))).moves, START, small.tool
    )


def requests(name, file):
    """SurfaceRequests of levels, of the finish and of the rest."""
    known = dict(stamp=(name,), feed=FEED, plunge_feed=600.0, start=START, relief=0.3)
    levels = surface_cases.request(file, tool=Shape(6), step=2.4, depth=1.5, allowance=0.3, tolerance=0.03, **known)
    finish = surface_cases.request(file, tool=Shape(6, 3), step=0.5, earlier=(levels,), **known)
    before = levels, dataclasses.replace(finish, earlier=())
    small = surface_cases.request(file, tool=Shape(3, 1.5), step=0.2, least=0.05, earlier=before, **known)
    return levels, finish, small


def feeds(levels, finish, small, plans):
    """{what: feed_figures()} of levels, and of the rest in what levels and finish have left."""
    low, high = plans["levels"][1].low, plans["levels"][1].high
    needles = surface_judge.grid(low, high, high[2] + levels.allowance, 0.15, 6.0)
    figures = {"levels": surface_judge.feed_figures(needles, plans["levels"][1].moves, START, levels.tool)}
    surface_judge.feed_figures(needles, surface_plan(finish).moves, START, finish.tool)
    before = needles.height.copy()
    for link in (1, 2):
        needles.height = before.copy()
        figures[f"rest P{link}"] = surface_judge.feed_figures(needles, plans["rest"][link].moves, START, small.tool)
    figures["rest P1, K0.1 and cells of 0.1 mm"] = fine_rest(small, needles, high[2] + levels.allowance)
    return figures


def rows_of_rest():
    """Rows of levels and of the rest with a smaller tool."""
    for name, make in PARTS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = surface_cases.write_stl(f"{folder}/model.stl", make())
            levels, finish, small = requests(name, file)
            plans = {
                kind: [surface_plan(dataclasses.replace(r, link=link)) for link in (0, 1, 2)]
                for kind, r in (("levels", levels), ("rest", small))
            }
            figures = feeds(levels, finish, small, plans)
        for kind, (lengths, deepest) in figures.items():
            cut, air = lengths[FEED]
            yield row(
                f"surface: {name}, {kind}, cuts in air",
                air / cut,
                "",
                f"of {cut:.0f} mm; deepest {deepest:.2f} mm",
                0.05,
            )
            everything, air = (sum(v[k] for v in lengths.values()) for k in (0, 1))
            yield row(
                f"surface: {name}, {kind}, feed in air with plunges and entries",
                air / everything,
                "",
                f"of {everything:.0f} mm",
                0.05,
            )
        for kind, made in plans.items():
            times = [link_seconds(plan) for plan in made]
            yield row(
                f"surface: {name}, {kind}, link time P1 / P0",
                times[1] / times[0],
                "",
                f"{times[0]:.1f}, {times[1]:.1f} and with P2 {times[2]:.1f} s; {made[1].cuts} cuts",
                0.5,
            )
