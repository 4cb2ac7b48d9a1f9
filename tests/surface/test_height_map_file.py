# SPDX-License-Identifier: GPL-2.0-or-later
"""Height maps of probing programs as models: the surface between the points, whatever wrote them."""

import random
import resource
import subprocess
import sys

import numpy as np
import pytest

from chipwise.errors import CycleError
from chipwise.surface import height_map_file
from chipwise.surface.model import Placing, read_model
from support import ROOT
from support.height_maps import FORMS, X, Y, Z, candle, pilot, rows
from support.surface_cases import triangles_of


def model_of(tmp_path, content, **placing):
    path = tmp_path / "probe.map"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_model(str(path), Placing(**placing))


@pytest.mark.parametrize("name", FORMS)
def test_the_points_of_a_file(tmp_path, name):
    model = model_of(tmp_path, FORMS[name], shift=(1, 2, 3))
    assert model.low == pytest.approx((X[0] + 1, Y[0] + 2, Z.min() + 3), abs=1e-5) and model.high == pytest.approx(
        (X[-1] + 1, Y[-1] + 2, Z.max() + 3), abs=1e-5
    )
    points = {tuple(point.round(3)) for point in triangles_of(model).reshape(-1, 3)}
    assert points == {
        (round(x + 1, 3), round(y + 2, 3), round(Z[j, i] + 3, 3)) for i, x in enumerate(X) for j, y in enumerate(Y)
    } or all(
        min(
            np.linalg.norm(np.subtract(one, (x + 1, y + 2, Z[j, i] + 3)))
            for i, x in enumerate(X)
            for j, y in enumerate(Y)
        )
        < 2e-3
        for one in points
    )
    assert len(model.triangles) == 2 * (len(X) - 1) * (len(Y) - 1)


def test_uneven_distances(tmp_path):
    xs, ys = [0.0, 1.0, 5.0], [0.0, 0.5, 10.0]
    model = model_of(tmp_path, "".join(f"{x} {y} {x + y}\n" for x in xs for y in ys))
    assert set(triangles_of(model)[..., 0].round(3).ravel()) == set(xs) and set(
        triangles_of(model)[..., 1].round(3).ravel()
    ) == set(ys)


BAD = {
    "a gap": (rows("{} {} {}").split("\n", 1)[1], "1 of 24 points of the height map are not known; probe them"),
    "not probed": (candle().replace(str(Z[1, 2]), "nan"), "1 of 24 points of the height map are not known"),
    "absent": (pilot().replace('<point X="0" Y="0">', '<p X="0" Y="0">'), "1 of 24 points"),
    "a row too few": (candle().rsplit("\r\n", 2)[0], "says 6 x 4 points and has others"),
    "one line": ("".join(f"{x} 0 1\n" for x in range(9)), "one line of points"),
    "many": ("0;0;1;1\n100000;100000;0;0\n1;1;1\n1\n2\n", "100000 x 100000 points, more than"),
    "no extent": (pilot().replace(f'MaxX="{X[-1]}"', f'MaxX="{X[0]}"'), "has no extent"),
    "no size": (pilot().replace("SizeX", "Size"), "lacks MinX"),
    "a point outside": (pilot().replace('X="5"', 'X="6"'), "not X, Y and a height"),
    "a program": ("G21\nG0 X0\n", "neither STL nor PNG nor a height map"),
    "a table": ("1 2 3\n4 5 6\n7 8\n", "neither STL nor PNG nor a height map"),
    "words of digits": ("1 2 " + "3" * 3000 + "\n1 2 3\n4 5 6\n7 8 9\n", "the file is text"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_whole_map(tmp_path, name):
    content, text = BAD[name]
    with pytest.raises(CycleError, match=text):
        model_of(tmp_path, content)


def test_scattered_points_are_no_grid(tmp_path):
    points = np.random.default_rng(5).random((4000, 3)) * 100
    with pytest.raises(CycleError, match="not a grid|are not known"):
        model_of(tmp_path, "".join("{} {} {}\n".format(*point) for point in points))


def test_any_bytes(tmp_path):
    """Nothing else than a model or a message comes of damaged files."""
    rng = random.Random(seed := 90210)
    for name in FORMS:
        for _ in range(40):
            data = bytearray(FORMS[name].encode())
            for _ in range(rng.randrange(1, 12)):
                data[rng.randrange(len(data))] = rng.choice(b'0123456789.;,- <>"eEn\n\xff\0')
            try:
                assert np.isfinite(model_of(tmp_path, bytes(data)).triangles).all()
            except CycleError as error:
                assert "; " in str(error) or "probe.map" in str(error), (seed, name)


def test_memory_of_a_hostile_file(tmp_path):
    """Counts and words are bounded before anything is made of them."""
    (tmp_path / "a.map").write_text("0;0;1;1\n1999;999;0;0\n1;1;1\n" + "1\n" * 10)
    (tmp_path / "b.map").write_text(
        '<heightmap MinX="0" MinY="0" MaxX="1" MaxY="1" SizeX="1e300" SizeY="2">' + "<point" * 200000
    )
    (tmp_path / "c.map").write_text("9" * 3_000_000 + "\n" + "1 2 3\n" * 100_000)
    code = (
        "import sys\nfrom chipwise.surface.model import Placing, read_model\nfrom chipwise.errors import CycleError\n"
        "for path in sys.argv[1:]:\n    try:\n        read_model(path, Placing())\n    except CycleError as error:\n"
        "        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *(str(tmp_path / name) for name in ("a.map", "b.map", "c.map"))],
        text=True,
        capture_output=True,
        timeout=300,
        check=False,
        env={"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": f"{ROOT}/remap"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (600 << 20, 600 << 20)),
    )
    assert done.returncode == 0 and len(done.stdout.splitlines()) == 3, done


def test_the_largest_count_is_that_of_the_points():
    assert (
        height_map_file._counts(1000, 2000) == [1000, 2000]
        and height_map_file._counts(1.5, 2) is None
        and height_map_file._counts(float("nan"), 2) is None
    )
