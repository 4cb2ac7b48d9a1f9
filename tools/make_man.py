"""Write the man page chipwise(1) from the command line tool's own help.

    make_man.py OUTFILE

Called by `make build`.  Commands, options and what they do are those of remap/chipwise/cli, so the page cannot be
behind them.
"""

import argparse
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, 'remap'))

from chipwise import version                    # noqa: E402
from chipwise.cli import INTERNAL, build_parser  # noqa: E402


def roff(text):
    """Text as roff takes it literally."""
    text = text.replace('\\', '\\e').replace('-', '\\-')
    return '\n'.join('\\&' + line if line.startswith(('.', "'")) else line for line in text.splitlines())


def option_lines(action):
    names = ', '.join(action.option_strings) or action.metavar or action.dest
    if action.option_strings and action.nargs != 0:
        metavar = action.metavar or action.dest.upper()
        names += ' ' + (metavar if isinstance(metavar, str) else ' '.join(metavar))
    described = (action.help or '') % {**vars(action), 'prog': 'chipwise'}
    return ['.TP', '.B ' + roff(names), roff(described)]


def command_lines(name, parser, help_text):
    parser.prog = 'chipwise ' + name
    usage = ' '.join(parser.format_usage().split()).removeprefix('usage: ')
    lines = ['.SS ' + name, roff(help_text[:1].upper() + help_text[1:] + '.'), '.PP', '.B ' + roff(usage)]
    if parser.description:
        lines += ['.PP', '.nf', roff(parser.description.strip()), '.fi']
    for action in parser._actions:
        if not isinstance(action, argparse._HelpAction):
            lines += option_lines(action)
    return lines


def page():
    parser, modules = build_parser()
    choices = next(action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    lines = [f'.TH CHIPWISE 1 "" "chipwise {version()}"', '.SH NAME', 'chipwise \\- ' + roff(parser.description.rstrip('.')),
             '.SH SYNOPSIS', '.B chipwise', '.I COMMAND', '[options]', '.br', '.B chipwise \\-\\-help', '.br',
             '.B chipwise \\-\\-version',
             '.SH DESCRIPTION',
             'chipwise is an add\\-on for LinuxCNC mills that knows the stock. The G\\-codes it adds (G12, G13, G77 to G79, '
             'M250 to M254) and its HAL components run inside LinuxCNC; this command does what is done from a shell.',
             '.SH COMMANDS']
    names = [name for name in choices if name not in INTERNAL] + [name for name in choices if name in INTERNAL]
    for name in names:
        lines += command_lines(name, choices[name], modules[name].HELP)
    lines += ['.SH EXIT STATUS', '0 done, 1 an error or findings, 2 input that cannot be used.',
              '.SH FILES', '.TP', '.B share/chipwise/configs/mill.ini', 'the simulated mill', '.TP', '.B share/doc/chipwise',
              'the documentation',
              '.SH SEE ALSO', 'linuxcnc(1), stock_tracker(9), volumetric_feed(9), chipwise_command(9), chipwise_guard(9), '
              'chipwise_inputs(9)']
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    with open(sys.argv[1], 'w') as handle:
        handle.write(page())
