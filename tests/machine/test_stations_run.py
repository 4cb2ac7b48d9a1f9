# SPDX-License-Identifier: GPL-2.0-or-later
"""M255 in the real LinuxCNC: what is in the file is where the tool was, when it was there; and G75 goes to it."""

import math
import tomllib

import numpy as np
import pytest

from chipwise.blank import points as probed_points
from chipwise.stations.frame import frame_of
from support.operate import operate

pytestmark = pytest.mark.machine

OFFSET, ROTATION, LENGTH, G92 = (31.0, -12.5, 4.0), 25.0, 17.25, (1.5, -2.0, 0.5)
BEFORE = [
    "T1 M6",
    f"G43.1 Z{LENGTH}",
    f"G10 L2 P1 X{OFFSET[0]} Y{OFFSET[1]} Z{OFFSET[2]} R{ROTATION}",
    "G54",
    "G0 X60 Y40 Z30",
    f"G92 X{60 + G92[0]} Y{40 + G92[1]} Z{30 + G92[2]}",
]
POINTS = {1: (40.0, 20.0, 5.0), 2: (90.0, 32.0, 5.0), 3: (35.0, 70.0, 5.0), 4: (80.0, 80.0, 5.04)}


def stations_in(tmp_path):
    return f"s#^STATIONS = .*#STATIONS = {tmp_path}/stations.toml#"


def read(tmp_path):
    """{station: {point: place}} of the file."""
    path = tmp_path / "stations.toml"
    return {
        int(n): {int(q): tuple(p) for q, p in table.items()}
        for n, table in tomllib.loads(path.read_text())["station"].items()
    }


def machine_of(point):
    """Work coordinates -> tip in machine coordinates, by LinuxCNC's own rules: G92, rotation, G54."""
    x, y, z = (value - shift for value, shift in zip(point, G92))
    w = complex(x, y) * complex(math.cos(math.radians(ROTATION)), math.sin(math.radians(ROTATION)))
    return np.array([w.real + OFFSET[0], w.imag + OFFSET[1], z + OFFSET[2]])


def go(point, number, *words):
    return [
        ["mdi", "G0 " + " ".join(f"{a}{v}" for a, v in zip("XYZ", point))],
        ["position"],
        ["mdi", f"M255 P3 Q{number} {' '.join(words)}"],
    ]


def test_points_are_where_the_tool_was(tmp_path):
    """Under G54 with R, G92 and a tool length; then a program runs the station in the same and in other offsets."""
    # the first G92 is reckoned from another place, so it is given where the machine stands
    run = "G21 G90\nF900\no100 sub\nG0 X10 Y5\nG0 Z2\nG1 Z1\nG0 Z9\no100 endsub\nG75 Q100 P3\nM2\n"
    steps = [
        *(["mdi", line] for line in BEFORE),
        *(step for number, point in POINTS.items() for step in go(point, number)),
        ["messages"],
        ["start", run],
        ["finish"],
        ["position"],
        ["mdi", "G92.1"],
        ["mdi", "G10 L2 P1 X0 Y0 Z0 R0"],
        ["start", run],
        ["finish"],
        ["position"],
    ]
    answers = operate(tmp_path, steps, edit=stations_in(tmp_path))
    assert [answer for step, answer in zip(steps, answers) if step[0] in ("mdi", "finish") and answer] == []
    places = [answer for step, answer in zip(steps, answers) if step[0] == "position"]
    taught = read(tmp_path)[3]
    for number, place in zip(POINTS, places):
        tip = np.array(place) - (0, 0, LENGTH)
        assert tip == pytest.approx(machine_of(POINTS[number]), abs=1e-6)  # the test knows LinuxCNC's coordinates
        assert taught[number] == pytest.approx(tip, abs=1e-6)
    messages = [m for m in answers[steps.index(["messages"])] if "M255" in m]
    assert "station 3: point 1 is taught; point 2 and 3 to come" in messages[0] and "point 3 to come" in messages[1]
    assert "station 3: point 3 is taught; tilt 0.000 degrees, a fourth point would check it" in messages[2]
    assert "residual 0.0" in messages[3] and "points that are 0.01 mm off move it by up to" in messages[3]
    made = frame_of(taught)
    end = np.array(made.matrix) @ (10.0, 5.0, 9.0) + made.origin
    for place in places[-2:]:
        assert np.array(place) - (0, 0, LENGTH) == pytest.approx(end, abs=2e-4)  # a tilt of 0.03 degrees is followed


def test_what_is_not_taught(tmp_path):
    """An abort before the machine is there, a line that run from line skips, a geometry that is refused, a probe that
    has found nothing."""
    wait = "G21 G90 F600\nG0 X20 Y20 Z10\nM66 E0 L0\nM0\nM255 P5 Q1\nM2\n"
    skipped = "G21 G90 F600\nG0 X20 Y20 Z10\nM255 P6 Q1\nG0 X30\nM255 P6 Q2\nM2\n"
    steps = [
        ["mdi", "T1 M6"],
        ["start", wait],
        ["until", "motion.motion-type", ">", 0.5],
        ["sleep", 3],
        ["abort"],
        ["open text", skipped],
        ["run_from", 4],
        ["finish"],
        ["messages"],
        *go((10, 10, 5), 1),
        *go((60, 10, 5), 2),
        ["mdi", "G0 X120 Y12"],
        ["mdi", "M255 P3 Q3"],
        ["mdi", "M255 P3 Q3 H1"],
        *go((10, 60, 5), 3),
    ]
    answers = operate(tmp_path, steps, edit=stations_in(tmp_path))
    found = read(tmp_path)
    assert 5 not in found and found[6] == {2: pytest.approx((30, 20, 10))}
    assert [m for m in answers[8] if "M255: run from line skips this line, so the station stays as it is" in m]
    refused = [answer for step, answer in zip(steps, answers) if step[:1] == ["mdi"] and answer]
    assert "chipwise: M255: point 3 is 1.0 degrees from the line through points 1 and 2, less than 5" in refused[0][0]
    assert "chipwise: M255: H1, but no G38 has found anything; probe first" in refused[1][0] and len(refused) == 2
    assert found[3] == {1: pytest.approx((10, 10, 5)), 2: pytest.approx((60, 10, 5)), 3: pytest.approx((10, 60, 5))}


# nc_files/probe_grid.ngc in inch, under G92 and a rotated work offset: a switch that closes where Z is below -2 mm of
# the machine
GRID_OFFSET, GRID_G92, GRID_Z = (1.0, 0.5, 0.2), (-0.1, 0.1, -0.02), -2.0
PROBE_GRID = [
    ["hal", "loadrt", "comp"],
    ["hal", "addf", "comp.0", "servo-thread"],
    ["hal", "net", "chipwise-pos-z", "comp.0.in0"],
    ["hal", "setp", "comp.0.in1", f"{GRID_Z}"],
    ["hal", "net", "touched", "comp.0.out", "motion.probe-input"],
    ["mdi", f"G10 L2 P1 X{GRID_OFFSET[0]} Y{GRID_OFFSET[1]} Z{GRID_OFFSET[2]} R{ROTATION}"],
    ["mdi", "G54"],
    ["mdi", "G0 X2 Y1 Z1"],
    ["mdi", "G92 X2.1 Y0.9 Z1.02"],
    ["mdi", "o<probe_grid> call [0.5] [0.2] [1.5] [1.0] [3] [2] [0.5] [-0.6] [40]"],
    ["messages"],
]


# A sub as buttons of probing screens call it from MDI: F beside what the interpreter waits for.
TOUCH = (
    "o<touch> sub\nG21 G91\nG38.3 X2 F100\nF200 G38.3 Y-3\nM66 P0 L0 F250\nG1 X-1 F300 S500\nG90 G20\n"
    "o<touch> endsub\nM2\n"
)
TOUCHED = [["position"], ["mdi", "o<touch> call"], ["position"], ["mdi", "G1 Z0.9 F20"], ["errors"]]


def assert_probed(tmp_path, answers):
    """The log has the six points, in the order they were touched, and where they are in the machine."""
    assert answers[-1] and "the points are in chipwise_probe.txt" in answers[-1][-1], answers
    touched = probed_points.read(str(tmp_path / "chipwise_probe.txt"), None, 1.0)
    flat = [
        complex(x + GRID_G92[0], y + GRID_G92[1]) * np.exp(1j * math.radians(ROTATION)) + complex(*GRID_OFFSET[:2])
        for x, y in ((0.5, 0.2), (1.0, 0.2), (1.5, 0.2), (1.5, 1.0), (1.0, 1.0), (0.5, 1.0))
    ]
    assert touched.place.machine(touched.points)[:, :2] / 25.4 == pytest.approx(
        np.array([[v.real, v.imag] for v in flat]), abs=1e-4
    )
    assert touched.place.machine(touched.points)[:, 2] == pytest.approx(GRID_Z, abs=0.3)


def test_a_probed_point_and_a_new_origin(tmp_path):
    """H1 takes where the probe has touched, not where the tool is now.  Q1 begins a station anew.  In inch.  Then MDI
    calls a sub with F beside G38, at which the task crashed, and a grid is probed."""
    (tmp_path / "touch.ngc").write_text(TOUCH)
    steps = [
        ["mdi", "T1 M6"],
        *go((10, 10, 5), 1),
        *go((60, 10, 5), 2),
        ["mdi", "G20"],
        ["mdi", "G0 X2 Y2 Z0.52"],
        ["mdi quietly", "G38.3 Z-1 F1"],
        ["until", "axis.z.pos-cmd", "<", 12.7],
        ["hal", "setp", "motion.probe-input", "1"],
        ["mdi_end"],
        ["hal", "setp", "motion.probe-input", "0"],
        ["pins", "motion.probe-input"],
        ["mdi", "G0 Z1"],
        ["mdi", "M255 P3 Q1 H1"],
        ["messages"],
    ]
    edit = stations_in(tmp_path) + f"' -e 's#^SUBROUTINE_PATH = #&{tmp_path}:#"
    answers = operate(
        tmp_path, [*steps, *TOUCHED, *PROBE_GRID], edit=edit, before=f"ln -sf {tmp_path}/chipwise_probe.txt ."
    )
    before, called, after, moved, errors = answers[len(steps) : len(steps) + len(TOUCHED)]
    assert called == moved == errors == [] and np.subtract(after, before) == pytest.approx((1, -3, 0), abs=1e-6)
    assert_probed(tmp_path, answers[len(steps) + len(TOUCHED) :])
    answers = answers[: len(steps)]
    points = read(tmp_path)[3]
    assert list(points) == [1] and points[1][:2] == pytest.approx((50.8, 50.8), abs=1e-6)
    assert 0 < points[1][2] <= 12.7 and points[1][2] == pytest.approx(12.7, abs=3.0), points
    assert "point 2 and 3 to come" in answers[-1][-1]
