# SPDX-License-Identifier: GPL-2.0-or-later
"""What a program leaves behind: nothing.  Feed and stock of the one before do not change the next; settings:
test_own_settings.py."""

import pytest

from support.operate import BOX, NO_SHADOW, Shared, operate

pytestmark = pytest.mark.machine

CARRIED, SEEN = (
    "chipwise-command.0.feed-carried",
    "chipwise-command.0.program-running",
)  # a late monitor has to have seen the program before, and its end
MODE, VELOCITY, ASKED, PROGRAMMED = (
    "volumetric-feed.0.mode",
    "motion.current-vel",
    "motion.requested-vel",
    "motion.analog-out-02",
)
LEFT_ON = f"G21 G90 G64 P0.01\nT1 M6\n{BOX}\nM251 P2 Q20 E3000\nF900\nG0 X-5 Y80 Z10\n"
VOLUME = "stock-tracker.0.removed-volume"
MILL = Shared("after program")
PLAIN = "G21 G90\nF300\nG0 X0 Y80 Z10\nG1 X40\nM2\n"  # 80 mm: outside of the old stock


def feeds(velocity=5.0):
    """Steps: a feed move has got to its velocity; what it does then."""
    return [
        ["until", "motion.motion-type", ">", 1.5],
        ["until", VELOCITY, ">", 0.99 * velocity],
        ["over", 0.5, VELOCITY, ASKED],
    ]


def check_plain(over, velocity=5.0):
    """The machine goes at F: neither faster, nor slower."""
    (low, high), (_asked_low, asked_high) = over
    assert high <= velocity * 1.001 and low >= velocity * 0.5, (
        f"{low:.3f} to {high:.3f} mm/s, allowed: up to {velocity:g}"
    )
    assert high == pytest.approx(velocity, rel=1e-3)


# As in a long program the M2 has not been read when it is aborted; a busy computer is not too late.
WORK = "G1 X60\nG1 X0\n" * 15 + "M66 E0 L0\nM2\n"
# It feeds: an abort in the traverse before would leave F as LinuxCNC makes it then, 0.
CUTS = [["until", "motion.motion-type", ">", 1.5], ["until", VELOCITY, ">", 5]]
ENDS = {  # of the program with M251: (its last lines, steps after its start)
    "M2": ("G1 X0\nM2\n", [["finish"]]),
    "M30": ("G1 X0\nM30\n", [["finish"]]),
    "percent": ("G1 X0\n%\n", [["finish"]]),
    "abort": (WORK, [*CUTS, ["abort"]]),
    "abort in a pause": (WORK, [*CUTS, ["pause"], ["abort"]]),
    "abort at M0": ("G1 X0\nM0\n" + WORK, [*CUTS, ["until", VELOCITY, "<", 0.001], ["abort"]]),
    "E-stop": (WORK, [*CUTS, ["estop"], ["home"]]),
    "off": (WORK, [*CUTS, ["off"], ["on"]]),
    "error": ("G1 X0\nG1 Y[1/0]\nM2\n", [["finish"]]),
    "in a sub": ("o1 sub\nG1 X0\nM2\no1 endsub\no1 call\n", [["finish"]]),
}


def ended(end):
    """Steps: the program with M251 and its end; then the next program, the same again, and a line of MDI."""
    lines, steps = ENDS[end]
    plain = [["start", PLAIN], *feeds(), ["finish"], ["pins", MODE, PROGRAMMED]]
    return [
        ["start", ("%\n" if end == "percent" else "") + LEFT_ON + lines],
        *steps,
        *plain,
        *plain,
        ["mdi quietly", "G1 X0 F300"],
        *plain[1:],
    ]


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.scene(MILL, ended)
def test_m251_ends_with_its_program(answers, end):
    """Whatever has ended the program: the next, which knows nothing of us, runs at its F from its first move on; the
    mode is 0, LinuxCNC's own feed is F again, and so it is in the run after that, and in MDI."""
    _lines, steps = ENDS[end]
    after = answers[1 + len(steps) :]
    for what, (_start, _type, _fast, over, errors, pins) in zip(
        ("next", "again", "MDI"), (after[:6], after[6:12], after[12:])
    ):
        print(end, what, over)
        check_plain(over)
        assert over[1][1] == pytest.approx(5.0), what  # and LinuxCNC gets the feed of the program
        assert not [e for e in errors if e.startswith("chipwise")] and pins == ["0", "0"], (what, errors)


def test_the_checker_sees_a_ceiling():
    with pytest.raises(AssertionError):
        check_plain([[40.0, 50.0], [50.0, 50.0]])
    with pytest.raises(AssertionError):
        check_plain([[1.0, 1.0], [5.0, 5.0]])


def without_f(end, killed=(), frozen=()):
    """Steps: the program with M251 and its end; then a program without an F.  killed: steps between the two; frozen:
    steps in the second, where the monitor has been stopped since before the end of the first."""
    lines, steps = ENDS[end]
    text = ("%\n" if end == "percent" else "") + LEFT_ON + lines
    freeze = [*CUTS, ["freeze worker"]] if frozen else []
    return [
        ["start", text],
        *freeze,
        *steps,
        *killed,
        ["start", PLAIN.replace("F300\n", "").replace("X40", "X200")],
        *frozen,
        *feeds(15.0),
        ["abort"],
    ]


@pytest.mark.parametrize("end", ["abort", "E-stop", "percent"])
@pytest.mark.scene(MILL, without_f)
def test_a_program_without_f_goes_on_with_it(answers, end):
    """LinuxCNC keeps F over an abort, and no code of ours runs in such a program: it goes at the program's F, 15
    mm/s."""
    check_plain(answers[-2], 15.0)


@pytest.mark.parametrize("end", ["percent", "abort"])
@pytest.mark.scene(MILL, lambda end: without_f(end, frozen=[["sleep", 0.2], ["thaw worker"], ["sleep", 0.3]]))
def test_a_monitor_that_was_late_misses_no_end(answers, end):
    """chipwise-monitor sees neither the end of the program nor the beginning of the next; then it goes on."""
    check_plain(answers[-2], 15.0)


def test_a_program_without_f_and_without_a_monitor(tmp_path):
    """The same with chipwise-monitor dead before it has seen the abort."""
    steps = without_f("abort", [["kill monitor"]])
    steps.insert(steps.index(["abort"]), ["freeze worker"])
    answers = operate(tmp_path, steps)
    assert answers[steps.index(["freeze worker"])] == 1
    check_plain(answers[-2], 15.0)


# --- MDI -------------------------------------------------------------------------------------------------------------

ON = [["mdi", "F900"], ["mdi", "M251 P2 Q20 E3000"], ["mdi", "G0 X0 Y80 Z10"]]


@pytest.mark.scene(
    MILL,
    [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        *ON,
        ["messages"],
        ["jog", 0, 10, 50],
        ["mdi", "G0 X0"],
        ["pins", MODE],
        ["mdi quietly", "G1 X60"],
        ["until", VELOCITY, ">", 45],
        ["finish"],
        ["start", PLAIN],
        *feeds(),
        ["finish"],
        ["pins", MODE, PROGRAMMED],
        ["messages"],
        *ON,
        ["off"],
        ["on"],
        ["pins", MODE],
        ["mdi quietly", "G1 X100"],
        *feeds(15.0),
        ["finish"],
        *ON,
        ["estop"],
        ["home"],
        ["pins", MODE],
        ["mdi quietly", "G1 X100 F300"],
        *feeds(),
        ["finish"],
        ["pins", PROGRAMMED],
    ],
)
def test_mdi_keeps_m251_until_a_program_starts(answers):
    """Over manual mode, jogging and homing it stays; a program that knows nothing of it ends it with a message; so
    do machine off and E-stop, and then F is the feed of the next line, given anew or not."""
    told, mode, plain, pins, said = answers[5], answers[8], answers[15], answers[17], answers[18]
    print(answers)
    assert [m for m in told if "M251 stays on until M252 or until a program starts" in m] and mode == ["2"]
    check_plain(plain)
    assert pins == ["0", "0"] and [m for m in said if "M251 of MDI has ended" in m]
    off = answers[19 + len(ON) :]
    assert off[2] == ["0"]
    check_plain(off[6], 15.0)
    estop = off[8 + len(ON) :]
    assert estop[2] == ["0"]
    check_plain(estop[6])
    assert estop[-1] == ["0"]


AIR = PLAIN.replace("G1 X40\n", "G1 X60\nG1 X0\n" * 15)  # long enough to be looked at while it runs at 50 mm/s
LATE = AIR.replace(
    "F300", "G4 P0.5\nM66 E0 L0\nF300"
)  # the first code of ours is read long after chipwise-monitor has seen the run
OWN_RATE = AIR.replace("G1", "M251 Q9\nG1", 1)


@pytest.mark.scene(
    MILL,
    [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        ["start", LATE],
        ["until", SEEN, ">", 0.5],
        ["abort"],
        ["until", SEEN, "<", 0.5],
        *ON,
        ["begin"],
        ["until", "motion.motion-type", ">", 1.5],
        ["until", VELOCITY, ">", 45],
        ["pins", MODE, PROGRAMMED, CARRIED],
        ["finish"],
        ["pins", MODE, CARRIED],
        ["messages"],
        ["begin"],
        *feeds(),
        ["abort"],
        ["until", SEEN, "<", 0.5],
        ["open_text", OWN_RATE],
        *ON,
        ["begin"],
        *feeds(),
        ["pins", MODE, CARRIED],
        ["abort"],
    ],
)
def test_the_program_that_is_loaded_takes_m251_of_mdi_into_its_next_run(answers):
    """Once, with its ceiling, which is in the place of F from the first F on; the run after that is at F.  M251 of the
    program itself wins."""
    runs, ended, said, again, own = answers[12], answers[14], answers[15], answers[19], answers[-2]
    assert runs == ["2", "5", "TRUE"] and ended == ["0", "FALSE"]
    for text in ("takes M251 into its next run, once", "M251 of MDI is in force in this run"):
        assert any(text in one for one in said), said
    assert not any("has ended" in one for one in said), said
    check_plain(again)
    assert own == ["1", "FALSE"]
    check_plain(answers[-3])


# --- run from line -----------------------------------------------------------------------------------------------

SLOTS = f"""G21 G90 G17 G40 G64 P0.01
T1 M6
{BOX}
M251 P2 Q6 E3000
F300
S10000 M3
G0 X-10 Y10 Z5
G0 Z-2
G1 X70
G0 Z5
G0 X-10 Y30
G0 Z-2
G1 X70 F300
G0 Z5
M252
M2
"""
FIRST, SECOND = 9, 11  # lines: the first cut, the path to the second one
SLOT = 60 * 6 * 2  # mm3


def run_from(text, line):
    return [["open text", text], ["run_from", line], ["finish"]]


@pytest.mark.scene(
    MILL,
    [
        *run_from(SLOTS, 0),
        ["pins", VOLUME],
        *run_from(SLOTS, SECOND),
        ["pins", VOLUME, MODE, PROGRAMMED],
        ["messages"],
        *run_from(SLOTS, 3),
        ["pins", VOLUME],
        ["mdi", BOX],
        ["open text", SLOTS],
        ["run_from", SECOND],
        ["until", VOLUME, ">", 200],
        ["over", 0.5, VELOCITY, ASKED],
        ["finish"],
        ["pins", VOLUME, MODE, PROGRAMMED],
    ],
)
def test_run_from_line_keeps_the_cut_part(answers):
    """Two slots, then from the second on: M250 of a line that is only read over leaves the map as it is, M251 holds the
    rate at the next F; from the start it is a whole block again."""
    print(answers)
    assert [answers[k] for k in (2, 6, 11, 13, 18)] == [[]] * 5
    assert float(answers[3][0]) == pytest.approx(2 * SLOT, rel=0.01)
    assert [float(v) for v in answers[7]] == [pytest.approx(2 * SLOT, rel=0.01), 0, 0]
    assert [m for m in answers[8] if "M250" in m and "the stock stays as it is" in m]
    assert float(answers[12][0]) == pytest.approx(2 * SLOT, rel=0.01)  # line 3 is not read over: filled and cut again
    assert answers[17][0] == pytest.approx([6000 / 60 / 12] * 2, rel=0.03)  # the rate of the M251 that was read over
    assert [float(v) for v in answers[19]] == [pytest.approx(SLOT, rel=0.01), 0, 0]


@pytest.mark.scene(
    MILL,
    [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        ["mdi", "G0 Z5"],
        ["open text", SLOTS.replace("G1 X70 F300", "G1 X70")],
        ["run_from", SECOND],
        *feeds()[:2],
        ["over", 1.0, VELOCITY],
        ["finish"],
        ["pins", VOLUME],
    ],
)
def test_run_from_line_without_another_f(answers):
    """M251 with a ceiling read over and no F behind the start line: the machine goes at F, never at the ceiling."""
    print(answers)
    assert answers[7][0][1] <= 5.001 and answers[8] == []
    assert float(answers[9][0]) == pytest.approx(SLOT, rel=0.01)


TWICE = SLOTS.replace("G0 X-10 Y30", "M250 P0 Q0 R-7 I50 J40 K7\nG0 X-10 Y30")  # another stock for the second slot
REFUSED = "the stock in force is a different one"


@pytest.mark.scene(
    MILL,
    [*run_from(TWICE, 0), ["pins", VOLUME], *run_from(TWICE, SECOND + 1), ["pins", VOLUME], *run_from(TWICE, FIRST)],
)
def test_run_from_line_behind_a_second_stock(answers):
    """The last M250 before the start line decides: behind the second one the run goes on with its stock, before it
    nothing moves."""
    print(answers)
    assert [answers[k] for k in (2, 6)] == [[]] * 2
    assert float(answers[3][0]) == pytest.approx(50 * 6 * 2, rel=0.01) and answers[7] == answers[3]
    assert len(answers[10]) == 1 and REFUSED in answers[10][0]


ASKS = [  # (line 3 of the program, lines of MDI before, words of the refusal)
    (BOX, [], "run from line skips this line and no stock is defined"),
    ("M254 P1", [], "run from line skips this line and no stock is defined"),
    (
        BOX,
        [["mdi", "M250 P0 Q0 R-10 I60 J40 K9"]],
        "run from line skips this line, and the stock in force is a different one",
    ),
]


def test_run_from_line_asks(tmp_path):
    """No stock, or that of something else: nothing moves."""
    scenes = [
        [
            ["mdi", "T1 M6"],
            *before,
            ["position"],
            *run_from(SLOTS.replace(BOX, line), SECOND),
            ["position"],
            ["pins", "stock-tracker.0.stock-defined", MODE],
        ]
        for line, before, _said in ASKS
    ]
    found = operate(tmp_path, sum(scenes, []), edit=NO_SHADOW)
    for (line, before, said), scene in zip(ASKS, scenes):
        answers, found = found[: len(scene)], found[len(scene) :]
        end, position, pins = answers[-3:]
        assert len(end) == 1 and said in end[0] and "line 3" in end[0], (line, end)
        assert position == answers[-6] and pins == ["TRUE" if before else "FALSE", "0"], line


def test_run_from_line_saves_and_restores_nothing(tmp_path):
    """M253 and M254 of lines that are only read over: the file and the map stay as they are."""
    folder = tmp_path / "stock"
    program = (
        f"G21 G90\nT1 M6\n{BOX}\nM253 P1\nM254 P1\nF2000\nG0 X-10 Y10 Z5\nG0 Z-2\nG1 X30\nG0 Z5\nG0 X-10 Y30\nM2\n"
    )
    edit = f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#"
    answers = operate(
        tmp_path,
        [
            *run_from(program, 0),
            ["map_sum"],
            *run_from(program, 11),
            ["map_sum"],
            ["messages"],
            ["mdi", "M254 P1"],
            ["map_sum"],
        ],
        edit=edit,
    )
    assert answers[2] == answers[6] == []
    assert answers[3] == answers[7] and answers[3][1] > 100
    assert answers[10][1] == 0  # the file is that of the first run: before the cut
    assert len([m for m in answers[8] if "run from line" in m]) == 3, answers[8]


SKIPPED = (
    f"G21 G90 G17\nT1 M6\n{BOX}\nF3000\nG0 X100 Y100 Z5\n#<_chipwise_chop_size> = 4.3\n"
    "G13 X100 Y100 I39 Z-3 R1\no79 sub\nG0 X5 Y5\nG1 X195\nG1 Y195\nG1 X5\nG1 Y5\no79 endsub\n"
    "G79 Q79 D0.11 Z-3 R1\nG79 Q79 D0.12 Z-3 R1\nG0 Z6\nM2\n"
)


@pytest.mark.scene(
    MILL,
    [
        ["mdi", "T1 M6"],
        ["mdi", BOX],
        ["mdi", "G0 X-7 Y-8 Z20"],
        ["open text", SKIPPED],
        ["run_from", 17],
        ["over", 4.0, *(f"axis.{a}.pos-cmd" for a in "xyz")],
        ["finish"],
        ["position"],
    ],
)
def test_run_from_line_moves_nothing_of_a_skipped_cycle(answers):
    """Cycles that take long to plan wait for the machine, and what is queued before a wait would be executed: 700 mm of
    chop lines and a pocket of 12,000 moves, read over, leave the machine where it stands."""
    (x, y, z), position = answers[5], answers[7]
    print(x, y, z, position)
    assert answers[6] == []
    assert x == [-7.0, -7.0] and y == [-8.0, -8.0] and z[0] >= 6 - 1e-6
    assert position == pytest.approx([-7, -8, 6])


def test_mdi_names_no_line_of_the_program_before(tmp_path):
    *_, said = operate(tmp_path, [["start", PLAIN], ["finish"], ["mdi", "M251 Q6"]])
    assert said == ["chipwise: M251: no stock is defined; define it with M250 before"]
