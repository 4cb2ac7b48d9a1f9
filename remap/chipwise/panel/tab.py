# SPDX-License-Identifier: GPL-2.0-or-later
"""The panel page as a tab of a screen: a window of GTK inside the screen's own, as AXIS, gmoccapy and QtVCP embed
programs (X11).

Called by cli/panel.py (`chipwise panel --tab XID`, in [DISPLAY]EMBED_TAB_COMMAND).  The page is shown by WebKitGTK if
it is installed; without it the tab has a button that opens the browser.  It ends with the screen.
"""

import os
import signal
from collections.abc import Sequence
from types import ModuleType
from typing import Any

Widget = Any  # of GTK, and windows of Xlib below: both have no types
AGAIN_MS = 2000  # until a page that did not answer is asked for again: the server starts after the screen
WEBKITS = ("4.1", "4.0")  # versions of WebKit2 for GTK 3
FIT_MS = 500  # between two looks at the size of the window around the page
TOUCH_PX = 48


def gtk() -> ModuleType:
    """GTK 3's module.  Raises ImportError or ValueError if it is not installed."""
    os.environ["GDK_BACKEND"] = "x11"  # embedding is a matter of X11
    os.environ.setdefault(
        "WEBKIT_DISABLE_DMABUF_RENDERER", "1"
    )  # which leaves foreign windows blank on some graphics drivers
    import gi

    gi.require_version("Gtk", "3.0")
    from gi.repository import Gtk

    return Gtk


def web_view(url: str, versions: Sequence[str] = WEBKITS) -> Widget | None:
    """A view of the page, None without WebKitGTK."""
    import gi
    from gi.repository import GLib

    for version in versions:
        try:
            gi.require_version("WebKit2", version)
            from gi.repository import WebKit2
        except (ImportError, ValueError):
            continue
        view = WebKit2.WebView()

        def again(*_failed: object) -> bool:
            GLib.timeout_add(AGAIN_MS, lambda: view.load_uri(url))
            return True

        view.connect("load-failed", again)
        view.connect("web-process-terminated", again)
        view.connect("context-menu", lambda *_event: True)
        view.load_uri(url)
        return view
    return None


def button(url: str) -> Widget:
    """What is there without WebKitGTK: the address, and a button that opens it in the browser."""
    Gtk = gtk()
    box = Gtk.Box(orientation=Gtk.Orientation.VERTICAL, spacing=12, halign=Gtk.Align.CENTER, valign=Gtk.Align.CENTER)
    opens = Gtk.Button(label="Open the panel page")
    opens.set_size_request(-1, TOUCH_PX)
    says = Gtk.Label(label=url, selectable=True)

    def clicked(_button: object) -> None:
        from gi.repository import Gio, GLib

        try:
            Gio.AppInfo.launch_default_for_uri(url, None)
        except GLib.Error as error:
            says.set_text(f"{url}\n{error.message}")

    opens.connect("clicked", clicked)
    box.add(opens)
    box.add(says)
    return box


def put_into(plug: Widget, window: int) -> tuple[Any, Any, Any]:
    """AXIS's container is one of Tk, which does not map a window that asks for it by XEmbed: as gladevcp does, with
    python3-xlib, which LinuxCNC brings for it."""
    from Xlib import display
    from Xlib.xobject import drawable

    server = display.Display()
    inner = drawable.Window(server.display, plug.get_window().get_xid(), 0)
    info = server.get_atom("_XEMBED_INFO")
    inner.change_property(info, info, 32, [0, 1])  # version 0, mapped
    inner.reparent(window, 0, 0)
    inner.map()
    server.sync()
    return server, inner, drawable.Window(server.display, window, 0)


def fit(server: Any, inner: Any, outer: Any) -> bool:
    """Give the page the size of the window around it: QtVCP's container does not follow XEmbed, and leaves that to
    whoever is in it.
    -> True, to be called again; a window that has gone ends the page elsewhere."""
    from Xlib.error import ConnectionClosedError, XError

    try:
        wanted, found = outer.get_geometry(), inner.get_geometry()
        size = wanted.width, wanted.height
        if size != (found.width, found.height) and min(size) > 1:
            inner.configure(x=0, y=0, width=size[0], height=size[1])
            server.sync()
    except (ConnectionClosedError, XError, OSError):
        return False
    return True


def show(window: int, url: str) -> None:
    """The page in the X window of that number, until it or this process ends.  Raises as gtk(), RuntimeError without a
    display."""
    Gtk = gtk()
    if not Gtk.init_check([])[0]:
        raise RuntimeError("there is no X display")
    from gi.repository import GdkX11, GLib  # GdkX11: get_xid() of a window

    assert GdkX11
    plug = Gtk.Plug.new(window)
    plug.add(web_view(url) or button(url))
    plug.connect("destroy", Gtk.main_quit)
    for number in (signal.SIGTERM, signal.SIGINT):
        GLib.unix_signal_add(GLib.PRIORITY_HIGH, number, Gtk.main_quit)
    plug.show_all()
    GLib.timeout_add(FIT_MS, fit, *put_into(plug, window))
    Gtk.main()
