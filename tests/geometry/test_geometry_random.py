# SPDX-License-Identifier: GPL-2.0-or-later
"""Random contours against the independent oracle, and proof that the oracle bites.

CHIPWISE_RANDOM_COUNT contours of each kind (default 150, so that the
quick run stays short; bench/offset_bench.py judges 5,000), from number
CHIPWISE_SEED on.  A failure names the case and leaves a replay file under build/.
"""

import numpy as np
import pytest

from chipwise.geometry.base import clearance
from chipwise.geometry.offset import slices
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from support.contour_judge import (
    ROOT,
    count_from_environment,
    judged,
    read_replay,
    seed_from_environment,
    variants,
    verdict,
    write_replay,
)
from support.contour_random import chords_case, contour_case, grid_case, needles_case
from support.contour_shapes import polygon

SEED, COUNT = seed_from_environment(), count_from_environment(150)
KINDS = ("filleted", "bulged", "grid", "chords", "needles")


def case(kind, seed):
    special = {"grid": grid_case, "chords": chords_case, "needles": needles_case}
    return special[kind](seed) if kind in special else contour_case(seed, kind)


def side_of(seed):
    """The quick run judges one side of each contour, the bench both."""
    return LEFT if seed % 2 else RIGHT


def how_many(kind, count):
    """Fewer of the long ones: the oracle compares all elements with all."""
    return max(count // {"chords": 15, "needles": 3}.get(kind, 1), 1)


def opened(parts, seed):
    """An open piece of a closed contour, tool up to three times as large."""
    rng = np.random.default_rng([seed, 7])
    k, drop = int(rng.integers(len(parts))), int(rng.integers(1, max(2, len(parts) // 2)))
    return (parts[k:] + parts[:k])[:-drop], float(rng.choice([1.0, 1.0, 3.0]))


def fail_on(kind, seed, parts, side, radius, found):
    if found:
        path = write_replay(kind, seed, parts, side, radius, found)
        pytest.fail(f"{kind} contour CHIPWISE_SEED={seed}, side {side}: {found}; replay: {path}")


@pytest.mark.parametrize("kind", KINDS)
def test_closed(kind):
    for seed in range(SEED, SEED + how_many(kind, COUNT)):
        parts, radius = case(kind, seed)
        side = side_of(seed)
        fail_on(kind, seed, parts, side, radius, verdict(parts, side, radius))


@pytest.mark.parametrize("kind", KINDS)
def test_backwards_and_from_every_vertex(kind):
    for seed in range(SEED, SEED + how_many(kind, COUNT // 10)):
        parts, radius = case(kind, seed)
        side = side_of(seed)
        fail_on(kind, seed, parts, side, radius, variants(parts, side, radius)[1])


@pytest.mark.parametrize("kind", KINDS)
def test_open(kind):
    for seed in range(SEED, SEED + how_many(kind, COUNT // 2)):
        parts, radius = case(kind, seed)
        parts, factor = opened(parts, seed)
        side = side_of(seed)
        found = verdict(parts, side, factor * radius)
        fail_on(f"open_{kind}", seed, parts, side, factor * radius, found)


def test_sharp_paths_do_not_gouge():
    from support.contour_oracle import from_elements, gouge

    for seed in range(SEED, SEED + max(COUNT // 5, 1)):
        parts, radius = case("bulged", seed)
        contour = make_contour(parts)
        for side in (LEFT, RIGHT):
            for path in offset_contour(contour, side, radius).sharp_paths:
                assert gouge(from_elements(contour.elements), radius, from_elements(path.elements), 0.1) < 1e-6


# The checker must be able to fail: the kernel is broken on purpose.


def findings(count=25):
    found = []
    for seed in range(count):
        parts, radius = case("filleted", seed)
        for side in (LEFT, RIGHT):
            found += verdict(parts, side, radius)
    return found


def test_sabotage_without_the_whole_contour_the_oracle_finds_gouges(monkeypatch):
    """Judging a slice by its neighbours only, as a controller's compensation does."""
    monkeypatch.setattr(slices, "gouge_depths", lambda check, point, radius: np.zeros(len(point)))
    assert any("gouge" in text for text in findings())


def test_sabotage_without_any_judge(monkeypatch):
    monkeypatch.setattr(slices, "gouge_depths", lambda check, point, radius: np.zeros(len(point)))
    monkeypatch.setattr(slices, "gouge_depths_beside", lambda check, p, i, radius: np.zeros(len(p)))
    found = findings(10)
    assert any("gouge" in text for text in found)


def test_sabotage_dropped_slices_are_found_missing(monkeypatch):
    """One slice in twenty thrown away."""
    whole = clearance.gouge_depths

    def lossy(j, point, radius):
        depth = whole(j, point, radius)
        depth[::20] = 1.0
        return depth

    monkeypatch.setattr(slices, "gouge_depths", lossy)
    assert any("lost" in text for text in findings(10))


def test_sabotage_shifted_rough_shape_is_found():
    """A rough shape that cuts 0.00001 mm into the finish shape."""
    from dataclasses import replace

    contour = polygon((0, 0), (20, 0), (20, 20), (0, 20))
    result = offset_contour(contour, LEFT, 3)
    rough = result.rough[0]
    moved = replace(rough, elements=replace_y(rough.elements, -1e-5))
    result.__dict__["rough"] = (moved,)
    assert any("inside the finish shape" in text for text in judged(contour, LEFT, 3, result))


def replace_y(e, shift):
    from chipwise.geometry.base.elements import Elements

    move = np.array([0.0, shift])
    return Elements(e.start + move, e.end + move, e.centre + move, e.radius, e.start_angle, e.sweep)


def test_replay_file_says_the_same(tmp_path):
    parts, radius = case("bulged", 3)
    path = write_replay("selftest", 3, parts, LEFT, radius, ["nothing"])
    again, side, same_radius = read_replay(path)
    path.unlink()
    assert side == LEFT and same_radius == radius
    assert np.allclose(make_contour(again).elements.start, make_contour(parts).elements.start)


@pytest.mark.parametrize("path", sorted((ROOT / "tests/geometry/replays").glob("*.json")), ids=lambda path: path.stem)
def test_cases_that_once_failed(path):
    parts, side, radius = read_replay(path)
    assert verdict(parts, side, radius) == []
    assert variants(parts, side, radius)[1] == []
