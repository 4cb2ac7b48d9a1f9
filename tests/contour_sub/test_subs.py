# SPDX-License-Identifier: GPL-2.0-or-later
"""Contour subs read without the cycle: what is refused and how it is said, what is remembered, how long it takes."""

import math
import os
import signal
import subprocess
import threading

import pytest

from chipwise.program import sub_process
from chipwise.contour_sub import run
from chipwise.errors import CycleError
from chipwise.geometry.base.contour import ArcElement, LineElement
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import UnknownStart, contours, one_contour, read_shape
from support.bad_subs import BAD_SUBS, sub
from support.computing import TRIES, least_s


@pytest.fixture
def read(tmp_path, monkeypatch):
    """text -> Shape of O100 in program.ngc."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.ini").write_text(
        "[RS274NGC]\nSUBROUTINE_PATH = subs:more\nREMAP = F python=feed\n[DISPLAY]\n"
        "PROGRAM_PREFIX = programs\n[CHIPWISE]\nCHOP_SIZE = 7\n"
    )

    def reader(text, **job):
        (tmp_path / "program.ngc").write_text(text)
        return read_shape(Job(**{"program": "program.ngc", "sub": 100, "ini": "a.ini", "close_gap": 0.01, **job}))

    return reader


@pytest.mark.parametrize("name", sorted(BAD_SUBS))
def test_bad_subs(read, name):
    """The message names the line; it takes less than 2 s of computing."""
    text, message = BAD_SUBS[name]

    def refused():
        with pytest.raises(CycleError) as caught:
            one_contour(read(text))
        return str(caught.value)

    found, spent = least_s(refused, 2.0)
    if message is not None:
        assert found == "chipwise: " + message
    assert spent < 2.0


def test_files_that_never_end(read, tmp_path):
    """A FIFO, a device and a socket's like as the sub's file, or as that of a sub it calls: refused at once."""
    (tmp_path / "subs").mkdir()
    os.mkfifo(tmp_path / "subs" / "7.ngc")
    (tmp_path / "subs" / "8.ngc").symlink_to("/dev/zero")
    for number in (7, 8):

        def refused(number=number):
            with pytest.raises(CycleError, match=f"{number}.ngc: it is not a regular file; put"):
                read(sub("G0 X0 Y0"), sub=number)
            with pytest.raises(CycleError, match=f"{number}.ngc: it is not a regular file; put"):
                read(sub("G0 X0 Y0", "G1 X5", f"o{number} call"))

        assert least_s(refused, 5.0)[1] < 5.0  # and had it waited, the message would be another


def test_a_call_that_waits_for_ever(read, tmp_path, monkeypatch):
    """A FIFO whose name only the running sub knows: given up because nothing is computed."""
    monkeypatch.setattr(sub_process, "STUCK_S", 2.0)
    (tmp_path / "subs").mkdir()
    os.mkfifo(tmp_path / "subs" / "7.ngc")
    with pytest.raises(CycleError, match="the sub waits for a file that does not answer"):
        read(sub("G0 X0 Y0", "G1 X5", "o[3 + 4] call"))


def test_a_busy_machine_is_no_endless_loop(read, monkeypatch):
    """A runner that gets no processor for 5 s is waited for: computing time counts, and no other."""
    popen = subprocess.Popen

    def stopped(*arguments, **options):
        process = popen(*arguments, **options)
        os.kill(process.pid, signal.SIGSTOP)
        threading.Timer(5.0, os.kill, (process.pid, signal.SIGCONT)).start()
        return process

    monkeypatch.setattr(sub_process.subprocess, "Popen", stopped)
    assert len(read(sub("G0 X0 Y0", "G1 X5", "G1 Y5")).loops[0]) == 2


def test_impossible_arc(read):
    """LinuxCNC's own words, with our line numbers."""
    with pytest.raises(CycleError, match=r"line 4 \(after line 3\) of program.ngc: Radius to end of arc differs"):
        read(BAD_SUBS["impossible arc"][0])


def test_elements(read):
    shape = read(sub("G0 X1 Y2", "G1 X11", "G3 X13 Y4 J2", "G2 X15 Y6 R2", "G0 X0 Y0", "G2 I5", "G0 X99"))
    assert shape.loops == (
        (
            LineElement((1.0, 2.0), (11.0, 2.0), 3),
            ArcElement((11.0, 2.0), (13.0, 4.0), (11.0, 4.0), True, 4),
            ArcElement((13.0, 4.0), (15.0, 6.0), (15.0, 4.0), False, 5),
        ),
        (ArcElement((0.0, 0.0), (0.0, 0.0), (5.0, 0.0), False, 7),),
    )
    assert [c.closed for c in contours(shape)] == [False, True]


def test_small_gaps_are_joined(read):
    """A drawing of someone else's: G0 over some micrometres between the elements, an end that misses the start."""
    shape = read(sub("G0 X0 Y0", "G1 X9", "G0 X9.004", "G1 Y9", "G0 Y9.0003", "G1 X0", "Y-0.0099"))
    contour = one_contour(shape)
    assert contour.closed and contour.gap == pytest.approx(0.0099) and contour.gap_line == 8
    assert [c.closed for c in contours(read(sub("G0 X0 Y0", "G1 X9", "Y9", "X0", "Y0.0015")))] == [True]
    circle = one_contour(read(sub("G0 X5 Y0", "G3 X5 Y-0.004 I-5 J0")))
    assert circle.closed and abs(circle.elements.sweep.sum()) == pytest.approx(2 * math.pi)


def test_lengths_of_a_refused_shape_are_in_program_units(read):
    with pytest.raises(CycleError) as caught:
        one_contour(read(sub("G0 X0 Y0", "G1 X1", "Y1", "X0", "Y0.01"), unit="in"))
    assert "line 6 ends 0.01 in from where line 3 starts, more than the 0.00039 in" in caught.value.text("in")


def test_a_sub_that_prints(read):
    """(print,..) writes to standard output, where the runner's result goes."""
    shape = read(sub("(print,hello)", "(debug,hello)", "G0 X0 Y0", "G1 X9"))
    assert shape.loops == ((LineElement((0.0, 0.0), (9.0, 0.0), 5),),)


def test_position_units_and_modes(read):
    assert read(sub("G1 X3 Y4"), position=(1.0, 2.0, 9.0)).loops[0][0].start == (1.0, 2.0)
    assert read(sub("G1 X3 Y4"), position=(1.0, 2.0, 9.0), incremental=True).loops[0][0].end == (4.0, 6.0)
    assert read(sub("G1 X3 Y4"), unit="in", position=(25.4, 0.0, 0.0)).loops[0][0] == LineElement(
        (25.4, 0.0), (76.2, 101.6), 2
    )
    arc = read(sub("G0 X1 Y1", "G3 X3 I2 J1"), ijk_absolute=True).loops[0][0]
    assert arc.centre == (2.0, 1.0)


def test_what_a_sub_may_read(read):
    text = sub(
        "G0 X0 Y0",
        "G1 X#31",
        "Y#<_depth_of_it>",
        "X[#5410 + #5400]",
        "Y[#<_x> + #<_feed>]",
        "X#<_ini[CHIPWISE]CHOP_SIZE>",
        "#1 = 7",
        "Y[#1]",
    )
    (loop,) = read(
        text, numbered=((31, 3.5),), named=(("_depth_of_it", 4.25), ("_x", 99.0)), tool=(4, 6.0), feed=50.0
    ).loops
    assert [e.end for e in loop] == [(3.5, 0.0), (3.5, 4.25), (10.0, 4.25), (10.0, 60.0), (7.0, 60.0), (7.0, 7.0)]


def test_places_of_files(read, tmp_path):
    """The program first, then the current folder, PROGRAM_PREFIX, SUBROUTINE_PATH in its order."""
    for number, folder in enumerate(("more", "subs", "programs", ".", "program")):
        (tmp_path / folder).mkdir(exist_ok=True)
        text = sub("G0 X0 Y0", f"G1 X{number + 1}")
        if folder != "program":
            (tmp_path / folder / "100.ngc").write_text(text)
        shape = read(text if folder == "program" else "M2\n")
        assert shape.loops[0][0].end == (number + 1.0, 0.0)


def test_home_folder(read, tmp_path, monkeypatch):
    """~ in the INI file is the user's, also for the files a sub calls."""
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "mine").mkdir()
    (tmp_path / "b.ini").write_text("[RS274NGC]\nSUBROUTINE_PATH = none:~/mine\n")
    (tmp_path / "mine" / "100.ngc").write_text(sub("G0 X0 Y0", "o<there> call"))
    (tmp_path / "mine" / "there.ngc").write_text("o<there> sub\nG1 X9\no<there> endsub\n")
    assert read("M2\n", ini="b.ini").loops == ((LineElement((0.0, 0.0), (9.0, 0.0), 3),),)


def test_polar_coordinates(read):
    (loop,) = read(sub("G0 X0 Y0", "G1 @10 ^0", "^90")).loops
    assert [e.end for e in loop] == [(10.0, 0.0), (0.0, 10.0)]


def test_functions_without_brackets_and_indirect_calls(read):
    (loop,) = read(
        sub("G0 X0 Y0", "G1 X SIN[90] Y-.5", "G1XATAN[1]/[1]", "#<n> = 2 G1 Y7", "o[#<n>] call")
        + "o2 sub\nG1 X50\no2 endsub\n"
    ).loops
    assert [e.end for e in loop] == [(1.0, -0.5), (45.0, -0.5), (45.0, 7.0), (50.0, 7.0)]


def test_remembered(read, tmp_path, monkeypatch):
    """A sub is run once while nothing it can see has changed."""
    runs = []
    real = run.run_sub
    monkeypatch.setattr(run, "run_sub", lambda *job: runs.append(1) or real(*job))
    plain, reading = sub("G0 X0 Y0", "G1 X7.5"), sub("G0 X0 Y0", "G1 X#31")
    for count, (text, job) in enumerate(
        (
            (plain, {}),
            (plain, dict(position=(1.0, 1.0, 1.0), numbered=((31, 1.0),))),
            (plain, dict(unit="in")),
            (reading, dict(numbered=((31, 1.0),))),
            (reading, dict(numbered=((31, 2.0),))),
        ),
        1,
    ):
        read(text, **job)
        read(text, **job)
        assert len(runs) == (count if count == 1 else count - 1)
    assert read("\n" + plain).loops[0][0].line == 4


def test_20000_lines_are_read_in_time(read):
    points = [(100 * math.cos(k / 3183), 100 * math.sin(k / 3183)) for k in range(20000)]
    text = sub("G0 X100 Y0", *(f"G1 X{x:.5f} Y{y:.5f}" for x, y in points[1:]))
    texts = iter("\n" * k + text for k in range(TRIES))  # what was read before is remembered
    shape, spent = least_s(lambda: read(next(texts)), 2.0)
    assert len(shape.loops[0]) == 19999 and spent < 2.0


def test_random_text_is_refused_or_read(read):
    """Whatever is in a sub: a shape or a CycleError, nothing else."""
    import random
    from support.random_cases import random_count, random_seed

    rng = random.Random(random_seed())
    pieces = [
        "G0",
        "G1",
        "G2",
        "G3",
        "X",
        "Y",
        "Z",
        "I",
        "J",
        "R",
        "1",
        "-2.5",
        "[",
        "]",
        "#1",
        "#<a>",
        "=",
        "+",
        "(",
        ")",
        "o1",
        "if",
        "endif",
        "while",
        "endwhile",
        "call",
        "sub",
        "endsub",
        ";",
        "\n",
        "\n",
        " ",
        "%",
        "N5",
        "P2",
        "é",
    ]
    for _ in range(random_count(8)):
        text = sub("".join(rng.choice(pieces) for _ in range(rng.randint(1, 60))))
        try:
            read(text)
        except CycleError as error:
            assert "internal" not in str(error) and "did not run it" not in str(error), text


UNKNOWN = [
    "G1 X5 Y1\nG1 X0 Y9\n",
    "G0 X3\nG1 X9 Y1\nG1 X9 Y5\n",
    "#1 = 4\nG1 X#1 Y0\nG1 X9 Y9\n",
    "G2 X4 Y0 I2\nG1 Y9\n",
    "G91\n",
    "G0 X#<_x> Y2\nG1 X9\n",
]
KNOWN = [
    "G0 X1 Y2\nG1 X5\nG1 Y9\n",
    "G0 X1\nG0 Y2\nG1 X5\nG1 Y9\n",
    "#1 = 3\nG0 X#1 Y2\nG1 X5\nG1 Y9\n",
    "o1 if [1]\nG0 X1 Y2\no1 endif\nG1 X5\nG1 Y9\n",
]


@pytest.mark.parametrize("text", [*UNKNOWN, *KNOWN])
def test_a_shape_that_begins_at_an_unknown_place_is_refused(read, text):
    """Without a position a shape has to be the same wherever the tool is: no coordinate is assumed."""
    text = f"O100 sub\n{text}O100 endsub\n"
    if text in [f"O100 sub\n{t}O100 endsub\n" for t in KNOWN]:
        assert read(text, position=None).loops == read(text, position=(3.0, 4.0, 0.0)).loops
        return
    with pytest.raises(CycleError) as caught:
        read(text, position=None)
    if "G91" not in text:
        assert (
            isinstance(caught.value, UnknownStart)
            and "the shape begins where the tool is" in str(caught.value)
            and "G0 X.. Y.." in str(caught.value)
        )


def test_a_turned_shape_needs_x_and_z(read):
    for start, known in (("G0 X5\n", False), ("G0 Z5\n", False), ("G0 X5 Z1\n", True)):
        text = f"O100 sub\n{start}G1 X9 Z-3\nG1 X9 Z-8\nO100 endsub\n"
        try:
            read(text, position=None, lathe=True)
            assert known
        except UnknownStart as error:
            assert not known and "G0 X.. Z.." in str(error)


@pytest.mark.parametrize(
    "name, text, message",
    [
        (
            "subs/100.ngc",
            "\ufeff" + sub("G0 X0 Y0", "G1 X5", "G1 Y5"),
            "100.ngc begins with a byte order mark, which LinuxCNC refuses; save it as UTF-8 without one",
        ),
        (
            "program.ngc",
            2 * (sub("G0 X0 Y0", "G1 X5", "G1 Y5") + "\n"),
            "sub O100 is defined twice in program.ngc, in lines 1 and ",
        ),
        (
            "program.ngc",
            sub("G0 X0 Y0", "G1 X5", "G1 Y5") + "\n" + 2 * "O7 sub\nO7 endsub\n",
            "sub O7 is defined twice in program.ngc, in lines ",
        ),
    ],
    ids=["mark", "twice", "another one twice"],
)
def test_files_that_linuxcnc_does_not_read(read, tmp_path, name, text, message):
    """Said as what they are: neither a missing sub nor the folder of a process."""
    (tmp_path / "subs").mkdir()
    (tmp_path / name).write_text(text)
    with pytest.raises(CycleError) as caught:
        read(text if name == "program.ngc" else "G21\n")
    assert message in str(caught.value) and "/tmp" not in str(caught.value), str(caught.value)


@pytest.mark.parametrize("speed, answer", [("1", None), ("10", ("", ""))])
def test_patience_is_in_real_time(monkeypatch, speed, answer):
    """A process that computes nothing is given up, but not sooner where the clock runs ten times as fast."""
    monkeypatch.setenv("CHIPWISE_SPEED", speed)
    monkeypatch.setattr(sub_process, "STUCK_S", 0.4)
    process = subprocess.Popen(
        ["sleep", "2"], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert sub_process.answer_of(process, "") == answer
