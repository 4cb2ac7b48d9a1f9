# SPDX-License-Identifier: GPL-2.0-or-later
"""M250, M251, M252 and the stock, on a running LinuxCNC: what the codes do, refuse and leave alone."""

import json
import os
import shutil
import subprocess

import pytest

from chipwise.headless import runner
from support import samples
from support.operate import BOX, NO_SHADOW, SCRIPTED, operate

pytestmark = pytest.mark.machine

STATE = [
    "pins",
    "stock-tracker.0.ready",
    "stock-tracker.0.removed-volume",
    "volumetric-feed.0.mode",
    "volumetric-feed.0.mrr-target",
]


def test_stock_and_feed_go_on_and_off(tmp_path):
    """The pins before and after each code; a cut in MDI removes what it must; the stock outlives M252."""
    before, _tool, box, defined, on, working, _fast, _down, cut, after, off, last = operate(
        tmp_path,
        [
            STATE,
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            STATE,
            ["mdi", "M251 Q6 P2 E3000"],
            STATE,
            ["mdi", "G0 X-5 Y20"],
            ["mdi", "G0 Z-2"],
            ["mdi", "G1 X65 F500"],
            STATE,
            ["mdi", "M252"],
            STATE,
        ],
    )
    assert (box, on, cut, off) == ([], [], [], [])
    assert before[0] == "FALSE" and before[2] == "0"
    assert defined[0] == "TRUE" and float(defined[1]) == 0
    assert working[2] == "2" and float(working[3]) == 6000
    assert float(after[1]) == pytest.approx(60 * 6 * 2, rel=0.003)
    assert last[0] == "TRUE" and last[1] == after[1] and last[2] == "0"


def test_the_nominal_cut_is_the_target(tmp_path):
    """2 x 1.5 mm at F500 and, in inch, 0.1 x 0.05 in at F20 of before the line: cm3/min at the pin; F behind it changes
    nothing; refused, the target stays."""
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            ["mdi", "F500 M251 I2 J1.5 P2 E3000"],
            STATE,
            ["mdi", "F900"],
            STATE,
            ["mdi", "M251 I2 J0"],
            STATE,
            ["mdi", "G20"],
            ["mdi", "F20"],
            ["mdi", "M251 I0.1 J0.05"],
            STATE,
        ],
    )
    _tool, _box, _on, first, _faster, second, refused, third, *_inch, last = answers
    assert [(found[2], float(found[3])) for found in (first, second, third)] == [("2", 1500.0)] * 3
    assert refused == ["chipwise: M251: depth of cut J0 mm is not above 0; give J above 0"]
    assert last[2] == "1" and float(last[3]) == pytest.approx(0.1 * 0.05 * 20 * 25.4**3, rel=1e-5)


def test_a_large_map_is_waited_for_before_the_first_tool(tmp_path):
    """1,400,000 cells take 0.4 s to fill; a missing tool does not count as a fault of the stock."""
    answers = operate(
        tmp_path,
        [["mdi", "T0 M6"], ["mdi", "M250 P0 Q0 R-6 I200 J70 K6"], ["pins", "stock-tracker.0.stock-defined"]],
        edit="s/^CELL = .*/CELL = 0.1/; s/^MAP_SIZE = .*/MAP_SIZE = 200 80/",
    )
    assert answers[1:] == [[], ["TRUE"]]


def test_jogging_and_homing_cut_nothing_and_are_never_slowed(tmp_path):
    """Jogging deep through the box, homing again: not a cell is cut, the override stays 1."""
    steps = [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        ["mdi", "M251 Q1 P1"],
        ["mdi", "G0 X-10 Y20"],
        ["jog", 2, -95, 50],
        ["jog", 0, 80, 50],
        ["jog", 1, -20, 50],
        STATE,
        ["position"],
        ["home"],
        STATE,
    ]
    answers = operate(tmp_path, steps)
    jogs, (state, position, _home, last) = answers[4:7], answers[7:]
    assert jogs == [[1.0]] * 3
    assert position == pytest.approx([70, 0, -5], abs=1e-6)
    assert state[:3] == ["TRUE", "0", "1"] and last[:3] == ["TRUE", "0", "1"]


def test_refusals_keep_the_stock_and_the_machine(tmp_path):
    """Each wrong line: the message, nothing moved, the stock cut so far is still there."""
    wrong = [
        ("M251 Q6", "chipwise: M251: no stock is defined; define it with M250 before"),
        (BOX, None),
        ("T1 M6", None),
        ("G0 X-5 Y20", None),
        ("G0 Z-2", None),
        ("G1 X30 F2000", None),
        ("M250 P0 Q0 R-10 I0 J40 K10", "chipwise: M250: size of the stock in X, I0 mm, is not above 0; give I above 0"),
        (
            "M250 P0 Q0 R-10 I301 J40 K10",
            "chipwise: M250: the stock of 301 mm by 40 mm is larger than the map of 300 mm by 200 mm; "
            "enlarge [CHIPWISE]MAP_SIZE in the INI file or use a smaller box",
        ),
        (
            "M250 P0 Q0 R-10 I10 J40 K10 E5",
            "chipwise: M250: word E is not used here; use P Q R (minimum in X, Y, Z) and I J K (size in X, Y, Z)",
        ),
        ("M250 P0 Q0 I10 J40 K10", "chipwise: M250: word R (minimum of the stock in Z) is missing; add R"),
        ("M251", "chipwise: M251: word Q (removal rate, cm3/min) is missing; add Q"),
        ("M251 Q-1", "chipwise: M251: removal rate Q-1 cm3/min is not above 0; give Q above 0"),
        (
            "M251 Q30000",
            "chipwise: M251: removal rate Q30000 cm3/min is above 10000 cm3/min, which no machine removes; give Q in "
            "cm3/min, not in mm3/min",
        ),
        ("M251 Q6 P4", "chipwise: M251: mode P4 is not a valid mode; use P1 (limit), P2 (constant) or P3 (window)"),
        ("M251 Q6 P2", "chipwise: M251: word E (ceiling of the feed) is missing; mode P2 replaces F; add E"),
        ("M251 Q6 P3 R7", "chipwise: M251: lower removal rate R7 is above the upper one, Q6; give R below Q"),
        ("G13 I5 Z-4", None),
    ]
    steps = [["mdi", line] for line, _message in wrong]
    answers = operate(tmp_path, steps + [STATE, ["position"]])
    for (line, message), said in zip(wrong, answers):
        assert said == ([message] if message else []), (line, said)
    state, position = answers[-2:]
    assert state[0] == "TRUE" and state[2] == "0"
    assert float(state[1]) > 60 * 2 * 3
    assert position[:2] == pytest.approx([30, 20], abs=1e-6)


def test_inch_machine(tmp_path):
    """The same slot on the inch machine, program in inch: the same volume."""
    answers = operate(
        tmp_path,
        [
            ["mdi", "G20 T1 M6"],
            ["mdi", "M250 P0 Q0 R-0.4 I2.4 J1.6 K0.4"],
            ["mdi", "M251 Q0.5 P2 E120"],
            ["mdi", "G0 X-0.2 Y0.8"],
            ["mdi", "G0 Z-0.08"],
            ["mdi", "G1 X2.6 F20"],
            STATE,
        ],
        ini="mill_inch.ini",
    )
    assert answers[:-1] == [[]] * 6
    diameter = 6.0
    assert float(answers[-1][1]) == pytest.approx(2.4 * 25.4 * diameter * 0.08 * 25.4, rel=0.003)
    assert float(answers[-1][3]) == pytest.approx(0.5 * 25.4**3)


def test_rotated_and_shifted_stock(tmp_path):
    """M250 in a shifted, G92'd and rotated work coordinate system: the machine box around it."""
    answers = operate(
        tmp_path,
        [
            ["mdi", "G10 L2 P1 X100 Y50 Z-5 R90"],
            ["mdi", "G92 X-83"],
            ["mdi", BOX],
            ["pins"] + [f"stock-tracker.0.{end}-{axis}" for end in ("min", "max") for axis in "xyz"],
            ["position"],
        ],
    )
    assert answers[:3] == [[]] * 3
    box = [float(v) for v in answers[3]]
    # position (0,0,90) is X-83 in G92: work x = machine-relative + shift
    x, y, z = answers[4]
    assert (x, y, z) == pytest.approx((0, 0, 90), abs=1e-6)
    # work x axis points along machine +Y: work (wx, wy) -> machine (100 - wy, 50 + wx + g92)
    g92 = (0 - 50) - (-83)
    assert box == pytest.approx([100 - 40, 50 + g92, -15, 100, 50 + g92 + 60, -5], abs=1e-6)


@pytest.mark.parametrize(
    "text, words",
    [
        ("[tool.1", "tools.toml: is not TOML"),
        ('[tool.1]\nshape = "spoon"\n', "tools.toml: tool 1: shape = 'spoon' is unknown; use one of flat"),
    ],
)
def test_broken_tool_geometry(tmp_path, text, words):
    """Said once, F as programmed, the machine usable; the file may be mended while LinuxCNC runs."""
    broken = tmp_path / "tools.toml"
    broken.write_text(text)
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            ["mdi", "M251 Q1 P1"],
            ["mdi", "G0 X-5 Y20"],
            ["mdi", "G0 Z-2"],
            ["mdi", "G1 X10 F600"],
            ["pins", "volumetric-feed.0.adaptive-feed", "volumetric-feed.0.limited-by"],
            ["position"],
        ],
        edit=f"s#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {broken}#",
    )
    said = [message for answer in answers[:6] for message in answer]
    assert [message for message in said if words in message][0].startswith("chipwise: ")
    assert sum(words in message for message in said) == 1
    assert answers[-2][0] == "1"
    assert answers[-1][0] == pytest.approx(10, abs=1e-6)


def test_a_tool_the_geometry_file_does_not_name(tmp_path):
    """A message, no error: the tool is cut with as a flat one, its depth not guarded."""
    few = tmp_path / "tools.toml"
    few.write_text("[tool.2]\nflute_length = 12\n")
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["messages"],
            ["pins", "chipwise-monitor.tool-diameter", "chipwise-monitor.tool-flute-length"],
        ],
        edit=f"s#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {few}#",
    )
    assert answers[0] == []
    assert [m for m in answers[1] if m.startswith("chipwise")] == [
        "chipwise: tools.toml: tool 1 is missing and treated as a flat end mill of unknown flute length; "
        "add [tool.1] if that is wrong"
    ]
    assert answers[2] == ["6", "0"]


def test_a_map_too_large_for_memory_stops_the_start(tmp_path):
    """LinuxCNC does not start with a map it could not hold; the message names value, rule and remedy."""
    configs = os.path.join(runner.ROOT, "configs")
    script = (
        f"cd {configs} && sed 's#^MAP_SIZE = .*#MAP_SIZE = 100000 90000#' mill_headless.ini > large.ini"
        " && exec linuxcnc -r large.ini"
    )
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "600", "--", "sh", "-c", script],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode != 0
    assert "[CHIPWISE]MAP_SIZE = 100000 90000 mm, CELL = 0.25 mm" in done.stdout
    assert "use larger cells or a smaller map" in done.stdout
    assert "Traceback" not in done.stdout


def test_three_lines_on_an_existing_machine(tmp_path):
    """LinuxCNC's own sample machine with the README's three lines: the codes work."""
    sample = os.path.join(samples.STOCK, "sim/axis")
    if not os.path.isdir(sample):
        pytest.skip("this LinuxCNC has no sample configurations")
    folder = tmp_path / "machine"
    shutil.copytree(sample, folder, ignore_dangling_symlinks=True)
    for name in ("chipwise.inc.in", "chipwise_codes.inc"):
        with open(os.path.join(runner.ROOT, "configs", name)) as handle:
            (folder / name.removesuffix(".in")).write_text(handle.read().replace("@SHARE@", runner.ROOT))
    text = (folder / "axis_mm.ini").read_text()
    text = text.replace("[RS274NGC]\n", "[RS274NGC]\n#INCLUDE chipwise_codes.inc\n")
    text = text.replace(
        "HALFILE = simulated_home.hal\n", f"HALFILE = simulated_home.hal\nHALFILE = {runner.ROOT}/hal/chipwise.hal\n"
    )
    text = text.replace("HALFILE = axis_manualtoolchange.hal\n", "")
    text = text.replace("DISPLAY = axis", "DISPLAY = " + SCRIPTED) + "\n#INCLUDE chipwise.inc\n"
    text = text.replace("TOOL_TABLE = sim_mm.tbl", "TOOL_TABLE = mill.tbl")
    (folder / "mine.ini").write_text(text)
    subprocess.run(["cp", os.path.join(runner.ROOT, "configs", "mill.tbl"), str(folder)], check=True)
    answers = tmp_path / "answers.json"
    steps = [["home"], ["mdi", "G10 L2 P1 Z-20"], ["mdi", BOX], ["mdi", "M251 Q6 P2 E3000"], STATE]
    env = dict(os.environ, CHIPWISE_STEPS=json.dumps(steps), CHIPWISE_ANSWERS=str(answers))
    env.pop("DISPLAY", None)
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "600", "--", "sh", "-c", f"cd {folder} && exec linuxcnc -r mine.ini"],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert answers.exists(), done.stdout[-3000:]
    found = json.loads(answers.read_text())
    assert found[1:4] == [[], [], []], (found, done.stdout[-2000:])
    assert found[4][2] == "2" and float(found[4][3]) == 6000


def test_a_program_with_g93_is_named_when_it_is_opened(tmp_path):
    """With F remapped LinuxCNC ends it at the tenth F, with a message about nesting that says nothing to an
    operator."""
    program = tmp_path / "inverse.ngc"
    program.write_text("G21\n(G93)\nG93 G1 X1 F60\nM2\n")
    *_, errors, said = operate(
        tmp_path, [["open", str(program)], ["messages", "G93"], ["errors"], ["messages"]], edit=NO_SHADOW
    )
    assert (
        [message for message in said if "inverse.ngc uses G93 (line 3)" in message and "REMAP = F" in message]
        == said
        != []
    )
    assert errors == []
