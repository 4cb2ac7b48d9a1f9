# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes docs/user/panel.png, panel_log.png, panel_entry.png and panel_tools.png: the page of `chipwise panel` in
Debian's chromium, a stock cut by the core, a machine set by hand.

    /usr/bin/python3 tools/pictures/panel.py

Needs chromium, chromium-driver and python3-selenium.
"""

import math
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "remap")]

from chipwise.entry import mdi  # noqa: E402
from chipwise.panel import entry, entry_process  # noqa: E402
from chipwise.panel.look_ahead import Ahead  # noqa: E402
from chipwise.panel.watch import LOOK_S  # noqa: E402
from support import panel_browser, panel_rig  # noqa: E402

ENTERED = "179,-6,,2"  # of G79
TARGET = 6000.0  # mm3/min
STEP = 0.417  # mm in a look
CEILING = 20.0  # mm/s, the velocity that M251 asks for; the override is a share of it
SHARE = TARGET / 60.0 / 24.0 / CEILING  # at a rate of TARGET in a section of 24 mm2
FEED_PER_TOOTH, WATTS = 0.026, 0.015  # mm at a rate of TARGET; W for each mm3/min
IDLE, MEASURED = 40.0, 1.08  # W of the spindle in air; measured over predicted power of the cut
# Of TARGET: target and rate of each pass, and what limits it: stock ahead; the lower bound, which is above the target;
# stock here.
PASSES = [(1.0, 1.0, 2.0), (0.75, 1.0, 3.0), (1.5, 1.5, 1.0)]
SLOT = [(-10.0, 10.0), (52.0, 10.0), (52.0, 30.0), (24.0, 30.0)]
# The loaded program: the slot to its end, and a pocket in it.
PROGRAM = """G21 G90
T1 M6
S9000 M3
F600
G0 X-10 Y10 Z5
G1 Z-4
G1 X52
G1 Y30 Z-7
G1 X8
G1 Y18
G0 Z5
G0 X24 Y18
G79 Q100 Z-5 R1
M2
o100 sub
G0 X14 Y15
G1 X46
G1 Y25
G1 X14
G1 Y15
o100 endsub
"""


def sums(values, seconds):
    """Of the run: as volumetric_feed adds them up."""
    cuts = values["mrr"] > 0.0
    values["run_time"] += seconds
    values["fed_time"] += seconds
    values["saved_time"] += seconds * (values["current_vel"] / values["programmed_vel"] - 1.0)
    values["cut_time"] += seconds * cuts
    values["air_time"] += seconds * (not cuts)
    values["peak_rate"] = max(values["peak_rate"], values["mrr"])
    values["mean_rate"] = values["removed"] / max(values["cut_time"], LOOK_S) * 60.0


def cut(rig, program):
    """A slot in two depths along SLOT, a look each STEP."""
    values = rig.machine.values
    values.update(
        mode=2.0,
        motion_type=2.0,
        target=TARGET,
        limited_by=1.0,
        override=SHARE,
        tool=1.0,
        tool_flute_length=20.0,
        max_chip=0.05,
        max_power=250.0,
        spindle_load_scale=1.0,
        load_idle=IDLE,
        load_factor=MEASURED,
        load_ratio=MEASURED,
        area=24.0,
        area_ahead=24.0,
        depth=4.0,
        requested_vel=CEILING,
        programmed_vel=10.0,
    )
    rig.machine.tasks.update(program=program, running=True)
    at = (*SLOT[0], -4.0)
    for number, (corner, (share, rate, limit)) in enumerate(zip(SLOT[1:], PASSES)):
        values.update(
            line=7.0 + number,
            target=share * TARGET,
            limited_by=limit,
            override=SHARE * rate,
            current_vel=CEILING * SHARE * rate,
        )
        count = math.ceil(math.dist(at[:2], corner) / STEP)
        start = at
        for k in range(1, count + 1):
            there = tuple(a + (b - a) * k / count for a, b in zip(start, (*corner, -4.0 if corner[1] < 20 else -7.0)))
            rig.machine.cut(at, there)
            values["mrr"] = rate * TARGET * (0.98 + 0.02 * math.sin(k)) * min(1.0, k / 8) if there[0] > 0 else 0.0
            values["chip"], values["power"] = FEED_PER_TOOTH * rate * (values["mrr"] > 0.0), values["mrr"] * WATTS
            values["spindle_load"] = IDLE + values["power"] * MEASURED
            values["removed"] += values["mrr"] / 60 * LOOK_S
            sums(values, LOOK_S)
            at = there
            rig.look()


def goes_on(rig, look, end):
    """Looks at a cut that goes on at the same rate."""
    while not end.is_set():
        before = time.monotonic()
        look()
        time.sleep(LOOK_S)
        passed = time.monotonic() - before
        rig.machine.values["removed"] += rig.machine.values["mrr"] / 60 * passed
        sums(rig.machine.values, passed)


class Mdi:
    """entry/mdi.py of a machine at rest, with the program that has the pocket."""

    State, check = mdi.State, staticmethod(mdi.check)

    @staticmethod
    def read():
        return mdi.State(tool=1, position=(0.0, 0.0, 5.0), program=str(ROOT / "nc_files" / "pocket.ngc"))


def entry_picture(folder):
    """docs/user/panel_entry.png and panel_tools.png."""
    found = entry.Lines(str(ROOT / "configs" / "mill.ini"), lambda order: entry_process.answer(order, Mdi))
    with panel_rig.serving("a-word-of-yours", lines=found) as rig:
        rig.machine.tasks["program"] = "pocket.ngc"
        rig.looks()
        driver = panel_browser.browser(folder)
        try:
            panel_browser.opened(driver, rig.url)
            panel_browser.enter_token(driver, "a-word-of-yours")
            driver.find_element("id", "enter").click()
            panel_browser.wait(driver, "document.getElementById('code').options.length", "the codes")
            panel_browser.typed(driver, "G79", ENTERED)
            panel_browser.wait(driver, "document.getElementById('entry-drawing').complete", "the drawing")
            driver.save_screenshot(str(ROOT / "docs" / "user" / "panel_entry.png"))
            driver.find_element("id", "geometry-open").click()
            panel_browser.wait(driver, "document.getElementById('geometry-flute_length')", "the form of a tool")
            driver.save_screenshot(str(ROOT / "docs" / "user" / "panel_tools.png"))
        finally:
            driver.quit()


def main():
    if panel_browser.missing():
        sys.exit(panel_browser.missing())
    with (
        tempfile.TemporaryDirectory() as folder,
        panel_rig.serving(ahead=Ahead(str(ROOT / "configs" / "mill.ini"))) as rig,
    ):
        program = Path(folder) / "slots.ngc"
        program.write_text(PROGRAM)
        rig.machine.loaded = {
            "program": str(program),
            "index": 1,
            "offset": [0.0] * 3,
            "g92": [0.0] * 3,
            "turn": 0.0,
            "tool": 1,
            "codes": "G21 G17 G90 G91.1",
            "block_delete": False,
        }
        rig.watch.pages = 1  # until the path has been read
        rig.wait(lambda: rig.look() or rig.watch.ahead.state()["from"] is not None)
        rig.watch.pages = 0
        clock, real = [time.monotonic()], time.monotonic
        time.monotonic = lambda: clock[0]

        def look():
            clock[0] += LOOK_S
            look.once()

        look.once, rig.look = rig.look, look
        cut(rig, str(program))
        shift = clock[0] - real()
        time.monotonic = lambda: real() + shift
        going = threading.Event()
        threading.Thread(target=goes_on, args=(rig, look.once, going), daemon=True).start()
        panel_browser.picture(rig.url, str(ROOT / "docs" / "user" / "panel.png"), folder)
        panel_browser.picture(
            rig.url,
            str(ROOT / "docs" / "user" / "panel_log.png"),
            folder,
            section="log-open",
            reached="document.querySelectorAll('#log-operations tr').length",
        )
        going.set()
    with tempfile.TemporaryDirectory() as folder:
        entry_picture(folder)


if __name__ == "__main__":
    main()
