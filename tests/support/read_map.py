# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the map of a running tracker; what it saw goes into NAME.json in the current folder.

Called by test_load_components.py and test_foreign_memory.py inside HAL: read_map.py TRACKER once|follow NAME
`follow`: from NAME.ready on until a stock has been there and has not changed for STILL_S.
"""

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "remap"))
from chipwise.stock.shared import attach  # noqa: E402

STILL_S, GIVE_UP_S = 2.0, 40.0  # a busy computer lets the servo thread wait, too


def missing_mm3(seen):
    """Volume between the top of the box and the map."""
    return float((seen.high[2] - seen.heights).sum() * seen.cell**2)


class Looks:
    """What snapshots had in common."""

    def __init__(self):
        self.count = self.none = self.inexact = 0
        self.first = self.last = None
        self.worst = {
            True: 0.0,
            False: 0.0,
        }  # mm3 by which map and removed volume differ, beyond what was cut meanwhile if not exact
        self.started = self.changed = time.monotonic()

    def look(self, stock):
        seen = stock.snapshot()
        self.count += 1
        if seen is None:
            self.none += 1
            return
        if self.last is None or seen.generation != self.last.generation:
            self.changed = time.monotonic()
        self.first, self.last = self.first or seen, seen
        self.inexact += not seen.exact
        meanwhile = 0.0 if seen.exact else stock._head.removed - seen.removed
        self.worst[seen.exact] = max(self.worst[seen.exact], abs(missing_mm3(seen) - seen.removed) - meanwhile)

    def still(self):
        now = time.monotonic()
        return self.last is not None and now - self.changed > STILL_S or now - self.started > GIVE_UP_S

    def result(self):
        found = {
            "looks": self.count,
            "none": self.none,
            "inexact": self.inexact,
            "worst_mm3": self.worst[True],
            "worst_inexact_mm3": self.worst[False],
            "look_s": (time.monotonic() - self.started) / self.count,
        }
        if self.last is not None:
            last = self.last
            found.update(
                low=last.low,
                high=last.high,
                shape=last.heights.shape,
                first_removed=self.first.removed,
                removed=last.removed,
                generation=last.generation,
                lowest=float(last.heights.min()),
            )
        return found


def main(tracker, mode, name):
    stock, looks = attach(tracker), Looks()
    Path(name + ".ready").touch()
    looks.look(stock)
    while mode == "follow" and not looks.still():
        time.sleep(0.0005)
        looks.look(stock)
    stock.close()
    Path(name + ".part").write_text(json.dumps(looks.result()))
    Path(name + ".part").rename(name + ".json")


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], sys.argv[3])
