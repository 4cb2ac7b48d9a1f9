# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise-monitor dead, stopped or merely late, and a tool change meanwhile: the tracker does not go on with the old
tool, the feed is F, M251 refuses, with a message; and none of that if the machine is only busy.  The times, to a servo
period: tests/components/tracker_watch."""

import pytest

from support.operate import OWN_PATIENCE, operate

pytestmark = pytest.mark.machine

BOX = [["mdi", "T1 M6"], ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"]]
READY = "stock-tracker.0.ready"
FAULT = "stock-tracker.0.fault-code"
STATE = ["pins", READY, "stock-tracker.0.fault", "stock-tracker.0.fault-code", "volumetric-feed.0.mode"]
TOOL = ["pins", "chipwise-monitor.tool-number", "stock-tracker.0.tool-diameter", "stock-tracker.0.fault-code"]
WELL = ["TRUE", "FALSE", "0", "0"]
DEAD = "chipwise: chipwise-monitor does not answer"
TIMEOUT_S = 5.0  # of real time (chipwise/cli/load.py)
WATCHED = [["watch_monitor"], ["until", FAULT, "=", 16]]


def refused(texts):
    return [text for text in texts if text.startswith("chipwise: M251: the tool in the spindle is not known")]


def test_dead_and_another_tool(tmp_path):
    """12 mm instead of 6: unknown at once, M251 refuses, with a message; another monitor makes all well."""
    before, _kill, _tool, state, fed, _watch, _silent, again, _start, _known, second, after = operate(
        tmp_path,
        [
            *BOX,
            STATE,
            ["kill_monitor"],
            ["mdi", "T8 M6"],
            STATE,
            ["mdi", "M251 Q6 P2 E3000"],
            *WATCHED,
            ["mdi", "M251 Q6 P2 E3000"],
            ["start_monitor"],
            ["until", READY, "=", 1],
            ["mdi", "M251 Q6 P1"],
            ["pins", "stock-tracker.0.ready", "stock-tracker.0.tool-diameter", "volumetric-feed.0.mode"],
        ],
        before=OWN_PATIENCE,
    )[2:]
    assert before == WELL
    assert state == ["FALSE", "TRUE", "15", "0"]
    assert len(refused(fed)) == 1 and len(refused(again)) == 1, (fed, again)
    assert second == [] and after == ["TRUE", "12", "1"]


def test_dead_while_a_program_runs(tmp_path):
    """Volumetric feed on, monitor killed, M6 in the program: the 12 mm tool cuts no faster than the 6 mm tool did,
    although F is six times that."""
    program = (
        "G21 G90 F1200\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nM251 Q3.6 P2 E3000\nG0 X-10 Y20 Z10\nG0 Z-3\nG1 X70\n"
        "G0 Z10\n"
        "T8 M6\nG0 X-10 Y32\nG0 Z-4\nG1 X30\nM252\nM2\n"
    )
    *_, fed, state, _abort, said = operate(
        tmp_path,
        [
            *BOX,
            ["until", READY, "=", 1],  # M251 waits for some seconds only until the tool is known
            ["start", program],
            ["until", "axis.x.pos-cmd", ">", 20],
            ["kill_monitor"],
            ["watch_monitor"],  # a traverse waits for the tool until then
            ["until", "stock-tracker.0.tool-in-spindle", ">", 7.5],
            ["until", "motion.motion-type", ">", 1.5],
            ["until", "axis.x.pos-cmd", ">", 2],
            ["over", 0.5, "motion.current-vel", "volumetric-feed.0.limited-by", "stock-tracker.0.ready"],
            STATE,
            ["abort"],
            ["errors", DEAD],
        ],
    )
    velocity, limited_by, ready = fed
    slot = 3.6 * 1000 / 60 / (6 * 3)  # mm/s of the target; F is 20
    assert 0.5 * slot < velocity[0] <= velocity[1] <= 1.03 * slot and limited_by == [5, 5] and ready == [0, 0]
    assert state[:2] == ["FALSE", "TRUE"] and any(text.startswith(DEAD) for text in said), said


def but_deaths(texts):
    return [text for text in texts if "was started again" not in text]


def test_the_worker_is_replaced(tmp_path):
    """Killed three times: pins and names stay, the tool is followed on, the operator hears of it."""
    steps = []
    for tool in (2, 8, 3):
        steps += [["kill_worker"], ["mdi", f"T{tool} M6"], ["until", READY, "=", 1], ["errors"], TOOL]
    answers = operate(tmp_path, [*BOX, *steps, ["mdi", "M253 P1"], ["mdi", "M254 P1"], STATE])[2:]
    said = [text for k in range(3) for text in [*answers[5 * k + 1], *answers[5 * k + 3]]]
    assert [answers[k] for k in (0, 5, 10)] == [True] * 3
    assert [answers[k] for k in (4, 9, 14)] == [["2", "3", "0"], ["8", "12", "0"], ["3", "10", "0"]]
    assert 1 <= len(said) <= 3 and all("was ended by signal 9 and was started again" in text for text in said), said
    assert but_deaths(answers[15]) == [] and but_deaths(answers[16]) == [] and answers[17] == WELL


def test_stopped_and_going_on(tmp_path):
    """SIGSTOP: a tool change is noticed; SIGCONT before the time-out: all is well and nothing was said."""
    _stop, said, state, _cont, _wait, after, errors = operate(
        tmp_path,
        [
            *BOX,
            ["signal_monitor", "STOP"],
            ["mdi", "T8 M6"],
            STATE,
            ["signal_monitor", "CONT"],
            ["until", READY, "=", 1],
            STATE,
            ["errors"],
        ],
    )[2:]
    assert state[0] == "FALSE" and state[2] in ("0", "15") and said == []
    assert after == WELL and errors == []


def test_stopped_for_good(tmp_path):
    """SIGSTOP for longer than the time-out: the fault, without a tool change."""
    *_, state, errors = operate(tmp_path, [*BOX, ["signal_monitor", "STOP"], *WATCHED, STATE, ["errors", DEAD]])
    assert state == ["FALSE", "TRUE", "16", "0"] and len(errors) == 1 and errors[0].startswith(DEAD)


def test_a_machine_without_the_number(tmp_path):
    """Without the tool number in HAL there is only the heartbeat: slower, and never a false alarm."""
    edit = "s#tap(TOOL_NUMBER#(lambda *_: None)(TOOL_NUMBER#"
    before = (
        f"mkdir -p p && cp -r ../remap/chipwise p/ && sed -i '{edit}' p/chipwise/cli/load.py && export "
        f"PYTHONPATH=$PWD/p"
    )
    first, _late, second, _kill, *_wait, state, errors = operate(
        tmp_path,
        [
            *BOX,
            ["mdi", "T8 M6"],
            ["until", "stock-tracker.0.tool-diameter", "=", 12],
            TOOL,
            ["kill_monitor"],
            *WATCHED,
            STATE,
            ["errors", DEAD],
        ],
        before=before,
    )[2:]
    assert first == [] and second == ["8", "12", "0"]
    assert state[:3] == ["FALSE", "TRUE", "16"] and len(errors) == 1


def test_a_busy_machine_is_no_dead_monitor(tmp_path):
    """Six processes that do nothing but work, and a program with tool changes: no fault, no message.  A look costs so
    little computing time that its seventh part of one core is enough to be in time: how late it is, is the computer's
    matter."""
    program = (
        "G21 G90 F1200\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nM251 Q3.6 P2 E3000\n"
        + "".join(
            f"T{tool} M6\nG0 X-10 Y{y} Z10\nG0 Z-1\nG1 X70\nG0 Z10\n" for tool, y in ((2, 5), (8, 15), (1, 25), (3, 35))
        )
        + "M252\nM2\n"
    )
    *_, before, _busy, _start, said, state, after = operate(
        tmp_path,
        [
            *BOX,
            ["until", READY, "=", 1],
            ["monitor_costs"],
            ["busy", 6],
            ["start", program],
            ["finish"],
            STATE,
            ["monitor_costs"],
        ],
    )
    assert said == [] and state[1:3] == ["FALSE", "0"]
    cost_s, looks = (late - early for early, late in zip(before, after))
    print(f"{1e3 * cost_s / looks:.2f} ms a look")
    assert looks > 50 and 7 * cost_s / looks < TIMEOUT_S


@pytest.mark.parametrize("mode, feed", [("P2 E3000", 300), ("P1", 1500)])
def test_the_monitor_has_no_time_when_a_program_begins(tmp_path, mode, feed):
    """SIGSTOP until the slot is half cut, longer than the feed waits for its program to be seen: the rate stays within
    Q all the same."""
    program = (
        f"G21 G90 G64 P0.01\nT1 M6\n{BOX[1][1]}\nM251 Q6 {mode}\nF{feed}\nG0 X-10 Y20 Z10\nG0 Z-2\nG1 X70\n"
        f"G0 Z10\nM252\nM2\n"
    )
    *_, over, _go, said, state = operate(
        tmp_path,
        [
            *BOX,
            ["until", READY, "=", 1],
            ["signal_monitor", "STOP"],
            ["start", program],
            ["until", "axis.x.pos-cmd", ">", 25],
            ["over", 0.5, "motion.current-vel", "volumetric-feed.0.mode"],
            ["signal_monitor", "CONT"],
            ["finish"],
            STATE,
        ],
        before=OWN_PATIENCE,
    )
    velocity, modes = over
    slot = 6 * 1000 / 60 / (6 * 2)  # mm/s of the target
    assert velocity == pytest.approx([slot] * 2, rel=0.03) and modes[0] == modes[1] > 0
    assert said == [] and state == WELL
