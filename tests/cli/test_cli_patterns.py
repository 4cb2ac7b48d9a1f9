# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise patterns: list, picture, files without a pattern."""

import json
import os
import re
import xml.etree.ElementTree as ET

import pytest

from support import forked

GOOD = (
    "(Bar: a line {} <long> & an arc)\no100 sub\nG0 X2 Y1\nG0 Z3\nG1 Z-1.5 F100\nX12\nG3 X12 Y5 J2\nG0 Z9\n"
    "o100 endsub\n"
)


def patterns(*arguments, ini="", cwd=None):
    return forked.run(
        [forked.CHIPWISE, "patterns", *arguments],
        env={**os.environ, "INI_FILE_NAME": str(ini)},
        cwd=cwd,
        timeout=600,
        errors="surrogateescape",
    )


@pytest.fixture
def shop(tmp_path):
    """A machine with a library."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "100.ngc").write_text(GOOD)
    (tmp_path / "m.ini").write_text(
        "[CHIPWISE]\nPATTERNS = lib:none\n[RS274NGC]\nSUBROUTINE_PATH = lib\n[TRAJ]\nLINEAR_UNITS = mm\n"
    )
    return tmp_path


def test_list(shop):
    done = patterns("--json", shop / "out.json", ini=shop / "m.ini")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        "O100 Bar: a line {} <long> & an arc",
        f"  X 2 to 14 mm, Y 1 to 5 mm, Z -1.5 to 3 mm, 6 moves, {shop}/lib/100.ngc",
    ]
    found = json.loads((shop / "out.json").read_text())
    assert found["skipped"] == [] and len(found["patterns"]) == 1
    entry = found["patterns"][0]
    assert (entry["number"], entry["name"], entry["text"], entry["moves"], entry["found"]) == (
        100,
        "Bar",
        "a line {} <long> & an arc",
        6,
        True,
    )
    assert entry["low"] == pytest.approx([2, 1, -1.5]) and entry["high"] == pytest.approx([14, 5, 3], abs=0.005)


def test_the_picture(shop):
    """The tile's path is the sub's, to scale and with Y up; the arc's middle is on it."""
    assert patterns("-o", "list.svg", ini=shop / "m.ini", cwd=shop).returncode == 0
    root = ET.parse(shop / "list.svg").getroot()
    name = "{http://www.w3.org/2000/svg}"
    assert [t.text for t in root.iter(name + "text")][:2] == ["O100 Bar", "a line {} <long> & an arc"]
    lines = [
        [tuple(map(float, p.split(","))) for p in e.get("points").split()]
        for e in root.iter(name + "polyline")
        if e.get("stroke") == "#0a4fa0"
    ]
    origin = re.match(r"M([\d.]+) ([\d.]+)h14", next(e.get("d") for e in root.iter(name + "path")))
    x0, y0 = float(origin[1]) + 7, float(origin[2])
    scale = (lines[0][2][0] - lines[0][0][0]) / 10
    mm = [((x - x0) / scale, (y0 - y) / scale) for x, y in lines[0]]
    assert scale > 10 and mm[0] == pytest.approx((2, 1), abs=0.02) and mm[-1] == pytest.approx((12, 5), abs=0.02)
    assert max(x for x, _y in mm) == pytest.approx(14, abs=0.02)
    assert len(list(root.iter(name + "circle"))) == 1


def test_the_samples(tmp_path):
    """Those of the repository, on its own machine, as PNG."""
    done = patterns("-o", tmp_path / "all.png")
    assert done.returncode == 0, done.stdout + done.stderr
    assert (
        len(re.findall(r"(?m)^O9\d\d \w", done.stdout)) == 4 and (tmp_path / "all.png").read_bytes()[:4] == b"\x89PNG"
    )


BAD = {
    "5.ngc": (None, "it is not a regular file"),
    "6.ngc": ("folder", "it is not a regular file"),
    "7.ngc": ("", "it has no comment"),
    "8.ngc": ("(Eight: x)\n", "there is no sub O8"),
    "9.ngc": ("o9 sub\nG0 X1\no9 endsub\n", "it has no comment"),
    "10.ngc": (
        "(MSG, hello)\n(: nameless)\no10 sub\nG0 X1\no10 endsub\n",
        "its first comment has no name before the colon",
    ),
    "11.ngc": ("(E)\no11 sub\nG28\no11 endsub\n", "sub O11, line 3 of 11.ngc: G28 moves in machine coordinates"),
    "12.ngc": (
        "(E)\no12 sub\no1 while [1]\n#1=1\no1 endwhile\no12 endsub\n",
        "the sub does not end within 5 s of computing time",
    ),
    "13.ngc": (
        "(E)\no13 sub\nG0 X#<_width>\no13 endsub\n",
        "line 3 of 13.ngc: Named parameter #<_width> not defined; give it with --set _width=value",
    ),
    "23.ngc": (
        "(E)\no23 sub\nG0 X[#5420 + #101]\no23 endsub\n",
        "line 3 of 23.ngc: #101 has its value only when the program runs; give it with --set 101=30",
    ),
    "14.ngc": ("(E)\no14 sub\nG0 X[1 / 0]\no14 endsub\n", "line 3 of 14.ngc: Attempt to divide by zero"),
    "15.ngc": ("(E)\no15 sub\nM3\no15 endsub\n", "the sub moves nothing"),
    "16.ngc": ("(E)\no16 sub\nG0 X1\n", "has no endsub"),
    "18.ngc": (
        b"(E\x00\xff)\no18 sub\n\x00\xff\xfe G1\no18 endsub\n",
        "sub O18, line 1 of 18.ngc: it is not a text file, it has a byte 0; save it as text",
    ),
    "0100.ngc": (GOOD, "its name is not a number"),
    "part.ngc": (GOOD, "its name is not a number"),
    "-1.ngc": (GOOD, "its name is not a number"),
    "19.NGC": (GOOD, "its name is not a number"),
    "20.ngc": ("link", "No such file"),
    "21.ngc": ("sparse", "it has 33554432 bytes, more than"),
    b"22\xff.ngc": (GOOD, "its name is not a number"),
}


def put(path, content):
    if content is None:
        os.mkfifo(path)
    elif content == "folder":
        os.mkdir(path)
    elif content == "link":
        os.symlink(b"nowhere", path)
    else:
        with open(path, "wb") as file:
            if content == "sparse":
                file.truncate(1 << 25)
            else:
                file.write(content if isinstance(content, bytes) else content.encode())


def test_files_that_are_no_patterns(shop):
    """Each is named with its reason; the good one is listed and drawn."""
    for name, (content, _words) in BAD.items():
        put(os.path.join(os.fsencode(shop / "lib"), os.fsencode(name)), content)
    done = patterns("-o", shop / "a.svg", "--json", shop / "out.json", ini=shop / "m.ini")
    assert done.returncode == 1 and done.stderr == "" and "Traceback" not in done.stdout
    assert done.stdout.count("skipped: ") == len(BAD) and done.stdout.startswith("O100 Bar")
    found = json.loads((shop / "out.json").read_text())
    assert len(found["skipped"]) == len(BAD) and len(found["patterns"]) == 1
    said = {os.path.basename(bad["file"]): bad["problem"] for bad in found["skipped"]}
    for name, (_content, words) in BAD.items():
        if isinstance(name, str):
            assert words in said[name], (name, said[name])
    ET.parse(shop / "a.svg")


def test_what_g75_finds(shop):
    """A folder that is not on the SUBROUTINE_PATH, and a number that is there twice."""
    (shop / "more").mkdir()
    (shop / "more" / "100.ngc").write_text(GOOD)
    (shop / "more" / "101.ngc").write_text(GOOD.replace("100", "101"))
    done = patterns(
        "--folder", shop / "lib", "--folder", shop / "more", "--json", shop / "out.json", ini=shop / "m.ini"
    )
    assert done.returncode == 1
    assert f"G75 Q100 runs {shop}/lib/100.ngc: it comes first on the SUBROUTINE_PATH" in done.stdout
    assert f"G75 Q101 does not find it: put {shop}/more on the SUBROUTINE_PATH" in done.stdout
    assert [p["found"] for p in json.loads((shop / "out.json").read_text())["patterns"]] == [True, False, False]


def test_inch_and_parameters(shop):
    (shop / "lib" / "100.ngc").write_text("; Long: by a parameter\no100 sub\nG0 Z1\nG1 X#<_long> F10\no100 endsub\n")
    (shop / "m.ini").write_text((shop / "m.ini").read_text().replace("= mm", "= inch"))
    done = patterns("--set", "_long=2", ini=shop / "m.ini")
    assert done.returncode == 0 and "O100 Long: by a parameter\n  X 0 to 2 in," in done.stdout, done.stdout


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--folder", "/nowhere"], "there is no folder /nowhere; make it"),
        (["--ini", "/nowhere.ini"], "/nowhere.ini"),
        (["--tool", "x"], "--tool x is not a diameter"),
        (["-o", "a.gif"], ".gif is not a known kind of picture"),
        (["--json", "/nowhere/a.json"], "there is no folder /nowhere"),
        (["--set", "5"], "--set 5 is not a parameter"),
    ],
)
def test_refused(shop, arguments, words):
    done = patterns(*arguments, ini=shop / "m.ini", cwd=shop)
    assert (
        done.returncode == 2
        and words in done.stderr
        and "Traceback" not in done.stderr
        and done.stderr.count("\n") == 1
    )


def test_an_empty_library(shop):
    (shop / "lib" / "100.ngc").unlink()
    done = patterns("-o", shop / "a.svg", ini=shop / "m.ini")
    assert done.returncode == 0 and done.stdout.startswith("there are no patterns") and ET.parse(shop / "a.svg")
