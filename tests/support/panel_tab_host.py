#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A screen that embeds `chipwise panel --tab` as AXIS and gmoccapy do, and the server it shows; run on an X display of
its own.

panel_tab_host.py INI               prints one JSON object; INI: where to write [CHIPWISE]PANEL_PORT
"""

import gc
import json
import os
import subprocess
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2] / "remap")]
os.environ["GDK_BACKEND"] = "x11"
import gi  # noqa: E402

gi.require_version("Gtk", "3.0")
from gi.repository import GLib, Gtk  # noqa: E402

from chipwise.panel import tab  # noqa: E402
from support import ROOT, panel_rig  # noqa: E402

WAIT_S = 90


def until(reached):
    """Let GTK work until something is so; -> whether it got so."""
    end = time.monotonic() + WAIT_S
    while not reached() and time.monotonic() < end:
        while Gtk.events_pending():
            Gtk.main_iteration()
        time.sleep(0.02)
    return bool(reached())


def main(ini):
    found = {
        "webkit": tab.web_view("about:blank") is not None,
        "button": type(tab.button("http://127.0.0.1:1")).__name__,
        "none": tab.web_view("about:blank", ()) is None,
    }
    gc.collect()  # the view goes here: a collection in a thread of the server would free it there, and WebKit aborts
    window, socket, inside = Gtk.Window(), Gtk.Socket(), []
    socket.connect("plug-added", lambda *_: inside.append(1))
    socket.connect("plug-removed", lambda *_: inside.clear() or True)
    window.add(socket)
    window.set_default_size(900, 600)
    window.show_all()
    with panel_rig.serving() as rig:
        Path(ini).write_text(f"[CHIPWISE]\nPANEL_PORT = {rig.server.server_port}\n")
        rig.looks()
        command = [sys.executable, str(ROOT / "bin/chipwise"), "panel", "--tab", hex(socket.get_id())]
        process = subprocess.Popen(command, env={**os.environ, "INI_FILE_NAME": ini})
        found["embedded"] = until(lambda: inside)
        found["reads"] = until(lambda: rig.watch.pages == 1) if found["webkit"] else None
        process.terminate()
        found["status"] = process.wait(WAIT_S)
        found["gone"] = until(lambda: not inside and rig.watch.pages == 0)
        process = subprocess.Popen(command, env={**os.environ, "INI_FILE_NAME": ini})
        found["again"] = until(lambda: inside)
        window.destroy()  # the screen ends
        found["ends"] = until(lambda: process.poll() is not None)
    print(json.dumps(found))
    GLib.idle_add(sys.exit)


if __name__ == "__main__":
    main(sys.argv[1])
