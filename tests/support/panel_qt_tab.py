# SPDX-License-Identifier: GPL-2.0-or-later
"""Inside QtDragon, as its USER_COMMAND_FILE: brings the tab TAB of tabWidget_utilities to the front, waits until the
page in it reads the stream of `chipwise panel`, and has a look at what the screen shows there.

    start(FOLDER)       FOLDER/result.json: {"tabs", "pages", "box", "state": shares of the tab's pixels that have the
                        colours of the page's boxes, and of its background, "outside": pixels by which QtVCP's container
                        is larger than the tab}; screen.png beside it
"""

import json
import os
import re
import urllib.request

from PyQt5 import QtCore, QtWidgets

STATE = "http://127.0.0.1:8250/state.json"
COLOURS = "http://127.0.0.1:8250/colours.css"
TAB = "Stock"  # LinuxCNC 2.9.4 adds others behind it
EVERY_MS = 2000
NEAR = 4  # of 255
# shares of the tab at least: of the page's boxes, and of the background that shows the state; a blank window has one
# colour
BOX, STATES = 0.2, 0.01
KEPT = []  # a timer lives as long as somebody has it


def widget(name):
    return next(one for one in QtWidgets.QApplication.instance().allWidgets() if one.objectName() == name)


def asked(url):
    """The answer of the server, "" without one."""
    try:
        with urllib.request.urlopen(url, timeout=5) as answer:
            return answer.read().decode()
    except OSError:
        return ""


def page_colours(name):
    """[(r, g, b)] of the page's variables that match a regular expression, in both modes."""
    return [
        tuple(int(value[k : k + 2], 16) for k in (0, 2, 4))
        for value in re.findall(rf"--{name}: #(\w{{6}})", asked(COLOURS))
    ]


def share(image, area, name):
    """Share of the pixels of an area, every fourth of each direction, that have one of the page's colours."""
    wanted, hits, count = page_colours(name), 0, 0
    for x in range(area.left(), area.right(), 4):
        for y in range(area.top(), area.bottom(), 4):
            colour = image.pixelColor(x, y)
            found = colour.red(), colour.green(), colour.blue()
            count += 1
            hits += any(max(abs(a - b) for a, b in zip(found, one)) <= NEAR for one in wanted)
    return hits / max(1, count)


def look(folder):
    tabs, stack = widget("tabWidget_utilities"), widget("stackedWidget_mainTab")
    screen = QtWidgets.QApplication.instance().primaryScreen()
    tabs.window().setGeometry(screen.geometry())  # there is no window manager that would do it
    tabs.setCurrentIndex(next(k for k in range(tabs.count()) if tabs.tabText(k) == TAB))
    stack.setCurrentIndex(next(k for k in range(stack.count()) if stack.widget(k).isAncestorOf(tabs)))
    pages = json.loads(asked(STATE) or "{}").get("pages", 0)
    if not pages:
        return
    shown = tabs.currentWidget()
    area = QtCore.QRect(shown.mapToGlobal(QtCore.QPoint(0, 0)), shown.size())
    picture = screen.grabWindow(0)
    picture.save(os.path.join(folder, "screen.png"))
    image = picture.toImage()
    found = {"box": share(image, area, "box"), "state": share(image, area, r"state-\w+")}
    container = next(
        one for one in shown.findChildren(QtWidgets.QWidget) if type(one).__name__ == "XEmbeddable"
    ).container
    at = container.mapToGlobal(QtCore.QPoint(0, 0))
    found["outside"] = [
        max(0, at.x() + container.width() - area.right() - 1),
        max(0, at.y() + container.height() - area.bottom() - 1),
    ]
    print("panel_qt_tab:", found, flush=True)
    if found["box"] > BOX and found["state"] > STATES:
        KEPT.pop().stop()
        with open(os.path.join(folder, "result.part"), "w", encoding="utf-8") as file:
            json.dump({"tabs": [tabs.tabText(k) for k in range(tabs.count())], "pages": pages, **found}, file)
        os.rename(os.path.join(folder, "result.part"), os.path.join(folder, "result.json"))


def start(folder):
    timer = QtCore.QTimer()
    timer.timeout.connect(lambda: look(folder))
    timer.start(EVERY_MS)
    KEPT.append(timer)
