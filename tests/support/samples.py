# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise on LinuxCNC's own sample configurations, installed as README says.

A row of SAMPLES is a configuration of the LinuxCNC that runs.  run(row) copies it, puts README's lines into its INI,
and starts it with its screen in a sandbox in which chipwise is installed (sample_driver.py is the operator): home,
define a stock beside the tool, cut with the volumetric feed.  Called by test_samples.py, and by tools/samples, which
tries all and writes docs/user/machines.md.
"""

import glob
import json
import os
import re
import shutil
import subprocess
from dataclasses import dataclass

from support import ROOT

HERE = os.path.dirname(os.path.abspath(__file__))
IN_PLACE = os.environ.get("EMC2_HOME")  # of a LinuxCNC that is run in place: its screens want its own samples
STOCK = f"{IN_PLACE}/configs" if IN_PLACE else "/usr/share/doc/linuxcnc/examples/sample-configs"
TIMEOUT_S = 1500
SANDBOX = os.path.join(ROOT, "bin", "chipwise-sandbox")

POSTGUI = "POSTGUI_HALFILE = /usr/local/share/chipwise/hal/chipwise.hal"

# The tool, 6 mm, is at work X0 Y0 Z0 and 3 mm beside the stock; a slot 2 mm deep goes 17 mm into it.
LINES = ["G49", "M61 Q{TOOL}", "G10 L1 P{TOOL} R{RADIUS}", "G10 L20 P1 X0 Y0 Z0", "G54"]
PROGRAM = """G21 G90 G94 G17 G40 G64 P0.01
F600
G1 X{D}1
M250 P{LOW} Q-10 R-2 I25 J20 K4
M251 P1 Q6
G1 X{D}20
M252
G1 X0
M2
"""
LATHE_LINES = ["G21", "G10 L20 P1 X0 Z0", "G54"]
LATHE_PROGRAM = """o100 sub
  G0 X{D}2 Z0
  G1 Z-1
  G0 X{D}3
o100 endsub
G21 G90 G94 G18 G40 G49 G64 P0.01
F600
G75 Q100 Z-2
M2
"""
CUT_MM3 = (192.0, 200.0)  # 2 mm x (14 mm x 6 mm + pi/2 x (3 mm)^2) = 196.3 mm3
PINS = ["stock-tracker.0.removed-volume", "stock-tracker.0.ready", "stock-tracker.0.fault-code"]


@dataclass
class Sample:
    """One configuration; `name` is the row's in the docs."""

    name: str
    path: str  # of the INI file, below sample-configs
    screen: str  # the program it needs
    refused: str = ""  # words of the sentence with which it is refused; '': it runs
    joined: tuple = ()  # pins of motion that the configuration itself connects
    postgui: bool = False  # POSTGUI in place of HALFILE = chipwise.hal
    own_error: str = ""  # an operator error the configuration has without chipwise, too
    display: str = ""  # a screen in place of the configuration's own
    lathe: bool = False  # with what docs/user/install.md says of a lathe, and LATHE_PROGRAM in place of PROGRAM
    recipe: bool = False  # with what docs/user/install.md says of a machine with a [PYTHON] section of its own


SAMPLES = [
    Sample("axis_mm", "sim/axis/axis_mm.ini", "axis"),
    Sample("axis (inch)", "sim/axis/axis.ini", "axis"),
    Sample("lathe", "sim/axis/lathe.ini", "axis", refused="this machine has no Y axis"),
    Sample("lathe, docs/user/install.md", "sim/axis/lathe.ini", "axis", lathe=True),
    Sample("XYZABCUVW", "sim/axis/axis_9axis.ini", "axis"),
    Sample("headless", "sim/axis/axis_mm.ini", "linuxcncrsh", display="linuxcncrsh"),
    Sample("gantry", "sim/axis/gantry/gantry_mm.ini", "axis"),
    Sample("gmoccapy", "sim/gmoccapy/gmoccapy.ini", "gmoccapy", joined=("motion.tooloffset.x", "motion.tooloffset.z")),
    Sample("gmoccapy lathe", "sim/gmoccapy/lathe_configs/lathe.ini", "gmoccapy", refused="this machine has no Y axis"),
    Sample("qtdragon", "sim/qtdragon/qtdragon_xyz/qtdragon_metric.ini", "qtvcp"),
    Sample("qtdragon_hd", "sim/qtdragon_hd/qtdragon_hd_xyz/qtdragon_hd_xyz.ini", "qtvcp"),
    Sample("qtdragon_hd XYZA", "sim/qtdragon_hd/qtdragon_hd_xyz/qtdragon_hd_xyza.ini", "qtvcp"),
    Sample("qtdragon XYYZ", "sim/qtdragon/qtdragon_multi_joint/qtdragon_xyyz.ini", "qtvcp"),
    Sample("qtplasmac", "sim/qtplasmac/qtplasmac_l_metric.ini", "qtvcp", refused="this is a plasma machine"),
    Sample("touchy", "sim/touchy/touchy.ini", "touchy"),
    Sample("5axis bridgemill", "sim/axis/vismach/5axis/bridgemill/5axis.ini", "axis", joined=("motion.tooloffset.z",)),
    Sample(
        "xyzac-trt",
        "sim/axis/vismach/5axis/table-rotary-tilting/xyzac-trt.ini",
        "axis",
        joined=("motion.tooloffset.z",),
    ),
    Sample("twopass", "sim/axis/twopass/twopass.ini", "axis", refused="[HAL]TWOPASS is set"),
    Sample("twopass, POSTGUI_HALFILE", "sim/axis/twopass/twopass.ini", "axis", postgui=True),
    Sample(
        "remap/getting-started",
        "sim/axis/remap/getting-started/demo.ini",
        "axis",
        refused="a [PYTHON] section of its own",
    ),
    Sample(
        "remap/getting-started, docs/user/install.md",
        "sim/axis/remap/getting-started/demo.ini",
        "axis",
        recipe=True,
        own_error="seeking o-word: o<on_abort>",
    ),
]


NEEDS = {  # what a screen imports that is not in LinuxCNC's own package
    "gmoccapy": "import gladevcp.makepins",
    "touchy": "import gladevcp.makepins",
    "qtvcp": "from PyQt5 import QtWidgets, Qsci, QtSvg, QtOpenGL",
}


def missing(sample):
    """-> what a sample needs and this machine does not have, '' where nothing is."""
    if not os.path.isdir(STOCK):
        return "LinuxCNC's sample configurations are not here"
    if not shutil.which(sample.screen):
        return sample.screen + " is not installed"
    if (
        sample.screen in NEEDS
        and not sample.refused
        and subprocess.run(
            [SANDBOX, "--xvfb", "800x600", "--", "/usr/bin/python3", "-c", NEEDS[sample.screen]],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ).returncode
    ):
        return f"{sample.screen} needs packages that are not installed ({NEEDS[sample.screen]})"
    return ""


def named(name):
    return next(sample for sample in SAMPLES if sample.name == name)


# --- README's lines ---------------------------------------------------------


def readme_lines(text=None):
    """-> [(section, [lines])] of the code block in README's "On your own machine"; section '' is the end of the
    file."""
    if text is None:
        with open(os.path.join(ROOT, "README.md")) as handle:
            text = handle.read()
    block = text.split("## On your own machine")[1].split("```")[1]
    found, section = [], ""
    for part in block.strip().split("\n\n"):
        lines = part.split("\n")
        section = ""
        if lines[0].startswith("["):
            section = lines.pop(0).strip("[]")
        found.append((section, lines))
    return found


def paste(ini, lines):
    """Put README's lines into an INI file, or into the file it includes that has the section: at the section's end."""
    for section, wanted in lines:
        if not section:
            with open(ini, "a") as handle:
                handle.write("\n" + "\n".join(wanted) + "\n")
            continue
        for path in [ini, *sorted(glob.glob(os.path.join(os.path.dirname(ini), "*.inc")))]:
            with open(path, errors="surrogateescape") as handle:
                text = handle.read()
            match = re.search(r"^\[%s\].*?(?=^\[|\Z)" % re.escape(section), text, re.MULTILINE | re.DOTALL)
            if match and (path == ini or os.path.basename(path) in open(ini, errors="replace").read()):
                text = text[: match.end()].rstrip() + "\n" + "\n".join(wanted) + "\n\n" + text[match.end() :]
                with open(path, "w", errors="surrogateescape") as handle:
                    handle.write(text)
                break
        else:
            raise AssertionError(f"{ini} has no section [{section}]")


def has_codes(ini):
    """Whether the configuration has a [PYTHON] section of its own."""
    with open(ini, encoding="utf-8") as handle:
        return "[PYTHON]" in handle.read().splitlines()


def follow_the_recipe(ini):
    """The two lines of docs/user/install.md's "A machine with codes of its own", taken from there."""
    with open(os.path.join(ROOT, "docs", "user", "install.md")) as handle:
        text = handle.read().split("## A machine with codes of its own")[1]
    section, module = (block.strip() for block in text.split("```")[1:4:2])
    paste(ini, [("PYTHON", section.split("\n")[1:])])
    with open(os.path.join(os.path.dirname(ini), "python", "remap.py"), "a") as handle:
        handle.write("\n" + module.split("\n", 1)[-1] + "\n")


def set_up_the_lathe(ini):
    """The lines of docs/user/install.md's "On a lathe", taken from there, and a tool geometry file."""
    with open(os.path.join(ROOT, "docs", "user", "install.md")) as handle:
        text = handle.read().split("### On a lathe")[1].split("```")[1].strip()
    codes, rest = text.split("\n\n", 1)
    paste(ini, [("RS274NGC", codes.split("\n")[1:])])
    with open(ini, "a") as handle:
        handle.write("\n" + rest + "\n")
    with open(os.path.join(os.path.dirname(ini), "lathe_tools.toml"), "w") as handle:
        handle.write('[lathe.1]\nroles = ["rough"]\nedge_length = 12\ndepth = 4\n')


def show_with(ini, display):
    """Another screen, and without what belongs to the old one."""
    with open(ini, errors="surrogateescape") as handle:
        text = handle.read()
    with open(ini, "w", errors="surrogateescape") as handle:
        handle.write(re.sub(r"^DISPLAY\s*=.*$", "DISPLAY = " + display, text, flags=re.MULTILINE))


def be_patient(ini):
    """The samples let the task wait 1 s for motion; on a busy machine LinuxCNC would end, with chipwise or without."""
    with open(ini, errors="surrogateescape") as handle:
        text = handle.read()
    # touchy gives its panel, whose component has a name of its own, 1 s to make its pins
    text = re.sub(r"^(HALCMD\s*=\s*loadusr) (gladevcp .*-c (\w+))", r"\1 -Wn \3 \2", text, flags=re.MULTILINE)
    with open(ini, "w", errors="surrogateescape") as handle:
        handle.write(re.sub(r"^COMM_TIMEOUT\s*=.*$", "COMM_TIMEOUT = 30", text, flags=re.MULTILINE))


def give_it_a_tool(ini):
    """A sample whose tool table is empty gets a tool."""
    with open(ini, errors="replace") as handle:
        name = re.search(r"^TOOL_TABLE\s*=\s*(\S+)", handle.read(), re.MULTILINE)
    path = os.path.join(os.path.dirname(ini), name[1]) if name else ""
    if path and os.path.exists(path) and not re.search(r"^\s*T\d", open(path).read(), re.MULTILINE):
        with open(path, "a") as handle:
            handle.write("T1 P1 D6\n")


# --- running one ------------------------------------------------------------


def stage(where):
    """`make install` into a folder; -> the folder."""
    folder = os.path.join(where, "installed")
    subprocess.run(
        ["make", "-s", "install", "DESTDIR=" + folder],
        cwd=ROOT,
        check=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    return folder


def copied(sample, where):
    """-> INI file of a copy of a configuration, with README's lines."""
    copy = os.path.join(where, "configs")
    shutil.copytree(STOCK, copy, symlinks=True, ignore=shutil.ignore_patterns("by_machine", "attic", "*.var"))
    subprocess.run(["chmod", "-R", "u+w", copy], check=True)
    ini = os.path.join(copy, sample.path)
    if sample.recipe or (not sample.refused and has_codes(ini)):  # gmoccapy of 2.10
        follow_the_recipe(ini)
    if sample.display:
        show_with(ini, sample.display)
    if sample.lathe:
        set_up_the_lathe(ini)
        be_patient(ini)
        return ini
    paste(
        ini,
        [
            (section, [POSTGUI if sample.postgui and line.startswith("HALFILE") else line for line in lines])
            for section, lines in readme_lines()
        ],
    )
    give_it_a_tool(ini)
    be_patient(ini)
    return ini


def run(sample, where, installed, edit=None, picture=None, after=()):
    """-> the driver's result.

    edit(ini): more changes to the copy.  after: MDI lines when the program is over.
    """
    ini = copied(sample, where)
    if edit:
        edit(ini)
    return drive(sample, ini, where, installed, picture, after=after)


# it gives the task 5.1 s in all (axis.py), and the task reads its Python when motion answers, no sooner
AXIS_WAITED = "waiting for s.joints"
# PAUSE_S: of the 5 s that the monitor may be silent; other processes had some of them
AWAY, PAUSE_S, DRIVES = "chipwise-monitor does not answer", 2.0, 3


def drive(*arguments, **options):
    """As driven().  A busy computer has pauses of many seconds, and LinuxCNC does the periods of a pause at once behind
    it: a run in which that has silenced the monitor is done again.  Without such a pause its silence counts.  So is a
    run in which AXIS did not wait for the task long enough."""
    for _ in range(DRIVES):
        result = driven(*arguments, **options)
        silenced = result.get("paused", 0.0) >= PAUSE_S and any(AWAY in error for error in result["errors"])
        if not silenced and (result["started"] or AXIS_WAITED not in result["output"]):
            break
    return result


def job_of(ini, sample, picture=None, watch=(), after=()):
    """JOB of sample_driver.py."""
    if sample.lathe:
        return {
            "lines": LATHE_LINES,
            "program": LATHE_PROGRAM,
            "pins": [],
            "after": list(after),
            "signals": [],
            "picture": picture,
            "watch": [],
        }
    inch = re.search(r"^LINEAR_UNITS\s*=\s*(in|imperial)", open(ini, errors="replace").read(), re.MULTILINE)
    lines = [
        line.replace("{RADIUS}", "%.6f" % (3 / 25.4 if inch else 3)) for line in ["G20" if inch else "G21", *LINES]
    ]
    return {
        "lines": lines,
        "program": PROGRAM,
        "pins": PINS,
        "after": list(after),
        "signals": list(sample.joined),
        "picture": picture,
        "watch": list(watch),
    }


def driven(sample, ini, where, installed, picture=None, watch=(), after=()):
    """-> the driver's result for an INI file."""
    job, result = os.path.join(where, "job.json"), os.path.join(where, "result.json")
    if os.path.exists(result):
        os.unlink(result)
    with open(job, "w") as handle:
        json.dump(job_of(ini, sample, picture, watch, after), handle)
    done = subprocess.run(
        [
            SANDBOX,
            "--installed",
            installed,
            "--xvfb",
            "1400x900",
            "--require-isolation",
            "--timeout",
            str(TIMEOUT_S),
            "--",
            "/usr/bin/python3",
            os.path.join(HERE, "sample_driver.py"),
            ini,
            job,
            result,
        ],
        cwd=os.path.dirname(ini),
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if not os.path.exists(result):
        return {
            "trouble": "no result",
            "output": done.stdout,
            "started": False,
            "done": False,
            "said": [],
            "errors": [],
            "pins": {},
            "signals": {},
            "screen_alive": False,
        }
    with open(result) as handle:
        return json.load(handle)


def verdict(sample, result):
    """-> '' where the row is what it says, else what is not."""
    if sample.refused:
        said = [line for line in result["said"] if sample.refused in line]
        if result["started"] or not said:
            return f'should be refused with "{sample.refused}": {result["trouble"]}\n{result["output"]}'
        return ""
    errors = [error for error in result["errors"] if not sample.own_error or sample.own_error not in error]
    if not result["done"] or not result["screen_alive"] or errors:
        return f"{result['trouble']} {errors}\n{result['output']}"
    if sample.lathe:
        return ""
    volume = float(result["pins"][PINS[0]])
    if not CUT_MM3[0] <= volume <= CUT_MM3[1]:
        return f"cut {volume:.1f} mm3, wanted {CUT_MM3}; fault code {result['pins'][PINS[2]]}\n{result['output']}"
    for pin, signal in result["signals"].items():
        if not signal or signal.startswith("chipwise"):
            return f'{pin} is on signal "{signal}" and not on the configuration\'s'
    return ""
