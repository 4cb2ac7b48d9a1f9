# SPDX-License-Identifier: GPL-2.0-or-later
"""Serve a page with the stock, the load and the alarms of the LinuxCNC that runs here.

`chipwise load` starts it unless [CHIPWISE]PANEL = no; type it in a shell to start it again.  The page is at the address
that it prints, http://127.0.0.1:8250 by default, for any browser.  It ends with LinuxCNC, and does not disturb it if it
ends before.
"""

import errno
import signal
import threading
import time

from chipwise.host.clock import patience
from chipwise.errors import MESSAGE_BYTES, CycleError, unnamed
from chipwise.errors import NAME as NAMED
from chipwise.settings import load_settings

NAME = "panel"
HELP = "serve a page with stock, load and alarms of the LinuxCNC that runs here"


def add_arguments(parser):
    parser.add_argument(
        "--tab",
        metavar="XID",
        help="show the page in the X window of this number: [DISPLAY]EMBED_TAB_COMMAND = chipwise panel --tab {XID}",
    )


def leave(_number, _frame):
    raise SystemExit(0)


def make_server(settings, watch, *parts):
    """The server, with its colours (colours.load()) and lines (lines.Lines), at [CHIPWISE]PANEL_ADDRESS.  Raises
    CommandError if it cannot be there."""
    from chipwise.options.machine import CommandError
    from chipwise.panel.server import Server

    address, port = settings["PANEL_ADDRESS"], settings["PANEL_PORT"]
    try:
        return Server(address, port, watch, settings["PANEL_TOKEN"], *parts)
    except OSError as error:
        remedy = (
            "end the program that uses it, or set [CHIPWISE]PANEL_PORT to a free one"
            if error.errno == errno.EADDRINUSE
            else "set [CHIPWISE]PANEL_ADDRESS to an address of this machine"
        )
        raise CommandError(f"the panel cannot use port {port} of {address}: {error.strerror}; {remedy}") from error


def run(options):
    """Runs until LinuxCNC ends, with --tab until the screen does."""
    from chipwise.options.machine import CommandError

    if options.tab is not None:
        return show_tab(options.tab)
    from chipwise.host.halcmd import pins
    from chipwise.panel import colours

    try:
        import linuxcnc

        from chipwise.monitor.takeover import ini_file
        from chipwise.panel.entry import Lines

        ini = ini_file(linuxcnc)
        settings = load_settings(ini)
        parts = colours.load(settings.path("COLOURS")), Lines(ini)
        if not pins("stock-tracker.0."):
            raise CycleError("there is no stock tracker in HAL", "start LinuxCNC with chipwise.hal first")
    except CycleError as error:
        raise CommandError(unnamed(error)) from error
    serve(settings, ini, *parts)
    return 0


def show_tab(text):
    """The page as a tab."""
    from chipwise.options.machine import CommandError, UsageError
    from chipwise.panel import tab
    from chipwise.panel.server import as_url

    try:
        window = int(text, 0)
    except ValueError:
        window = 0
    if not 0 < window < 1 << 32:
        raise UsageError(f"--tab {text} is not the number of an X window; use the one that EMBED_TAB_COMMAND gives")
    try:
        settings = load_settings()
        here = settings["PANEL_ADDRESS"].replace("0.0.0.0", "127.0.0.1")
        tab.show(window, as_url("::1" if here == "::" else here, settings["PANEL_PORT"]))
    except CycleError as error:
        raise CommandError(unnamed(error)) from error
    except (ImportError, ValueError) as error:
        raise CommandError(
            f"a tab needs GTK 3 for Python ({error}); apt-get install python3-gi gir1.2-gtk-3.0"
        ) from error
    except RuntimeError as error:
        raise CommandError(f"a tab cannot be shown: {error}; start it from a screen of LinuxCNC") from error
    return 0


def serve(settings, ini, *parts):
    """The looks in this thread, the server in another one."""
    import linuxcnc
    from chipwise.options.machine import CommandError
    from chipwise.monitor.start_line import Quiet, running
    from chipwise.panel.look_ahead import Ahead
    from chipwise.panel.machine import Machine, wait_for_task
    from chipwise.panel.watch import LOOK_S, Watch

    signal.signal(signal.SIGTERM, leave)
    if not wait_for_task():
        return
    watch = Watch(Machine(), settings.path("PANEL_LOG"), Ahead(ini))
    is_quiet = Quiet(linuxcnc)
    try:
        server = make_server(settings, watch, *parts)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        print(
            f"chipwise: the panel is at {server.url}" + ("" if settings["PANEL_TOKEN"] else ", read-only"), flush=True
        )
        said = running(f"stock, load and alarms are at {server.url}")
        while watch.look():
            if said and is_quiet():
                inform(said)
                said = ""
            time.sleep(patience(LOOK_S))
        server.close()
    except CommandError as error:
        while not is_quiet():
            time.sleep(patience(LOOK_S))
        inform(running(str(error)))
        raise
    finally:
        watch.close()


def inform(text):
    """An information on the operator's screen, if there is one."""
    import linuxcnc

    try:
        linuxcnc.command().text_msg(f"{NAMED}{text}"[:MESSAGE_BYTES])
    except linuxcnc.error:
        pass
