# SPDX-License-Identifier: GPL-2.0-or-later
"""Whatever interrupts the volumetric feed: the feed is the programmed one or the override 1, and no cut is lost.

A slot of 60 mm, 6 mm wide (T1) and 2 mm deep: 720 mm3, 12 mm2, at 6 cm3/min 8.33 mm/s, F 500 = 8.33 mm/s, E 50 mm/s.
"""

import math

import pytest

from support.operate import BOX, Shared, operate
from support.slot import (
    BEGIN,
    BY,
    DEPTH,
    FEED,
    OVERRIDE_IGNORED,
    RADIUS,
    SLOT_VEL,
    TYPE,
    VELOCITY,
    VOLUME,
    WHOLE,
    values,
)

pytestmark = pytest.mark.machine

CEILING_VEL, F_VEL = 50.0, 5.0  # mm/s
SLOT = BEGIN + "G0 X-10 Y20 Z5\nG0 Z-2\nG1 X70\nG0 Z5\nM252\nM2\n"
SLOW = SLOT.replace("Q6", "Q1.5")  # a busy computer interrupts it before its end, too
MODE = "volumetric-feed.0.mode"
X = "axis.x.pos-cmd"
MILL = Shared("unknown")
STEPS = Shared(
    "unknown steps"
)  # of its own: after the last step LinuxCNC 2.9 may pause the first move that comes, also one of MDI


def cut_to(x):
    """mm3 of the slot cut with the axis of the tool at x > 3 mm."""
    return DEPTH * (2 * RADIUS * x + math.pi * RADIUS**2 / 2)


@pytest.mark.scene(
    MILL,
    [
        ["start", SLOW],
        ["until", VOLUME, ">", 200],
        ["pause"],
        ["pins", VOLUME],
        ["over", 0.5, FEED, VELOCITY, OVERRIDE_IGNORED],
        ["pins", VOLUME, BY],
        ["resume"],
        ["until", VOLUME, ">", 700],
        ["finish"],
        ["pins", VOLUME, FEED, OVERRIDE_IGNORED],
    ],
)
def test_pause_and_resume(answers):
    """Paused in the cut: at rest, nothing cut, the override a sound number; then on to the whole slot."""
    _start, _until, _pause, before, over, after, _resume, going, end, last = answers
    feed, velocity, ignored = over
    assert 0 < feed[0] and feed[1] <= 1 and velocity[1] == 0 and ignored[1] == 0
    assert values(after)[0] == values(before)[0] and 200 < values(before)[0] < 700 < going
    assert end == []
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 1.0, 0.0]


@pytest.mark.scene(
    STEPS,
    [
        ["start", SLOW],
        ["until", VOLUME, ">", 200],
        ["pause"],
        ["step to end"],
        ["finish"],
        ["pins", VOLUME, OVERRIDE_IGNORED, FEED],
    ],
)
def test_single_steps(answers):
    """From the middle of the cut to the end line by line: the same volume, no message."""
    _start, _until, _pause, steps, errors, last = answers
    assert steps is not None and steps >= 3
    assert errors == []
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0, 1.0]


# Without Q: two edges, 3000 1/min and the default chip of 0.05 mm of a tool of 6 mm in aluminium; then the
# spindle stands
CHIP_VEL, ALONE_F = 2 * 50 * 0.05, 10.0  # mm/s
ALONE = (
    "(MATERIAL,NAME=6061)\n"
    + BEGIN.replace("Q6 ", "").replace("F300\nS10000", "F600\nS3000")
    + "G0 X-10 Y20 Z5\nG0 Z-2\nG1 X40\nM5\nG1 X70\nG0 Z5\nM252\nM2\n"
)
TARGETS = "volumetric-feed.0.mode", "volumetric-feed.0.mrr-target", "volumetric-feed.0.mrr-effective"


@pytest.mark.scene(
    MILL,
    [
        ["start", ALONE],
        ["until", VOLUME, ">", 200],
        ["until", BY, ">", 5.5],
        ["over", 0.5, VELOCITY, BY, *TARGETS],
        ["until", X, ">", 45],
        ["until", VELOCITY, ">", 0.99 * ALONE_F],
        ["over", 0.5, VELOCITY, BY],
        ["finish"],
        ["pins", VOLUME],
    ],
)
def test_without_a_rate(answers):
    """M251 P2 without Q: the chip is kept, and beside it the tool's own rate counts; F as soon as the
    spindle stands."""
    _start, _met, by, (velocity, limit, *targets), _on, _fast, (standing, fallback), errors, last = answers
    assert by == 6 and limit == [6, 6] and velocity == [pytest.approx(CHIP_VEL, rel=0.02)] * 2
    assert targets == [[2, 2], [0, 0], [12000, 12000]]
    assert fallback == [5, 5] and standing == [pytest.approx(ALONE_F, rel=0.001)] * 2
    assert not errors and values(last) == [pytest.approx(WHOLE, rel=0.003)]


@pytest.mark.scene(
    MILL,
    [
        ["start", SLOW],
        ["until", VOLUME, ">", 200],
        ["pause"],
        ["reverse"],
        ["resume"],
        ["sleep", 0.3],
        ["reverse"],
        ["over", 1.0, FEED, OVERRIDE_IGNORED],
        ["finish"],
        ["pins", VOLUME, OVERRIDE_IGNORED],
    ],
)
def test_reverse_run(answers):
    """Reverse pressed while paused and in the cut: LinuxCNC 2.9 runs forward again as long as the adaptive feed is
    positive (motion/control.c); the override stays 0..1, nothing is lost."""
    *_, over, errors, last = answers
    assert 0 < over[0][0] <= over[0][1] <= 1 and over[1][1] == 0
    assert errors == []
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0]


@pytest.mark.scene(
    MILL,
    [
        ["start", SLOW],
        ["until", VOLUME, ">", 100],
        ["abort"],
        ["sleep", 0.5],
        ["pins", VOLUME, FEED, "stock-tracker.0.ready", "volumetric-feed.0.mode", OVERRIDE_IGNORED],
        ["position"],
        ["mdi", "G1 X70 F300"],
        ["mdi", "M252"],
        ["pins", VOLUME, FEED],
    ],
)
def test_abort_in_the_cut_and_go_on(answers):
    """After the abort the map holds what the tool has cut, to its round front, and M251 has ended; the rest by MDI."""
    *_, abort, state, position, on, rest, last = answers
    volume, feed, ready, mode, ignored = values(state)
    assert (feed, ready, mode, ignored) == (1.0, 1.0, 0.0, 0.0)
    assert volume == pytest.approx(cut_to(position[0]), rel=0.004) and volume < 700  # so the front is in the stock
    assert (abort, on, rest) == (None, [], [])
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 1.0]


@pytest.mark.scene(
    MILL,
    [
        ["start", SLOW],
        ["until", VOLUME, ">", 100],
        ["off"],
        ["pins", VOLUME, FEED],
        ["position"],
        ["on"],
        ["mdi", "G1 X70 F300"],
        ["pins", VOLUME],
    ],
)
def test_machine_off_in_the_cut(answers):
    """Abort and machine off and on again, as E-stop does; the stock stays true."""
    *_, state, position, _on, _mdi, last = answers
    assert values(state) == [pytest.approx(cut_to(position[0]), rel=0.004), 1.0]
    assert values(last) == [pytest.approx(WHOLE, rel=0.003)]


@pytest.mark.scene(
    MILL,
    [
        ["start", SLOT.replace("G1 X70\n", "G1 X70\nG0 Z20\nG0 X30\nF300\nG38.2 X250\nG0 X70\n")],
        ["until", TYPE, ">", 4.5],
        ["over", 1.0, FEED, VELOCITY, OVERRIDE_IGNORED, "motion.requested-vel"],
        ["hal", "setp", "motion.probe-input", "1"],
        ["finish"],
        ["pins", VOLUME, OVERRIDE_IGNORED],
        ["hal", "setp", "motion.probe-input", "0"],
    ],
)
def test_probing_goes_at_the_programmed_feed(answers):
    """G38.2 with F replaced by the ceiling: adaptive-feed 1, the probe at F and not at E, the slot whole afterwards.
    The probe's path is long: a busy computer trips it late."""
    _start, _type, over, _trip, end, last, _free = answers
    feed, velocity, ignored, requested = over
    assert feed == [1.0, 1.0] and ignored[1] == 0
    assert requested[1] == pytest.approx(CEILING_VEL)  # that is what LinuxCNC got
    assert velocity[1] == pytest.approx(F_VEL, rel=1e-3)  # and that is what it did
    assert end == []
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0]


def fallback(missing):
    """Steps: a feed move without tool or stock, and then all is well again."""
    away, back = {
        "tool": (["mdi", "T0 M6"], []),
        "stock": (
            ["hal", "setp", "stock-tracker.0.units-per-mm", "0"],
            [["hal", "setp", "stock-tracker.0.units-per-mm", "1"]],
        ),
    }[missing]
    return [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        ["mdi", "M251 Q6 P2 E3000"],
        ["mdi", "F300"],
        ["mdi", "G0 X-10 Y20 Z30"],
        away,
        ["mdi quietly", "G1 X70"],
        ["until", TYPE, ">", 1.5],
        ["sleep", 0.3],
        ["over", 1.0, FEED, BY, VELOCITY, OVERRIDE_IGNORED],
        ["finish"],
        *back,
    ]


@pytest.mark.parametrize("missing", ["tool", "stock"])
@pytest.mark.scene(MILL, fallback)
def test_without_tool_or_stock(answers, missing):
    """F as programmed, limited-by 5, said once."""
    over, end = answers[9:11]
    feed, by, velocity, ignored = over
    assert by == [5, 5] and ignored == [0, 0]
    assert feed == pytest.approx([F_VEL / CEILING_VEL] * 2, rel=1e-6)
    assert velocity == pytest.approx([F_VEL] * 2, rel=1e-3)
    assert len(end) == 1 and end[0].startswith("chipwise: ")


BOTH_MODES = SLOT, SLOT.replace("P2 E3000", "P1").replace("F300", "F1500")


@pytest.mark.parametrize("override", [0.5, 1.5])
@pytest.mark.scene(
    MILL,
    lambda override: [
        step
        for start in BOTH_MODES
        for step in (
            ["mdi", BOX],
            ["feed override", override],
            ["start", start],
            ["until", VOLUME, ">", 200],
            ["over", 0.5, VELOCITY, OVERRIDE_IGNORED, FEED, BY, MODE],
            ["finish"],
            ["pins", VOLUME, OVERRIDE_IGNORED],
        )
    ],
)
def test_feed_override_of_the_operator(answers, override):
    """Modes 1 and 2 at 50 % and 150 %: the velocity follows, no override counts as ignored."""
    for over, end, last in (answers[4:7], answers[11:14]):
        assert over[0] == pytest.approx([override * SLOT_VEL] * 2, rel=0.03) and over[1][1] == 0, (
            over
        )  # with what the feed was limited by
        assert end == []
        assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0]


@pytest.mark.parametrize(
    "before, told",
    [
        ("M52 P0\n", True),  # the monitor reads it
        ("M49\nM52 P0\n", True),  # feed-inhibit is ignored: the abort stops it
        ("M52 P0\n", False),
    ],
)  # without the monitor: the velocity in realtime
def test_m52_p0_is_stopped(tmp_path, before, told):
    """Adaptive feed disabled at the ceiling: the machine stops within millimetres, with a message."""
    program = SLOT.replace("G1 X70\n", f"G1 X20\n{before}G1 X70\n").replace("F300", "F120")
    blind = (
        []
        if told
        else [
            ["hal", "unlinkp", "volumetric-feed.0.adaptive-off"],
            ["hal", "unlinkp", "chipwise-monitor.override-ignored"],
        ]
    )
    # the pin falls when the monitor has aborted the program, sooner than a busy machine looks: a flip-flop keeps it
    latch = [
        ["hal", "loadrt", "flipflop", "names=seen"],
        ["hal", "addf", "seen", "servo-thread"],
        ["hal", "setp", "seen.data", "1"],
        ["hal", "net", "chipwise-override-ignored", "seen.clk"],
    ]
    blind = latch + blind
    steps = [
        *blind,
        ["start", program],
        ["until", "axis.x.pos-cmd", ">", 19.999],
        ["until", "seen.out", ">", 0.5],
        ["over", 1.5, "axis.x.pos-cmd"],
        ["over", 0.2, VELOCITY],
        ["abort"],
        ["pins", OVERRIDE_IGNORED],
        ["finish"],
        ["mdi", "M252"],
        ["pins", "volumetric-feed.0.mode"],
    ]
    answers = operate(tmp_path, steps)[len(blind) :]
    (_low, furthest), at_rest, _abort, let_go, said = answers[3][0], answers[4], answers[5], answers[6], answers[7]
    print(f"stopped {furthest - 20:.3f} mm behind M52 P0")
    assert furthest - 20 < 2.0
    assert at_rest == [[0.0, 0.0]] and values(let_go) == [0.0]
    assert [m for m in said if "M252 before M52 P0" in m and m.startswith("chipwise: ")] == said
    assert len(said) == told
    assert values(answers[-1]) == [0.0]


WINDOW = SLOT.replace("P2 E3000", "P3 R1").replace("F300", "F{}")


@pytest.mark.scene(
    MILL,
    [
        step
        for feed in (300, 900)
        for step in (
            ["mdi", BOX],
            ["start", WINDOW.format(feed)],
            ["until", VOLUME, ">", 200],
            ["over", 0.5, VELOCITY, "motion.requested-vel"],
            ["finish"],
            ["pins", VOLUME, OVERRIDE_IGNORED],
        )
    ],
)
def test_window_without_a_ceiling(answers):
    """M251 P3 without E: F is the upper limit; if the rate at F is in the window F stays, above it Q counts."""
    for feed, expected, (over, end, last) in ((300, 5.0, answers[3:6]), (900, SLOT_VEL, answers[9:12])):
        assert over[0] == pytest.approx([expected] * 2, rel=0.03)
        assert over[1] == pytest.approx([feed / 60] * 2)
        assert end == []
        assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0]


def test_the_tool_of_the_moment_counts(tmp_path):
    """max_rate of the geometry file, taken on tool change: T2 (3 mm) stands 1.2 cm3/min of the 6 of M251."""
    geometry = tmp_path / "tools.toml"
    geometry.write_text("[tool.2]\nmax_rate = 1.2\n")
    program = BEGIN + ("G0 X-10 Y20 Z5\nG0 Z-2\nG1 X20\nG0 Z5\nT2 M6\nG0 X-10 Y30\nG0 Z-2\nG1 X70\nG0 Z5\nM252\nM2\n")
    *_, first, _next, second, end = operate(
        tmp_path,
        [
            ["start", program],
            ["until", VOLUME, ">", 100],
            ["over", 0.3, VELOCITY, "volumetric-feed.0.mrr-effective"],
            ["until", VOLUME, ">", 320],
            ["over", 0.3, VELOCITY, "volumetric-feed.0.mrr-effective"],
            ["finish"],
        ],
        edit=f"s#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {geometry}#",
    )
    assert first[0] == pytest.approx([SLOT_VEL] * 2, rel=0.03) and first[1] == [6000, 6000]
    assert second[0] == pytest.approx([1200 / 60 / 6.0] * 2, rel=0.03) and second[1] == [1200, 1200]
    assert end == []


@pytest.mark.scene(
    MILL,
    [
        [
            "start",
            BEGIN.replace("F300", "F240")
            + ("G0 X-10 Y20 Z20\nG1 X0\nT2 M6\nG1 X250\nG1 X20\nG13 X30 Y20 I5 Z18\nM252\nG1 X60\nM2\n"),
        ],
        ["until", "axis.x.pos-cmd", "<", -1.0],
        ["until", "axis.x.pos-cmd", ">", 1.0],
        ["over", 0.1, "volumetric-feed.0.programmed-vel", "motion.requested-vel"],
        ["until", TYPE, ">", 2.5],
        ["over", 0.1, "volumetric-feed.0.programmed-vel"],
        ["until", "volumetric-feed.0.mode", "<", 0.5],
        ["until", "motion.requested-vel", ">", 0.1],
        ["over", 0.5, "motion.requested-vel"],
        ["finish"],
    ],
)
def test_f_outlives_a_tool_change(answers):
    """After M6 the interpreter takes the ceiling for its F; a cycle and M252 go by what the program said."""
    _start, _left, _x, replaced, _arc, cycle, _mode, _moves, back, end = answers
    assert replaced == [pytest.approx([4.0, 4.0]), pytest.approx([CEILING_VEL] * 2)]
    assert cycle[0] == pytest.approx([4.0, 4.0])
    assert back[0] == pytest.approx([4.0, 4.0])
    assert end == []


@pytest.mark.scene(
    MILL,
    [
        ["feed override", 0.2],
        ["start", SLOT.replace("M251 Q6 P2 E3000\n", "").replace("F300", "F600")],
        ["until", VOLUME, ">", 250],
        ["pause"],
        ["feed override", 1],
        ["pins", VOLUME],
        ["reverse"],
        ["resume"],
        ["until", "axis.x.pos-cmd", "<", 15],
        ["pins", VOLUME, FEED, OVERRIDE_IGNORED, "stock-tracker.0.rapid-contact"],
        ["pause"],
        ["forward"],
        ["resume"],
        ["finish"],
        ["pins", VOLUME, OVERRIDE_IGNORED, "stock-tracker.0.fault-code"],
    ],
)
def test_reverse_run_without_adaptive_feed(answers):
    """No M251: LinuxCNC really goes back along its path, and forward again; going back cuts nothing, nothing is
    lost."""
    _slow, _start, _until, _pause, _fast, there, _reverse, _resume, _back, turned, *_, errors, last = answers
    assert 250 < values(there)[0] < 700
    assert values(turned) == [pytest.approx(values(there)[0], rel=1e-6), 1.0, 0.0, 0.0]
    assert errors == []
    assert values(last) == [pytest.approx(WHOLE, rel=0.003), 0.0, 0.0]
