# SPDX-License-Identifier: GPL-2.0-or-later
"""A LinuxCNC that does what a test tells it, step by step (scripted_display.py)."""

import json
import os
import subprocess

from chipwise.headless import runner

SCRIPTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'scripted_display.py')
CONFIGS = os.path.join(runner.ROOT, 'configs')          # a private copy inside the sandbox
BOX = 'M250 P0 Q0 R-10 I60 J40 K10'                    # the stock of most tests

SPEED = 4       # of the machine's time; what the task does between moves takes that much more of it


def operate(tmp_path, steps, ini='mill.ini', edit='', before=':', home=True, speed=SPEED):
    """Start LinuxCNC, do the steps, -> the answers.

    edit     a sed command on the INI file
    before   a shell command run in configs/ before LinuxCNC is started
    home     begin with the step home, whose answer is left out
    speed    lets time pass that many times as fast, waits and time-outs of the steps included
    """
    answers = tmp_path / 'answers.json'
    answers.unlink(missing_ok=True)
    script = (f"cd {CONFIGS} && {before} && sed -e 's#^DISPLAY = .*#DISPLAY = {SCRIPTED}#' -e '{edit or 'p;d'}' {ini}"
              " > scripted.ini && exec linuxcnc -r scripted.ini")
    steps = [['home'], *steps] if home else steps
    env = dict(os.environ, CHIPWISE_STEPS=json.dumps(steps), CHIPWISE_ANSWERS=str(answers))
    env.pop('DISPLAY', None)
    done = subprocess.run([runner.SANDBOX, '--timeout', '150', '--speed', f'{speed:g}', '--', 'sh', '-c', script], env=env, text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    (tmp_path / 'linuxcnc.txt').write_text(done.stdout)
    assert answers.exists(), done.stdout[-3000:]
    found = json.loads(answers.read_text())
    assert len(found) == len(steps), found[-1:] + [done.stdout[-2000:]]
    return found[1:] if home else found
