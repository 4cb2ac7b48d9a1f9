# SPDX-License-Identifier: GPL-2.0-or-later
"""A screen for shipped_scenes.py: a virtual X display, its keys and pointer (XTEST), its windows, a picture of it.

python3-xlib comes with LinuxCNC's package.
"""

import os
import struct
import subprocess
import time
import zlib

from Xlib import X, XK, display
from Xlib.error import XError
from Xlib.ext import xtest

WIDTH, HEIGHT = 1280, 1024
SETTLE_S = 0.15  # between two events, as from a person


def start_x():
    """-> the name of a new display, which everybody may use."""
    reading, writing = os.pipe()
    subprocess.Popen(
        [
            "Xvfb",
            "-displayfd",
            str(writing),
            "-screen",
            "0",
            f"{WIDTH}x{HEIGHT}x24",
            "-nolisten",
            "tcp",
            "-ac",
            "-noreset",
        ],
        pass_fds=[writing],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as pipe:
        return ":" + pipe.readline().strip()


class Keys:
    """Keys, pointer and windows of a display."""

    def __init__(self, name):
        self.display = display.Display(name)
        self.root = self.display.screen().root

    def _event(self, kind, detail=0, **place):
        xtest.fake_input(self.display, kind, detail, **place)
        self.display.sync()

    def press(self, key, *held):
        """A key by its X name, with others held down."""
        codes = [self.display.keysym_to_keycode(XK.string_to_keysym(name)) for name in (*held, key)]
        for code in codes:
            self._event(X.KeyPress, code)
        for code in reversed(codes):
            self._event(X.KeyRelease, code)
        time.sleep(SETTLE_S)

    def type(self, text):
        """Letters, digits and a few signs."""
        names = {"/": "slash", ".": "period", "-": "minus", "_": "underscore", " ": "space"}
        for sign in text:
            name = names.get(sign, sign)
            self.press(name, *(["Shift_L"] if sign.isupper() or sign == "_" else []))

    def point(self, x, y):
        self._event(X.MotionNotify, x=x, y=y)
        time.sleep(SETTLE_S)

    def click(self, x, y):
        self.point(x, y)
        for kind in (X.ButtonPress, X.ButtonRelease):
            self._event(kind, 1)
            time.sleep(SETTLE_S)

    def windows(self):
        """{name: (x, y, width, height)} of the windows that are to be seen."""
        found = {}
        for window in self.root.query_tree().children:
            try:
                if window.get_attributes().map_state == X.IsViewable:
                    for each in (window, *window.query_tree().children):
                        if each.get_wm_name():
                            place = window.get_geometry()
                            found[str(each.get_wm_name())] = (place.x, place.y, place.width, place.height)
            except XError:  # gone meanwhile
                continue
        return found

    def stacked(self):
        """[name, lowest first] of the windows that are to be seen."""
        return list(self.windows())

    def window(self, part):
        """-> (x, y, width, height) of the window with these words in its name, None without one."""
        return next((place for name, place in self.windows().items() if part in name), None)


def picture(name, path):
    """A PNG of the display."""
    screen = display.Display(name)
    image = screen.screen().root.get_image(0, 0, WIDTH, HEIGHT, X.ZPixmap, 0xFFFFFFFF)
    screen.close()
    pixels = image.data if isinstance(image.data, bytes) else image.data.encode("latin-1")
    rows = []
    for y in range(HEIGHT):
        row = pixels[4 * WIDTH * y : 4 * WIDTH * (y + 1)]
        rgb = bytearray(3 * WIDTH)
        rgb[0::3], rgb[1::3], rgb[2::3] = row[2::4], row[1::4], row[0::4]
        rows.append(b"\0" + bytes(rgb))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(path, "wb") as file:
        file.write(
            b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"".join(rows), 6))
            + chunk(b"IEND", b"")
        )
