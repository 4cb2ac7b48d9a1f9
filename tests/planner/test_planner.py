# SPDX-License-Identifier: GPL-2.0-or-later
"""The process that plans cycles: same result as in process, budgets, and every way in which it may end.

The program under test is what session.run_cycle asks; nothing of LinuxCNC is needed.
"""

import gc
import math
import os
import pickle
import signal
import subprocess
import sys
import time

import pytest

from chipwise import gcode_lines
from chipwise.host import processes
from chipwise.planner import client, plans
from chipwise.errors import CycleError
from chipwise.moves import Arc, Line, Rapid, Thread
from chipwise.contour_sub.job import Job
from chipwise.order import Outcome, Packed
from chipwise.turning.blocks import Block, Run, Turning
from support.planner_orders import CUT, HOLE, LARGE, LONG, SECONDS, SQUARE, order


@pytest.fixture(autouse=True)
def _ended():
    """No process is left by a test."""
    yield
    client.end()


@pytest.fixture
def job(tmp_path):
    """Job of a square."""
    path = tmp_path / "square.ngc"
    path.write_text(SQUARE)
    return Job(program=str(path), sub=100)


def wait(plan, seconds=600.0):
    """The outcome of a plan that is asked for all the time."""
    end = time.monotonic() + seconds
    while not plan.ready(0.2):
        assert time.monotonic() < end
    return plan.outcome()


def runner():
    """Pid of the planner."""
    return client.start().pid


def spent_until_gone(pid, seconds=600.0):
    """The last computing time seen of a process that ends."""
    seen, end = 0.0, time.monotonic() + seconds
    while time.monotonic() < end:
        now = processes.cpu_s(pid)
        if not processes.lives(pid):
            return seen if now == math.inf else max(seen, now)
        seen = now
        time.sleep(0.02)
    raise AssertionError(f"process {pid} goes on, {seen} s so far")


# ---- what it gives ---------------------------------------------------------------------------------------------------


def test_same_as_in_process(job):
    """The process gives what the pure functions give, in any order and again."""
    orders = [
        order(),
        order(fields=dict(HOLE, chop_size=8.0)),
        order(unit_mm=25.4),
        order("contour", CUT, job),
        order("contour", dict(CUT, finish=True, chop_size=8.0), job),
        order(
            "pocket",
            dict(
                bottom=-5.0,
                clearance=0.0,
                tool_radius=3.0,
                step=2.4,
                feed=300.0,
                plunge_feed=150.0,
                start=(0.0, 0.0, 5.0),
            ),
            job,
        ),
    ]
    for one in orders + orders[::-1]:
        outcome = wait(client.ask(one, 10))
        assert outcome == plans.make(one)
        assert outcome.chunks


def test_refusals_come_back(job):
    """A CycleError of the plan is raised with its values; one of the sub names its line."""
    with pytest.raises(CycleError) as caught:
        wait(client.ask(order(fields=dict(HOLE, radius=2.0)), 10))
    assert caught.value.text("in") == (
        "chipwise: radius I0.07874 in is not larger than the tool radius 0.11811 in; use I above "
        "0.11811 in or a smaller tool"
    )
    with pytest.raises(CycleError, match="there is no sub O7 in square.ngc"):
        wait(client.ask(order("contour", CUT, Job(program=job.program, sub=7)), 10))
    assert wait(client.ask(order(), 10)).chunks


def test_a_fault_of_the_plan_is_no_traceback():
    """An exception nobody has thought of is one line; the process goes on."""
    with pytest.raises(CycleError, match="internal error: TypeError: "):
        wait(client.ask(order(fields=dict(HOLE, colour="red {x}")), 10))
    first = runner()
    assert wait(client.ask(order(), 10)).chunks and runner() == first


# ---- budgets ---------------------------------------------------------------------------------------------------------


def test_computing_time():
    """A plan ends with the remedy when its computing time is over, and took no more than that; the next one is
    planned."""
    plan = client.ask(order(fields=LONG), 3)
    pid = runner()
    with pytest.raises(CycleError) as caught:
        while not plan.ready(0.05):
            assert processes.cpu_s(pid) < 3 + 1.5 or processes.cpu_s(pid) == float("inf")
        plan.outcome()
    assert str(caught.value) == (
        "chipwise: planning takes more than 3 s of computing time; use a larger step, fewer passes or "
        "a simpler contour, or raise [CHIPWISE]PLAN_TIME"
    )
    assert wait(client.ask(order(), 10)).chunks


def test_a_busy_machine_takes_nothing_from_the_budget(job):
    """A process that gets no processor for longer than its budget still plans to the end."""
    wait(client.ask(order(), 10))
    plan = client.ask(order("contour", dict(CUT, passes=10, step=0.3, depth_step=0.1), job), 3)
    os.kill(runner(), signal.SIGSTOP)
    end = time.monotonic() + 5
    while time.monotonic() < end:
        assert not plan.ready(0.2)
    os.kill(runner(), signal.SIGCONT)
    assert wait(plan).chunks


def test_memory():
    """A plan ends with the remedy when it takes too much; the task's own memory does not grow with it."""
    with pytest.raises(CycleError) as caught:
        wait(client.ask(order(fields=LARGE, memory_mb=64), 60))
    text = str(caught.value)
    crashed = (
        sys.version_info >= (3, 13)
        and "ended by signal 11; try again; if it happens again, raise [CHIPWISE]PLAN_MEMORY" in text
    )
    assert crashed or text == (
        "chipwise: planning takes more than 64 MB of memory; use a larger step, fewer passes or a simpler "
        "contour, or raise [CHIPWISE]PLAN_MEMORY"
    )  # Python 3.13 itself may crash when memory is used up
    assert wait(client.ask(order(), 10)).chunks


def test_memory_of_earlier_plans_does_not_count():
    """A plan that fits alone fits after many others: what they have left is given back."""
    rings = dict(HOLE, radius=6.0, finished=60.0, step=0.2, depth_step=0.1)  # 55,000 moves, some 12 MB kept
    for more in range(12):
        assert wait(client.ask(order(fields=dict(rings, x=float(more)), memory_mb=100), 60)).chunks


# ---- the task is not kept --------------------------------------------------------------------------------------------

MANY = dict(HOLE, radius=6.0, finished=60.0, step=0.2, depth_step=0.1)  # 55,000 moves, some 3 MB


def test_a_long_answer_comes_in_parts(monkeypatch):
    """Each question without patience takes a part or two of the answer, and the task can serve Stop between them.

    The parts are small here: how much of 3 MB the system has ready between two questions is by chance."""
    monkeypatch.setattr(client, "_PART", 1 << 16)
    plan = client.ask(order(fields=MANY), 60)
    counts = [0]
    while not plan.ready(0.0):
        counts.append(client.start()._count)
    steps = [after - before for before, after in zip(counts, counts[1:]) if after != before]
    assert len(steps) > 3 and max(steps) <= 2 * client._PART
    assert plan.outcome().chunks == plans.make(order(fields=MANY)).chunks


def test_an_answer_is_taken_apart_chunk_by_chunk():
    """No row is made before its chunk is executed: a plan of 500,000 rows would keep the task for a third of a
    second."""
    chunks = tuple(tuple((float(k), f"G1 X{k}", k + 1) for k in range(2000)) for _ in range(50))
    answer = pickle.dumps(plans.packed(Outcome(chunks)))
    gc.collect()
    before = len(gc.get_objects())
    outcome = pickle.loads(answer)
    assert len(gc.get_objects()) - before < 100
    most = max(len(gc.get_objects()) - before for _chunk in outcome.chunks)
    assert 2000 <= most < 2 * 2000 + 100  # the one that is made, and the one before
    assert outcome.chunks == chunks


def test_a_turned_part_comes_chunk_by_chunk():
    """Its blocks have no second copy of their lines."""
    rows = tuple(((0.1, f"G1 X{k}\nG1 Z{k}"),) for k in range(1000))
    block = Block(
        1, "rough outside", 1, True, True, "G97 S1 M3", 0.1, (0.0, 0.0), False, tuple(f"G1 X{k}" for k in range(2000))
    )
    made = plans.packed(Outcome((), turning=Turning((Run(block, rows, (0,) * 1000),), (0.0, 0.0), "G97 S1 M3")))
    (run,) = pickle.loads(pickle.dumps(made)).turning.blocks
    assert (
        run.block.lines == ()
        and isinstance(run.chunks, Packed)
        and len(run.chunks) == 1000
        and run.chunks == rows
        and run.chunks != rows[1:]
    )


# ---- how it may end --------------------------------------------------------------------------------------------------


def test_a_killed_process_is_replaced():
    """Killed while idle, and killed at work: the plan comes all the same; killed whenever it is asked: a message."""
    wait(client.ask(order(), 10))
    os.kill(runner(), signal.SIGKILL)
    assert wait(client.ask(order(), 10)).chunks

    plan = client.ask(order(fields=dict(HOLE, depth_step=0.01)), 10)
    os.kill(runner(), signal.SIGKILL)
    assert wait(plan).chunks

    with pytest.raises(CycleError, match="the planning process was ended by signal 9; try again"):
        plan = client.ask(order(fields=dict(HOLE, depth_step=0.011)), 10)
        while not plan.ready(0.0):
            os.kill(runner(), signal.SIGKILL)
        plan.outcome()


def test_a_plan_nobody_asks_for_ends():
    """After an abort nobody asks: the process ends after its lease; asked for later, the plan begins again."""
    plan = client.ask(order(fields=SECONDS), 100)
    spent = spent_until_gone(runner())
    assert spent <= client.LEASE_S + 1.5
    assert wait(plan).chunks


def test_the_next_order_ends_the_one_before():
    """A new program after an abort does not wait for the old plan."""
    wait(client.ask(order(), 10))
    client.ask(order(fields=LONG), 100)
    before = runner()
    assert wait(client.ask(order(), 10), 120).chunks
    assert runner() != before and processes.cpu_s(before) == float("inf")


@pytest.mark.parametrize("busy", ["plan", "sub", "idle"])
def test_nothing_is_left_when_the_parent_is_killed(tmp_path, busy):
    """LinuxCNC killed (-9): the planner goes, and the contour sub it runs."""
    program = tmp_path / "sub.ngc"
    program.write_text(SQUARE if busy != "sub" else SQUARE.replace("G1 X50", "o1 while [1]\no1 endwhile"))
    cycle, fields = ("hole", LONG) if busy == "plan" else ("contour", CUT)
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            f"""
import sys, time
sys.path[:0] = {sys.path!r}
from chipwise.planner import client as planner
from chipwise.contour_sub.job import Job
from support.planner_orders import order
plan = planner.ask(order({cycle!r}, {fields!r}, Job(program={str(program)!r}, sub=100)), 100)
print(planner.start().pid, flush=True)
while not plan.ready(0.1): pass
time.sleep(100)
""",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    pid = int(parent.stdout.readline())
    family = {pid}
    end = time.monotonic() + 300
    while time.monotonic() < end and len(family) < (2 if busy == "sub" else 1):
        family |= children(pid)
    assert len(family) >= (2 if busy == "sub" else 1)
    parent.kill()
    parent.wait()
    end = time.monotonic() + 300
    while any(processes.cpu_s(one) < float("inf") for one in family):
        assert time.monotonic() < end
        time.sleep(0.02)


def children(pid):
    """Pids of a process's children."""
    return set(processes.children(pid))


# ---- lines -----------------------------------------------------------------------------------------------------------


def test_chunks_end_where_the_tool_may_rest():
    """Every line once, in order; a new chunk begins with a traverse or a plunge only."""
    moves = []
    for level in range(300):
        moves += [Rapid(z=5.0), Rapid(x=0.0, y=0.0), Line(z=-level - 1.0, feed=100.0)]
        moves += [Line(x=float(k % 7) + 1, y=float(k), feed=300.0) for k in range(30)]
        moves += [Arc(x=1.0, y=31.0, cx=1.0, cy=30.0, ccw=True, feed=200.0)]
    found = gcode_lines.chunks(moves, (0.0, 0.0, 5.0), 1.0)
    assert len(found) > 3
    every = [line for chunk in found for _, text in chunk for line in text.split("\n")]
    assert every == [line for (line,) in ((text,) for _, text, _ in gcode_lines._lines(moves, (0.0, 0.0, 5.0), 1.0))]
    for chunk in found[1:]:
        first = chunk[0][1].split("\n")[0]
        assert first.startswith("G0") or " Z-" in first
    assert all(sum(text.count("\n") + 1 for _, text in chunk) < gcode_lines.CHUNK_MOVES + 40 for chunk in found)
    feeds = [(feed, line[:2]) for chunk in found for feed, text in chunk for line in text.split("\n")]
    assert all(feed in (100.0, 300.0, 200.0) for feed, code in feeds if code != "G0")


def test_a_rest_where_the_path_is_long():
    """One pass that would keep the task for more than a third of a second is parted: on a curve after MOST_MOVES moves,
    at a corner before."""

    def on_circle(k):
        return Line(x=100.0 * math.cos(1e-4 * k), y=100.0 * math.sin(1e-4 * k), feed=300.0)

    moves = [on_circle(k) for k in range(2 * gcode_lines.MOST_MOVES + 5)]
    start = (100.0, -1.0, 5.0)
    found = gcode_lines.chunks(moves, start, 1.0)
    assert [sum(text.count("\n") + 1 for _, text in chunk) for chunk in found] == [
        gcode_lines.MOST_MOVES,
        gcode_lines.MOST_MOVES,
        5,
    ]
    corner = gcode_lines.MOST_MOVES - gcode_lines.CORNER_MOVES + 100
    half = [0.5 * value for value in (on_circle(corner - 1).x, on_circle(corner - 1).y)]
    for turned, smooth in (
        (Line(x=0.0, y=0.0, feed=300.0), 0),
        (Arc(x=0.0, y=0.0, cx=half[0], cy=half[1], ccw=True, feed=300.0), 1),
    ):
        path = moves[:corner] + [turned] + moves[corner:]
        found = gcode_lines.chunks(path, start, 1.0)
        assert found[0][0][1].count("\n") + 1 == corner + smooth
        assert [line for chunk in found for _, text in chunk for line in text.split("\n")] == [
            text for _, text, _ in gcode_lines._lines(path, start, 1.0)
        ]
    arc = Arc(x=moves[corner].x, y=moves[corner].y, cx=0.0, cy=0.0, ccw=True, feed=300.0)
    assert (
        gcode_lines.chunks(moves[:corner] + [arc] + moves[corner + 1 :], start, 1.0)[0][0][1].count("\n") + 1
        == gcode_lines.MOST_MOVES
    )
    assert len(gcode_lines.chunks(moves[: gcode_lines.MOST_MOVES], start, 1.0)) == 1


def test_threads_are_not_parted():
    """Passes in step with the spindle stay together, however many."""
    moves = [Thread(x=0.0, y=0.0, z=-0.01 * k, pitch=1.0) for k in range(gcode_lines.MOST_MOVES + 5)]
    assert len(gcode_lines.chunks(moves, (0.0, 0.0, 5.0), 1.0)) == 1
