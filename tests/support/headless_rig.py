# SPDX-License-Identifier: GPL-2.0-or-later
"""INI files of their own for runs without a screen.  Called by tests/machine."""

import os
import re

import numpy as np

from chipwise.headless import runner

# LinuxCNC drops a command that motion does not answer within so many s, of a clock that may be ten times as fast as the
# computer's.
SLOW_MOTION = "COMM_TIMEOUT = 300"


def own_ini(tmp_path, source=runner.HEADLESS, **sections):
    """A copy of a configuration outside configs/, with lines put into its sections.

    A key given is put first and removed from where it was.
    """
    with open(source) as handle:
        text = handle.read()
    text = text.replace("../", runner.ROOT + "/")
    text = re.sub(
        r"^(TOOL_TABLE|TOOL_GEOMETRY|TOPLEVEL|PATH_PREPEND) *= *(?!/)",
        r"\1 = %s/configs/" % runner.ROOT,
        text,
        flags=re.M,
    )
    for section, lines in sections.items():
        for key in re.findall(r"^(\w+) *=", lines, flags=re.M):
            text = re.sub(r"^%s *=.*\n" % key, "", text, flags=re.M)
        text = text.replace("[%s]\n" % section, "[%s]\n%s\n" % (section, lines))
    ini = tmp_path / "own.ini"
    ini.write_text(text)
    return str(ini)


def headless_ini(tmp_path, machine, before=""):
    """A configuration of configs/ without a screen, as mill_headless.ini is of mill.ini; `before`: a HAL file that goes
    before chipwise.hal."""
    ini = own_ini(
        tmp_path,
        os.path.join(runner.ROOT, "configs", machine + ".ini"),
        DISPLAY="DISPLAY = %s/bin/chipwise-headless" % runner.ROOT,
        EMCMOT=SLOW_MOTION,
    )
    with open(ini) as handle:
        text = handle.read()
    hal = "HALFILE = %s/hal/" % runner.ROOT
    first = "HALFILE = %s\n" % before if before else ""
    with open(ini, "w") as handle:
        handle.write(text.replace(hal + "chipwise.hal\n", first + hal + "chipwise.hal\n" + hal + "headless.hal\n"))
    return ini


SPINDLE = (
    "HALFILE = spindle.hal",
    """loadrt sim_spindle names=sim-spindle
setp sim-spindle.scale 0.0166666667
net spindle-index-enable spindle.0.index-enable <=> sim-spindle.index-enable
net spindle-pos sim-spindle.position-fb => spindle.0.revs
net spindle-speed-cmd spindle.0.speed-out => sim-spindle.velocity-cmd
addf sim-spindle servo-thread
""",
)


# A sed command: the sampler for the step "log" of scripted_display.py.
WITH_LOG = r"s#^HALFILE = ../hal/chipwise.hal#&\nHALFILE = ../hal/headless.hal#"


def with_spindle(tmp_path):
    """A sed command that gives the machine a spindle encoder, before chipwise.hal."""
    path = tmp_path / "spindle.hal"
    path.write_text(SPINDLE[1])
    return f"s#^HALFILE = ../hal/chipwise.hal#HALFILE = {path}\\n&#"


def motion_rows(path):
    """(n, 3) positions of a log from the first motion to the end, in servo periods."""
    log = np.load(path)
    at = np.column_stack([log[name] for name in "xyz"])
    moves = np.flatnonzero(np.abs(np.diff(at, axis=0)).max(axis=1) > 0)
    return at[moves[0] : moves[-1] + 2]
