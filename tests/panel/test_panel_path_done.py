# SPDX-License-Identifier: GPL-2.0-or-later
"""The path done on the page: what the servo thread has kept of it, however seldom the page looks."""

import numpy as np
import pytest

from chipwise.panel import watch
from chipwise.clib import layout
from support import panel_browser
from support.panel_circle import PERIOD_S, circle, off_circle
from support.panel_rig import Machine, serving

DRAWN_MM = 0.02  # a quarter of the strip of components/core/path_done.h, and a bit of the chord of a period
STAR_MM = 1.0


def traced(found, path, seconds):
    """The path done of a program that goes along `path`, seen by looks that are so many seconds apart, with the tip as
    the page draws it; -> [(n, 3)] a look."""
    watching, step, seen = watch.Watch(found), round(seconds / PERIOD_S), []
    found.tip = tuple(path[0])
    if found.kept:
        found.go(path[:1])
    watching.look()
    found.tasks["running"] = True
    watching.look()
    for first in range(0, len(path), step):
        part = path[first : first + step]
        if found.kept:
            found.go(part)
        found.tip = tuple(part[-1])
        watching.look()
        seen.append([*watching.path_since(0, 0)["points"], found.tip])
    found.tasks["running"] = False
    watching.look()
    return [*seen, watching.path_since(0, 0)["points"]]


@pytest.mark.parametrize(
    "radius, velocity, seconds", [(15.0, 60.0, 1.0), (15.0, 20.0, 1.0), (3.0, 30.0, 3.0), (0.5, 5.0, 1.0)]
)
def test_a_circle_is_round(radius, velocity, seconds):
    path = circle(radius, velocity)
    for drawn in traced(Machine(keeps=True), path, seconds):
        assert off_circle(drawn, radius) <= DRAWN_MM
    assert np.hypot(*(np.array(drawn[-1]) - drawn[0])[:2]) < 1e-3 and len(drawn) > 10


def test_looks_alone_make_a_star():
    """What a map without the path done, or the page before, shows of it."""
    drawn = traced(Machine(), circle(15.0, 60.0), 1.0)[-1]
    assert off_circle(drawn, 15.0) > STAR_MM


def test_a_program_begins_where_the_tool_stands():
    """After a jog in the direction in which the program goes on nothing is kept there: the look before has the
    place."""
    found = Machine(keeps=True)
    watching = watch.Watch(found)
    watching.look()
    found.go([(x, 0.0, 5.0) for x in np.arange(0.0, 10.0, 0.1)])
    watching.look()
    found.tasks["running"] = True
    found.go([(x, 0.0, 5.0) for x in np.arange(9.9, 30.0, 0.1)] + [(29.9, y, 5.0) for y in np.arange(0.0, 5.0, 0.1)])
    watching.look()
    assert np.allclose(watching.path_since(0, 0)["points"], [(9.9, 0.0, 5.0), (29.9, 0.0, 5.0)], atol=1e-3)


def test_nothing_of_the_time_between_programs():
    found = Machine(keeps=True)
    watching = watch.Watch(found)
    for running, x in ((True, 1.0), (False, 2.0), (False, 3.0), (True, 4.0)):
        found.tasks["running"] = running
        found.go([(x, y, 0.0) for y in (0.0, 5.0, 0.0)])
        watching.look()
    assert {point[0] for point in watching.path_since(0, 0)["points"]} == {3.0, 4.0}


def test_an_hour_of_corners_is_bounded():
    found = Machine(keeps=True)
    watching = watch.Watch(found)
    found.tasks["running"] = True
    watching.look()
    for _ in range(4):
        found.go([(k % 2, k * 1e-3, 0.0) for k in range(layout.PATH_DONE_POINTS + 100)])
        watching.look()
    path = watching.path_since(0, 0)
    assert len(path["points"]) == watch.PATH_POINTS < path["count"]


@pytest.mark.parametrize("count", [0, 3, layout.PATH_DONE_POINTS, 2**63, 2**64 - 1])
@pytest.mark.parametrize("number", [float("nan"), float("inf"), -1e308, 1.5])
def test_hostile_memory(count, number):
    """Whatever another program has written there: a bounded look, and finite points or none."""
    found = Machine(keeps=True)
    watching = watch.Watch(found)
    found.tasks["running"] = True
    watching.look()
    np.frombuffer(memoryview(found.kept.done), float)[1:] = number
    for hostile in (count, 0, count // 2, count):
        found.kept.done.count = hostile
        watching.look()
    points = np.array(watching.path_since(0, 0)["points"], float).reshape(-1, 3)
    assert np.isfinite(points).all() and len(points) <= watch.PATH_POINTS
    assert number == 1.5 or len(points) <= 1


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_the_circle_that_a_browser_draws(tmp_path):
    """The points that are drawn, the tool's own among them, in the middle of the circle and at the end."""
    path = circle(15.0, 30.0)
    driver = panel_browser.browser(tmp_path, (1280, 800))
    try:
        with serving(keeps=True) as rig:
            rig.machine.go(path[:1])
            rig.look()
            rig.machine.tasks["running"] = True
            rig.look()
            panel_browser.opened(driver, rig.url + "/")
            for end in (len(path) // 2, len(path)):
                rig.machine.go(path[:end] if end < len(path) else path[len(path) // 2 :])
                rig.look()
                panel_browser.wait(driver, f"chipwise.state.look === {rig.watch.number}", "the look")
                drawn = np.array(driver.execute_script("return chipwise.view.points"))
                assert off_circle(drawn + [0, 0, 0], 15.0) <= DRAWN_MM
                assert np.allclose(drawn[-1][:2], path[end - 1][:2], atol=1e-3)
            driver.save_screenshot(str(tmp_path / "circle.png"))
    finally:
        driver.quit()
