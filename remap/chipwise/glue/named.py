# SPDX-License-Identifier: GPL-2.0-or-later
"""Named parameters: which the interpreter has, which are chipwise's, and which of those the running program has set.

Called by glue/state.py and glue/shape.py for their values, and by glue/program_run.py.

Global named parameters live as long as milltask, while a preview has an interpreter of its own: a program would be run
with what the one before it has left, and its preview would not show that.  So when a program begins, and when MDI
begins after a program, forget() takes what was set before out of the interpreter.  Two things show what was set before:
    1. every code of ours marks what it has seen; the interpreter takes the mark off with the next assignment;
    2. what nobody has marked was set by lines without a code of ours: it stays where the program has such a line.
The mark is the bit "unset" of the parameter, which LinuxCNC clears when it stores a value and asks for nowhere else.
Read in LinuxCNC 2.9.0~pre1, 2.9.4 and 2.10: interp_namedparams.cc, pyinterp1.cc, pyparamclass.cc.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Callable

from chipwise.errors import CycleError

if TYPE_CHECKING:
    from chipwise.program.interp import Interp

PREFIX = "_chipwise_"
KNOWN = (
    "_chipwise_allowance",
    "_chipwise_approach_angle",
    "_chipwise_chop_size",
    "_chipwise_keep_climb",
    "_chipwise_ramp_angle",
    "_chipwise_seam_overlap",
    "_chipwise_surface_depth",
    "_chipwise_surface_rest",
    "_chipwise_surface_scallop",
    "_chipwise_to_and_fro",
)

_UNSET = 4  # interp_internal.hh: PA_UNSET


def global_names(interp: Interp) -> list[str]:
    """Names of the global named parameters.  LinuxCNC lists the local ones of the main program with them."""
    return [name for name in interp.params.globals() if name.startswith("_")]


def chipwise_names(interp: Interp) -> list[str]:
    """Those with our prefix; LinuxCNC makes no difference between capital and small letters."""
    return [name for name in global_names(interp) if name.lower().startswith(PREFIX)]


def value(interp: Interp, name: str) -> float | None:
    """A parameter of ours, None where the program has not set it."""
    return interp.params[name] if name in (known.lower() for known in chipwise_names(interp)) else None


def check_known(interp: Interp) -> None:
    """Raise CycleError for an unknown name with our prefix: a typing error would count as not set."""
    unknown = sorted(name for name in chipwise_names(interp) if name.lower() not in KNOWN)
    if unknown:
        del interp.sub_context[0].named_params[unknown[0]]  # said once: nobody else could take it out in MDI
        shown = unknown[0].lower().replace("{", "{{").replace("}", "}}")
        raise CycleError(
            f"#<{shown}> is not known",
            f"known after #<{PREFIX} are " + ", ".join(name.removeprefix(PREFIX) for name in KNOWN),
        )


# ---- what was set before ----------------------------------------------------------------------------------------


def mark(interp: Interp) -> None:
    """Everything that is set now has been seen."""
    names = chipwise_names(interp)
    if names:
        parameters = interp.sub_context[0].named_params
        for name in names:
            parameters[name].attr |= _UNSET


def forget(interp: Interp, was_set: Callable[[str], bool]) -> None:
    """Take out what was set before; was_set(name): whether an unmarked one has been set since."""
    parameters = interp.sub_context[0].named_params
    for name in chipwise_names(interp):
        if parameters[name].attr & _UNSET or not was_set(name.lower()):
            del parameters[name]


_BLANKS_AND_COMMENTS = re.compile(r"\([^)]*\)?|;.*|\s")
_ASSIGNED = re.compile(r"#<(_chipwise_[^>]*)>=")
_O_WORD = re.compile(r"^/?(?:n\d+(?:\.\d+)?)?(?:o(\d+|<[^>]*>)(sub|endsub|call)|m98p(\d+))")


def assigned_in(text: str, line: int) -> tuple[set[str], set[str]]:
    """(names of ours, subs called) in a program's text: assigned up to a line of it, or in a sub wherever it stands."""
    names: set[str] = set()
    called: set[str] = set()
    inside = False
    for number, raw in enumerate(text.split("\n"), 1):
        lower = raw.lower()
        if "o" not in lower and PREFIX not in lower and "m98" not in lower:
            continue
        plain = _BLANKS_AND_COMMENTS.sub("", lower)
        word = _O_WORD.match(plain)
        if word and word.group(2) in ("sub", "endsub"):
            inside = word.group(2) == "sub"
        elif word:
            called.add((word.group(1) or word.group(3)).strip("<>"))
        if inside or number <= line:
            names.update(_ASSIGNED.findall(plain))
    return names, called
