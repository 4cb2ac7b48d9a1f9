# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs with and without a set-up, and everything that ends it."""

import math

from support.halrig import Stimulus

FEED_COMMIT, IDLE = 17, 0
CEILINGS = (1.0, 1.25, 9.99, 10.0)  # times F; 10 is the largest that a set-up may have
ODD_TARGETS = (-1.0, -math.inf, math.inf, math.nan, 1e300)


def stimulus():
    rows = Stimulus(
        {
            "word": [],
            "value": [],
            "enabled": [],
            "program-running": [],
            "aborted": [],
            "job": [],
            "job-target": [],
            "job-ceiling": [],
            "job-waits": [],
            "program-mark": [],
            "job-air": [],
        }
    )
    rows.add({"enabled": 1, "job-target": 3000.0})

    def play(phase, periods, **pins):
        rows.phase(phase)
        rows.add({name.replace("_", "-"): value for name, value in pins.items()})
        for _ in range(periods - 1):
            rows.add({})

    def switch(mode, target, of_program):
        rows.phase(f"switching {len(rows)}")
        for number, value in enumerate((mode, target, 0.0, of_program), 11):
            rows.add({"word": number})
            rows.add({"value": value})
        rows.add({"word": FEED_COMMIT})
        rows.add({"word": IDLE})

    def start(name):
        play(f"{name}: before", 5, job=1, program_running=0, enabled=1, aborted=0, job_target=3000.0)
        play(f"{name}: on", 20, program_running=1)

    goes_through(play, start)
    is_switched(play, start, switch)
    is_ended(play, start)
    is_asked(play)
    is_of_mdi(play, switch)
    rows.phase("end")
    rows.add({})
    return rows


def goes_through(play, start):
    """Without a set-up, and with one to the end."""
    play("without: idle", 20)
    play("without: runs", 20, program_running=1)
    play("without: set up too late", 20, job=1)
    play("without: over", 20, program_running=0)
    start("whole")
    play("whole: another tool", 20, job_target=5000.0)
    play("whole: a drill", 20, job_target=0.0)
    for number, target in enumerate(ODD_TARGETS):
        play(f"whole: odd {number}", 5, job_target=target)
    play("whole: back", 20, job_target=3000.0)
    play("whole: over", 20, program_running=0)


def is_switched(play, start, switch):
    """M251 and M252 of the program, and the end of a feed of before."""
    start("own")
    switch(3.0, 7000.0, 1.0)
    play("own: wins", 20)
    play("own: over", 20, program_running=0)
    start("own off")
    switch(0.0, 0.0, 1.0)
    play("own off: wins", 20)
    start("left over")
    switch(0.0, 0.0, 0.0)
    play("left over: goes on", 20)


def is_of_mdi(play, switch):
    """M251 of MDI: the program that was loaded then has it once, also where it has a set-up; another one, or one with
    another content, does not."""

    def give(name, mark, **pins):
        play(f"{name}: before", 5, program_running=0, program_mark=mark, **pins)
        switch(3.0, 7000.0, 0.0)
        play(f"{name}: MDI", 5)

    give("carried", 77, job=0)
    play("carried: runs", 20, program_running=1)
    play("carried: is changed", 20, program_mark=78)
    play("carried: over", 20, program_running=0)
    play("carried: again", 20, program_running=1)
    give("set up", 77, job=1)
    play("set up: runs", 20, program_running=1)
    play("set up: over", 20, program_running=0)
    play("set up: again", 20, program_running=1)
    give("other", 77, job=0)
    play("other: runs", 20, program_running=1, program_mark=78)
    give("none", 0)
    play("none: runs", 20, program_running=1)
    give("stopped", 77)
    play("stopped: runs", 20, program_running=1)
    play("stopped: now", 1, aborted=1)
    play("stopped: still", 20, aborted=0)
    give("own wins", 77)
    play("own wins: runs", 20, program_running=1)
    switch(1.0, 500.0, 1.0)
    play("own wins: on", 20)


def is_ended(play, start):
    """Stopped, or withdrawn in the middle of a run."""
    for name, pins, back in (("aborted", {"aborted": 1}, {"aborted": 0}), ("off", {"enabled": 0}, {"enabled": 1})):
        start(name)
        play(f"{name}: stopped", 1, **pins)
        play(f"{name}: stays off", 20, **back)
        play(f"{name}: over", 20, program_running=0)
    start("withdrawn")
    play("withdrawn: gone", 20, job=0)
    play("withdrawn: late", 20, job=1)
    play("withdrawn: over", 20, program_running=0)


def is_asked(play):
    """What the interpreter finds in `status`: ceiling, whether adaptive feed waits, and whether the set-up is in
    force."""
    for ceiling in CEILINGS:
        for waits in (0, 1):
            play(
                f"asked: {ceiling:g} {waits} 0",
                5,
                job=1,
                program_running=0,
                job_ceiling=ceiling,
                job_waits=waits,
                job_air=waits,
            )
            play(f"asked: {ceiling:g} {waits} 1", 5, program_running=1)
