# SPDX-License-Identifier: GPL-2.0-or-later
"""Stop while a cycle is planned or handed over: abort and E-stop are served at any moment, and what long plans still
do.

The machine runs at 50 mm/s when the cycles are read.  Times are without those for which other programs, or other
guests of the same computer, had the processors.
"""

import math

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

SERVED_S = 0.3

# LinuxCNC's process for E-stop looks for commands ten times a second, which is up to 0.2 s of an E-stop's time.
IO_LOOKS = r"/^\[EMCIO\]/,/^\[HAL\]/s/^CYCLE_TIME = .*/CYCLE_TIME = 0.01/"


def square(side):
    return f"o100 sub\nG0 X0 Y0\nG1 X{side}\nG1 Y{side}\nG1 X0\nG1 Y0\no100 endsub"


def comb(teeth):
    """A closed contour of four lines a tooth."""
    points = [(0, 0), (teeth, 0)]
    for k in range(teeth - 1, -1, -1):
        points += [(k + 1, 20), (k + 0.5, 20), (k + 0.5, 40), (k, 40)]
    lines = [f"G1 X{x:g} Y{y:g}" for x, y in points[1:] + points[:1]]
    return "\n".join(["o100 sub", "G0 X0 Y0", *lines, "o100 endsub"])


def zigzag(moves):
    """A sub of so many moves that ends above its cuts."""
    lines = [f"G1 X{k % 2 * 3 + 1} Y{k * 0.1:g}" for k in range(moves - 3)]
    return "\n".join(["o100 sub", "G0 X0 Y0", "G1 Z-1", *lines, "G0 Z5", "o100 endsub"])


# name: (cycle, settings before it, sub); no budget but PLAN_TIME ends these
LONG = {
    "hole": ("G13 I2000 Z-10 J1", "#<_chipwise_chop_size>=6.1", ""),
    "hole, moves": ("G12 I6 K100 Q0.4 Z-10 J0.01", "", ""),
    "slug": ("G78 Q100 P41 Z-10", "#<_chipwise_chop_size>=10", square(100000)),
    "radial passes": ("G77 Q100 P41 L50 D0.1 Z-10 J0.0101", "", square(60)),
    "comb": ("G79 Q100 Z-10 P0", "", comb(3000)),
    "constant engagement": ("G79 Q100 Z-10 P4 D0.3", "", square(300)),
    "pattern": ("G75 Q100 L990 I0.1", "", zigzag(500)),
    "pattern of a large sub": ("G75 Q100 L98 I0.1", "", zigzag(5000)),
    "endless sub": ("G77 Q100 P41 Z-10", "", "o100 sub\nG0 X0 Y0\no1 while [1]\no1 endwhile\no100 endsub"),
}

# name: (cycle, settings, sub, words of the message)
REFUSED = {
    "chop size": ("G13 I100 Z-10 J0.01", "#<_chipwise_chop_size>=0.001", "", "chop size 0.001 mm is below 0.1 mm; set"),
    "moves": (
        "G13 I6 K100 Q0.11 Z-10 J0.01",
        "",
        "",
        "this takes 1715000 moves, more than 500000; use a larger J or Q",
    ),
    "ramp angle": (
        "G79 Q100 Z-10",
        "#<_chipwise_ramp_angle>=0.00001",
        square(60),
        "is not from 0.1 to 90 degrees; set",
    ),
    "approach angle": (
        "G78 Q100 P41 K2 Z-10",
        "#<_chipwise_approach_angle>=0.0001",
        square(60),
        "is not from 0.1 to 90 degrees; set",
    ),
    "approach height": ("G78 Q100 P41 K123456789012345 Z-10", "", square(60), "more than 1000 mm; use a smaller K"),
}


def program(cycle, settings="", sub=""):
    """The machine moves at 50 mm/s for 6 s; the cycle is read at once."""
    return f"""G21 G90 G17 G64 P0.01 T1 M6 F3000
#<_chipwise_chop_size>=0
#<_chipwise_ramp_angle>=3
#<_chipwise_approach_angle>=30
{settings}
G0 X0 Y0 Z5
G1 X300
{cycle} R0 F600
{sub}
M2
"""


def write(tmp_path, name, text):
    path = tmp_path / (name.replace(" ", "_").replace(",", "") + ".ngc")
    path.write_text(text)
    return str(path)


def stopped(tmp_path, path, moments):
    """-> what was found at each moment; a planner for the task and one for the preview are left at most."""
    steps = [["stop", how, after] for how, after in moments]
    answers = operate(tmp_path, [["open", path], *steps, ["planners until", "<", 2]], edit=IO_LOOKS, speed=1)
    *stops, planners = answers[1:]
    assert planners <= 2, planners
    return stops


@pytest.mark.parametrize("name", sorted(LONG))
def test_stop_is_served(tmp_path, name):
    """Abort and E-stop, early and late in the plan and while its moves are handed over.

    A disk can keep LinuxCNC waiting, which no count of processors shows.  So a moment at which a stop came late is
    tried once more, in a machine started anew: what chipwise does at that moment, it does again."""
    path = write(tmp_path, name, program(*LONG[name]))
    moments = [("abort", 0.4), ("estop", 1.0), ("abort", 2.5), ("estop", 7.0), ("abort", 9.0)]
    stops = stopped(tmp_path, path, moments)
    assert any(stop["busy"] for stop in stops), stops
    late = [moment for moment, stop in zip(moments, stops) if stop["served"] >= SERVED_S]
    if late:
        print("late, and tried again:", late, stops)
        for moment, stop in zip(late, stopped(tmp_path, path, late)):
            assert stop["served"] < SERVED_S, (name, moment, stop)


def test_refused_with_the_remedy(tmp_path):
    """What can only be a slip of the finger: one message with the remedy, no move of the cycle."""
    steps = []
    for name, (cycle, settings, sub, _words) in REFUSED.items():
        steps += [["start", program(cycle, settings, sub)], ["finish"], ["position"]]
    answers = operate(tmp_path, steps)
    for name, said, position in zip(REFUSED, answers[1::3], answers[2::3]):
        assert len(said) == 1 and REFUSED[name][3] in said[0], (name, said)
        assert position[1] == pytest.approx(0, abs=1e-6), name


def test_a_long_plan_is_done_and_is_the_same(tmp_path):
    """Cycles that wait for their plan, in the program, in a sub in a loop and in MDI: every hole is cut where it
    belongs."""
    holes = "o200 sub\nG13 I20 Z-2 R1 F6000\nG0 X[#5420 + 45]\no200 endsub\n"
    text = (
        "G21 G90 G17 G64 P0.01 T1 M6 F3000\nM250 P0 Q0 R-10 I200 J60 K10\nG0 X25 Y30 Z5\n#<_chipwise_chop_size>=6.3\n"
        + holes
        + "o201 repeat [3]\no200 call\no201 endrepeat\nM2\n"
    )
    answers = operate(
        tmp_path,
        [
            ["start", text],
            ["finish"],
            ["pins", "stock-tracker.0.removed-volume"],
            ["position"],
            ["mdi", "G0 X170 Y30 Z5"],
            ["mdi", "F500 G12 I5 Z-2 R1"],
            ["position"],
            ["pins", "stock-tracker.0.removed-volume"],
            ["mdi", "G91"],
            ["mdi", "G0 X1"],
            ["position"],
        ],
    )
    assert answers[1] == [] and answers[4] == [] and answers[5] == []
    assert answers[3][:2] == pytest.approx([160, 30], abs=1e-6)
    assert answers[6] == pytest.approx([170, 30, 1], abs=1e-6)
    assert answers[10] == pytest.approx([171, 30, 1], abs=1e-6)
    cut = float(answers[7][0]) - float(answers[2][0])
    assert cut == pytest.approx(math.pi * 25 * 2, rel=0.03)


def test_planner_ends_with_the_task(tmp_path):
    """LinuxCNC ended, or killed, in the middle of a plan: no process is left."""
    path = write(tmp_path, "slug", program(*LONG["slug"]))
    answers = operate(
        tmp_path,
        [["open", path], ["begin"], ["planners until", ">", 0], ["kill", "milltask"], ["planners until", "=", 0]],
        speed=1,
    )
    assert answers[2] >= 1
    assert answers[4] == 0
