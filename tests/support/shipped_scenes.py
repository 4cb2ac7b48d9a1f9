# SPDX-License-Identifier: GPL-2.0-or-later
"""What happens in the shipped form: each function is a scene of tests/shipped, run as root by shipped_machine.py.

A scene does and reports; the test judges.
"""

import contextlib
import json
import os
import shutil
import time
import urllib.request
from pathlib import Path

import numpy as np

from support import shadow_runs
from support.shipped_machine import LOGS
from support.shipped_person import KEY, Person, Trouble, memory, scripted, text_of, wait
from support.shipped_screen import Keys, picture, start_x

# --- the stock outlives ----------------------------------------------------------------------------------------------

BOX = "M250 P0 Q0 R-10 I60 J40 K10"
CUT = [["mdi", "G0 X-5 Y20"], ["mdi", "G0 Z-2"], ["mdi", "G1 X30 F2000"], ["mdi", "G0 Z5"]]
KEPT = [scripted("DISPLAY = axis"), ("KEEP_STOCK = no", "KEEP_STOCK = yes")]


def stock():
    """Save, cut on, restore, quit; start again."""
    op = Person()
    ini = op.edit("mill.ini", *KEPT, name="scripted.ini")
    first = op.steps(
        ini,
        [
            ["home"],
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            *CUT,
            ["map_sum"],
            ["mdi", "M253 P3"],
            ["mdi", "G0 X-5 Y5"],
            ["mdi", "G0 Z-8"],
            ["mdi", "G1 X30 F2000"],
            ["mdi", "G0 Z5"],
            ["map_sum"],
            ["mdi", "M254 P3"],
            ["map_sum"],
            ["errors"],
        ],
    )
    folder = op.own_configs() + "/stock"
    files = {
        name: [os.stat(f"{folder}/{name}").st_uid, os.stat(f"{folder}/{name}").st_size]
        for name in sorted(os.listdir(folder))
    }
    quit_left = [list(op.left().values()), sorted(memory())]
    again = op.steps(ini, [["map_sum"], ["home"], ["errors"]])
    return {
        "errors": first[-1],
        "sums": [first[k] for k in (7, 13, 15)],
        "files": files,
        "uid": os.stat(op.home).st_uid,
        "left": quit_left,
        "again": again[0],
        "again_errors": again[2],
    }


def shadow(texts, word, sampler):
    """Programs with SHADOW = `word`: {name: [operator errors, whether no servo period is lost, what was said of the
    stock, pins]}; rows in which something moves in NAME.npy.  sampler: text of hal/headless.hal, which is not
    installed."""
    op = Person()
    op.write(op.own_configs() + "/headless.hal", sampler)
    hal = next(
        line
        for line in text_of(op.own_configs() + "/mill.ini").splitlines()
        if line.startswith("HALFILE") and line.endswith("chipwise.hal")
    )
    ini = op.edit(
        "mill.ini",
        scripted("DISPLAY = axis"),
        (hal, f"{hal}\nHALFILE = headless.hal"),
        ("KEEP_STOCK = no", f"KEEP_STOCK = no\nSHADOW = {word}"),
        name="scripted.ini",
    )
    paths = [Path(op.write(f"{op.home}/{name}.ngc", text)) for name, text in texts.items()]
    answers, found = op.steps(ini, [["home"], *shadow_runs.steps_of(paths, word == "yes")])[1:], {}
    for at, path in enumerate(paths):
        said, (errors, log), pins = answers[9 * at + 6 : 9 * at + 9]
        rows = shadow_runs.moves(log)
        found[path.stem] = errors, rows is not None, said or [], pins
        np.save(f"{LOGS}/{path.stem}.npy", np.zeros((0, 5)) if rows is None else rows)
    return found


def killed(victims):
    """Start, cut, kill -9 a victim, end what is left of LinuxCNC as an operator does, start again, with the next
    victim."""
    op, seen = Person(), []
    ini = op.edit("mill.ini", *KEPT, name="scripted.ini")
    kept = op.own_configs() + "/stock/kept.stock"
    for victim in [*victims, ""]:
        before = {"victim": victim, "kept": os.path.exists(kept)}
        look = [
            "program",
            "sh",
            "-c",
            "halcmd -s getp stock-tracker.0.stock-defined; halcmd -s getp stock-tracker.0.removed-volume",
        ]
        steps = [
            ["home"],
            *([["map_sum"]] if before["kept"] else []),
            look,
            ["errors"],
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            *CUT,
            look,
        ]
        steps += [["kept", op.own_configs() + "/stock/kept.journal"]] if victim == "all" else []
        if victim:
            op.hold(ini, steps)
            before |= {
                "volume": op.getp("stock-tracker.0.removed-volume"),
                "fault": op.getp("stock-tracker.0.fault-code"),
                "said": op.said()[-3000:],
            }
            strike(op, victim)
        else:
            before["answers"] = op.steps(ini, steps)
        seen.append(before)
    return {"seen": seen, "left": list(op.left().values()), "memory": sorted(memory())}


def strike(op, victim):
    """Kill the victim, and half a second later the screen: the linuxcnc script then clears up; `all`: everything, at
    once."""
    there = op.programs()
    if victim == "all":
        op.kill_all()
        return
    struck = [pid for pid, line in there.items() if victim in line]
    if not struck:
        raise Trouble(f"no {victim} among {there}")
    for pid in struck:
        op.run("kill", "-9", str(pid))
    time.sleep(0.5)
    for pid, line in there.items():
        if "scripted_display" in line or line.startswith("sleep 1000"):
            op.run("kill", "-9", str(pid))
    op.until_ended()
    op.kill_all()  # what the linuxcnc script has left: after a kill of itself everything


def realtime():
    """LinuxCNC in its realtime form: memory locked, SCHED_FIFO. Cut, kill rtapi_app, cut again.

    Its first step is to lift RLIMIT_RTPRIO, which root needs CAP_SYS_RESOURCE for: on a machine without, rlimit.so (of
    the test) says that it is lifted. LinuxCNC needs it for nothing else.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError as error:
        return {"without": f"SCHED_FIFO: {error.strerror}"}
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    shutil.copy(LOGS + "/rlimit.so", "/usr/lib/rlimit.so")
    with open("/etc/ld.so.preload", "w") as file:
        file.write("/usr/lib/rlimit.so\n")
    op, seen = Person(), []
    ini = op.edit("mill.ini", *KEPT, name="scripted.ini")
    for _ in range(2):
        op.hold(ini, [["home"], ["mdi", "T1 M6"], ["mdi", BOX], *CUT], LINUXCNC_FORCE_REALTIME="1")
        server = next(pid for pid, line in op.programs().items() if line.split()[0].endswith("rtapi_app"))
        locked = next(
            line.split()[1] for line in text_of(f"/proc/{server}/status").splitlines() if line.startswith("VmLck")
        )
        seen.append(
            {
                "threads": [os.sched_getscheduler(int(thread)) for thread in os.listdir(f"/proc/{server}/task")],
                "locked": 1024 * int(locked),
                "map": memory()[KEY],
                "volume": op.getp("stock-tracker.0.removed-volume"),
                "fault": op.getp("stock-tracker.0.fault-code"),
                "said": op.said()[-6000:],
            }
        )
        strike(op, "rtapi_app")
    return {"seen": seen, "left": list(op.left().values()), "memory": sorted(memory()), "without": ""}


# --- two users --------------------------------------------------------------------------------------------------------


def second_user():
    """op's LinuxCNC is killed with all of its processes; other starts one: told what to do, does it, and it works.

    LinuxCNC's own memory and lock, which would stop the other user before chipwise is asked, are removed first, as a
    LinuxCNC of op's without chipwise removes them.
    """
    op, other, found = Person("op"), Person("other"), {}
    ini = op.edit("mill.ini", scripted("DISPLAY = axis"), name="scripted.ini")
    op.hold(ini, [["home"]])
    strike(op, "all")
    found["owner of the map"] = memory()[KEY]["uid"]
    for key in memory():
        if key != KEY:
            op.run("ipcrm", "-M", hex(key))
    op.run("ipcrm", "--all=sem")
    os.unlink("/tmp/linuxcnc.lock")
    ini = other.edit("mill.ini", scripted("DISPLAY = axis"), name="scripted.ini")
    other.start(ini, CHIPWISE_STEPS=json.dumps([["home"]]), CHIPWISE_ANSWERS=other.home + "/answers.json")
    found["refused"] = [other.until_ended(), text_of(other.log).replace("\r", "")]
    other.left()  # linuxcncsvr takes LinuxCNC's memory along when it ends
    found["not allowed"] = other.run("ipcrm", "-M", hex(KEY))
    found["remedy"] = op.run("ipcrm", "-M", hex(KEY))
    found["then"] = other.steps(
        ini, [["home"], ["mdi", "T1 M6"], ["mdi", BOX], *CUT, ["pins", "stock-tracker.0.removed-volume"], ["errors"]]
    )
    found["uids"] = [os.stat(op.home).st_uid, os.stat(other.home).st_uid]
    return found


# --- screens ----------------------------------------------------------------------------------------------------------

PROGRAM = """(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-20,XMAX=60,YMAX=40,ZMAX=0)
G17 G21 G40 G49 G54 G80 G90 G94
G64 P0.01
T3 M6
M250
M251 P2 Q30 E5000
S12000 M3
F1200
G0 X-8 Y20 Z5
Z-5
G1 X68
G0 Z20
M252
M5
M2
"""


def axis():
    """From E-stop to the end line by keys, the page beside it, and quit; started from a terminal."""
    op = Person(display=start_x())
    ini = op.edit("mill.ini")
    program = op.write(op.home + "/cut.ngc", PROGRAM)
    op.start(ini)
    keys = Keys(op.display)
    with pictured(op, "axis"):
        x, y, *_size = wait("the window", lambda: keys.window("chipwise mill"))
        op.until_component("chipwise-display")
        keys.point(x + 200, y + 10)
        op.until_pin("iocontrol.0.user-enable-out", "TRUE", lambda: keys.press("F1"))
        op.until_pin("motion.motion-enabled", "TRUE", lambda: keys.press("F2"))
        op.until_pin("joint.2.homed", "TRUE", lambda: keys.press("Home", "Control_L"))
        keys.press("o")
        x, y, *_size = wait("the file dialog", lambda: keys.window("Open"))
        keys.point(x + 50, y + 50)
        keys.type(program)
        keys.press("Return")
        wait("the file dialog closes", lambda: not keys.window("Open"))
        keys.point(200, 10)
        op.until_pin("stock-tracker.0.stock-defined", "TRUE", lambda: keys.press("r"))
        op.until_said("chipwise: cut.ngc: ")
        found = after_the_program(op)
        close(op, "/axis -ini")
        return {**found, "status": op.until_ended(), "left": op.left()}


def gmoccapy():
    """The same by the buttons of the screen, started from a menu: the pins of gmoccapy are there for buttons of a
    machine's own panel."""
    op = Person(display=start_x())
    ini = op.edit("mill_gmoccapy.ini")
    program = op.write(op.home + "/cut.ngc", PROGRAM)
    op.write(
        os.path.dirname(ini) + "/gmoccapy.pref", f"[DEFAULT]\nopen_file = {program}\n"
    )  # the last program, opened again
    op.start(ini, terminal=False)
    keys = Keys(op.display)

    def press(button):
        for text in ("1", "0"):
            op.run("halcmd", "setp", f"gmoccapy.{button}", text)
            time.sleep(0.5)  # the screen looks ten times a second

    with pictured(op, "gmoccapy"):
        wait("the window", lambda: keys.window("moccapy"))
        op.until_component("chipwise-display")
        op.until_pin("iocontrol.0.user-enable-out", "TRUE", lambda: press("v-button.button-0"))
        op.until_pin("motion.motion-enabled", "TRUE", lambda: press("v-button.button-1"))
        op.until_pin(
            "joint.2.homed", "TRUE", lambda: (press("h-button.button-0"), time.sleep(2.0), press("h-button.button-1"))
        )
        op.until_pin(
            "stock-tracker.0.stock-defined",
            "TRUE",
            lambda: (press("v-button.button-4"), time.sleep(2.0), press("h-button.button-2")),
        )
        op.until_said("chipwise: cut.ngc: ")
        found = after_the_program(op)
        close(op, "/gmoccapy -ini")
        wait("LinuxCNC's window of errors", lambda: close(op, "show_errors.tcl"))
        return {**found, "status": op.until_ended(), "left": op.left()}


def close(op, words):
    """End the programs of the user with these words, a screen above all; -> whether there was one.  The linuxcnc script
    clears up then."""
    there = [pid for pid, line in op.programs().items() if words in line]
    for pid in there:
        op.run("kill", "-9", str(pid))  # gmoccapy hears no SIGTERM
    return bool(there)


@contextlib.contextmanager
def pictured(op, name):
    """A picture of the screen where something fails, and what LinuxCNC has said."""
    try:
        yield
    except BaseException:
        picture(op.display, f"{LOGS}/{name}.png")
        print(op.said()[-4000:])
        raise


def after_the_program(op):
    """What there is at the end of PROGRAM: the end line, the pins, the page."""
    with urllib.request.urlopen("http://127.0.0.1:8250/", timeout=300) as page:
        html = page.read().decode()
    line = next(line for line in op.said().splitlines() if line.startswith("chipwise: cut.ngc: "))
    return {
        "line": line,
        "removed": float(op.getp("stock-tracker.0.removed-volume")),
        "fault": op.getp("stock-tracker.0.fault-code"),
        "page": [page.status, html],
    }


# --- the measured load on the page ------------------------------------------------------------------------------------

SPINDLE = """loadrt spindle_sim
addf spindle-sim.0 servo-thread
net sim-spindle => spindle-sim.0.speed-cmd
net spindle-power volumetric-feed.0.power => spindle-sim.0.cut-power
net spindle-load spindle-sim.0.load => volumetric-feed.0.spindle-load
"""
SLOT = (
    f"(MATERIAL,NAME=6061)\nG21 G90 G64 P0.01\nT1 M6\n{BOX}\nS6000 M3\nF600\nG0 X-30 Y20 Z5\nG0 Z-4\nG1 X70\n"
    f"G0 Z5\nM2\n"
)


def load():
    """A slot in 6061 by a spindle whose inverter gives its load; the page while it is cut, and at the end."""
    op = Person()
    op.write(op.own_configs() + "/spindle.hal", SPINDLE)
    hal = next(
        line
        for line in text_of(op.own_configs() + "/mill.ini").splitlines()
        if line.startswith("HALFILE") and line.endswith("chipwise.hal")
    )
    ini = op.edit("mill.ini", scripted("DISPLAY = axis"), (hal, f"{hal}\nHALFILE = spindle.hal"), name="scripted.ini")
    op.begin(
        ini,
        [
            ["home"],
            ["start", SLOT],
            ["finish"],
            ["errors"],
            ["program", "touch", op.home + "/done"],
            ["program", "sleep", "3"],
        ],
    )
    seen = []

    def look():
        with (
            contextlib.suppress(OSError),
            urllib.request.urlopen("http://127.0.0.1:8250/state.json", timeout=300) as page,
        ):
            state = json.loads(page.read())
            seen.append({name: state.get(name) for name in ("loads", "power")})
        return os.path.exists(op.home + "/done") or op.linuxcnc.poll() is not None

    wait("the end of the program", look)
    answers = op.answered()
    return {"seen": seen, "errors": answers[3], "left": op.left()}
