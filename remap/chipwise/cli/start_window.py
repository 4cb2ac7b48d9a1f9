# SPDX-License-Identifier: GPL-2.0-or-later
"""Why LinuxCNC does not start, in a window: for who starts it from a menu or an icon.

Called by `chipwise load` and the other commands whose failure ends the start (__init__.py), and run by itself for the
window:

    start_window.py TEXT

There the linuxcnc script writes all output to its log and opens a window of its own at the end ("LinuxCNC Errors"),
which begins with a hundred lines of settings; the reason is far below them.  This window is in a process of its own,
stays above that one, and is there until the operator closes it.
"""

import os
import subprocess
import sys

WIDTH = 560  # pixels a line is broken at
LIFT_MS = 1000  # between two looks whether another window has come above it


def is_needed():
    """Whether LinuxCNC has started this process, with a screen and no terminal (as `tty -s` in the linuxcnc script)."""
    try:
        at_terminal = os.isatty(0) or os.isatty(2)
    except OSError:
        at_terminal = False
    return bool(os.environ.get("DISPLAY") and os.environ.get("INI_FILE_NAME")) and not at_terminal


def open_window(text):
    """Open it if it is needed, and return at once; without a screen or Tk nothing happens."""
    if is_needed():
        try:
            subprocess.Popen(
                [sys.executable, os.path.realpath(__file__), text],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                cwd="/",
            )
        except OSError:
            pass


def main(text):
    import tkinter

    top = tkinter.Tk(className="chipwise")
    top.title("chipwise")
    top.attributes("-topmost", True)
    top.geometry(f"+{max(0, (top.winfo_screenwidth() - WIDTH) // 2)}+{top.winfo_screenheight() // 3}")

    def lift():
        top.lift()
        top.after(LIFT_MS, lift)

    lift()
    tkinter.Label(top, bitmap="error", padx=16).grid(row=0, column=0)
    tkinter.Label(top, text=text, wraplength=WIDTH, justify="left", padx=8, pady=16).grid(row=0, column=1)
    close = tkinter.Button(top, text="OK", width=10, command=top.destroy)
    close.grid(row=1, column=0, columnspan=2, pady=(0, 12))
    close.focus_set()
    for key in ("<Return>", "<Escape>"):
        top.bind(key, lambda _event: top.destroy())
    top.mainloop()


if __name__ == "__main__":
    main(sys.argv[1])
