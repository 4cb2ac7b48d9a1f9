# SPDX-License-Identifier: GPL-2.0-or-later
"""Write a man page from a program's own command line parser.

    make_man.py OUTFILE         OUTFILE ends in chipwise.1, chipwise-sandbox.1 or chipwise-headless.1

Called by `make build`.  Commands, options and their descriptions come from argparse, so the page is never behind them.
"""

import argparse
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "remap"))

from chipwise import version  # noqa: E402
from chipwise.cli import INTERNAL, build_parser  # noqa: E402
from chipwise.headless import display  # noqa: E402
from chipwise.machine import sandbox  # noqa: E402


def roff(text):
    """Text as roff takes it literally."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line for line in text.splitlines())


def literal(text):
    """Lines that keep their breaks and indents."""
    return [".PP", ".nf", roff(text.strip()), ".fi"]


def option_lines(action):
    names = ", ".join(action.option_strings) or action.metavar or action.dest
    if action.option_strings and action.nargs != 0:
        metavar = action.metavar or action.dest.upper()
        names += " " + (metavar if isinstance(metavar, str) else " ".join(metavar))
    described = (action.help or "") % {**vars(action), "prog": "chipwise"}
    return [".TP", ".B " + roff(names), roff(described)]


def options(parser):
    """Every argument that is shown in the help, but not --help itself."""
    return [
        line
        for action in parser._actions
        if not isinstance(action, argparse._HelpAction) and action.help != argparse.SUPPRESS
        for line in option_lines(action)
    ]


def synopsis(parser):
    return [".B " + roff(" ".join(parser.format_usage().split()).removeprefix("usage: "))]


def command_lines(name, parser, help_text):
    parser.prog = "chipwise " + name
    lines = [".SS " + name, roff(help_text[:1].upper() + help_text[1:] + "."), ".PP", *synopsis(parser)]
    if parser.description:
        lines += literal(parser.description)
    return lines + options(parser)


def head(name, title):
    return [f'.TH {name.upper()} 1 "" "chipwise {version()}"', ".SH NAME", f"{roff(name)} \\- " + roff(title)]


def chipwise():
    """chipwise(1)."""
    parser, modules = build_parser()
    choices = next(action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    lines = [
        *head("chipwise", parser.description.rstrip(".")),
        ".SH SYNOPSIS",
        ".B chipwise",
        ".I COMMAND",
        "[options]",
        ".br",
        ".B chipwise \\-\\-help",
        ".br",
        ".B chipwise \\-\\-version",
        ".SH DESCRIPTION",
        "chipwise is an add\\-on for LinuxCNC mills that knows the stock. The G\\-codes it adds (G12, G13, G24, G75, "
        "G77 to G79, "
        "M250 to M256) and its HAL components run inside LinuxCNC; this command does what is done from a shell.",
        ".SH COMMANDS",
    ]
    names = [name for name in choices if name not in INTERNAL] + [name for name in choices if name in INTERNAL]
    for name in names:
        lines += command_lines(name, choices[name], modules[name].HELP)
    return lines + [
        ".SH EXIT STATUS",
        "0 done, 1 an error or findings, 2 input that cannot be used.",
        ".SH FILES",
        ".TP",
        ".B ~/linuxcnc/configs/chipwise/mill.ini",
        "the simulated mill, made by chipwise new\\-config",
        ".TP",
        ".B share/doc/chipwise",
        "the documentation",
        ".SH SEE ALSO",
        "chipwise\\-sandbox(1), chipwise\\-headless(1), linuxcnc(1), stock_tracker(9), "
        "volumetric_feed(9), chipwise_command(9), chipwise_guard(9), chipwise_inputs(9), tracer(9), tracer_offset(9), "
        "tracer_slave(9), tracer_model(9), spindle_sim(9)",
    ]


def single(parser):
    """The page of a program without subcommands; the first line of its description is its title."""
    title, _, description = parser.description.strip().partition("\n")
    return [
        *head(parser.prog, title.rstrip(".")),
        ".SH SYNOPSIS",
        *synopsis(parser),
        ".SH DESCRIPTION",
        *literal(description)[1:],
        ".SH OPTIONS",
        *options(parser),
        ".SH SEE ALSO",
        "chipwise(1), linuxcnc(1)",
    ]


PAGES = {
    "chipwise": chipwise,
    "chipwise-sandbox": lambda: single(sandbox.build_parser()),
    "chipwise-headless": lambda: single(display.build_parser()),
}


if __name__ == "__main__":
    with open(sys.argv[1], "w") as handle:
        handle.write("\n".join(PAGES[os.path.basename(sys.argv[1]).removesuffix(".1")]()) + "\n")
