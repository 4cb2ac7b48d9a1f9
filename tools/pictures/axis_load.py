# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes docs/user/axis.gif: AXIS with chipwise's tab on the simulated mill while nc_files/slots.ngc runs.

    /usr/bin/python3 tools/pictures/axis_load.py [OUTPUT.gif]

The real LinuxCNC, AXIS and panel on a virtual X display in bin/chipwise-sandbox; the run is driven by linuxcnc.command,
as a person would by keys.  Needs Xvfb and python3-pil, which the tests and LinuxCNC bring, and a computer with nothing
else to do: the machine runs in real time.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "remap"))

from chipwise.host import processes  # noqa: E402

WIDTH, HEIGHT = 954, 720  # of the display: that of the window
SHOWN = 700  # pixels, of the picture
EACH_S = 0.6  # between two frames
FASTER = 4  # the picture shows so many seconds in one
COLOURS = 48
START_S, RUN_S = 60.0, 240.0


def record(folder):
    """In the sandbox, with LinuxCNC: the frames of a run, as PNG files in a folder."""
    import linuxcnc
    from PIL import ImageGrab

    command, status = linuxcnc.command(), linuxcnc.stat()

    def until(what, reached, seconds):
        end = time.monotonic() + seconds
        while True:
            status.poll()
            if reached():
                return
            if time.monotonic() > end:
                raise SystemExit(f"axis_load: {what} does not come within {seconds:g} s")
            time.sleep(0.05)

    until("the program", lambda: status.file.endswith("slots.ngc"), START_S)
    time.sleep(6.0)  # AXIS draws it, and the panel is there
    for step in (
        lambda: command.state(linuxcnc.STATE_ESTOP_RESET),
        lambda: command.state(linuxcnc.STATE_ON),
        lambda: command.mode(linuxcnc.MODE_MANUAL),
        lambda: command.teleop_enable(0),
        lambda: command.home(-1),
    ):
        step()
        command.wait_complete()
    until("the end of homing", lambda: all(status.homed[:3]), START_S)
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.auto(linuxcnc.AUTO_RUN, 0)
    until("the start", lambda: status.interp_state != linuxcnc.INTERP_IDLE, START_S)
    begin, number = time.monotonic(), 0
    while status.interp_state != linuxcnc.INTERP_IDLE and time.monotonic() - begin < RUN_S:
        ImageGrab.grab(xdisplay=os.environ["DISPLAY"]).save(os.path.join(folder, f"{number:04d}.png"))
        number += 1
        time.sleep(max(0.0, begin + number * EACH_S - time.monotonic()))
        status.poll()


def in_sandbox(folder):
    """LinuxCNC with AXIS, and record() beside it; the sandbox ends what is left."""
    ini = ROOT / "configs" / "mill_picture.ini"  # in the sandbox's own copy of the folder
    ini.write_text(
        (ROOT / "configs" / "mill.ini")
        .read_text()
        .replace("[DISPLAY]\n", f"[DISPLAY]\nOPEN_FILE = {ROOT}/nc_files/slots.ngc\n", 1)
    )
    with open(os.path.join(folder, "linuxcnc.txt"), "w", encoding="utf-8") as log:
        subprocess.Popen(["linuxcnc", "-r", str(ini)], stdout=log, stderr=log, stdin=subprocess.DEVNULL)
        end = time.monotonic() + START_S
        while not processes.named("milltask"):
            if time.monotonic() > end:
                raise SystemExit(
                    "axis_load: LinuxCNC does not start: " + Path(folder, "linuxcnc.txt").read_text()[-2000:]
                )
            time.sleep(0.2)
        time.sleep(2.0)
        record(folder)


def joined(folder, path):
    """One GIF of the frames, with one table of colours."""
    from PIL import Image

    names = sorted(Path(folder).glob("*.png"))
    if len(names) < 10:
        raise SystemExit(f"axis_load: {len(names)} frames only; see {folder}/linuxcnc.txt")
    frames = [Image.open(name).convert("RGB").resize((SHOWN, SHOWN * HEIGHT // WIDTH), Image.LANCZOS) for name in names]
    some = frames[:: len(frames) // 8]
    strip = Image.new("RGB", (SHOWN, some[0].height * len(some)))
    for number, frame in enumerate(some):
        strip.paste(frame, (0, number * frame.height))
    table = strip.quantize(COLOURS, dither=Image.NONE)
    frames = [frame.quantize(palette=table, dither=Image.NONE) for frame in frames]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=int(1000 * EACH_S / FASTER), loop=0, optimize=True
    )
    print(f"{path}: {len(frames)} frames, {os.path.getsize(path) / 1e6:.2f} MB")


def main():
    if sys.argv[1:2] == ["--record"]:
        in_sandbox(sys.argv[2])
        return
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o777)
        subprocess.run(
            [
                str(ROOT / "bin" / "chipwise-sandbox"),
                "--timeout",
                "420",
                "--xvfb",
                f"{WIDTH}x{HEIGHT}",
                "--",
                sys.executable,
                __file__,
                "--record",
                folder,
            ],
            check=True,
        )
        joined(folder, sys.argv[1] if sys.argv[1:] else str(ROOT / "docs" / "user" / "axis.gif"))


if __name__ == "__main__":
    main()
