# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise panel beside a real LinuxCNC that cuts on a map of 1000 x 600 cells: computing time of the server, age of
the pictures.

Times of the server are computing times of its process for a look at the machine, times ten: the share of a core at ten
looks a second, also on a computer that is too busy for so many.
The age of a picture is from the look at the machine to the drawn picture in Debian's chromium, if that is installed.
The path ahead: a program of MOVES short moves is read, and followed; `bench_panel.py path` measures that alone.
"""

import json
import math
import os
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

from roots import ROOT
from rows import row

from chipwise.host import processes
from support import panel_browser, panel_client
from support.operate import operate

URL = "http://127.0.0.1:8250"
PAGES = (0, 1, 10)
SECONDS = 20.0
MAP = "s/^MAP_SIZE = .*/MAP_SIZE = 250 150/"
# Slots across 250 x 150 mm for as long as it is measured.
PROGRAM = (
    "G21 G90 G64 P0.01\nT8 M6\nM250 P0 Q0 R-10 I250 J150 K10\nS1000 M3\nF1500\nG0 X-10 Y0 Z5\nG1 Z-2\nM251 P1 Q20\n"
    + "".join(f"G1 Y{y}\nG1 X{260 if k % 2 == 0 else -10}\n" for k, y in enumerate(range(5, 146, 14)))
    + "M2\n"
)
MOVES = 1_000_000  # of 0.03 to 0.15 mm
PERIODS = ("motion-controller.time", "stock-tracker.0.time")


def panel():
    """PID of the server."""
    return next(pid for pid in processes.pids() if processes.command_line(pid)[-1:] == [b"panel"])


def looks():
    """Looks of the server so far."""
    return json.loads(panel_client.request(URL, "/state.json")[2])["look"]


def times(names, count=400):
    """Medians of the times of realtime functions, ns."""
    import hal

    component = hal.component(f"bench-{os.getpid()}")
    component.ready()
    found = {name: [] for name in names}
    for _ in range(count):
        for name in names:
            found[name].append(hal.get_value(name))
        time.sleep(0.005)
    component.exit()
    return {name: statistics.median(values) for name, values in found.items()}


def inside(folder):
    """In LinuxCNC's own environment, while it cuts: one JSON line."""
    import subprocess

    client = [sys.executable, str(ROOT / "tests/support/panel_client.py"), URL]
    server, found = panel(), {}
    for pages in PAGES:
        readers = [subprocess.Popen([*client, str(SECONDS + 6)], stdout=subprocess.DEVNULL) for _ in range(pages)]
        time.sleep(3)
        used, first = processes.cpu_s(server), looks()
        time.sleep(SECONDS)
        count = looks() - first
        found[f"share {pages}"] = 10 * (processes.cpu_s(server) - used) / count
        found[f"looks {pages}"] = count / SECONDS
        found[f"times {pages}"] = times(PERIODS)
        for reader in readers:
            reader.wait()
    found["memory"] = processes.memory_bytes(server)[1]
    if not panel_browser.missing():
        driver = panel_browser.browser(folder)
        panel_browser.opened(driver, URL)
        panel_browser.opened(driver, URL)  # the first one waits for chromium's own start
        panel_browser.wait(driver, "chipwise.ageMs.length > 30", "thirty pictures")
        found.update(
            first=driver.execute_script("return chipwise.firstPicture"),
            ages=driver.execute_script("return chipwise.ageMs"),
        )
        driver.quit()
    print(json.dumps(found))


def show(*values, **more):
    print(json.dumps(row(*values, **more)), flush=True)


def path_ahead(folder):
    """Computing times of reading a program of MOVES moves and of following the tool on it."""
    from chipwise.panel import look_ahead, path_window as path_ahead

    program = folder / "path.ngc"
    with program.open("w") as file:
        file.write("G21 G90\nT1 M6\nF2000\nG0 X0 Y0 Z5\n")
        for k in range(MOVES):
            radius, angle = 10 + 2e-5 * k * 1e6 / MOVES, 0.003 * k
            file.write(
                f"G1 X{50 + radius * math.cos(angle):.3f} Y{40 + radius * math.sin(angle):.3f} Z{-5e-6 * k:.4f}\n"
            )
        file.write("M2\n")
    scene = {
        "program": str(program),
        "index": 1,
        "offset": [0.0] * 3,
        "g92": [0.0] * 3,
        "turn": 0.0,
        "tool": 1,
        "codes": "G21 G17 G90 G91.1",
        "block_delete": False,
    }
    reading, most = (
        look_ahead.Reading(
            {"ini": str(ROOT / "configs/mill.ini"), "program": str(program), "scene": scene, "tip": [0.0, 0.0, 5.0]}
        ),
        {},
    )
    while reading.found is None:
        for pid in [reading._child.pid, *processes.descendants(reading._child.pid)]:
            try:
                most[pid] = max(most.get(pid, 0), processes.memory_bytes(pid)[1])
            except OSError:
                pass
        time.sleep(0.1)
    path, used = reading.found[1], resource.getrusage(resource.RUSAGE_CHILDREN)
    show(
        f"path ahead of {MOVES} moves, read",
        used.ru_utime + used.ru_stime,
        "s",
        f"computing time; {len(path.points)} points, none of the program further than {path.step:g} mm",
    )
    show("path ahead, memory while it is read", sum(most.values()) / 2**20, "MiB", "largest of each process, added")
    places, began = range(1, len(path.s), len(path.s) // 1000), time.process_time()
    for k in places:
        path_ahead.follow(path, path.s[k - 1], path.points[k], int(path.high[k]), 20.0)
    show("path ahead, followed", 1000 * (time.process_time() - began) / len(places), "ms", "computing time of a look")


def main():
    with tempfile.TemporaryDirectory() as name:
        path_ahead(Path(name))
    if sys.argv[1:] == ["path"]:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o777)
        answers = operate(
            folder,
            [
                ["start", PROGRAM],
                ["until", "axis.x.pos-cmd", ">", 10],
                ["program", sys.executable, __file__, "inside", name],
                ["abort"],
            ],
            edit=MAP,
            speed=1,
            timeout=400,
        )
    status, text = answers[2]
    if status:
        sys.exit(text)
    found = json.loads(text.splitlines()[-1])
    for pages in PAGES:
        show(
            f"server, {pages} pages",
            100 * found[f"share {pages}"],
            "%",
            f"of a core at ten looks a second, 1000 x 600 cells; there were {found[f'looks {pages}']:.1f} a second",
            target=5 if pages == 1 else None,
        )
    for pin in PERIODS:
        for pages in PAGES:
            show(
                f"{pin}, {pages} pages",
                found[f"times {pages}"][pin] / 1000,
                "us",
                "median; at the clock of the processor then",
            )
    show("server, memory", found["memory"] / 2**20, "MiB")
    if "ages" in found:
        ages = sorted(found["ages"][10:])
        show("age of a picture, median", ages[len(ages) // 2], "ms", "look to drawn, software rendering", target=200)
        show("age of a picture, 95 %", ages[len(ages) * 95 // 100], "ms", "the same")
        show("first picture", found["first"], "ms", "from the request of the page, software rendering", target=1000)


if __name__ == "__main__":
    inside(sys.argv[2]) if sys.argv[1:2] == ["inside"] else main()
