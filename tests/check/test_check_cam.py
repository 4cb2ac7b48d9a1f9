# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise check on the same part in the style of three CAM post-processors, on the programs of this repository, and on
programs that are broken in random ways: judged alike, or refused with one line."""

import glob
import json
import math
import os
import random
import subprocess

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CHIPWISE = os.path.join(ROOT, "bin", "chipwise")
SEED = int(os.environ.get("CHIPWISE_SEED", "1"))
STOCK = ["--stock", "0", "0", "-20", "80", "60", "0"]

# (code, x, y, z, i, j): a ring and a slot in two levels, tool 1 (6 mm); then two slots with tool 3 (10 mm)
RING = [("G1", 30, 30, z, 0, 0) if k == 0 else ("G3", 30, 30, z, 10, 0) for z in (-2, -4) for k in (0, 1)]
SLOTS = [("G1", 8, 8, -3, 0, 0), ("G1", 72, 8, -3, 0, 0), ("G1", 72, 52, -3, 0, 0)]


def words(move):
    code, x, y, z, i, j = move
    return f"X{x:.3f} Y{y:.3f} Z{z:.3f}" + (f" I{i:.3f} J{j:.3f}" if code != "G1" else "")


def numbered_post():
    """N words, a percent sign, an O number as comment, G28 in G91, G43 H, G17 on its own, upper case, no spaces."""
    lines = ["(PART 1001)", "G90 G94 G17 G91.1", "G21", "G53 G0 Z0."]
    for tool, x, y, moves in ((1, 30, 30, RING), (3, 8, 8, SLOTS)):
        lines += [
            f"(TOOL {tool})",
            f"T{tool} M6",
            "S9000 M3",
            "G54",
            f"G0 X{x}. Y{y}.",
            f"G43 Z15. H{tool}",
            "G0 Z5.",
            "F300.",
        ]
        lines += [f"{move[0]}{words(move).replace(' ', '')}" for move in moves]
        lines += ["G0 Z15.", "M5", "G49", "G53 G0 Z0."]
    lines += ["M30"]
    return "%\n" + "\n".join(f"N{10 * k} {line}" for k, line in enumerate(lines, 1)) + "\n%\n"


def plain_post():
    """Lower case, a comment on each line, modal codes repeated, semicolons, blank lines, CRLF."""
    lines = ["; generated", "g21 (mm)", "g90", "g17 g40 g49 g80", ""]
    for tool, x, y, moves in ((1, 30, 30, RING), (3, 8, 8, SLOTS)):
        lines += ["(begin operation)", f"m6 t{tool}", "m3 s9000", "g0 z5 (up)", f"g0 x{x} y{y}"]
        lines += [f"{move[0].lower()} {words(move).lower()} f300 ; cut" for move in moves] + ["g0 z5", "m5", ""]
    return "\r\n".join(lines + ["m2"]) + "\r\n"


def chords_post():
    """Inch, arcs as chords of 0.01 mm, only the words that change."""
    lines = ["%", "G20", "G90", "G64 P0.0004 Q0.0004"]
    for tool, x, y, moves in ((1, 30, 30, RING), (3, 8, 8, SLOTS)):
        lines += [f"T{tool}", "M06", "M03 S9000", "G00 Z0.2", f"G00 X{x / 25.4:.5f} Y{y / 25.4:.5f}", "F11.811"]
        for code, px, py, z, i, j in moves:
            if code == "G1":
                lines.append(f"G01 X{px / 25.4:.5f} Y{py / 25.4:.5f} Z{z / 25.4:.5f}")
                continue
            count = 220
            for k in range(1, count + 1):
                angle = math.pi + 2 * math.pi * k / count
                lines.append(
                    f"X{(px + i + 10 * math.cos(angle)) / 25.4:.5f} Y{(py + j + 10 * math.sin(angle)) / 25.4:.5f}"
                )
        lines += ["G00 Z0.2", "M05"]
    return "\n".join([*lines, "M02", "%"]) + "\n"


def check(tmp_path, *paths, options=()):
    """-> (exit status, stdout, JSON)."""
    found = tmp_path / "found.json"
    done = subprocess.run(
        [CHIPWISE, "check", *map(str, paths), "--json", str(found), *options],
        text=True,
        errors="replace",
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=600,
        check=False,
    )
    assert "Traceback" not in done.stderr + done.stdout and "internal error" not in done.stdout, (
        done.stderr + done.stdout
    )
    return done.returncode, done.stdout, json.loads(found.read_text())


def test_three_posts_are_judged_alike(tmp_path):
    posts = {"numbered.ngc": numbered_post(), "plain.ngc": plain_post(), "chords.ngc": chords_post()}
    for name, text in posts.items():
        (tmp_path / name).write_bytes(text.encode())
    status, out, report = check(tmp_path, *(tmp_path / name for name in posts), options=STOCK)
    assert status == 0, out
    ring = math.pi * (13**2 - 7**2) * 4
    slots = 3 * (
        64 * 10 + 44 * 10 + 2 * math.pi * 25 - (25 + 0.75 * math.pi * 25)
    )  # less what both arms share at the corner
    for program in report["programs"]:
        tools = {t["tool"]: t for t in program["tools"]}
        assert tools[1]["volume_mm3"] == pytest.approx(ring, rel=0.003)
        assert tools[3]["volume_mm3"] == pytest.approx(slots, rel=0.005)
        assert tools[1]["depth_mm"] == pytest.approx(2.0, abs=0.26) and tools[3]["depth_mm"] == pytest.approx(
            3.0, abs=0.01
        )
    volumes = [[t["volume_mm3"] for t in p["tools"]] for p in report["programs"]]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-3) and volumes[0] == pytest.approx(volumes[2], rel=2e-3)


def test_programs_of_this_repository(tmp_path):
    """Those of the mill; turning_*.ngc is a lathe's, stations.ngc a robot's, probe_grid.ngc a sub."""
    paths = sorted(
        path
        for path in glob.glob(os.path.join(ROOT, "nc_files", "*.ngc"))
        if not os.path.basename(path).startswith(("turning", "stations", "probe_grid"))
    )
    status, out, report = check(tmp_path, *paths)
    assert status == 0 and out.count("no findings") == len(paths), out
    assert all(p["tools"][0]["volume_mm3"] > 1000 for p in report["programs"])


def test_broken_programs_are_refused_with_one_line(tmp_path):
    generator = random.Random(SEED)
    sound = [numbered_post(), plain_post(), chords_post()]
    paths = []
    for number in range(12):
        text = bytearray(sound[number % 3].encode())
        for _ in range(generator.choice((1, 3, 10))):
            place = generator.randrange(len(text))
            kind = generator.randrange(4)
            if kind == 0:
                del text[place : place + generator.randrange(1, 200)]
            elif kind == 1:
                text[place] = generator.randrange(1, 256)
            elif kind == 2:
                text[place:place] = generator.choice(
                    (b"-", b"999999", b"#1", b"[", b"o1 call\n", b"G93 ", b"X1Y1", b"\n")
                )
            else:
                text[place:place] = text[generator.randrange(len(text)) :][:50]
        paths.append(tmp_path / f"{number}.ngc")
        paths[-1].write_bytes(bytes(text))
    _status, out, report = check(tmp_path, *paths, options=[*STOCK, "--time-limit", "20", "--cell", "1"])
    assert [p["status"] in (0, 1, 2) for p in report["programs"]] == [True] * len(paths)
    for program in report["programs"]:
        if program["status"] == 2:
            assert sum(line.startswith(program["program"] + ": ") for line in out.splitlines()) == 1
            assert len(program["error"]) > 5


def test_moves_of_a_turning_cycle_have_its_line(tmp_path):
    """LinuxCNC gives the moves within G70 to G72 the line -1."""
    path = tmp_path / "cycle.ngc"
    path.write_text(
        "G54 G18 G21\nF400\nO100 sub\nG0 X10 Z2\nG1 Z-10\nX14 Z-12\nO100 endsub\nG0 X20 Z5\nG70 Q100 X20 Z5 D1\nM2\n"
    )
    status, out, report = check(tmp_path, path, options=STOCK)
    assert (
        status == 2
        and report["programs"][0]["status"] == 2
        and "no tool is in the spindle" in out
        and "(line 9)" in out
    ), out
