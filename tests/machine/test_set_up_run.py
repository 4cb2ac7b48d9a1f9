# SPDX-License-Identifier: GPL-2.0-or-later
"""A program that a person has set up (chipwise setup) runs with that as a limit: never above F, on its own stock;
nothing of it is left for another."""

import hashlib
import os

import numpy as np
import pytest

from chipwise.setup.job import Job, JobTool, text_of
from support.headless_rig import WITH_LOG, motion_rows
from support.operate import NO_SHADOW, operate

pytestmark = pytest.mark.machine

# Slots of 6 mm, 2 mm deep: 12 mm2, at F600 7.2 cm3/min; the job allows 3.
PROGRAM = """%
(part)
T1 M6
G21 G90 G64 P0.01
M3 S8000
G0 X-10 Y10 Z5
G1 Z-2 F600
G1 X40
G1 X-10 Y20
(M1)
G0 Z5
M30
%
"""
# Exact stop: with blends, and at a bend under G61, the acceleration of a move depends on whether the task has sent the
# next one (tcSetKinkProperties of tc.c), and the first F rests the machine where it ends a ceiling that the E-stop has
# left.
OTHER = PROGRAM.replace("G64 P0.01", "G61.1")
TARGET, F_VEL, AREA = 3000.0, 10.0, 12.0
PINS = [
    "stock-tracker.0.certain",
    "stock-tracker.0.removed-volume",
    "chipwise-command.0.job-active",
    "volumetric-feed.0.mode",
    "chipwise-monitor.job",
]
VELOCITY, RATE, MODE, REMOVED = (
    "motion.current-vel",
    "volumetric-feed.0.peak-rate",
    "volumetric-feed.0.mode",
    "stock-tracker.0.removed-volume",
)
SET_UP = "set up as confirmed"
FRESH = ["TRUE", "0", "FALSE", "0", "TRUE"]
LOG_ALONE = WITH_LOG + "\n" + NO_SHADOW  # or another program has an assumed stock


def with_job(
    path, text=PROGRAM, low=(-5.0, 0.0, -10.0), high=(35.0, 30.0, 0.0), tools=None, source="option", air=False
):
    """A program with a job file beside it."""
    path.write_text(text)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    job = Job(path.name, digest, low, high, source, "", tools or {1: JobTool(6.0, TARGET, 2.0)}, air)
    path.with_name(path.stem + ".job.toml").write_text(text_of(job))
    return str(path)


def opened(path):
    """Steps: the program is open, its set-up in force."""
    return [["open", path], ["mdi", "G0 X0 Y0 Z20"], ["messages", f"{os.path.basename(path)}: {SET_UP}"]]


def _of_the_slots(log):
    """Median of the velocities (mm/s) in the slots."""
    velocity = np.linalg.norm(np.diff(motion_rows(log), axis=0), axis=1) / np.load(log)["period"]
    return np.median(velocity[(velocity > 0.5 * TARGET / 60 / AREA) & (velocity < F_VEL)])


def test_it_is_a_limit_and_ends_with_its_program(tmp_path):
    """Two runs with a new part each, E-stop in the first second; then another program, which runs as on a machine that
    has never seen the first."""
    part, other = with_job(tmp_path / "part.ngc"), tmp_path / "other.ngc"
    other.write_text(OTHER)
    home, ran, rest = ["mdi", "G0 X0 Y0 Z20"], ["log", str(other)], [["sleep", 2.0], ["pins", *PINS]]
    fresh = [["until", REMOVED, "<", 0], *rest]
    alone = operate(tmp_path, [home, ran], edit=LOG_ALONE, speed=1, timeout=200)
    answers = operate(
        tmp_path,
        [
            *opened(part),
            ["pins", *PINS],
            ["log", part],
            ["pins", *PINS, RATE],
            *fresh,
            ["log", part],
            ["pins", *PINS, RATE],
            *fresh,
            ["begin"],
            ["sleep", 0.5],
            ["estop"],
            ["pins", *PINS],
            ["on"],
            *fresh,
            ["open", str(other)],
            ["until", PINS[0], "=", 0],
            *rest,
            home,
            ran,
            ["pins", *PINS],
        ],
        edit=LOG_ALONE,
        speed=1,
        timeout=300,
    )
    assert answers[3] == FRESH
    for errors, log in (answers[4], answers[9]):
        assert errors == [] and _of_the_slots(log) == pytest.approx(TARGET / 60 / AREA, rel=0.02)
    for end, then in ((answers[5], answers[8]), (answers[10], answers[13])):
        assert (
            end[2:4] == ["FALSE", "0"] and 0.9 * TARGET < float(end[5]) <= 1.02 * TARGET and then == FRESH
        )  # the next part
    stopped, on = answers[17], answers[21]
    assert stopped[2:4] == ["FALSE", "0"] and on == FRESH
    loaded, _, (errors, log), last = answers[25:]
    assert loaded == last == ["FALSE", "0", "FALSE", "0", "FALSE"] and errors == []
    rows, wanted = (_moved(path) for path in (log, alone[1][1]))
    assert alone[1][0] == [] and len(rows) == len(wanted) > 3000 and np.abs(rows - wanted).max() == 0.0


def _moved(path):
    """The same without the periods in which it stands: how long it waits for a move is the computer's."""
    at = motion_rows(path)
    return at[np.append(True, np.abs(np.diff(at, axis=0)).max(axis=1) > 0)]


def _with(before, after):
    """PROGRAM with other lines in place of some that it has."""
    assert before in PROGRAM
    return PROGRAM.replace(before, after)


PAUSED = _with("G1 X40\n", "G1 X0\nM1\nG1 X10\nM0\nG1 X40\n")
OWN = _with("G0 X-10 Y10 Z5", "M250 P-5 Q0 R-10 I40 J30 K10\nM251 Q30\nG0 X-10 Y10 Z5")
TAPPED = _with("(M1)\n", "M1\nG0 Z5\nG98 G81 X0 Y25 Z-3 R1 F120\nG80\nG38.3 Z4 F100\nG93 G1 X5 F20\nG94 F600\n")


def _stops(paths, changed):
    """Steps: each program as far as it is looked at; changed: the file that is changed while it runs."""
    return [
        ["open", paths["paused"]],
        ["messages", f"paused.ngc: {SET_UP}"],
        ["program", "true"],
        ["optional stop", True],
        ["begin"],
        ["until paused"],
        ["position"],
        ["pins", *PINS],
        ["resume"],
        ["until paused"],
        ["position"],
        ["pins", *PINS],
        ["optional stop", False],
        ["step to end", 40],
        ["pins", *PINS],
        *opened(paths["own"]),
        ["begin"],
        ["until", REMOVED, ">", 50],
        ["pins", *PINS, "chipwise-command.0.mrr-target"],
        ["finish"],
        ["pins", *PINS, RATE],
        *opened(paths["tapped"]),
        ["begin"],
        ["until", REMOVED, ">", 50],
        ["over", 0.5, VELOCITY, MODE],
        ["finish"],
        ["pins", *PINS, RATE],
        *opened(paths["changed"]),
        ["begin"],
        ["until", REMOVED, ">", 50],
        ["program", "sh", "-c", f'echo "(more)" >> {changed}'],
        ["until", MODE, "=", 0],
        ["pins", *PINS],
        ["abort"],
        ["messages", "was changed while it ran"],
        ["until", PINS[0], "=", 0],
        ["sleep", 3.0],
        ["pins", *PINS],
        ["messages", "confirm it again"],
    ]


def test_what_stops_and_what_wins(tmp_path):
    """Opened in AUTO, where the first F switches adaptive feed on; M0, M1 with the optional stop on, and single steps
    with it; the program's own M250 and M251 win; a cycle, a probe, G93 and M1 with the optional stop off go through; a
    program that is changed while it runs."""
    paths = {
        name: with_job(tmp_path / f"{name}.ngc", text)
        for name, text in (("paused", PAUSED), ("own", OWN), ("tapped", TAPPED), ("changed", PAUSED))
    }
    changed = tmp_path / "changed.ngc"
    answers = operate(tmp_path, _stops(paths, changed), speed=2, timeout=300)
    (optional, at_m1, _, _, m0, at_m0, _, steps, end), answers = answers[6:15], answers[15:]
    assert (
        optional == pytest.approx([0, 10, -2])
        and m0 == pytest.approx([10, 10, -2])
        and steps >= 3
        and end[2:4] == ["FALSE", "0"]
    )
    assert all(held[2:4] == ["TRUE", "2"] for held in (at_m1, at_m0)) and 50 < float(at_m1[1]) < float(at_m0[1])
    own, errors, own_end = answers[5:8]
    assert own[2:4] == ["FALSE", "1"] and float(own[5]) == 30000.0 and errors == [] and float(own_end[5]) > 1.5 * TARGET
    over, errors, tapped_end = answers[13:16]
    assert over[1] == [2, 2] and over[0][1] <= F_VEL + 1e-6 and errors == [] and float(tapped_end[5]) <= 1.02 * TARGET
    now, _, said, _, _, later, again = answers[-7:]
    assert now[2:] == ["FALSE", "0", "FALSE"] and any("was changed while it ran" in text for text in said)
    assert later[0] == "FALSE" and later[4] == "FALSE" and any("confirm it again" in text for text in again)


RAISED = """T1 M6
G21 G90 G64 P0.01
M3 S8000
G0 X-30 Y10 Z5
G1 Z-2 F600
G1 X60
G1 X80 Z-4
G1 X100
F300
G1 X120
G0 Z5
M30
"""


FREE = (
    RAISED.replace("G1 Z-2 F600", "G1 X60 F600\nG1 X-30 Z4.5\nG1 Z-2 F300")
    .replace("G1 X60\nG1 X80", "G1 X61 F600\nG1 X80")
    .replace("\nG0 Z5", "\nG1 Z5")
)


def _fastest(log, line, text=RAISED, below=np.inf):
    """(largest, median) velocity of the feed move of a line, mm/s; below: mm, only there."""
    found = np.load(log)
    at = np.column_stack([found[name] for name in "xyz"])
    velocity = np.linalg.norm(np.diff(at, axis=0, prepend=at[:1]), axis=1) / found["period"]
    rows = (found["line"] == text.splitlines().index(line) + 1) & (found["motion_type"] == 2) & (found["z"] < below)
    return velocity[rows].max(), np.median(velocity[rows])


def _judge_air(said, run, end):
    """Of the set-up with `air`."""
    errors, log = run
    assert (
        any("and above the stock that of the axes" in text for text in said)
        and errors == []
        and float(end[5]) <= 1.02 * 9000
    )
    for line, fastest in (("G1 X60 F600", 100), ("G1 X-30 Z4.5", 100)):
        assert _fastest(log, line, FREE)[0] == pytest.approx(fastest, rel=0.05), line
    for line, fastest in (
        ("G1 Z-2 F300", 5),
        ("G1 X61 F600", 20),
        ("G1 X80 Z-4", 10),
        ("G1 X100", 20),
        ("G1 X120", 10),
    ):
        assert _fastest(log, line, FREE, 0.45)[0] == pytest.approx(fastest, rel=0.01), line
    assert _fastest(log, "G1 Z-2 F300", FREE)[0] > 30 and _fastest(log, "G1 Z5", FREE)[0] > 40


def test_the_ceiling_is_a_multiple_of_the_f_of_each_move(tmp_path):
    """Twice F in air, the target in the slot, F where the tool goes down, braked before; without G84 or M52, with which
    it is a limit. With `air` as fast as the axes above the stock and straight up, and below the clearance as before."""
    part = with_job(tmp_path / "part.ngc", RAISED, tools={1: JobTool(6.0, 9000.0, 2.0)})
    tap = with_job(
        tmp_path / "tap.ngc", RAISED.replace("G0 Z5\nM30", "G0 Z5\nM52 P1\nM30"), tools={1: JobTool(6.0, 9000.0, 2.0)}
    )
    free = with_job(tmp_path / "free.ngc", FREE, tools={1: JobTool(6.0, 9000.0, 2.0)}, air=True)
    answers = operate(
        tmp_path,
        [
            ["open", part],
            ["messages", "part.ngc: set up as confirmed"],
            ["log", part],
            ["pins", *PINS, RATE],
            ["mdi", "G1 X0 Y0 F200"],
            ["open", tap],
            ["messages", "tap.ngc: set up as confirmed"],
            ["log", tap],
            ["pins", *PINS, RATE],
            ["open", free],
            ["mdi", "G0 Z20"],
            ["messages", "free.ngc: set up as confirmed"],
            ["log", free],
            ["pins", *PINS, RATE],
        ],
        edit=WITH_LOG,
        speed=1,
        timeout=240,
    )
    said, (errors, log), end = answers[1:4]
    assert any("up to 2 times F" in text for text in said) and errors == [] and float(end[5]) <= 1.02 * 9000
    for line, fastest in (("G1 Z-2 F600", 10), ("G1 X60", 20), ("G1 X80 Z-4", 10), ("G1 X100", 20), ("G1 X120", 10)):
        assert _fastest(log, line)[0] == pytest.approx(fastest, rel=0.01), line
    assert _fastest(log, "G1 X60")[1] == pytest.approx(9000 / 60 / AREA, rel=0.02)
    _judge_air(*answers[11:14])
    said, (errors, log), end = answers[6:9]
    assert any("at most F, because of its M52" in text for text in said) and errors == []
    assert max(_fastest(log, line)[0] for line in ("G1 X60", "G1 X80 Z-4", "G1 X100")) == pytest.approx(F_VEL, rel=1e-3)


# Feeds in a remapped tool change, 20 mm high, at F300; then slots as above.
CHANGE = "o<change> sub\\nG90\\nG0 Z20\\nG1 X-40 F300\\nG1 X-35\\nM6\\no<change> endsub\\nM2\\n"
CHANGED = "G21 G90 G64 P0.01\nM3 S8000\n" + 2 * "T1 M6\nG0 X-30 Y10\nG0 Z5\nG1 Z-2 F600\nG1 X60\nG0 Z5\n" + "M30\n"


def test_a_feed_in_a_remapped_tool_change(tmp_path):
    """M6 as a sub with an F: that F arms no ceiling, where the old tool is in, and has none; the program's own F has
    it, before and behind the second change."""
    part = with_job(tmp_path / "part.ngc", CHANGED, tools={1: JobTool(6.0, 9000.0, 2.0)})
    remapped = WITH_LOG + r"' -e 's/^\[RS274NGC\]/&\nREMAP = M6 modalgroup=6 ngc=change/"
    answers = operate(
        tmp_path,
        [["open", part], ["messages", f"part.ngc: {SET_UP}"], ["log", part], ["pins", *PINS, RATE]],
        edit=remapped,
        before=f"mkdir -p nc_files && printf '{CHANGE}' > nc_files/change.ngc",
        speed=1,
        timeout=240,
    )
    (errors, log), end = answers[2:]
    found = np.load(log)
    at = np.column_stack([found[name] for name in "xyz"])
    velocity = np.linalg.norm(np.diff(at, axis=0, prepend=at[:1]), axis=1) / found["period"]
    feeds, high = found["motion_type"] == 2, np.abs(found["z"] - 20) < 1e-3
    assert errors == [] and float(end[5]) <= 1.02 * 9000
    assert (feeds & high).sum() > 1000 and velocity[feeds & high].max() == pytest.approx(5.0, rel=1e-3)
    assert velocity[feeds & ~high].max() == pytest.approx(2 * F_VEL, rel=0.01)
