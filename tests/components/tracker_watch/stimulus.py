# SPDX-License-Identifier: GPL-2.0-or-later
"""A 6 mm tool cuts a slot along X; the tool number, the number followed and the heartbeat do what a phase says."""

from support.halrig import Stimulus

LIMIT = 500  # periods without a heartbeat, test.hal
LATE = 20  # periods a monitor that runs is behind
DEAD = 200  # periods of a cut with a tool nobody has described
SPEED = 0.01  # mm a period


class Slot(Stimulus):
    def __init__(self):
        super().__init__(
            {
                name: []
                for name in (
                    "pos-x",
                    "pos-y",
                    "pos-z",
                    "motion-type",
                    "enable",
                    "tool-diameter",
                    "define",
                    "tool-in-spindle",
                    "tool-followed",
                    "heartbeat",
                )
            }
        )
        self.row = {
            "pos-x": -5.0,
            "pos-y": 20.0,
            "pos-z": -3.0,
            "motion-type": 2,
            "enable": 1,
            "tool-diameter": 6.0,
            "define": 0,
            "tool-in-spindle": 1,
            "tool-followed": 1,
            "heartbeat": 0,
        }
        self.beating = True

    def go(self, periods, speed=SPEED, **values):
        self.row.update({name.replace("_", "-"): value for name, value in values.items()})
        for k in range(periods):
            self.row["pos-x"] += speed
            if self.beating and len(self) % 20 == 0:
                self.row["heartbeat"] += 1
            self.add(dict(self.row))
        return self


def stimulus():
    slot = Slot()
    slot.phase("define")
    slot.go(1, 0, define=1).go(30, 0, define=0).go(500, 0.02)
    slot.phase("cutting")
    slot.go(200)
    slot.phase("changed, late")  # a monitor that runs, 20 ms behind
    slot.go(LATE, tool_in_spindle=2)
    slot.phase("followed")
    slot.go(200, tool_followed=2)
    slot.phase("changed, dead")
    slot.go(DEAD, tool_in_spindle=8)
    slot.phase("followed at last")
    slot.go(300, tool_followed=8)
    slot.phase("no heartbeat")
    slot.beating = False
    slot.go(LIMIT + 300)
    slot.phase("heartbeat again")
    slot.beating = True
    slot.go(300)
    slot.phase("changed, never followed")  # by a monitor that runs
    slot.go(LIMIT + 300, 0.0, tool_in_spindle=9)
    slot.phase("followed after all")
    slot.go(50, 0.0, tool_followed=9)
    slot.phase("changed, silent")
    slot.beating = False
    slot.go(100, 0.0)
    slot.go(LIMIT + 300, 0.0, tool_in_spindle=1)
    return slot
