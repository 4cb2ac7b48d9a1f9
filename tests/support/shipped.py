# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise as people have it: installed, an ordinary user, the package's own setuid rtapi_app, real time.

Called by tests/shipped.  scene() runs a function of shipped_scenes.py or shipped_machines.py as root in namespaces of
its own (IPC, PID, network, mount), where shipped_machine.py lays what `make install` has put into a folder over the
machine's files; nothing of it stays.  No sandbox of chipwise's, no libfaketime, no user namespace: in one, setuid would
not make root.
"""

import functools
import json
import os
import shutil
import subprocess
import sys

from support import ROOT

TIMEOUT_S = 1500  # for a scene, in real time; a machine under load is slow
AS_ROOT = [] if os.geteuid() == 0 else ["sudo", "-n"]
UNSHARE = [*AS_ROOT, "unshare", "--ipc", "--pid", "--net", "--mount", "--fork", "--mount-proc", "--kill-child"]
MACHINE = str(ROOT / "tests/support/shipped_machine.py")
PYTHON = "/usr/bin/python3"


@functools.lru_cache(maxsize=None)
def missing():
    """-> why no scene can run here, '' where they can."""
    if AS_ROOT and not shutil.which("sudo"):
        return "needs root, or sudo"
    done = subprocess.run(
        [*UNSHARE, PYTHON, MACHINE, "--try"], text=True, stdin=subprocess.DEVNULL, capture_output=True
    )
    return (
        ""
        if done.returncode == 0
        else "needs root, or sudo without a password, and private namespaces: " + done.stderr.strip()[-200:]
    )


def stage(folder):
    """-> `folder`, with what `make install` would put on this machine; '' with CHIPWISE_SHIPPED=package, where the
    installed packages are tried.

    A tree beside packages would be tried in part only: LinuxCNC looks into /usr/bin first."""
    packages = os.path.isdir("/usr/share/chipwise/remap")
    if os.environ.get("CHIPWISE_SHIPPED") == "package":
        assert packages, "CHIPWISE_SHIPPED=package, and the package chipwise is not installed"
        return ""
    assert not packages, "the package chipwise is installed here: remove it, or try it with CHIPWISE_SHIPPED=package"
    done = subprocess.run(
        ["make", "--no-print-directory", "install", f"DESTDIR={folder}", "PREFIX=/usr/local"],
        cwd=ROOT,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout
    return folder


def scene(name, installed, folder, modules="", **arguments):
    """What a scene returns; name: scenes.FUNCTION of shipped_scenes.py, machines.FUNCTION of shipped_machines.py.

    installed   of stage()
    folder      gets the logs and, where something has failed, a screenshot
    modules     a folder of other realtime modules, to be used in place of the installed ones
    """
    folder.mkdir(exist_ok=True)
    job = json.dumps(
        {
            "scene": name,
            "installed": str(installed),
            "folder": str(folder),
            "tests": str(ROOT / "tests"),
            "modules": str(modules),
            "arguments": arguments,
        }
    )
    with open(folder / "machine.txt", "w") as log:
        try:
            done = subprocess.run(
                [*UNSHARE, PYTHON, MACHINE, job],
                text=True,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                timeout=TIMEOUT_S,
            )
            status = done.returncode
        except subprocess.TimeoutExpired:
            status = f"none within {TIMEOUT_S} s"
    said = (folder / "machine.txt").read_text(errors="replace")
    print(said[-6000:], file=sys.stderr)
    assert status == 0, f"{name}: exit status {status}; all that was said: {folder}\n{said[-3000:]}"
    return json.loads((folder / "result.json").read_text())
