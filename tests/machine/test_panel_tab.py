# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise panel --tab`: the page inside another program's window."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from chipwise.headless import runner
from support import filter_rig, samples

pytestmark = pytest.mark.machine

HERE = os.path.join(runner.ROOT, "tests", "support")
HOST = os.path.join(runner.ROOT, "tests", "support", "panel_tab_host.py")


def test_a_screen_embeds_the_page(tmp_path):
    if subprocess.run(
        ["/usr/bin/python3", "-c", 'import gi; gi.require_version("Gtk", "3.0")'], stderr=subprocess.DEVNULL
    ).returncode:
        pytest.skip("no GTK 3 for Python")
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "900", "--xvfb", "1024x768", "--", HOST, str(tmp_path / "machine.ini")],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["embedded"] and found["gone"] and found["again"] and found["ends"] and found["status"] == 0, found
    assert found["button"] == "Box" and found["none"]
    if found["webkit"]:
        assert found["reads"]  # the page in it reads the stream


@pytest.mark.parametrize("ini, screen", [("mill.ini", "axis"), ("mill_gmoccapy.ini", "gmoccapy")])
def test_the_page_in_a_screen(tmp_path, ini, screen):
    """The real screen starts the tab, and the page in it reads the stream of this LinuxCNC."""
    webkit = subprocess.run(
        ["/usr/bin/python3", "-c", 'import gi; gi.require_version("WebKit2", "4.1")'], stderr=subprocess.DEVNULL
    )
    if webkit.returncode or not shutil.which(screen):
        pytest.skip(f"no WebKitGTK 4.1 or no {screen}")
    command = f"{runner.ROOT}/bin/chipwise panel --tab {{XID}}"
    tab = f"EMBED_TAB_NAME = stock\\nEMBED_TAB_LOCATION = box_right\\nEMBED_TAB_COMMAND = {command}"
    script = f"""cd {runner.ROOT}/configs
        sed -e '/^PYVCP/d' -e '/^EMBED_TAB/d' -e '/chipwise_panel/d' {ini} >tab.ini
        sed -i 's#^DISPLAY = .*#&\\n{tab}#' tab.ini
        linuxcnc -r tab.ini </dev/null &
        for i in $(seq 600); do
            /usr/bin/python3 -c 'import json, urllib.request as r
state = json.load(r.urlopen("http://127.0.0.1:8250/state.json"))
print("pages", state["pages"])' 2>/dev/null | grep "pages 1" && exit 0
            sleep 0.2
        done
        exit 1"""
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "900", "--xvfb", "1280x1024", "--", "sh", "-c", script],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout[-3000:]


def test_the_page_in_qtdragon(tmp_path):
    """LinuxCNC's own sample machine with README's lines and a tab: as above, and the picture of the tab has the colours
    of the page."""
    webkit = subprocess.run(
        ["/usr/bin/python3", "-c", 'import gi; gi.require_version("WebKit2", "4.1")'], stderr=subprocess.DEVNULL
    )
    sample = samples.named("qtdragon")
    if webkit.returncode or filter_rig.missing(sample):
        pytest.skip(filter_rig.missing(sample) or "no WebKitGTK 4.1")
    where = str(tmp_path)
    installed, ini = samples.stage(where), samples.copied(sample, where)
    (tmp_path / "command.py").write_text(
        f"import sys\nsys.path.insert(0, {HERE!r})\nimport panel_qt_tab\npanel_qt_tab.start({where!r})\n"
    )
    with open(ini, encoding="utf-8") as file:
        text = re.sub(r"(?m)^EMBED_TAB_.*\n", "", file.read())
    with open(ini, "w", encoding="utf-8") as file:
        file.write(
            text.replace(
                "[DISPLAY]\n",
                f"[DISPLAY]\nUSER_COMMAND_FILE = {where}/command.py\nEMBED_TAB_NAME = Stock\n"
                "EMBED_TAB_LOCATION = tabWidget_utilities\nEMBED_TAB_COMMAND = chipwise panel --tab {XID}\n",
                1,
            )
            + "\n[CHIPWISE]\nPANEL = yes\n"
        )
    os.chmod(where, 0o777)
    script = f"""cd {os.path.dirname(ini)}
        linuxcnc -r {os.path.basename(ini)} </dev/null &
        for i in $(seq 1500); do [ -e {where}/result.json ] && exit 0; sleep 0.2; done
        exit 1"""
    done = subprocess.run(
        [runner.SANDBOX, "--installed", installed, "--xvfb", "1400x900", "--timeout", "900", "--", "sh", "-c", script],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    found = json.loads((tmp_path / "result.json").read_text())
    assert (
        "Stock" in found["tabs"]
        and found["pages"] == 1
        and found["box"] > 0.2
        and found["state"] > 0.01
        and found["outside"] == [0, 0]
    ), found


@pytest.mark.parametrize("number, status", [("x", 2), ("0", 2), ("-1", 2), ("", 2), ("99999999999", 2), ("0x1f", 1)])
def test_words_without_a_traceback(number, status):
    env = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "INI_FILE_NAME")}
    done = subprocess.run(
        [sys.executable, os.path.join(runner.ROOT, "bin", "chipwise"), "panel", f"--tab={number}"],
        env=env,
        text=True,
        capture_output=True,
    )
    assert done.returncode == status and "Traceback" not in done.stderr and "chipwise: " in done.stderr, done.stderr
