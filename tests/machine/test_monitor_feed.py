# SPDX-License-Identifier: GPL-2.0-or-later
"""The feed while nobody follows the tool: chipwise-monitor killed in a full slot, and another one that takes M251 up
again.

F is that of a light cut, four times what the slot allows.  The time-out of the heartbeat is made shorter, so that slots
are.
"""

import pytest

from support.operate import SPEED, operate

pytestmark = pytest.mark.machine

Q, E, F, DEPTH, DIAMETER = 3.6, 3000, 1200, 4.0, 6.0
SLOT = Q * 1000.0 / 60.0 / (DEPTH * DIAMETER)  # mm/s of Q in a full slot
TIMEOUT_S = 1.0 * SPEED
FAULT, READY, LOST = "stock-tracker.0.fault-code", "stock-tracker.0.ready", "stock-tracker.0.load-lost"
START = (
    f"G21 G90 G64 P0.01 F{F}\nT1 M6\nM250 P0 Q0 R-20 I150 J60 K20\nM251 Q{Q} P2 E{E}\nG0 X-10 Y20 Z10\nG0 Z-{DEPTH:g}\n"
)
# The first slot is long enough for a busy computer to kill the monitor in it: 12 s of real time.
SLOTS = START + "G1 X140\nG0 Z10\nG0 X160 Y45\nG0 Z-4\nG1 X60\nG0 Z10\nM252\nG1 X20\nM2\n"
CHANGED = START + "G1 X140\nG0 Z10\nT8 M6\nG0 X-10 Y45\nG0 Z-4\nG1 X100\nG0 Z10\nM252\nM2\n"
SEEN = ["motion.current-vel", "volumetric-feed.0.mode"]
# Another monitor
ANOTHER = [["pause"], ["start_monitor"], ["until", READY, "=", 1], ["resume"]]
CUTTING = ["until", "axis.x.pos-cmd", ">", 15]


def begun(program):
    """Steps up to the monitor's death in the first slot, and its being noticed."""
    return [
        ["mdi", "T1 M6"],
        ["until", "stock-tracker.0.tool-diameter", "=", DIAMETER],  # M251 waits for some seconds only for that
        ["start", program],
        CUTTING,
        ["over", 0.5, *SEEN],
        ["kill_monitor"],
        ["watch_monitor", TIMEOUT_S],
        ["until", FAULT, "=", 16],
    ]


def test_killed_in_a_full_slot(tmp_path):
    """The feed of the slot stays, in this one and in the next; another monitor takes M251 up again.  M252: F again."""
    (
        *_,
        before,
        _kill,
        _watch,
        _fault,
        lost,
        _y,
        _x,
        later,
        _pause,
        _start,
        _well,
        _on,
        _fast,
        after,
        said,
        _m252,
        _free,
        errors,
    ) = operate(
        tmp_path,
        [
            *begun(SLOTS),
            ["over", 1.0, *SEEN, "volumetric-feed.0.limited-by", LOST],
            ["until", "axis.y.pos-cmd", ">", 44.9],
            ["until", "axis.x.pos-cmd", "<", 145],
            ["over", 1.0, *SEEN],
            *ANOTHER,
            ["until", "motion.current-vel", ">", 0.98 * SLOT],
            ["over", 1.0, *SEEN, LOST],
            ["messages", "M251"],
            ["until", "volumetric-feed.0.mode", "=", 0],
            ["until", "motion.current-vel", ">", 15],
            ["finish"],
        ],
        timeout=100,
    )
    within = pytest.approx([SLOT, SLOT], rel=0.03)
    assert before == [within, [2, 2]]
    assert lost[0][1] <= 1.001 * before[0][1] and lost[0][0] > 0.9 * SLOT and lost[1:] == [[2, 2], [5, 5], [1, 1]]
    assert 0 < later[0][1] <= 1.001 * before[0][1] and later[1] == [2, 2]
    assert after == [within, [2, 2], [0, 0]]
    assert any("chipwise-monitor follows the tool again" in text and "M251" in text for text in said), said
    assert len(errors) == 1 and "chipwise-monitor does not answer" in errors[0], errors


def test_another_tool_meanwhile(tmp_path):
    """12 mm instead of 6 while nobody looked: the feed never rises, not even when another monitor knows the tool, until
    a person decides: Stop."""
    (
        *_,
        before,
        _kill,
        _watch,
        _fault,
        _change,
        _y,
        _feeds,
        lost,
        _pause,
        _start,
        _well,
        _on,
        _moves,
        after,
        said,
        _abort,
        state,
    ) = operate(
        tmp_path,
        [
            *begun(CHANGED),
            ["until", "stock-tracker.0.tool-in-spindle", ">", 7.5],
            ["until", "axis.y.pos-cmd", ">", 44.9],
            ["until", "motion.motion-type", ">", 1.5],
            ["over", 1.0, *SEEN],
            *ANOTHER,
            ["until", "motion.current-vel", ">", 0.1],
            ["over", 1.0, *SEEN, LOST],
            ["errors", "another tool"],
            ["abort"],
            ["pins", "volumetric-feed.0.mode", "volumetric-feed.0.adaptive-feed", LOST],
        ],
        timeout=100,
    )
    for found in (lost, after):
        assert 0 < found[0][1] <= 1.001 * before[0][1] and found[1] == [2, 2]
    assert after[2] == [1, 1]
    assert any("another tool" in text and "M252" in text for text in said), said
    assert state == ["0", "1", "FALSE"]
