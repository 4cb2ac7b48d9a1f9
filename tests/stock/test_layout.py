# SPDX-License-Identifier: GPL-2.0-or-later
"""Python's structures and constants of the core are those of the C headers, and a library with others is refused."""

import os
import re
import shutil
import subprocess

import pytest

from chipwise.clib import library
from support import ROOT, unchanged

PYTHON = "/usr/bin/python3"
PROBE = """
import sys
sys.path.insert(0, sys.argv[1])
from chipwise.errors import LibraryError
from chipwise.clib import library
try:
    library.library()
except LibraryError as error:
    print(error)
"""


def copy(folder):
    """The generator with all that it reads and writes, in a folder of its own."""
    shutil.copytree(ROOT / "components", folder / "components")
    for name in ("tools/make_layout.py", "remap/chipwise/clib/layout.py", "VERSION"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def replace(path, text, other):
    """Put `other` in the place of a text, which may be spaced in another way."""
    pattern = r"\s+".join(map(re.escape, text.split()))
    content, count = re.subn(pattern, lambda _found: other, path.read_text())
    assert count == 1, f"{path.name} has `{text}` {count} times; give this test a new text"
    path.write_text(content)


def generate(folder, *options):
    return subprocess.run(
        [PYTHON, str(folder / "tools" / "make_layout.py"), *options], text=True, stdout=subprocess.PIPE
    )


def answer(library):
    """What library.py says about a library; "" if it takes it."""
    done = subprocess.run(
        [PYTHON, "-c", PROBE, str(ROOT / "remap")],
        env={**os.environ, "CHIPWISE_CORE": str(library)},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout.strip()


def build(folder, changed):
    """The core of a folder as a library; -> its path.  changed: file below components/: what does not include it is
    linked as `make build` made it."""
    library, sources, objects = folder / "libchipwise.so", sorted(folder.glob("build/*.c")), []
    for path in sorted([*ROOT.glob("components/core/*.c"), *ROOT.glob("components/offline/*.c")]):
        name = path.relative_to(ROOT / "components")
        if ROOT / "components" / changed in unchanged.closure([path]):
            sources.append(folder / "components" / name)
        else:
            objects.append(ROOT / "build" / name.with_suffix(".o"))
    subprocess.run(
        [
            "gcc",
            "-O0",
            "-w",
            "-shared",
            "-fPIC",
            "-I",
            str(folder / "components"),
            "-o",
            str(library),
            *map(str, sources + objects),
            "-lm",
        ],
        check=True,
    )
    return library


def test_the_committed_files_are_those_of_the_headers():
    done = generate(ROOT, "--check")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "header, text, other",
    [
        ("cell.h", "#define CHIP_FULL 65535", "#define CHIP_FULL 65534"),
        ("tracker.h", "CHIP_FAULT_JUMP = 21,", "CHIP_FAULT_JUMP = 24,"),
        ("path.h", "int first, count;", "int first; long count;"),
    ],
)
def test_a_stale_file_is_seen(tmp_path, header, text, other):
    folder = copy(tmp_path)
    assert generate(folder).returncode == 0 and generate(folder, "--check").returncode == 0
    replace(folder / "components" / "core" / header, text, other)
    done = generate(folder, "--check")
    assert done.returncode == 1 and "layout.py" in done.stdout and "make build" in done.stdout


@pytest.mark.parametrize(
    "text, other, named",
    [
        ("int limit;                  /* chip_limited_by */", "int limit, extra;", "chip_feed_out.extra"),
        (
            "double ramp_mm_s;           /* velocity the climb has reached */\n"
            "    double given_mm_s;          /* velocity of the last "
            "output */",
            "double given_mm_s, ramp_mm_s;",
            "chip_feed_easing.given_mm_s",
        ),
        ("int is_trusted; ", "long is_trusted; ", "chip_feed_in"),
    ],
    ids=["grown", "in another order", "wider"],
)
def test_a_changed_structure_is_refused(tmp_path, text, other, named):
    """Built from other headers than Python's copy: a sentence when the library is opened, no call into it."""
    folder = copy(tmp_path)
    replace(folder / "components" / "core" / "feed.h", text, other)
    assert generate(folder).returncode == 0
    said = answer(build(folder, "core/feed.h"))
    assert said.startswith("chipwise: core library ") and named in said and "run `make build`" in said, said


def test_another_version_of_the_interface_is_refused(tmp_path):
    folder = copy(tmp_path)
    replace(folder / "components" / "core" / "version.h", "CHIP_CORE_VERSION 1", "CHIP_CORE_VERSION 999")
    assert generate(folder).returncode == 0
    assert "another version" in answer(build(folder, "core/version.h"))


def test_a_library_without_a_table_is_refused(tmp_path):
    library = tmp_path / "libchipwise.so"
    (tmp_path / "empty.c").write_text("int nothing;\n")
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", str(library), str(tmp_path / "empty.c")], check=True)
    assert "another version" in answer(library)
    library.write_text("no library")
    assert "cannot be loaded" in answer(library)


def test_a_library_without_a_function_is_refused(tmp_path):
    folder = copy(tmp_path)
    replace(folder / "components" / "offline" / "png.c", "chip_png_unfilter(", "chip_png_unfilter_old(")
    assert generate(folder).returncode == 0
    said = answer(build(folder, "offline/png.c"))
    assert "another version (it has no chip_png_unfilter); run `make build`" in said, said


def test_the_library_of_this_build_is_taken():
    assert answer(library.library_path()) == ""
