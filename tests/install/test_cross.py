# SPDX-License-Identifier: GPL-2.0-or-later
"""Another processor: what `make CROSS=aarch64` builds, and that it computes the same figures, under qemu-user.

`make test-cross` installs compiler and qemu-user and runs all of it; elsewhere the C programs have few random cases,
and the slowest is left out."""

import math
import os
import shutil
import subprocess

import pytest

from support import ROOT

CROSS = "aarch64"
MACHINE = 183  # of ELF: AArch64
GCC = f"{CROSS}-linux-gnu-gcc"
BUILT = ROOT / "build" / CROSS
SYSROOT = f"/usr/{CROSS}-linux-gnu"
ALL = os.environ.get("CHIPWISE_CROSS") == "all"
FEW = "20"  # random cases, where not all of it runs
SLOW = {"test_plunge"}  # 77 s under qemu
TIMEOUT_S = 1800  # a loaded machine
PROGRAMS = sorted(path.stem for path in (ROOT / "tests/core").glob("*.c"))
SUMS = 1e-6  # of sums of single precision, whose order is the compiler's

pytestmark = [
    pytest.mark.xdist_group("cross"),
    pytest.mark.skipif(
        not shutil.which(GCC) or not os.path.isdir(f"{SYSROOT}/include"),
        reason=f"no cross compiler; apt-get install gcc-{CROSS}-linux-gnu libc6-dev-arm64-cross",
    ),
]
needs_qemu = pytest.mark.skipif(not shutil.which(f"qemu-{CROSS}"), reason="no emulator; apt-get install qemu-user")


@pytest.fixture(scope="module")
def built():
    done = subprocess.run(
        ["make", "-s", f"CROSS={CROSS}"],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT_S,
    )
    assert done.returncode == 0, done.stdout
    assert "warning" not in done.stdout, done.stdout
    return BUILT


def printed(command):
    """-> exit status and output."""
    few = {} if ALL else {"CHIPWISE_RANDOM_COUNT": FEW}
    done = subprocess.run(
        list(map(str, command)),
        env={**os.environ, **few},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=TIMEOUT_S,
    )
    return done.returncode, done.stdout


def emulated(program):
    return printed([f"qemu-{CROSS}", "-L", SYSROOT, program])


def figures(folder, compiler, objects, *flags):
    """tests/support/figures.c built with objects of a build -> the program."""
    program = folder / f"figures_{compiler}"
    parts = [path for part in ("core", "offline") for path in sorted((objects / part).glob("*.o"))]
    subprocess.run(
        [
            compiler,
            "-O1",
            "-ffp-contract=off",
            *flags,
            "-Icomponents",
            "-o",
            program,
            "tests/support/figures.c",
            *parts,
            objects / "version.o",
            objects / "layout_table.o",
            "-lm",
        ],
        cwd=ROOT,
        check=True,
    )
    return program


def differences(ours, theirs):
    """Lines of two runs of figures.c that do not agree."""
    found = [] if len(ours) == len(theirs) else [(len(ours), len(theirs))]
    for a, b in zip(ours, theirs):
        sums = a.startswith("about ") and b.startswith("about ")
        if a != b and not (sums and math.isclose(*(float.fromhex(line.split()[1]) for line in (a, b)), rel_tol=SUMS)):
            found.append((a, b))
    return found


def test_modules_and_library_are_of_that_processor(built):
    modules = sorted(path.stem for path in (built / "modules").glob("*.so"))
    assert modules == sorted(path.stem for path in (ROOT / "components").glob("*.comp")) and len(modules) == 10
    for path in [*(built / "modules").glob("*.so"), *built.glob("*.so")]:
        head = path.read_bytes()[:20]
        assert head[:4] == b"\x7fELF" and int.from_bytes(head[18:20], "little") == MACHINE, path
        symbols = subprocess.run(
            ["readelf", "-Ws", "--dyn-syms", path], stdout=subprocess.PIPE, text=True, check=True
        ).stdout
        assert path.parent.name != "modules" or "rtapi_app_main" in symbols, path


@needs_qemu
@pytest.mark.parametrize("name", PROGRAMS)
def test_c_program_prints_the_same(built, name):
    if name in SLOW and not ALL:
        pytest.skip("part of `make test-cross`")
    assert emulated(built / "tests" / name) == printed([ROOT / "build/tests" / name])


@needs_qemu
def test_figures_are_the_same(built, tmp_path):
    """Volumes, areas, depths and scales of a tracker with four tools, heights and witnesses of four programs: to the
    last bit."""
    here, there = (
        run(figures(tmp_path, compiler, objects))
        for run, compiler, objects in (
            (lambda program: printed([program]), "gcc", ROOT / "build"),
            (emulated, GCC, built),
        )
    )
    assert here[0] == there[0] == 0
    ours, theirs = (out.decode().splitlines() for _status, out in (here, there))
    assert len(ours) > 2000 and not differences(ours, theirs), differences(ours, theirs)[:10]


@needs_qemu
@pytest.mark.skipif(not ALL, reason="part of `make test-cross`")
def test_fused_products_are_seen(built, tmp_path):
    """Sabotage: products fused with sums, which gcc has for that processor without the option, change the figures."""
    objects = tmp_path / "fused"
    shutil.copytree(built / "offline", objects / "offline")
    for name in ("version.o", "layout_table.o"):
        shutil.copy(built / name, objects)
    (objects / "core").mkdir()
    sources = sorted((ROOT / "components/core").glob("*.c"))
    subprocess.run(
        [GCC, "-Os", "-fPIC", "-ffp-contract=fast", f"-I{ROOT}/components", "-c", *sources],
        cwd=objects / "core",
        check=True,
    )
    ours, theirs = (
        out.decode().splitlines()
        for _status, out in (emulated(figures(tmp_path, GCC, built)), emulated(figures(objects, GCC, objects)))
    )
    assert differences(ours, theirs)
