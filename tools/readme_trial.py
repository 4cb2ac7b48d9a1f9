# SPDX-License-Identifier: GPL-2.0-or-later
"""README's commands on a bare Debian, then the first program in AXIS; called in it by tools/try_readme, as an ordinary
user with sudo.

    readme_trial.py RELEASE [packages]

 1. `make run` with a display; with "packages": apt install build/deb/chipwise*.deb, chipwise new-config, linuxcnc on
    its mill.ini.
 2. As a person does: E-stop off (F1), machine on (F2), home all (Ctrl-Home), open slots.ngc, run (R).
 3. The program has to end, and no line of it may be refused.  Pictures of the screen before and after go to
    build/readme.

Prints the minutes until AXIS was there.  Exit status 1 with the reason.
"""

import glob
import os
import signal
import subprocess
import sys
import time

DISPLAY = ":7"
START_S, RUN_S = 2400, 900
LOOK = """
import linuxcnc, sys
stat, errors = linuxcnc.stat(), linuxcnc.error_channel()
stat.poll()
print(stat.task_state, stat.interp_state, sum(stat.homed[:3]), stat.file or '-', stat.motion_line)
"""


def shot(name):
    subprocess.run(["import", "-window", "root", "build/readme/%s.png" % name], check=True)


def keys(*names):
    window = subprocess.run(
        ["xdotool", "search", "--name", "AXIS|chipwise mill"], text=True, stdout=subprocess.PIPE
    ).stdout.split()
    if window:
        subprocess.run(["xdotool", "windowfocus", window[-1]], stderr=subprocess.DEVNULL)
    subprocess.run(["xdotool", "key", *names], check=True)


def state():
    """-> (task state, interpreter state, joints homed, file, line); zeros before LinuxCNC is there."""
    done = subprocess.run(["python3", "-c", LOOK], text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    words = done.stdout.split()
    return (
        (int(words[0]), int(words[1]), int(words[2]), words[3], int(words[4])) if len(words) == 5 else (0, 0, 0, "-", 0)
    )


def until(condition, seconds, what):
    """Wait for a state that stays."""
    end = time.monotonic() + seconds
    while not condition(state()):
        if time.monotonic() > end:
            shot("failed")
            sys.exit(
                "readme_trial: %s did not come in %d s; the state is %s; see build/readme/failed.png"
                % (what, seconds, state())
            )
        time.sleep(1)


def start(by_packages):
    """-> the process that ends with LinuxCNC."""
    if not by_packages:
        return subprocess.Popen(["make", "run"], stdin=subprocess.DEVNULL, start_new_session=True)
    number = {"bookworm": 12, "trixie": 13}[sys.argv[1]]
    packages = sorted(os.path.abspath(path) for path in glob.glob("build/deb/chipwise*+deb%du*.deb" % number))
    subprocess.run(
        ["sudo", "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q", "-y", "install", *packages],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run(["chipwise", "new-config"], check=True)
    return subprocess.Popen(
        ["linuxcnc", os.path.expanduser("~/linuxcnc/configs/chipwise/mill.ini")],
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    )


def main():
    by_packages = sys.argv[2:] == ["packages"]
    name = sys.argv[1] + ("-packages" if by_packages else "")
    os.makedirs("build/readme", exist_ok=True)
    os.environ["DISPLAY"] = DISPLAY
    screen = subprocess.Popen(
        ["Xvfb", DISPLAY, "-screen", "0", "1280x1024x24"], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    begin = time.monotonic()
    machine = start(by_packages)
    until(
        lambda now: (
            now[0] > 0
            and subprocess.run(
                ["xdotool", "search", "--name", "AXIS|chipwise mill"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            ).returncode
            == 0
        ),
        START_S,
        "AXIS",
    )
    print("readme_trial: AXIS is there after %.1f minutes" % ((time.monotonic() - begin) / 60), flush=True)
    time.sleep(10)
    keys("F1")
    until(lambda now: now[0] >= 2, 30, "the end of the E-stop")
    keys("F2")
    until(lambda now: now[0] == 4, 30, "machine on")
    keys("ctrl+Home")
    until(lambda now: now[2] == 3, 120, "home")
    shot(name + "-homed")
    folder = os.path.expanduser("~/linuxcnc/configs/chipwise" if by_packages else "~/chipwise")
    subprocess.run(["axis-remote", folder + "/nc_files/slots.ngc"], check=True)
    until(lambda now: now[3].endswith("/slots.ngc"), 60, "the program")
    time.sleep(5)
    keys("r")
    until(lambda now: now[1] != 1, 30, "the start of the program")
    until(lambda now: now[1] == 1, RUN_S, "the end of the program")
    time.sleep(5)  # the screen shows the end line
    shot(name + "-end")
    print("readme_trial: slots.ngc ran to its end; screenshots %s-homed.png and %s-end.png" % (name, name), flush=True)
    os.killpg(machine.pid, signal.SIGTERM)
    machine.wait(60)
    screen.terminate()


if __name__ == "__main__":
    main()
