# SPDX-License-Identifier: GPL-2.0-or-later
"""A person at the machine, for shipped_scenes.py: starts LinuxCNC as one of the users, presses keys and buttons, looks.

Runs as root in the namespaces of shipped_machine.py; everything of LinuxCNC runs as the user, with the environment of a
login.  What is waited for lasts until the next action, so a late look misses nothing.
"""

import contextlib
import json
import os
import pwd
import shutil
import signal
import subprocess
import time

from chipwise.host import processes

from support.shipped_machine import LOGS, TREE

WAIT_S = 300.0  # real time; a machine under load is slow
END_S = 120.0  # until nothing of LinuxCNC is left
KEY = 0x43575354  # of the map


class Trouble(Exception):
    """What did not happen."""


def wait(what, reached, seconds=WAIT_S):
    """-> the first true answer of reached()."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = reached()
        if found:
            return found
        time.sleep(0.1)
    raise Trouble(f"not within {seconds:g} s: {what}")


def text_of(path):
    try:
        with open(path, errors="replace") as file:
            return file.read()
    except FileNotFoundError:
        return ""


class Person:
    def __init__(self, user="op", display=""):
        self.user, self.home, self.display = user, "/home/" + user, display
        self.linuxcnc, self.log, self.starts, self.asked = None, "", 0, []
        self.computer = []  # words before the command of LinuxCNC: namespaces of its own

    # --- as the user ----------------------------------------------------------------------------------------------

    def environment(self, **more):
        own = {
            "HOME": self.home,
            "USER": self.user,
            "LOGNAME": self.user,
            "SHELL": "/bin/bash",
            "LANG": "C.UTF-8",
            "TERM": "dumb",
            "PATH": "/usr/local/bin:/usr/bin:/bin:/usr/local/games:/usr/games",
        }
        if self.display:
            own |= {"DISPLAY": self.display, "LIBGL_ALWAYS_SOFTWARE": "1"}
        return {**own, **more}

    def command(self, *words):
        return ["/sbin/runuser", "-u", self.user, "--", *words]

    def run(self, *words, cwd="", **environment):
        """-> (exit status, what it printed)."""
        done = subprocess.run(
            self.command(*words),
            env=self.environment(**environment),
            cwd=cwd or self.home,
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            errors="replace",
        )
        return done.returncode, done.stdout

    def getp(self, pin):
        return self.run("halcmd", "-s", "getp", pin)[1].strip()

    # --- the configuration ----------------------------------------------------------------------------------------

    def own_configs(self):
        """The sample machines in a folder of the user's own, as README says; -> the folder."""
        folder = self.home + "/machines"
        if not os.path.isdir(folder):
            status, said = self.run("chipwise", "new-config", folder)
            if status:
                raise Trouble(said)
        return folder

    def write(self, path, text):
        with open(path, "w") as file:
            file.write(text)
        shutil.chown(path, self.user, self.user)
        return path

    def edit(self, ini, *changes, name=""):
        """The INI file of the own configs with (old, new) changed, as `name`; -> its path."""
        path = os.path.join(self.own_configs(), ini)
        text = text_of(path)
        for old, new in changes:
            if old not in text:
                raise Trouble(f"{ini} has no {old!r}")
            text = text.replace(old, new)
        return self.write(os.path.join(os.path.dirname(path), name or ini), text)

    # --- LinuxCNC -------------------------------------------------------------------------------------------------

    def start(self, ini, terminal=True, **environment):
        """Start it from a terminal, or as from a menu: then LinuxCNC keeps its output in /tmp."""
        self.starts += 1
        for name in ("print", "debug"):
            with contextlib.suppress(FileNotFoundError):
                os.unlink(f"{self.home}/linuxcnc_{name}.txt")
        self.log = f"{LOGS}/{self.user}{self.starts}.txt"
        words = ["script", "-qefc", f"linuxcnc {ini}", "/dev/null"] if terminal else ["linuxcnc", ini]
        self.linuxcnc = subprocess.Popen(
            [*self.computer, *self.command(*words)],
            env=self.environment(**environment),
            cwd=self.home,
            stdin=subprocess.DEVNULL,
            stdout=open(self.log, "w"),
            stderr=subprocess.STDOUT,
        )

    def said(self):
        """All output of LinuxCNC so far."""
        kept = [
            f"/tmp/{name}"
            for name in sorted(os.listdir("/tmp"))
            if name.startswith(("linuxcnc.print", "linuxcnc.debug"))
        ]
        kept += [f"{self.home}/linuxcnc_{name}.txt" for name in ("print", "debug")]  # after a failed start
        return "".join(text_of(path) for path in [self.log, *kept]).replace("\r", "")

    def until_said(self, text, seconds=WAIT_S):
        def look():
            said = self.said()
            if text in said:
                return True
            if self.linuxcnc.poll() is not None:
                raise Trouble(
                    f"LinuxCNC ended with status {self.linuxcnc.returncode}, and did not say {text!r}:\n{said[-2000:]}"
                )
            return False

        wait(f"{text!r} in the output of LinuxCNC", look, seconds)

    def until_pin(self, pin, value, press=lambda: None):
        """Press until the pin has the value: a screen that is still busy does not hear a key, or hears it later; each
        time the wait is longer."""
        patience = 5.0
        while patience < WAIT_S:
            press()
            with contextlib.suppress(Trouble):
                wait(f"{pin} = {value}", lambda: self.getp(pin) == value, patience)
                return
            patience *= 2
        raise Trouble(f"{pin} is {self.getp(pin)}, not {value}")

    def until_component(self, name):
        wait(name, lambda: f" {name} " in self.run("halcmd", "-s", "show", "comp")[1])

    def until_ended(self, seconds=WAIT_S):
        """-> exit status."""
        wait("the end of LinuxCNC", lambda: self.linuxcnc.poll() is not None, seconds)
        return self.linuxcnc.returncode

    def begin(self, ini, steps, **environment):
        """Start LinuxCNC with steps of scripted_display.py; ini: of edit(), whose display is that program."""
        self.asked, answers = steps, self.home + "/answers.json"
        with contextlib.suppress(FileNotFoundError):
            os.unlink(answers)
        self.start(
            ini,
            CHIPWISE_STEPS=json.dumps(steps),
            CHIPWISE_ANSWERS=answers,
            CHIPWISE_PATIENCE=f"{2 * WAIT_S:g}",
            **environment,
        )

    def answered(self):
        """-> the answers, when LinuxCNC has ended."""
        self.until_ended(3 * WAIT_S)
        found = json.loads(text_of(self.home + "/answers.json") or "[]")
        if len(found) != len(self.asked):
            raise Trouble(f"{found[-1:]}\n{self.said()[-2500:]}")
        return found

    def steps(self, ini, steps):
        """begin() and answered()."""
        self.begin(ini, steps)
        return self.answered()

    def hold(self, ini, steps, **environment):
        """The same, and LinuxCNC stays as it is after the steps."""
        ready = self.home + "/ready"
        with contextlib.suppress(FileNotFoundError):
            os.unlink(ready)
        self.begin(ini, [*steps, ["program", "touch", ready], ["program", "sleep", "1000"]], **environment)
        wait("the steps", lambda: os.path.exists(ready) or self.linuxcnc.poll() is not None)
        if self.linuxcnc.poll() is not None:
            raise Trouble(f"{text_of(self.home + '/answers.json')[-500:]}\n{self.said()[-2500:]}")

    # --- what is left ---------------------------------------------------------------------------------------------

    def programs(self, ending=False):
        """{pid: command line} of everything the user runs, and of rtapi_app, which is root's; with `ending` also {pid:
        name} of what has ended and still returns its memory: it has no command line any more, and its shared memory is
        still there."""
        found = {}
        for pid in processes.pids():
            words = [os.fsdecode(word) for word in processes.command_line(pid)]
            try:
                own = os.stat(f"/proc/{pid}").st_uid == pwd.getpwnam(self.user).pw_uid
                words = words or [text_of(f"/proc/{pid}/comm").strip()] * ending
                alone = len(os.listdir(f"/proc/{pid}/task")) == 1
            except OSError:
                continue
            if (
                words
                and (own or "rtapi_app" in words[0])
                and not (alone and processes.stat_fields(pid)[:1] in ([], ["Z"]))
            ):
                found[pid] = " ".join(words)
        return found

    def left(self):
        """{pid: command line} of what still runs some seconds after the end of LinuxCNC; the panel looks once a
        second."""
        with contextlib.suppress(Trouble):
            wait("the end of everything", lambda: not self.programs(ending=True), END_S)
        return self.programs()

    def kill_all(self):
        """kill -9 of all, as the user would: nothing has the time to clear up."""
        for _ in range(20):
            there = self.programs()
            if not there:
                return
            for pid in there:
                self.run("kill", "-9", str(pid))
        raise Trouble(f"cannot be killed: {there}")


def memory():
    """{key: row} of the shared memory of this IPC namespace."""
    return {row["key"]: row for row in processes.shared_memory()}


def kill(pid, number=signal.SIGKILL):
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        pass


def scripted(own):
    """(old, new) that makes scripted_display.py the display of an INI file: `own` is the line it has."""
    return own, f"DISPLAY = {TREE}/tests/support/scripted_display.py"
