# SPDX-License-Identifier: GPL-2.0-or-later
"""The filter in LinuxCNC's GUIs: programs of every kind, a machine for each GUI, and what the GUI made of them.

Used by tests/machine/test_filter_gui.py and bench/bench_filter.py.  filter_probe.py works inside the GUI.
"""

import json
import os
import re
import shutil
import subprocess

from support import samples, surface_cases

HERE = os.path.dirname(os.path.abspath(__file__))
TIMEOUT_S = 1500
LIMIT_S = 20  # [CHIPWISE]FILTER_TIME

HEAD = "G21 G90 G17 G40 G49 G80 G94\nM250 P0 Q0 R-20 I100 J60 K20\nT1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\n"
CLEAN = HEAD + "G1 X110 F400\nG0 Z5\nM2\n"
RAPID = HEAD + "G0 X110\nG0 Z5\nM2\n"  # line 7
BAD = HEAD + "G1 X[1/0] F400\nM2\n"  # line 7
UNKNOWN = "G21 G90\nT1 M6\nG1 X5 F300\nM2\n"  # no stock
ENDLESS = "G21\nF100\no1 while [1]\nG1 X1\nG1 X0\no1 endwhile\nM2\n"
BINARY = bytes(range(256)) * 64
HUGE = 200_000_000
MODEL = surface_cases.stl_bytes(surface_cases.waves(12, 15.0))
JOB = 'model = "part.stl"\nlink = 1\n[[cut]]\ntool = 1\nstep = 2\n'


def make_programs(folder):
    """-> {name: path} of one of each kind."""
    os.makedirs(folder, exist_ok=True)
    texts = {
        "it's clean.nc": CLEAN,
        "finding.NC": RAPID,
        "unknown.tap": UNKNOWN,
        "bad.nc": BAD,
        "endless.nc": ENDLESS,
        "killed.nc": ENDLESS,
        "binary.TAP": BINARY,
        "part.stl": MODEL,
        "picture.stl": b"\xff\xd8\xff" + bytes(200),
    }
    paths = {}
    for name, text in texts.items():
        paths[name] = os.path.join(folder, name)
        with open(paths[name], "wb") as file:
            file.write(text if isinstance(text, bytes) else text.encode())
    for name in ("part", "picture"):
        with open(os.path.join(folder, name + ".toml"), "w") as file:
            file.write(JOB.replace("part", name))
    paths["huge.nc"] = os.path.join(folder, "huge.nc")
    with open(paths["huge.nc"], "wb") as file:
        file.write(b"G1 X1\n" * 1000)
        file.truncate(HUGE)
    return paths


def screens():
    """{name: Sample} of the GUIs."""
    return {
        "axis": samples.Sample("mill.ini", "mill.ini", "axis"),
        "gmoccapy": samples.Sample("mill_gmoccapy.ini", "mill_gmoccapy.ini", "gmoccapy"),
        "qtdragon": samples.named("qtdragon"),
    }


def missing(sample):
    """-> what a screen needs and this machine does not have, '' where nothing is."""
    if sample.screen == "qtvcp" and not shutil.which("pyrcc5"):
        return "QtDragon needs pyrcc5 (pyqt5-dev-tools)"
    return samples.missing(sample)


def make_machine(sample, where, installed, command_file):
    """-> INI file of a machine with the screen, the [FILTER] lines of configs/mill.ini and a short FILTER_TIME."""
    share = os.path.join(installed, "usr/local/share/chipwise")
    if sample.screen != "qtvcp":
        shutil.copytree(share, os.path.join(where, "share"), symlinks=True)  # LinuxCNC finds its bin/chipwise first
        library = os.path.join("build", "libchipwise.so")
        os.unlink(os.path.join(where, "share", library))
        shutil.copy(os.path.join(share, library), os.path.join(where, "share", library))
        ini = os.path.join(where, "share", "configs", sample.path)
        with open(ini) as file:
            text = file.read()
    else:
        ini = samples.copied(sample, where)
        with open(ini) as file, open(os.path.join(share, "configs", "mill.ini")) as mill:
            lines = re.search(r"^\[FILTER\]\n(.*?)\n\[", mill.read(), re.MULTILINE | re.DOTALL)[1]
            text = re.sub(
                r"^\[FILTER\]\n.*?\n\[", f"[FILTER]\n{lines}\n[", file.read(), count=1, flags=re.MULTILINE | re.DOTALL
            )
    text = re.sub(r"^(\[DISPLAY\])$", rf"\1\nUSER_COMMAND_FILE = {command_file}", text, count=1, flags=re.MULTILINE)
    with open(ini, "w") as file:
        file.write(f"{text}\n[CHIPWISE]\nFILTER_TIME = {LIMIT_S}\n")
    return ini


def open_all(sample, where, installed, files):
    """Open files [{path, expect, kill}] in a GUI, one after the other; -> {trouble, records, output}."""
    where = str(where)
    job, result, command_file = (os.path.join(where, name) for name in ("job.json", "result.json", "command.py"))
    with open(job, "w") as file:
        json.dump({"files": files, "result": result, "screen": sample.screen}, file)
    with open(command_file, "w") as file:
        file.write(
            f"import sys\nsys.path.insert(0, {HERE!r})\nimport filter_probe\n"
            f"filter_probe.start({{**globals(), **locals()}}, {job!r})\n"
        )
    ini = make_machine(sample, where, installed, command_file)
    with open(os.path.join(where, "output"), "wb") as output:
        subprocess.run(
            [
                samples.SANDBOX,
                "--installed",
                installed,
                "--xvfb",
                "1400x900",
                "--require-isolation",
                "--timeout",
                str(TIMEOUT_S),
                "--",
                "/usr/bin/python3",
                os.path.join(HERE, "filter_probe.py"),
                ini,
                result,
            ],
            cwd=os.path.dirname(ini),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
    with open(output.name, errors="replace") as file:
        text = file.read()
    if not os.path.exists(result):
        return {"trouble": "no result", "records": [], "output": text}
    with open(result) as file:
        return {**json.load(file), "output": text}
