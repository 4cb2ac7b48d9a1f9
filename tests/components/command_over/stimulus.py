# SPDX-License-Identifier: GPL-2.0-or-later
"""Feeds switched on by a program and in MDI, and what comes after them; the commit (17) stays in word, as in a run."""

from support.halrig import Stimulus

FEED_COMMIT, SAVE_COMMIT, RESTORE_COMMIT, IDLE = 17, 27, 28, 0
MDI, PROGRAM = 0.0, 1.0


def stimulus():
    rows = Stimulus({"word": [], "value": [], "enabled": [], "program-running": [], "aborted": [], "current-vel": []})

    def switch_on(whose, running):
        rows.phase(f"switching {len(rows)}")
        for number, value in enumerate((2.0, 6000.0, 0.0, whose), 11):
            rows.add({"word": number, "enabled": 1, "program-running": running})
            rows.add({"value": value})
        rows.add({"word": FEED_COMMIT})

    def play(phase, periods, **pins):
        rows.phase(phase)
        rows.add({name.replace("_", "-"): value for name, value in pins.items()})
        for _ in range(periods - 1):
            rows.add({})

    switch_on(PROGRAM, 1)
    for phase, pins in (
        ("program on", {}),
        ("program over", {"program_running": 0}),
        ("the next program", {"program_running": 1}),
    ):
        play(phase, 300, **pins)
    switch_on(PROGRAM, 1)
    play("off: before", 50)
    play("off", 100, enabled=0)
    play("on again", 300, enabled=1)
    switch_on(MDI, 0)
    play("mdi", 2500)
    play("mdi, program starts", 100, program_running=1)
    play("mdi, program over", 100, program_running=0)
    switch_on(MDI, 0)
    play("mdi again", 100)
    play("mdi, off", 100, enabled=0)
    switch_on(PROGRAM, 0)
    play("never seen to run", 990)
    play("never seen: not yet", 30)
    play("never seen, over", 300)
    switch_on(PROGRAM, 0)
    play("seen late: before", 900)
    play("seen late", 2500, program_running=1)
    switch_on(PROGRAM, 0)
    play("never seen, moves", 2500, current_vel=12.5)
    for phase, periods in (("before", 990), ("not yet", 30), ("over", 300)):
        play(f"never seen, at rest: {phase}", periods, current_vel=0)
    _files(rows, play)
    rows.phase("end")
    rows.add({})
    return rows


def _files(rows, play):
    """A stock is saved or restored, and nobody answers before the program is aborted or the machine off."""
    for commit, end in (
        (SAVE_COMMIT, {"aborted": 1}),
        (RESTORE_COMMIT, {"aborted": 1}),
        (SAVE_COMMIT, {"enabled": 0}),
        (RESTORE_COMMIT, {"enabled": 0}),
    ):
        name = f"file {commit} {'aborted' if 'aborted' in end else 'off'}"
        rows.add({"word": IDLE, "enabled": 1})
        play(f"{name}: asked", 20, word=commit)
        play(f"{name}: given up", 1, **end)
        play(f"{name}: afterwards", 50, aborted=0, enabled=1)
