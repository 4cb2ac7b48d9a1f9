# SPDX-License-Identifier: GPL-2.0-or-later
"""The subcommands of bin/chipwise, one module each.

A subcommand is a module here with

    NAME, HELP                  as in `chipwise NAME` and `chipwise --help`
    add_arguments(parser)       its own options
    run(options)                does it; -> exit status (None: 0)

and an entry in COMMANDS.  An error that the user can cause is a CommandError,
printed without a traceback.  To add one: write the module, name it
below, describe it in docs/.  LinuxCNC waits for some of them while it starts,
so only the module that is called is imported.
"""

import argparse
import errno
import importlib
import os
import signal
import sys
import threading

from chipwise import ROOT, version
from chipwise.errors import NAME, of_unexpected, printable
from chipwise.options.machine import CommandError, refuser

COMMANDS = {
    name: name
    for name in (
        "blank",
        "check",
        "clamps",
        "contour",
        "demo",
        "digitise",
        "display",
        "enter",
        "filter",
        "link",
        "load",
        "monitor",
        "panel",
        "patterns",
        "resume",
        "rewrite",
        "setup",
        "stations",
        "surface",
        "turn",
    )
} | {
    "new-config": "new_config",
    "load-factors": "load_factors",
    "try": "try_program",
    "import": "import_drawing",
    "turn-over": "turn_over",
}
INTERRUPTED = 130  # as a shell has it
FULL = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO
INTERNAL = ("display", "link", "load", "monitor")  # LinuxCNC calls them
STARTERS = ("link", "load", "monitor")  # and does not start if one fails


def build_parser(names=tuple(COMMANDS)):
    """-> (parser, {name: module}) of the commands named, of all by default."""
    parser = argparse.ArgumentParser(prog="chipwise", description="Stock-aware feed and cycles for LinuxCNC.")
    parser.add_argument("--version", action="version", version="chipwise " + version())
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND")
    modules = {}
    for name in names:
        module = importlib.import_module("chipwise.cli." + COMMANDS[name])
        modules[module.NAME] = module
        subparser = subparsers.add_parser(
            module.NAME,
            help=module.HELP,
            description=module.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        subparser.error = refuser(module.NAME)
        module.add_arguments(subparser)
    return parser, modules


def welcome(modules):
    """Printed if no command is given."""
    usual = [f"  chipwise {name:<10} {module.HELP}" for name, module in modules.items() if name not in INTERNAL]
    return "\n".join(
        [
            f"chipwise {version()}: stock-aware feed and cycles for LinuxCNC",
            "",
            *usual,
            "",
            "chipwise COMMAND --help says more about one of them; man chipwise about all.",
            *machine_lines(),
        ]
    )


def machine_lines():
    """How to start a simulated machine: LinuxCNC writes beside the INI file, which nobody but root may do where
    chipwise is installed."""
    folder, first = os.path.join(ROOT, "configs"), []
    if not os.path.isfile(os.path.join(ROOT, "Makefile")):  # not the repository
        folder, first = (
            "~/linuxcnc/configs/chipwise",
            ["Simulated machines, in a folder of your own:", "  chipwise new-config"],
        )
    return [
        *first,
        "The codes work inside LinuxCNC: G12, G13, G24, G75, G77 to G79 and M250 to M256 on the simulated mill,",
        f"  linuxcnc {os.path.join(folder, 'mill.ini')}",
        "G22, G23, G26 and G27 on the simulated lathe,",
        f"  linuxcnc {os.path.join(folder, 'lathe.ini')}",
    ]


def open_handles():
    """Closed standard handles lead to nowhere from here on: else the next file that is opened would get their
    number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))


def drop_output():
    """What is still to be printed goes nowhere: the interpreter's own end would complain of it once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def of_system(error):
    """What is said of an OSError, without "chipwise: "."""
    if error.filename is None and error.errno in FULL:
        return f"the output cannot be written: {error.strerror}; it is not complete"
    return str(error)


def hear_interrupts():
    """-> list, not empty from the first Ctrl-C on: where that cuts off the import of an extension module, what comes of
    it is an ImportError.  Ctrl-C stays ignored where it is."""
    heard = []

    def hear(number, _frame):
        heard.append(number)
        raise KeyboardInterrupt

    usual = signal.SIG_DFL, signal.default_int_handler  # bin/chipwise has the first one
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) in usual:
        signal.signal(signal.SIGINT, hear)
    return heard


def fail(argv, text):
    """Say why a command fails: in a window as well where LinuxCNC has called it and only its log gets the line."""
    print(text, file=sys.stderr, flush=True)
    if argv[:1] and argv[0] in STARTERS:
        from chipwise.cli.start_window import open_window

        open_window(text)


def run(argv):
    """-> exit status of a command."""
    parser, modules = build_parser(argv[:1] if argv[:1] and argv[0] in COMMANDS else tuple(COMMANDS))
    try:
        options, unknown = parser.parse_known_args(argv)
        if unknown and options.command:
            refuse = refuser(options.command)
            refuse(f"{' '.join(unknown)} is not understood")
        elif unknown:
            parser.parse_args(argv)  # says so
        if options.command is None:
            print(welcome(modules))
            return 2
        return modules[options.command].run(options) or 0
    except SystemExit as ended:  # of argparse after --help, of a signal
        return ended.code or 0


def main(argv):
    """-> exit status.  Any error is one line; CHIPWISE_TRACEBACK=1 adds the traceback."""
    heard = hear_interrupts()
    open_handles()
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # paths need not be UTF-8
    try:
        status = run(argv)
        sys.stdout.flush()  # what could not be written is not done
        return status
    except CommandError as error:
        fail(argv, "chipwise: %s" % error)
        return error.status
    except BrokenPipeError:
        drop_output()
    except OSError as error:
        fail(argv, printable(NAME + of_system(error)))
        drop_output()
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        if heard:
            return INTERRUPTED
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        fail(argv, printable(NAME + of_unexpected(error)))
    return 1
