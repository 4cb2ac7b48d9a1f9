# SPDX-License-Identifier: GPL-2.0-or-later
"""Opens programs in a real AXIS, gmoccapy or QtVCP screen, from inside, as their own open buttons do, and says what
came of each.

    filter_probe.py INI RESULT      in a sandbox: LinuxCNC until there is a result
    start(names, job)       names: those of the user command file, which each of the GUIs executes in itself at its
    start

Used by filter_rig.py, which writes that file.  job: JSON of `files` [{path, expect, kill}], `result`.  A file is done
when the GUI has opened it or has shown a dialog, and a message with the text `expect` has been on the screen.  kill:
the filter is killed while it runs.  The result is a list of {path, seconds (until the GUI answered), loaded (path of
the program in the task), dialog, messages}.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
import traceback

TICK_S = 0.05
_alive = []  # what the GUI would forget
READY_S, READY_TICKS = 3.0, 40  # of the GUI's loop before the first file
KILL_AFTER_S = 1.0
PATIENCE_S = 300.0  # for the answer, and for the message


class Axis:
    """names: AXIS's own module."""

    def __init__(self, names):
        self.names, self.root, self.returned = names, names["root_window"], True

    def every(self, seconds, call):
        def again():
            self.root.after(int(seconds * 1000), again)
            call()

        self.root.after(int(seconds * 1000), again)

    def open(self, path):
        def go():
            self.returned = False
            try:
                self.names["commands"].open_file_name(path)
            finally:
                self.returned = True

        self.root.after(1, go)
        self.returned = False

    def answers(self):
        return self.returned

    def dialog(self):
        tk = self.root.tk
        if not int(tk.call("winfo", "exists", ".error")):
            return None
        texts, waiting = [], [".error"]
        while waiting:
            widget = waiting.pop(0)
            waiting += list(tk.splitlist(tk.call("winfo", "children", widget)))
            kind = str(tk.call("winfo", "class", widget))
            if kind == "Label":
                texts.append(str(tk.call(widget, "cget", "-text")))
            elif kind == "Text":
                texts.append(str(tk.call(widget, "get", "1.0", "end")))
            elif kind == "Button":
                self.button = widget
        return "\n".join(texts)

    def close_dialog(self):
        self.root.after(1, lambda: self.root.tk.call(self.button, "invoke"))

    def messages(self):
        return [str(widgets[2].cget("text")) for widgets in self.names["notifications"].widgets]


class Gmoccapy:
    """names['self']: its window's class."""

    def __init__(self, names):
        from gi.repository import GLib, Gtk

        self.glib, self.gtk, self.app, self.shown = GLib, Gtk, names["self"], []
        add = self.app.notification.add_message

        def added(message, *rest):
            self.shown.append(message)
            return add(message, *rest)

        self.app.notification.add_message = added

    def every(self, seconds, call):
        self.glib.timeout_add(int(seconds * 1000), lambda: call() or True)

    def open(self, path):
        self.glib.idle_add(lambda: self.app.widgets.hal_action_open.load_file(path) and False)

    def answers(self):
        return True

    def _dialogs(self):
        return [
            window
            for window in self.gtk.Window.list_toplevels()
            if isinstance(window, self.gtk.MessageDialog) and window.get_visible()
        ]

    def dialog(self):
        return next(
            (
                "\n".join(filter(None, (window.get_property("text"), window.get_property("secondary-text"))))
                for window in self._dialogs()
            ),
            None,
        )

    def close_dialog(self):
        for window in self._dialogs():
            window.response(self.gtk.ResponseType.CLOSE)

    def messages(self):
        return self.shown


class Qt:
    """QtVCP's screens."""

    def __init__(self, _names):
        from PyQt5 import QtCore, QtWidgets
        from qtvcp.core import Action, Status

        self.core, self.widgets, self.action, self.shown, self.asked = QtCore, QtWidgets, Action(), [], None
        Status().connect("error", lambda _source, _kind, text: self.shown.append(text))
        Status().connect("dialog-request", self._ask)

    def _ask(self, _source, request):
        self.asked = "\n".join(str(request.get(key)) for key in ("MESSAGE", "MORE", "DETAILS"))

    def every(self, seconds, call):
        self.timer = self.core.QTimer()
        self.timer.timeout.connect(call)
        self.timer.start(int(seconds * 1000))

    def open(self, path):
        self.asked = None
        self.core.QTimer.singleShot(0, lambda: self.action.OPEN_PROGRAM(path))

    def answers(self):
        return True

    def dialog(self):
        box = self.widgets.QApplication.activeModalWidget()
        return self.asked if self.asked and box is not None else None

    def close_dialog(self):
        self.asked = None
        box = self.widgets.QApplication.activeModalWidget()
        self.core.QTimer.singleShot(0, box.accept if hasattr(box, "accept") else box.close)

    def messages(self):
        return self.shown


def _filters(pid):
    """Filters below a process."""
    found = []
    for number in os.listdir(f"/proc/{pid}/task"):
        try:
            with open(f"/proc/{pid}/task/{number}/children") as file:
                children = file.read().split()
        except OSError:
            continue
        for child in children:
            try:
                with open(f"/proc/{child}/cmdline", "rb") as file:
                    words = file.read().split(b"\0")
            except OSError:
                continue
            if b"filter" in words and any(word.endswith(b"bin/chipwise") for word in words):
                found.append(int(child))
            found += _filters(child)
    return found


class Probe:
    def __init__(self, gui, job):
        import linuxcnc

        self.gui, self.job, self.files, self.record = gui, job, list(job["files"]), None
        self.status, self.results, self.begun, self.ticks = linuxcnc.stat(), [], time.monotonic(), 0
        self.file, self.killed = None, False
        gui.every(TICK_S, self.tick)

    def tick(self):
        try:
            now = time.monotonic()
            self.ticks += 1
            self.status.poll()
            if self.record is None:
                self.next(now)
            else:
                self.follow(now)
        except Exception:
            self.write(traceback.format_exc())
            self.files, self.record = [], None

    def next(self, now):
        if (
            now - self.begun < READY_S
            or self.ticks < READY_TICKS
            or not self.gui.answers()
            or self.gui.dialog() is not None
        ):
            return
        if not self.files:
            if not os.path.exists(self.job["result"]):
                self.write("")
            return
        self.file, self.killed = self.files.pop(0), False
        self.record = {"path": self.file["path"], "seconds": None, "loaded": "", "dialog": None, "messages": []}
        self.started, self.before = now, len(self.messages())
        self.gui.open(self.file["path"])

    def messages(self):
        """Of the GUI, without chipwise's start line, which comes when it likes."""
        return [text for text in self.gui.messages() if " is running; stock, load and alarms" not in text]

    def follow(self, now):
        record = self.record
        if self.file.get("kill") and not self.killed and now - self.started > KILL_AFTER_S:
            for pid in _filters(os.getpid()):
                with contextlib.suppress(
                    ProcessLookupError
                ):  # it may have ended by itself: then the next look finds another
                    os.kill(pid, signal.SIGKILL)
                    self.killed = True
        record["messages"] = self.messages()[self.before :]
        if record["seconds"] is None:
            record["dialog"] = self.gui.dialog()
            path = self.status.file
            name = os.path.basename(record["path"])
            loaded = path != record["path"] and os.path.basename(path) in (name, "filtered-" + name)  # AXIS of 2.10
            if record["dialog"] is None and not (loaded and self.gui.answers()):
                assert now - self.started < PATIENCE_S, f"no answer: {record}"
                return
            record["seconds"], record["loaded"] = round(now - self.started, 3), path if loaded else ""
            if loaded:
                with open(path, "rb") as file:
                    record["content"] = file.read().decode("latin-1")
            if record["dialog"] is not None:
                self.gui.close_dialog()
        if self.file.get("expect", "") in "\n".join(record["messages"]) or now - self.started > PATIENCE_S:
            self.results.append(record)
            self.record = None

    def write(self, trouble):
        with open(self.job["result"] + ".part", "w") as file:
            json.dump({"trouble": trouble, "records": self.results}, file, indent=1)
        os.rename(self.job["result"] + ".part", self.job["result"])


def start(names, path):
    with open(path) as file:
        job = json.load(file)
    kind = Axis if "root_window" in names else Gmoccapy if job["screen"] == "gmoccapy" else Qt
    _alive.append(Probe(kind(names), job))


def main(ini, result):
    """In the sandbox: LinuxCNC until the probe is done."""
    linuxcnc = subprocess.Popen(["linuxcnc", "-r", ini], stdin=subprocess.DEVNULL)
    while linuxcnc.poll() is None and not os.path.exists(result):
        time.sleep(0.2)


if __name__ == "__main__":
    main(*sys.argv[1:])
