# SPDX-License-Identifier: GPL-2.0-or-later
"""A line, one that is left in the middle, one that is switched off."""

from support.halrig import Stimulus


def stimulus():
    s = Stimulus({"enable": [], "retract": [], "feed": [], "feed-override": [], "direction": []})

    def stay(periods, **row):
        for _ in range(periods):
            s.add({"feed": 1000 / 60, "feed-override": 1.0, "retract": 0, "direction": 1, **row})

    s.phase("off")
    stay(20, enable=0)
    s.phase("line")
    stay(2500, enable=1)
    s.phase("off again")
    stay(20, enable=0)
    s.phase("left")
    stay(600, enable=1, direction=-1)
    stay(900, enable=1, direction=-1, retract=1)
    s.phase("off a third time")
    stay(20, enable=0)
    s.phase("held")
    stay(700, enable=1)
    stay(200, enable=1, **{"feed-override": 0.0})
    s.phase("switched off")
    stay(100, enable=0)
    return s
