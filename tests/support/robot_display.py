#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A display program for the simulated robot: homes it, runs programs, and writes what came of each.

Started by LinuxCNC in tests/machine/test_robot.py.  CHIPWISE_PROGRAMS: JSON list of paths; CHIPWISE_ANSWERS: path of a
JSON list with
{"errors": [..], "joints": joints in the end, "pose": position in the end} of each.  CHIPWISE_SAMPLES: file for the
joints of every servo period, as halsampler writes them.
"""

import json
import os
import subprocess
import time

import linuxcnc

PATIENCE_S = 120
IDLE_POLLS = 20  # a program that has been idle so often is over, however short it was


def until(command, stat, done):
    """Wait for a state; raises TimeoutError."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        stat.poll()
        if done():
            return
        time.sleep(0.01)
    raise TimeoutError(str(done))


def run(command, stat, errors, program):
    """Run a program to its end."""
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(program)
    command.wait_complete()
    found, idle = [], 0

    def more():
        while error := errors.poll():
            found.append(error[1])
        return bool(found)

    def has_begun():
        nonlocal idle
        is_taken = stat.echo_serial_number >= command.serial
        idle += is_taken
        return stat.interp_state != linuxcnc.INTERP_IDLE or is_taken and more() or idle > IDLE_POLLS

    command.auto(linuxcnc.AUTO_RUN, 0)
    until(command, stat, has_begun)
    until(command, stat, lambda: stat.interp_state == linuxcnc.INTERP_IDLE and stat.inpos)
    more()
    return {"errors": found, "joints": list(stat.joint_position[:6]), "pose": list(stat.position[:6])}


def main():
    command, stat, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    command.home(-1)
    until(command, stat, lambda: all(stat.homed[: stat.joints]))
    sampler = subprocess.Popen(["halsampler", "-t", os.environ["CHIPWISE_SAMPLES"]], stdin=subprocess.DEVNULL)
    answers = []
    for program in json.loads(os.environ["CHIPWISE_PROGRAMS"]):
        answers.append(run(command, stat, errors, program))
        with open(os.environ["CHIPWISE_ANSWERS"], "w", encoding="utf-8") as file:
            json.dump(answers, file)
    time.sleep(0.5)
    sampler.terminate()
    sampler.wait()


if __name__ == "__main__":
    main()
