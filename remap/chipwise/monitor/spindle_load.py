# SPDX-License-Identifier: GPL-2.0-or-later
"""The load of the spindle that is measured: factors of tools in materials are kept, and alarms are put into words.

Called by worker.py.  core/spindle_load.h finds factors and alarms; here is what needs a file and an operator.  The
first cut of a tool in a material teaches its factor (tool_data/load_factors.py); later ones are compared with it, each
with a line in the log.

A thread writes the file (aside.py).  If the monitor is killed before a factor is on the disk, that factor is lost, and
the next cut of the tool in the material teaches it again; the file is the old one or the new one.
"""

import functools
import os

from chipwise.clib.layout import LoadAlarm
from chipwise.errors import CycleError, unnamed
from chipwise.monitor.aside import Aside
from chipwise.monitor.saying import Saying
from chipwise.tool_data import load_factors

WORN = 1.3  # times the factor that was taught, by two cuts one after the other
STRANGE_LOOKS = 50  # of 0.02 s, one after the other, with a ratio that cannot be a factor: the unit is wrong

LOAD_ALARMS = {  # volumetric-feed.0.load-alarm (man volumetric_feed)
    LoadAlarm.BROKEN: "the load of the spindle has fallen in stock ({where}): the tool is broken; press Stop and look "
    "at it",
    LoadAlarm.MISSING: "the spindle has no load in stock ({where}): tool or stock are missing; press Stop and look at "
    "both",
    LoadAlarm.IN_AIR: "the spindle has a load where no stock is known ({where}); press Stop, check stock and work "
    "offset",
    LoadAlarm.HIGH: "the spindle takes {ratio:.1f} times the load of this tool ({where}): it is dull, or another tool "
    "or material; press Stop and look at it",
    LoadAlarm.LOW: "the spindle takes {ratio:.1f} times the load of this tool ({where}): it is another tool or "
    "material, or less stock; press Stop and look at it",
    LoadAlarm.UNUSABLE: "the load of the spindle is not a number, negative, or does not change; check the wiring of "
    "spindle-load",
}
NOT_KEPT = (
    "the factor {factor:.2f} of tool {tool} in {material} is not kept in {file}: {reason}; make room, or "
    "correct [CHIPWISE]SPINDLE_LOADS"
)
TAUGHT = "the spindle takes {factor:.2f} times the predicted power with tool {tool} in {material}; it is kept in {file}"
STRANGE = (
    "the spindle takes {ratio:.2g} times the predicted power with tool {tool}: too far off to be kept; check "
    "[CHIPWISE]SPINDLE_LOAD_SCALE (W), tool and stock"
)
WEAR = (
    "tool {tool} takes {ratio:.2f} times the power that it was taught with in {material}; look at its edges, or "
    "delete its line in {file}"
)


class SpindleLoad:
    """The pins load-factor, load-cut-factor, load-cuts and load-alarm."""

    def __init__(self, component, settings, say, inform):
        self.pins, self.path, self.say, self.saying = component, settings.path("SPINDLE_LOADS"), say, Saying(inform)
        self.factors, self.stamp = {}, None
        self.cuts = None  # of the last look
        self.unkept, self.due = {}, set()  # factors that are not in the file yet; those of them that are to be written
        self.aside, self.written = Aside(), None  # the thread, and what came of it: arguments of took()
        self.said_alarm = LoadAlarm.SOUND
        self.worn, self.said_worn = set(), set()  # (tool, material): of the last cut; said
        self.strange, self.said_strange = 0, False  # looks; since a cut gave its factor

    def read(self):
        """The file again if it has changed; a broken one is said, and the factors before it stay."""
        try:
            stamp = os.stat(self.path).st_mtime_ns
        except OSError:
            stamp = 0
        if stamp == self.stamp:
            return
        self.stamp = stamp
        try:
            self.factors = {**load_factors.read(self.path), **self.unkept}
        except CycleError as error:
            self.say(unnamed(error))

    def follow(self, material, line):
        """material: its name, '' if it is not known; line: function that returns that of the program, 0 in MDI."""
        self.look()
        pins, key = self.pins, (self.pins["tool-number"], material)
        cuts, before = pins["load-cuts"], self.cuts
        self.cuts = cuts
        if before is not None and cuts != before and key[0] > 0 and material:
            self.cut(key, pins["load-cut-factor"])
        pins["load-factor"] = self.factors.get(key, 0.0)
        self.report(key, line)
        self.compare_unit(key)

    def cut(self, key, factor):
        """A cut has given its factor."""
        tool, material = key
        self.said_strange = False
        taught, file = self.factors.get(key), os.path.basename(self.path)
        if taught is None:
            self.factors[key] = self.unkept[key] = factor
            self.due.add(key)
            self.look()
            return
        print(f"chipwise: spindle load: tool {tool} in {material} {factor:.3f}, taught {taught:.3f}", flush=True)
        worn = factor > WORN * taught
        if worn and key in self.worn and key not in self.said_worn:
            self.said_worn.add(key)
            self.saying.tell(WEAR.format(tool=tool, ratio=factor / taught, material=material, file=file))
        (self.worn.add if worn else self.worn.discard)(key)

    def look(self):
        """What the thread has written, what others have, and what is to be written; waits for nothing."""
        if self.aside.is_busy():
            return
        if self.written:
            self.took(*self.written)
            self.written = None
        self.read()
        if self.due:
            self.aside.begin(functools.partial(self.keep, dict(self.unkept)))

    def keep(self, taught):
        """The thread's: write what has been taught; while somebody else writes it waits for the next look."""
        try:
            with load_factors.changing(self.path, waits=False) as found:
                found.update(taught)
            self.written = taught, found, os.stat(self.path).st_mtime_ns, ""
        except BlockingIOError:
            return
        except OSError as error:  # it counts until LinuxCNC ends
            self.written = taught, None, None, error.strerror or str(error)
        except CycleError as error:
            self.written = taught, None, None, unnamed(error).partition("; ")[0]
        except Exception as error:  # it is tried again with the next factor, not at every look
            self.written = taught, None, None, f"{type(error).__name__}: {error}"

    def took(self, taught, found, stamp, reason):
        """Factors are in the file, or cannot be for a reason; those that have been taught meanwhile are next."""
        told = set(taught) if found else self.due & set(taught)
        if found:
            self.unkept = {key: factor for key, factor in self.unkept.items() if key not in taught}
            self.factors, self.stamp = {**found, **self.unkept}, stamp
        for tool, material in sorted(told):
            self.saying.tell(
                (TAUGHT if found else NOT_KEPT).format(
                    factor=self.factors[tool, material],
                    tool=tool,
                    material=material,
                    file=os.path.basename(self.path),
                    reason=reason,
                )
            )
        self.due -= set(taught)

    def end(self):
        """Until what has been taught is on the disk; a file that somebody else is writing is tried once more."""
        for _ in range(2):
            self.aside.wait()
            self.look()
        self.aside.wait()

    def report(self, key, line):
        """An alarm, once."""
        alarm, before = self.pins["load-alarm"], self.said_alarm
        self.said_alarm = alarm
        if alarm in (before, LoadAlarm.SOUND) or alarm not in LOAD_ALARMS:
            return
        taught = self.factors.get(key, 0.0)
        at = line()
        ratio = self.pins["load-ratio"] / taught if taught > 0.0 else 0.0
        self.say(LOAD_ALARMS[alarm].format(where=f"{f'line {at}' if at > 0 else 'MDI'}, tool {key[0]}", ratio=ratio))

    def compare_unit(self, key):
        """A cut whose ratio cannot be a factor teaches nothing, without a word from the realtime side: as if
        spindle-load is a share and the scale 1."""
        ratio = self.pins["load-ratio"]
        strange = ratio > 0.0 and not load_factors.LEAST < ratio < 0.99 * load_factors.MOST and key not in self.factors
        self.strange = self.strange + 1 if strange else 0
        if self.strange >= STRANGE_LOOKS and not self.said_strange:
            self.said_strange = True
            self.saying.tell(STRANGE.format(ratio=ratio, tool=key[0]))
