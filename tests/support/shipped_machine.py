# SPDX-License-Identifier: GPL-2.0-or-later
"""PID 1 of a scene in the shipped form: lays the installed chipwise and ordinary users over this machine, and runs the
scene.

    unshare .. shipped_machine.py JOB | --try

Called by shipped.py as root, in a mount namespace of its own, so that nothing of this outlives it.  JOB is JSON:
`scene` as in shipped.py, `installed` a DESTDIR, `folder` for the logs, `tests` the folder of that name, `modules` a
folder with other realtime modules or '', `arguments` of the scene.  The scene's answer is written to result.json in
`folder`.
"""

import importlib
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../remap"))

from chipwise.machine.namespaces import loopback_up  # noqa: E402

PLACE = "/mnt"  # of the machine: everybody may go there
TREE = PLACE + "/tree"  # laid out as the repository: its tests, the installed remap and bin
LOGS = PLACE + "/logs"
PREFIX = "/usr" if os.environ.get("CHIPWISE_SHIPPED") == "package" else "/usr/local"
SHARE = PREFIX + "/share/chipwise"
OVERLAID = ("usr", "etc")
USERS = ("op", "other")


def run(*words):
    done = subprocess.run(words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        raise SystemExit(f"{' '.join(words)}: {done.stdout.strip()}")


def bind(source, target):
    os.makedirs(target, exist_ok=True)
    run("mount", "--bind", source, target)


def lay(installed, modules=""):
    """Cover /usr and /etc by an overlay, with `installed` in front; /home, /tmp and /dev/shm are empty."""
    run("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", PLACE)
    bind(installed or PLACE, PLACE + "/installed")
    for name in OVERLAID:
        upper, work = f"{PLACE}/over/{name}/upper", f"{PLACE}/over/{name}/work"
        os.makedirs(upper)
        os.makedirs(work)
        front = f"{PLACE}/installed/{name}:" if installed and os.path.isdir(f"{PLACE}/installed/{name}") else ""
        run(
            "mount",
            "-t",
            "overlay",
            "overlay",
            "-o",
            f"lowerdir={front}/{name},upperdir={upper},workdir={work}",
            "/" + name,
        )
    if modules:
        there = subprocess.run(
            ["find", "/usr/lib", "-name", "stock_tracker.so"], text=True, capture_output=True, check=True
        ).stdout.strip()
        for name in os.listdir(modules):
            run("cp", os.path.join(modules, name), os.path.dirname(there))


def cover():
    """Empty /home, /tmp and /dev/shm: last, what is needed of there has been bound elsewhere."""
    for place, mode in (("/home", "755"), ("/tmp", "1777"), ("/dev/shm", "1777")):
        run("mount", "-t", "tmpfs", "-o", "mode=" + mode, "tmpfs", place)


def make_users():
    for name in USERS:
        run("useradd", "--create-home", "--shell", "/bin/bash", name)


def main(job):
    loopback_up()
    lay(job["installed"], job["modules"])
    bind(job["tests"], TREE + "/tests")
    for name in ("remap", "bin"):
        os.symlink(f"{SHARE}/{name}", f"{TREE}/{name}")
    for name in ("README.md", "docs"):
        os.symlink(f"{PREFIX}/share/doc/chipwise/{name}", f"{TREE}/{name}")
    bind(job["folder"], LOGS)
    cover()
    make_users()
    for name in [name for name in sys.modules if name.partition(".")[0] == "chipwise"]:
        del sys.modules[name]  # from here on the installed one
    sys.path[:1] = [TREE + "/tests", TREE + "/remap"]
    module, function = job["scene"].split(".")
    scene = getattr(importlib.import_module("support.shipped_" + module), function)
    try:
        answer = scene(**job["arguments"])
    except BaseException:
        subprocess.run(
            'for f in /tmp/linuxcnc.*; do echo "== $f"; tail -n 60 "$f"; done; ps -eo user,pid,ppid,stat,args '
            "--forest; ipcs -m",
            shell=True,
        )
        raise
    with open(LOGS + "/result.json", "w") as file:
        json.dump(answer, file, indent=1)


def attempt():
    """Whether all this is possible here."""
    loopback_up()
    lay("")
    cover()


def reap(action):
    """As PID 1, which every orphan becomes a child of: run the action in a child; -> its exit status."""
    child = os.fork()
    if child == 0:
        action()
        sys.stdout.flush()
        os._exit(0)
    while True:
        pid, status = os.wait()
        if pid == child:
            return os.waitstatus_to_exitcode(status)


if __name__ == "__main__":
    if sys.argv[1] == "--try":
        attempt()
    else:
        sys.exit(reap(lambda: main(json.loads(sys.argv[1]))))
