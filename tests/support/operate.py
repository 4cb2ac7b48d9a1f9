# SPDX-License-Identifier: GPL-2.0-or-later
"""A LinuxCNC that does what a test tells it, step by step (scripted_display.py)."""

import json
import os
import subprocess

from chipwise.headless import runner
from support.headless_rig import SLOW_MOTION

SCRIPTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scripted_display.py")
CONFIGS = os.path.join(runner.ROOT, "configs")  # a private copy inside the sandbox
BOX = "M250 P0 Q0 R-10 I60 J40 K10"  # the stock of most tests

SPEED = 4  # of the machine's time; what the task does between moves takes that much more of it


NO_SHADOW = r"s/^KEEP_STOCK = .*/&\nSHADOW = no/"  # a sed command: no stock is assumed, and nothing is said of one

CELL_MM = (
    0.133333333  # side of the cells of a small stock with the sample INI files: 90 across their flat tool of 12 mm
)
TIMEOUT_S = 600  # real time, for one start and its steps: a busy computer takes ten times as long as an idle one
SCENE_S = 60  # more for each scene of several


class Stopped(AssertionError):
    """The steps were not all done; `answers` are those of the steps before."""

    def __init__(self, answers, text):
        super().__init__(text)
        self.answers = answers


# As `before`, for steps that M251 refuses: it waits for chipwise-monitor as long as on a machine
OWN_PATIENCE = "export CHIPWISE_MONITOR_S=0"

# The sandbox ends with its command. [c]: not the shell itself.  LinuxCNC does not wait until a monitor that a step has
# started by hand has kept the stock.  One that a step has stopped (T) never ends.
MONITOR_ENDS = (
    'for i in $(seq 6000); do ps -e -o stat,args | grep "^[^TZ].*[c]hipwise monitor" >/dev/null || break; sleep 0.1; '
    "done; "
)


def operate(tmp_path, steps, ini="mill.ini", edit="", before=":", home=True, speed=SPEED, timeout=TIMEOUT_S):
    """Start LinuxCNC, do the steps, -> the answers; raises Stopped.

    edit     a sed command on the INI file
    before   a shell command run in configs/ before LinuxCNC is started
    home     begin with the step home, whose answer is left out
    speed    lets time pass that many times as fast, waits and time-outs of the steps included
    timeout  s of real time, if TIMEOUT_S is too little
    """
    timeout = max(timeout, TIMEOUT_S)
    answers = tmp_path / "answers.json"
    answers.unlink(missing_ok=True)
    script = (
        f"cd {CONFIGS} && {before} && sed -e 's#^DISPLAY = .*#DISPLAY = {SCRIPTED}#' -e 's#^COMM_TIMEOUT = "
        f".*#{SLOW_MOTION}#' "
        f"-e '{edit or 'p;d'}' {ini}"
        " > scripted.ini && { linuxcnc -r scripted.ini; status=$?; " + MONITOR_ENDS + "exit $status; }"
    )
    steps = [["home"], *steps] if home else steps
    env = dict(
        os.environ,
        CHIPWISE_STEPS=json.dumps(steps),
        CHIPWISE_ANSWERS=str(answers),
        CHIPWISE_PATIENCE=f"{0.8 * timeout:g}",
    )
    env.pop("DISPLAY", None)
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", f"{timeout:g}", "--speed", f"{speed:g}", "--", "sh", "-c", script],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    (tmp_path / "linuxcnc.txt").write_text(done.stdout)
    if not answers.exists():
        raise Stopped([], done.stdout[-3000:])
    found = json.loads(answers.read_text())
    if len(found) != len(steps):
        raise Stopped(found[home:-1], f"{found[-1:]}\n{done.stdout[-2000:]}")
    return found[1:] if home else found


class Shared:
    """One LinuxCNC for the scenes of several tests, one after the other, with a step "fresh" between them.

        MILL = Shared('unknown')                            options as in operate()

        @pytest.mark.scene(MILL, [['mdi', 'T1 M6'], ..])    the steps, or a function of the test's parameters that gives
        them def test_..(answers): ..                            the fixture `answers` has the answers of these steps

    For tests that mean nothing less on a machine that has done something before.  Only the scenes of tests that are run
    are done.  The first scene that cannot be done to its end fails its test; the next test goes on with a new LinuxCNC.
    """

    def __init__(self, name, **options):
        self.name, self.options = name, options
        self.found = {}  # nodeid: answers or a Stopped

    def answers_of(self, node, folder):
        """folder: function -> a new directory."""
        if node.nodeid not in self.found:
            self.run(
                [item for item in node.session.items if scene_of(item)[0] is self and item.nodeid not in self.found],
                folder(),
            )
        found = self.found[node.nodeid]
        if isinstance(found, Stopped):
            raise found
        return found

    def run(self, items, folder):
        """The scenes of all tests, up to the first that fails."""
        scenes = [(item.nodeid, scene_of(item)[1]) for item in items]
        steps = [step for _name, scene in scenes for step in ([*scene, ["fresh"]])][:-1]
        try:
            answers, failure = operate(folder, steps, timeout=TIMEOUT_S + SCENE_S * len(scenes), **self.options), None
        except Stopped as stopped:
            answers, failure = stopped.answers, stopped
        for name, scene in scenes:
            self.found[name] = answers[: len(scene)] if len(answers) >= len(scene) else failure
            if self.found[name] is failure:
                return
            answers = answers[len(scene) + 1 :]


def printed(answer):
    """What the program of a step printed last, as JSON; its answer: (status, text)."""
    status, text = answer
    assert status == 0, text
    return json.loads(text.splitlines()[-1])


def scene_of(item):
    """-> (the Shared or None, its steps) of a test."""
    marker = item.get_closest_marker("scene")
    if marker is None:
        return None, []
    shared, steps = marker.args
    return shared, steps(**item.callspec.params) if callable(steps) else steps
