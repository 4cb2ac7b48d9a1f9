"""Every checker is seen to fail: the core is built with one fault at a time, and the test that
guards against it must turn red.  Also the C tests under the sanitizers."""
import os
import shutil
import subprocess
import sys

import pytest

from conftest import ROOT

CORE = ROOT / "components" / "core"
C_TEST = ROOT / "tests" / "core" / "test_core.c"
SANITIZE = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]

# The load as the cells a step of 0.1 mm removes, each wholly or not at all.
COUNTED = """{
        double sum = 0.0, ds = 0.1;
        int ix, iy;
        met.area = met.depth = 0.0;
        met.nodes = 1;
        for (iy = 0; iy < stock->ny; iy++)
            for (ix = 0; ix < stock->nx; ix++) {
                double x = stock->x0 + (ix + 0.5) * stock->cell - tip[0], y = stock->y0 + (iy + 0.5) * stock->cell - tip[1];
                double nx = x - ds * dir[0], ny = y - ds * dir[1], r2 = tool->radius * tool->radius;
                if (nx * nx + ny * ny <= r2 && x * x + y * y > r2) sum += cw_cell_above(stock, cw_stock_cell(stock, ix, iy), tip[2]);
            }
        met.area = sum * stock->cell * stock->cell / ds;
    }"""

# name: (file, text, faulty text, test that must fail)
FAULTS = {
    "outline a fifth of a cell too wide": (
        "stock.c", "half, t = -outside", "half, t = 0.2 - outside", "test_stock.py::test_known_volume[slot 17 deg-0.25]"),
    "plunge misses its outline": (
        "sweep.c", "leg->dz < 0.0 ? 1.0 : 0.0;", "0.0;", "test_stock.py::test_known_volume[plunge flat-0.25]"),
    "round tool cuts a bit more each time": (
        "sweep.c", "cell->top < (float)stock->z_max", "0",
        "test_stock.py::test_known_volume_in_servo_steps[ball groove 31 deg-0.25]"),
    "shares are added": (
        "stock.c", "levels->cut = cw_max(c, k);", "levels->cut = c + k;", "test_stock.py::test_layers_share_a_wall"),
    "volume of a partly cut cell forgotten": (
        "stock.h", "(low > 0.0 ? low : 0.0) - high)", "0.0)",
        "test_stock.py::test_known_volume[slot 17 deg-0.25]"),
    "rim cells taken for whole ones": (
        "stock.c", "(1.0 - levels.gone) *", "1.0 *", "test_rim.py::test_faced_and_cut_deeper"),
    "a turned box is its hull": (
        "stock.c", "v = c * y - s * x,", "v = 0.0,", "test_rim.py::test_turned_box"),
    "front read where the tool has cut": (
        "section.c", "#define CW_CLEAR 1.5", "#define CW_CLEAR 0.1",
        "test_section.py::test_section[slot flat 17 deg]"),
    "bands too wide": (
        "tool.c", "ring->run = 0.5 *", "ring->run = 0.6 *", "test_section.py::test_section[plunge ball]"),
    "samples a place too far": (
        "ahead.c", "cw_max(0.0, at - early(ahead, &part, i))", "at + ahead->gap",
        "test_ahead.py::test_a_wall_is_seen_in_time"),
    "cells counted, in the look-ahead": (
        "ahead.c", "met = cw_section_at(stock, tool, tip, dir, clear, at->curvature);", COUNTED,
        "test_section.py::test_through_the_look_ahead[slot flat 17 deg]"),
    "walls at the tool's edge smeared": (
        "section.c", "#define CW_EDGE_CELLS 1.5", "#define CW_EDGE_CELLS -9.0", "test_profiles.py::test_area[flat D6, depth 3]"),
    "a cone taken for cylinders": (
        "section.c", "low = cw_max(tip + cw_tool_height(tool, side), strip->low)", "low = strip->low",
        "test_profiles.py::test_area[taper D8, 40 % beside]"),
    "points of a cell cut by one leg only": (
        "sweep.c", "#define CW_BEHIND 1.5", "#define CW_BEHIND 0.0", "test_profiles.py::test_volume_in_servo_steps[vee 60]"),
    "cells cut wholly or not at all": (
        "section.c", "return uncut + (cell->cut * (1.0 / CW_FULL)) * (rest - uncut);",
        "return cell->cut > CW_FULL / 2 ? rest : uncut;", "test_section.py::test_section[side flat 10 % 0 deg]"),
    "look-ahead off": (
        "feed.c", "if (in->next_area[i] <= CW_LEAST_AREA) continue;", "continue;",
        "test_feed.py::test_ahead_is_braked_in_time"),
    "arcs taken for straight": (
        "course.c", "course->piece.curvature = now.turn;", "course->piece.curvature = 0.0;",
        "test_ahead.py::test_arc_and_helix_are_followed"),
    "five percent too fast": (
        "feed.c", "cw_feed_target(in) / area", "1.05 * cw_feed_target(in) / area", "test_feed.py::test_at_the_tool"),
    "brakes too late": (
        "feed.c", "#define CW_BRAKING 0.5", "#define CW_BRAKING 1.0",
        "test_feed.py::test_ahead_is_braked_in_time"),
    "highest velocity not braked to": (
        "feed.c", "in->next_area[i]), most)", "in->next_area[i]), CW_UNBOUND)",
        "test_feed.py::test_fastest_while_cutting"),
    "chip as at the small engagement": (
        "feed.c", "2.0 * e / acos(1.0 - 2.0 * e)", "sqrt(e)", "test_feed.py::test_mean_chip"),
    "rises at once": (
        "feed.c", "cw_min(goal, ramp + step)", "goal", "test_feed.py::test_drops_pass_at_once_and_rises_climb"),
    "braking taken for disobedience": (
        "obey.c", "#define CW_OBEY_BRAKING 0.25", "#define CW_OBEY_BRAKING 2.0",
        "test_obey.py::test_obedience_is_never_taken_for_it"),
    "disobedience explained by the ceiling": (
        "obey.c", "cw_max(scale * speed(in->requested)", "cw_max(speed(in->requested)",
        "test_obey.py::test_it_is_seen_in_time"),
    "no number comes through": (
        "feed.c", "!cw_finite(in->area) || in->area < 0.0", "0", "test_feed.py::test_fallback_is_the_programmed_feed"),
}


def build(folder, faulty=None):
    """The core as a shared library, with one text replaced; -> its path."""
    source = folder / "core"
    shutil.copytree(CORE, source)
    if faulty:
        name, text, wrong, _ = faulty
        content = (source / name).read_text()
        assert text in content, f"{name} no longer has `{text}`; give this fault a new text"
        (source / name).write_text(content.replace(text, wrong))
    library = folder / "libchipwise.so"
    subprocess.run(["gcc", "-Os", "-fno-fast-math", "-w", "-shared", "-fPIC", "-o", str(library),
                    *map(str, sorted(source.glob("*.c"))), "-lm"], check=True)
    return library


def outcome(library, test):
    """Exit status of one test of tests/python run with another library."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider",
               str(ROOT / "tests" / "python") + "/" + test]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, "CHIPWISE_CORE": str(library)},
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, timeout=120)
    return done.returncode, done.stdout


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_seen(name, tmp_path):
    status, text = outcome(build(tmp_path, FAULTS[name]), FAULTS[name][3])
    assert status == 1, text            # 1: tests ran and some failed


def test_without_fault(tmp_path):
    """The same way of building and running, with no fault, is green."""
    status, text = outcome(build(tmp_path), "test_feed.py")
    assert status == 0, text


OFFLINE = ("height_sweep.c",)


@pytest.mark.parametrize("flags", [SANITIZE, ["-fno-fast-math", "-Wframe-larger-than=2560"]],
                         ids=["sanitizers", "realtime flags"])
def test_c_program(flags, tmp_path):
    """The bound on the frame is for the realtime core, not for the test program nor for what only runs offline."""
    program, build_flags = tmp_path / "test_core", ["gcc", "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Werror"]
    sources = [str(source) for source in sorted(CORE.glob("*.c")) if source.name not in OFFLINE]
    subprocess.run([*build_flags, *flags, "-c", *sources], check=True, cwd=tmp_path)
    subprocess.run([*build_flags, *[f for f in flags if "frame" not in f], "-o", str(program), str(C_TEST),
                    *map(str, sorted(tmp_path.glob("*.o"))), "-lm"], check=True)
    done = subprocess.run([str(program)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, done.stdout
    assert done.stdout.splitlines()[-1].endswith(" passed, 0 failed")
