# SPDX-License-Identifier: GPL-2.0-or-later
"""Write the bash completion of chipwise and chipwise-sandbox from their command line parsers.

    make_completion.py OUTFILE      OUTFILE ends in chipwise or chipwise-sandbox

Called by `make build`; `make install` puts the files where bash-completion loads them from.
"""

import argparse
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "remap"))

from chipwise.cli import INTERNAL, build_parser  # noqa: E402
from chipwise.machine import sandbox  # noqa: E402

CHIPWISE = """\
# bash completion of chipwise; made by tools/make_completion.py
_chipwise()
{{
    local word=${{COMP_WORDS[COMP_CWORD]}} options
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W '{commands} --help --version' -- "$word"))
        return
    fi
    case ${{COMP_WORDS[1]}} in
{cases}
        *) options='' ;;
    esac
    case $word in
        -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
        *) compopt -o filenames; COMPREPLY=($(compgen -f -- "$word")) ;;
    esac
}}
complete -F _chipwise chipwise
"""
SANDBOX = """\
# bash completion of chipwise-sandbox; made by tools/make_completion.py
_chipwise_sandbox()
{{
    local word=${{COMP_WORDS[COMP_CWORD]}}
    case $word in
        -*) COMPREPLY=($(compgen -W '{options}' -- "$word")) ;;
        *) compopt -o filenames; COMPREPLY=($(compgen -c -f -- "$word")) ;;
    esac
}}
complete -F _chipwise_sandbox chipwise-sandbox
"""


def options(parser):
    """Long options of a parser in one line."""
    return " ".join(
        name
        for action in parser._actions
        if action.help != argparse.SUPPRESS
        for name in action.option_strings
        if name.startswith("--")
    )


def chipwise():
    parser, _modules = build_parser()
    choices = next(action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    cases = [
        f"        {name}) options='{options(command)}' ;;" for name, command in choices.items() if name not in INTERNAL
    ]
    return CHIPWISE.format(commands=" ".join(name for name in choices if name not in INTERNAL), cases="\n".join(cases))


FILES = {"chipwise": chipwise, "chipwise-sandbox": lambda: SANDBOX.format(options=options(sandbox.build_parser()))}


if __name__ == "__main__":
    with open(sys.argv[1], "w") as handle:
        handle.write(FILES[os.path.basename(sys.argv[1])]())
