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
import sys
import time

sys.path[:0] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", folder) for folder in ("../remap", "")]

import hal  # noqa: E402

from chipwise.headless import session  # noqa: E402

from support.display_program import WAIT_S, ProgramSteps  # noqa: E402


class Robot(ProgramSteps):
    """errors: all messages since the last program, of any kind."""

    def __init__(self):
        session.wait_for_task(time.monotonic() + session.STEP_TIMEOUT_S)
        self.machine = session.Session(float("inf"))
        self.component = hal.component("robot-display")  # hal.get_value wants one
        self.component.ready()
        self.machine.switch_on()
        self.machine.home()

    def run_to_end(self, program):
        machine = self.machine
        machine.errors, machine.messages = [], []
        machine.open(program)
        self.run()
        self.rest("end of program")
        status = machine.status
        machine.wait(
            "the place in the status",
            lambda s: all(
                abs(s.joint_position[k] - hal.get_value(f"joint.{k}.pos-cmd")) < 1e-9 for k in range(s.joints)
            ),
            WAIT_S,
        )
        return {
            "errors": machine.errors + machine.messages,
            "joints": list(status.joint_position[:6]),
            "pose": list(status.position[:6]),
        }


def main():
    robot = Robot()
    sampler = subprocess.Popen(["halsampler", "-t", os.environ["CHIPWISE_SAMPLES"]], stdin=subprocess.DEVNULL)
    answers = []
    for program in json.loads(os.environ["CHIPWISE_PROGRAMS"]):
        answers.append(robot.run_to_end(program))
        with open(os.environ["CHIPWISE_ANSWERS"], "w", encoding="utf-8") as file:
            json.dump(answers, file)
    time.sleep(0.5)
    sampler.terminate()
    sampler.wait()


if __name__ == "__main__":
    main()
