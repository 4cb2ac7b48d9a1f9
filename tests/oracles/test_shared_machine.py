# SPDX-License-Identifier: GPL-2.0-or-later
"""One LinuxCNC for the scenes of several tests (support/operate.py): who gets which answers, and what a failing scene
does."""

from types import SimpleNamespace

import pytest

from support import operate


def items_of(shared, scenes):
    """Tests of that many scenes, as pytest has them."""
    session = SimpleNamespace()
    session.items = [
        SimpleNamespace(
            nodeid=name,
            session=session,
            get_closest_marker=lambda _name, steps=steps: SimpleNamespace(args=(shared, steps)),
        )
        for name, steps in scenes.items()
    ]
    return dict(zip(scenes, session.items))


@pytest.fixture
def started(monkeypatch):
    """Steps of each start; a step "fail" ends it, every other answers with itself."""
    starts = []

    def operated(_folder, steps, **_options):
        starts.append(steps)
        if ["fail"] in steps:
            raise operate.Stopped(steps[: steps.index(["fail"])], "failed")
        return steps

    monkeypatch.setattr(operate, "operate", operated)
    return starts


def test_one_start_for_all(started):
    shared = operate.Shared("x")
    scenes = {"a": [["1"], ["2"]], "b": [["3"]], "c": [["4"], ["5"]]}
    items = items_of(shared, scenes)
    other = items_of(operate.Shared("y"), {"d": [["6"]]})["d"]
    items["a"].session.items.append(other)
    assert {name: shared.answers_of(item, str) for name, item in items.items()} == scenes
    assert started == [[["1"], ["2"], ["fresh"], ["3"], ["fresh"], ["4"], ["5"]]]


def test_a_failing_scene_fails_its_own_test_only(started):
    shared = operate.Shared("x")
    items = items_of(shared, {"a": [["1"]], "b": [["2"], ["fail"]], "c": [["4"]]})
    assert shared.answers_of(items["a"], str) == [["1"]]
    for _ in range(2):
        with pytest.raises(operate.Stopped):
            shared.answers_of(items["b"], str)
    assert shared.answers_of(items["c"], str) == [["4"]] and len(started) == 2


def test_a_machine_that_does_not_become_fresh_fails_the_next_scene(monkeypatch):
    shared = operate.Shared("x")
    items = items_of(shared, {"a": [["1"]], "b": [["2"]]})

    def stopped(_folder, steps, **_options):
        raise operate.Stopped(steps[:1], "fresh failed")

    monkeypatch.setattr(operate, "operate", stopped)
    assert shared.answers_of(items["a"], str) == [["1"]]
    with pytest.raises(operate.Stopped, match="fresh failed"):
        shared.answers_of(items["b"], str)
