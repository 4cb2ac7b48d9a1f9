# SPDX-License-Identifier: GPL-2.0-or-later
"""What is committed, when, and that nothing else ever is."""

import numpy as np

from support.halrig import SCENES, always, load_module, require

scene = load_module(SCENES / "command/stimulus.py")
BOX = ("min-x", "min-y", "min-z", "max-x", "max-y", "max-z")


def box_is(trace, phase, box):
    for name, value in zip(BOX, box):
        part = trace.only(phase)
        require(part, name, part[name] == value, "machine units", f"{value} in phase '{phase}'")


def feed_is(trace, phase, mode, target, lower):
    part = trace.only(phase)
    for name, value in (("mode", mode), ("mrr-target", target), ("mrr-lower", lower)):
        if value is not None:
            require(part, name, part[name] == value, "mm3/min", f"{value} in phase '{phase}'")


def check(trace):
    none, on, off = (0.0,) * 6, (2, 6000.0, 3000.0), (0, None, None)
    for phase, box, feed in (
        ("before", none, (0, 0, 0)),
        ("box A, registers", none, (0, 0, 0)),
        ("box A, commit", scene.BOX_A, (0, 0, 0)),
        ("box A, idle", scene.BOX_A, (0, 0, 0)),
        ("feed, registers", scene.BOX_A, (0, 0, 0)),
        ("feed, commit", scene.BOX_A, on),
        ("box B, aborted after each register", scene.BOX_A, on),
        ("feed, aborted after each register", scene.BOX_A, on),
        ("odd words", scene.BOX_A, on),
        ("feed off", scene.BOX_A, on),
        ("feed off, commit", scene.BOX_A, off),
        ("box B, registers", scene.BOX_A, off),
        ("box B, commit", scene.BOX_B, off),
        ("box B, idle", scene.BOX_B, off),
    ):
        box_is(trace, phase, box)
        feed_is(trace, phase, *feed)
    for k in range(len(scene.ODD_MODES)):
        feed_is(trace, f"odd mode {k}", 0, 100.0, 50.0)
    committing = np.zeros(len(trace["define"]), bool)
    for phase in (
        "box A, commit",
        "box B, commit",
        "shape: cylinder",
        "shape: no shape",
        "shape: box after it",
        *(f"turn {k}" for k in range(len(scene.TURNS))),
    ):
        committing[trace.phases[phase]] = True
    require(trace, "define", (trace["define"] == 1) == committing, "(pin)", "1 just while the word is 7")
    check_status(trace)
    check_shape(trace)
    check_files(trace)


def check_shape(trace):
    for what, shape in (("cylinder", 1), ("no shape", 0), ("box after it", 0)):
        always(trace.only("shape: " + what), "shape", shape)

    for k, turn in enumerate(scene.TURNS):
        always(trace.only(f"turn {k}"), "turn", turn if turn in (33.5, -120.0) else 0.0)
    always(trace.only("before"), "turn", 0.0)
    always(trace.only("before turn 1"), "turn", 33.5)
    always(trace.only("before turn 2"), "turn", 0.0)


def check_files(trace):
    for commit, slot, wanted in ((27, 4.0, 4), (28, 9.0, 9), (27, -3.0, -1), (28, "nan", -1)):
        always(trace.only(f"file {commit} {slot}, registers"), "request", 0)
        part = trace.only(f"file {commit} {slot}")
        always(part, "request", commit - 26)
        always(part, "slot", wanted)
        assert part["status"][1] - part["status"][0] == 20000, "status: no reply in it, allowed: 10000 * reply"
    always(trace.only("files over"), "request", 0)


def check_status(trace):
    part = trace.only("status")
    status, mode = part["status"], part["mode"]
    rows_per_mode = 2 + len(scene.STATUS)
    for wanted_mode in range(4):
        for k, (defined, code) in enumerate(scene.STATUS):
            row = wanted_mode * rows_per_mode + 2 + k
            wanted = wanted_mode + 10 * defined + 100 * code
            assert status[row] == wanted and mode[row] == wanted_mode, (
                f"status: {status[row]:.0f} with mode {mode[row]:.0f} at "
                f"{(part.start + row) * 0.001:.3f} s, allowed: {wanted}"
            )
    always(trace.only("end"), "mode", 3)


SABOTAGE = {
    "registers act at once": lambda t: t.put("min-x", "box A, registers", -10.5, -1),
    "aborted box acts": lambda t: t.put("max-z", "box B, aborted after each register", 6.0, -1),
    "aborted feed acts": lambda t: t.put("mode", "feed, aborted after each register", 1, -1),
    "define stuck": lambda t: t.but(define=lambda d: np.maximum.accumulate(d)),
    "define never": lambda t: t.but(define=lambda d: 0 * d),
    "two columns swapped": lambda t: t.but(min_x=lambda x: t["min-y"]),
    "a period late": lambda t: t.but(mode=lambda m: np.roll(m, 1)),
    "rate 5 % too large": lambda t: t.but(mrr_target=lambda q: 1.05 * q),
    "rate NaN": lambda t: t.put("mrr-lower", "odd words", np.nan, 3),
    "odd mode taken": lambda t: t.put("mode", "odd mode 1", 4),
    "odd word commits": lambda t: t.put("define", "odd words", 1, 7),
    "status without fault": lambda t: t.but(status=lambda s: s % 100),
    "shape stays": lambda t: t.put("shape", "shape: box after it", 1),
    "turn stays": lambda t: t.put("turn", "turn 1", 33.5),
    "turn lost": lambda t: t.put("turn", "turn 2", 0.0),
    "turn not finite": lambda t: t.put("turn", "turn 3", np.nan),
    "turn acts at once": lambda t: t.put("turn", "before turn 2", -120.0, -1),
    "no cylinder": lambda t: t.but(shape=lambda s: 0 * s),
    "request stuck": lambda t: t.but(request=lambda r: np.maximum.accumulate(r)),
    "slot of before": lambda t: t.but(slot=lambda s: 0 * s + 4),
    "reply lost": lambda t: t.but(status=lambda s: s % 10000),
    "status stuck": lambda t: t.put("status", "status", 10.0),
}
