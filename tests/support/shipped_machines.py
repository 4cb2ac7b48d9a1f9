# SPDX-License-Identifier: GPL-2.0-or-later
"""The other machines in the shipped form, and starts that fail: scenes as in shipped_scenes.py."""

import json
import os
import re
import subprocess
import time

from support import buried_tip, samples
from support.shipped_machine import LOGS, SHARE, TREE
from support.shipped_person import KEY, Person, scripted, text_of, wait
from support.shipped_screen import Keys, picture, start_x

SAMPLER = """
loadrt sampler depth=160000,160000 cfg=ffffsffffffssbb,fb
setp sampler.0.enable 0
addf sampler.0 servo-thread
addf sampler.1 servo-thread
net chipwise-section sampler.1.pin.0
net seen-known stock-tracker.0.path-known sampler.1.pin.1
loadusr halsampler -c 1 {path}
"""


def headless(program, ini="mill_headless.ini", seconds=240):
    """A program of the samples without a screen; -> the summary, and [section area, path known] of each servo
    period."""
    op = Person()
    configs = op.own_configs()
    path = op.write(op.home + "/known.txt", "")
    op.write(configs + "/headless.hal", SAMPLER.format(path=path))
    ini = op.edit(ini, (f"HALFILE = {SHARE}/hal/headless.hal", "HALFILE = headless.hal"))
    program = op.write(op.home + "/program.ngc", program) if "\n" in program else f"{configs}/nc_files/{program}"
    summary = op.home + "/summary.json"
    op.start(ini, CHIPWISE_PROGRAM=program, CHIPWISE_SUMMARY=summary, CHIPWISE_TIMEOUT=str(seconds))
    status = op.until_ended(seconds)
    rows = [line.split() for line in text_of(path).splitlines()]
    cutting = [row[1] for row in rows if len(row) == 2 and float(row[0]) > 0]
    return {
        "status": status,
        "summary": json.loads(text_of(summary) or "{}"),
        "cutting": len(cutting),
        "known": cutting.count("1"),
        "left": op.left(),
        "said": op.said(),
    }


def run_program(ini, program, seconds=180):
    """A program on lathe or robot, without a screen."""
    op = Person()
    summary = op.home + "/summary.json"
    op.start(
        f"{op.own_configs()}/{ini}",
        CHIPWISE_PROGRAM=op.write(op.home + "/program.ngc", program),
        CHIPWISE_SUMMARY=summary,
        CHIPWISE_TIMEOUT=str(seconds),
    )
    return {
        "status": op.until_ended(seconds),
        "summary": json.loads(text_of(summary) or "{}"),
        "left": op.left(),
        "said": op.said(),
    }


def sample(configuration):
    """One of LinuxCNC's sample configurations with README's three lines, worked on by sample_driver.py."""
    op = Person(display=start_x())
    chosen = samples.named(configuration)
    folder = op.home + "/sample"
    os.mkdir(folder)
    ini = samples.copied(chosen, folder)
    op.write(
        ini, text_of(ini).replace("/usr/local/share/chipwise", SHARE)
    )  # README: with the packages /usr/share in its place
    op.write(folder + "/job.json", json.dumps(samples.job_of(ini, chosen, watch=["stock-tracker.0.path-known"])))
    subprocess.run(["chown", "-R", f"{op.user}:", folder], check=True)
    status, said = op.run(
        "/usr/bin/python3", TREE + "/tests/support/sample_driver.py", ini, folder + "/job.json", folder + "/result.json"
    )
    picture(op.display, LOGS + "/sample.png")
    return {"status": status, "said": said, "result": json.loads(text_of(folder + "/result.json") or "{}")}


OTHER_COMPUTER = [
    "unshare",
    "--ipc",
    "--pid",
    "--mount",
    "--fork",
    "--mount-proc",
    "--kill-child",
    "sh",
    "-c",
    'mount -t tmpfs -o mode=1777 tmpfs /tmp && exec "$@"',
    "sh",
]

# A slave that gets no packet for 0.1 s stops, and one that had to brake may be behind by more than 1 mm: both are right
# on a machine, and both come on a computer whose other processes have the processors.
PATIENT = """
setp tracer-slave.0.dead-periods 60000
setp tracer-slave.0.max-behind 2000000000
setp tracer-offset.0.max-behind 100
"""


def _ini_of_pair(master, slave):
    """(INI file of the master, of the slave), which are linked."""
    slave.computer = OTHER_COMPUTER
    slave_ini = slave.edit("tracer_slave.ini", scripted("DISPLAY = axis"), name="scripted.ini")
    slave.write(f"{os.path.dirname(slave_ini)}/patient.hal", PATIENT)
    slave.write(
        slave_ini, re.sub("(?m)^(HALFILE = .*tracer_offset.hal)$", r"\1\nHALFILE = patient.hal", text_of(slave_ini))
    )
    head = "HALFILE = tracer_head_sim.hal"
    ini = master.edit(
        "tracer.ini",
        scripted("DISPLAY = axis"),
        (head, f"{head}\nHALFILE = {SHARE}/hal/tracer_link_master.hal"),
        name="scripted.ini",
    )
    master.write(ini, text_of(ini) + "\n[TRACER_LINK]\nSLAVE = 127.0.0.1:7134\n")
    return ini, slave_ini


def pair():
    """tracer.ini leads tracer_slave.ini, a LinuxCNC of another user with IPC and processes of its own, over the
    loopback."""
    master, slave = Person("op"), Person("other")
    ini, slave_ini = _ini_of_pair(master, slave)
    following, tracing = (text_of(f"{SHARE}/nc_files/tracer/{name}.ngc") for name in ("follow", "trace"))
    ready = "/mnt/ready"  # both may write there
    os.mkdir(ready)
    os.chmod(ready, 0o777)

    def until(name):
        return [
            "program",
            "sh",
            "-c",
            f"for i in $(seq 1200); do [ -e {ready}/{name} ] && exit 0; sleep 0.1; done; exit 1",
        ]

    slave.begin(
        slave_ini,
        [
            ["home"],
            ["mdi", "G53 G0 X200 Y60 Z30"],
            until("master"),
            ["start", following],
            ["until", "tracer-slave.0.state", "=", 2],
            ["program", "touch", ready + "/slave"],
            until("end"),
            ["until", "tracer-slave.0.pos-x", "<", -2.5],
            ["pins", "chipwise-link.passed", "tracer-slave.0.last-fault", "tracer-offset.0.last-fault"],
            ["position"],
            ["abort"],
        ],
    )
    master.begin(
        ini,
        [
            ["home"],
            ["mdi", "G53 G0 X50 Y46 Z12"],
            ["program", "touch", ready + "/master"],
            until("slave"),
            ["start", tracing],
            ["until", "tracer.0.lines", ">", 0],
            ["pins", "tracer.0.fault-code", "tracer-offset.0.last-fault"],
            ["abort"],
            ["sleep", 1],
            ["program", "touch", ready + "/end"],
        ],
    )
    return {"master": master.answered(), "slave": slave.answered()}


def menu():
    """LinuxCNC is started from a menu while another user's map is there: a window says what to do."""
    op, other = Person("op", display=start_x()), Person("other")
    other.run("/usr/bin/python3", "-c", f"import ctypes; assert ctypes.CDLL(None).shmget({KEY}, 4096, 0o1600) >= 0")
    op.start(op.edit("mill.ini"), terminal=False)
    keys = Keys(op.display)
    wait("LinuxCNC's own window", lambda: keys.window("LinuxCNC Errors") or keys.window("show_errors"))
    time.sleep(3.0)  # this window looks once a second whether it is above the other
    picture(op.display, LOGS + "/menu.png")
    return {"windows": keys.stacked()}


def refused(seconds=60):
    """A start from a terminal; -> its end."""
    op = Person()
    op.start(
        op.edit("mill.ini", scripted("DISPLAY = axis"), name="scripted.ini"),
        CHIPWISE_STEPS="[]",
        CHIPWISE_ANSWERS=op.home + "/answers.json",
    )
    return {"status": op.until_ended(seconds), "said": op.said()}


def buried(ini, mm):
    """A length that places the tip in the stock; mm: how many are a unit of this machine.

    -> the answers to the steps of buried_tip.py, and those of a second start."""
    op = Person()
    ini = op.edit(ini, scripted("DISPLAY = axis"), name="scripted.ini")
    return [op.steps(ini, [["home"], *buried_tip.steps(mm)])[1:] for _ in range(2)]
