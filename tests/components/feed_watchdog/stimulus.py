# SPDX-License-Identifier: GPL-2.0-or-later
"""A machine of 500 mm/s2: it follows the override, then ignores it, then moves that are not judged."""

from support.halrig import Stimulus

STEP = 0.5  # mm/s a period
EXPLAINED = 1.5 * 10.0  # mm/s: 150 % of 10 mm/s


class Scene(Stimulus):
    def __init__(self):
        super().__init__(
            {
                name: []
                for name in (
                    "mode",
                    "section-area",
                    "programmed-vel",
                    "motion-type",
                    "current-vel",
                    "index-enable",
                    "adaptive-off",
                )
            }
        )
        self.pins = {
            "mode": 2,
            "section-area": 10.0,
            "programmed-vel": 5.0,
            "motion-type": 2,
            "current-vel": 0.0,
            "index-enable": 0,
            "adaptive-off": 0,
        }

    def stay(self, periods, **pins):
        self.pins.update({name.replace("_", "-"): value for name, value in pins.items()})
        for _ in range(periods):
            self.add(self.pins)

    def go(self, velocity, step=STEP, **pins):
        """Speed up or brake to `velocity`."""
        while self.pins["current-vel"] != velocity:
            at = self.pins["current-vel"]
            self.stay(1, current_vel=min(velocity, at + step) if at < velocity else max(velocity, at - step), **pins)


def stimulus():
    s = Scene()
    s.phase("follows")
    s.go(50.0, section_area=0.0)  # air, at the ceiling
    s.stay(20)
    s.stay(2, section_area=10.0)  # a wall nobody has seen coming
    s.go(10.0, step=0.43 * STEP)  # the weakest braking there is: a blend on an arc
    s.stay(50)
    s.go(15.0)  # feed override 150 %
    s.stay(50)
    s.go(0.0)
    s.phase("ignores")
    s.go(50.0)
    s.go(0.0, step=2 * STEP)  # inhibited
    s.stay(50)
    s.phase("let go")
    s.stay(10, motion_type=0)
    s.stay(10, motion_type=2)
    s.phase("told")
    s.stay(10, adaptive_off=1)
    s.phase("switched off")
    s.stay(10, mode=0, programmed_vel=0.0)  # M252
    s.stay(10, motion_type=0, adaptive_off=0, mode=2, programmed_vel=5.0)
    s.phase("not judged")
    s.stay(5, motion_type=1, current_vel=90.0)
    s.stay(5, motion_type=4)
    s.stay(5, motion_type=0, current_vel=0.0)
    s.stay(5, motion_type=2, programmed_vel=0.0)
    s.go(50.0)
    s.go(0.0)
    s.stay(20, programmed_vel=5.0, index_enable=1)
    s.go(40.0, index_enable=0)  # a thread
    s.go(0.0)
    s.go(40.0)  # the tap comes back
    s.go(0.0)
    s.phase("judged again")
    s.stay(120)
    s.go(50.0)
    return s
