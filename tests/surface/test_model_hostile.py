# SPDX-License-Identifier: GPL-2.0-or-later
"""Models that ask for more memory than they are worth, whose header lies, or whose unit is another one: answered,
nothing lost without a word."""

import os
import resource
import struct
import subprocess

import numpy as np
import pytest
from support import ROOT, surface_cases

from chipwise.errors import CycleError
from chipwise.surface.model import Placing, read_model

WAVES = surface_cases.waves(12)
ROOM = 500 << 20  # bytes: the command with a small model has 330 MB of addresses, most of them of libraries
FLAT = [(0, 0, 0), (2000, 0, 0), (0, 2000, 1)]


def surface(path, *arguments, room=ROOM):
    return subprocess.run(
        [
            ROOT / "bin" / "chipwise",
            "surface",
            path,
            "-o",
            path.parent / "out.ngc",
            "--tool",
            "4",
            *map(str, arguments),
        ],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
        check=False,
        env={**os.environ, "INI_FILE_NAME": "", "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (room, room)),
    )


def facets(count, word="0"):
    one = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 1\nendloop\nendfacet\n"
    return ("solid a\n" + one * count + one.replace("vertex 0 0 0", f"vertex {word} 0 0") + "endsolid\n").encode()


@pytest.mark.parametrize(
    "content, step, said",
    [
        (
            surface_cases.stl_bytes([FLAT]),
            1,
            "the cuts need 16340166 points of the model, more than 6000000; use a larger D or tolerance, or correct "
            "SCALE of the model",
        ),
        (
            facets(50_000, "0" * 3000),
            1,
            "the ASCII STL file has a number of more than 64 characters after triangle 48770; export the model again",
        ),
        (facets(50_000, "0." + "0" * 60), 1, None),
    ],
    ids=["one large triangle", "a word of 3,000 digits", "a word of 62"],
)
def test_memory_is_bounded_before_it_is_taken(tmp_path, content, step, said):
    path = tmp_path / "part.stl"
    path.write_bytes(content)
    done = surface(path, "--step", step)
    if said is None:
        assert done.returncode == 0, done.stderr
    else:
        assert (done.returncode, done.stderr.splitlines()[-1].partition("surface: ")[2].removeprefix("part.stl: ")) == (
            2,
            said,
        )


def read(tmp_path, content, **placing):
    (tmp_path / "part.stl").write_bytes(content)
    return read_model(str(tmp_path / "part.stl"), Placing(**placing))


def header_says(count, triangles=WAVES):
    data = surface_cases.stl_bytes(triangles)
    return data[:80] + struct.pack("<I", count) + data[84:]


@pytest.mark.parametrize(
    "content, triangles, note",
    [
        (header_says(242), 242, None),
        (header_says(0), 242, "the file has 242 triangles, its header says 0: all 242 are read"),
        (header_says(240), 242, "the file has 242 triangles, its header says 240: all 242 are read"),
        (
            header_says(242) + bytes(100),
            242,
            "100 bytes behind the 242 triangles that the header says are something else, and are not read",
        ),
        (
            header_says(242) + b"name of the part, made by hand, 2 x ".ljust(50, b"z"),
            242,
            "50 bytes behind the 242 triangles",
        ),
        (
            header_says(200) + b"more",
            200,
            "2104 bytes behind the 200 triangles that the header says are not read; export the model again",
        ),
    ],
    ids=["right", "none", "too few", "padding", "a text", "no whole number"],
)
def test_a_header_that_says_too_few(tmp_path, content, triangles, note):
    model = read(tmp_path, content)
    assert (
        len(model.triangles) == triangles
        and len(model.notes) == (note is not None)
        and all(note in one for one in model.notes)
    ), model.notes


def test_a_header_that_says_too_many(tmp_path):
    with pytest.raises(CycleError, match="is cut off: it says 300 triangles and has 242"):
        read(tmp_path, header_says(300))


@pytest.mark.parametrize(
    "size, options, said",
    [
        (
            0.04,
            (),
            "the model is 0.04 mm across, smaller than the tool (6 mm), and its lengths count as mm; use SCALE "
            "(--scale) 1000 if it is in metres "
            "(40 mm) or 1 if it is that small",
        ),
        (
            40 / 25.4,
            (),
            "use SCALE (--scale) 25.4 if it is in inch (40 mm) or 1000 if it is in metres (1574.8031 mm) or 1 if it is "
            "that small",
        ),
        (0.04, ("--scale", 1000), None),
        (0.04, ("--scale", 1), None),
        (6.5, (), None),
    ],
)
def test_a_model_smaller_than_the_tool(tmp_path, size, options, said):
    """Its unit is probably another one: the scale has to be said."""
    path = tmp_path / "part.stl"
    path.write_bytes(surface_cases.stl_bytes(np.asarray(WAVES) * size / 40))
    done = surface(path, "--step", 2, *options, room=resource.RLIM_INFINITY)
    assert done.returncode == (2 if said else 0) and (said is None or said in done.stderr), done.stderr
    assert (tmp_path / "out.ngc").exists() == (said is None)


def test_cuts_deeper_than_the_flutes_are_a_finding(tmp_path):
    """91 mm with flutes of 15 mm: written, said, and exit status 1; in levels there is nothing to say."""
    path = tmp_path / "part.stl"
    path.write_bytes(surface_cases.stl_bytes(np.asarray(WAVES) * (1, 1, 9.1)))
    done = surface(path, "--step", 3, room=resource.RLIM_INFINITY)
    assert done.returncode == 1 and "mm deep, the flutes are 15 mm long; rough in levels first" in done.stdout
    assert surface(path, "--step", 3, "--rough", 10, room=resource.RLIM_INFINITY).returncode == 0
