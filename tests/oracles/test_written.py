# SPDX-License-Identifier: GPL-2.0-or-later
"""How the Python is written: counts of what makes a function hard to read.  They may only fall: whoever mends some
lowers the number."""

import ast

import pytest

from support import ROOT

SOURCES = {path: path.read_text() for path in sorted((ROOT / "remap").rglob("*.py"))}
PARAMETERS, TARGETS = 6, 2  # of a function, without self; of an assignment of a row of values
# Modules that are imported where they are used, and why.
NOT_EVERYWHERE = {
    "hal",
    "linuxcnc",
    "emccanon",
    "emctask",
    "interpreter",
    "lcnc_realtime",  # LinuxCNC's, and some only in its own processes
    "tkinter",
    "readline",
    "gi",
    "Xlib",
    "distributed",
    "ezdxf",
    "svgelements",
    "tomlkit",
}  # a package that one command needs
QUICK = (
    "cli",
    "options",
    "filter",
    "panel",
)  # folders of commands and pages: one that only prints its help, or waits, loads nothing else
MOST_ROWS, MOST_LATE = 321, 30


def nodes(text, *kinds):
    return [node for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)]


def rows(text):
    """Lines that assign a row of values to more than TARGETS names."""
    return [
        node.lineno
        for node in nodes(text, ast.Assign)
        if isinstance(node.value, ast.Tuple)
        for target in node.targets
        if isinstance(target, ast.Tuple) and len(target.elts) > TARGETS
    ]


def long_heads(text):
    """Names of functions with more than PARAMETERS parameters."""
    return [
        node.name
        for node in nodes(text, ast.FunctionDef, ast.AsyncFunctionDef)
        if len(
            [
                one
                for one in node.args.posonlyargs + node.args.args + node.args.kwonlyargs
                if one.arg not in ("self", "cls")
            ]
        )
        > PARAMETERS
    ]


def late(text, folder=""):
    """Lines with an import within a function, without a reason beside it or above it."""
    lines = [""] + text.split("\n")
    found = {
        node.lineno: node
        for function in nodes(text, ast.FunctionDef, ast.AsyncFunctionDef)
        for node in ast.walk(function)
        if isinstance(node, (ast.Import, ast.ImportFrom))
    }
    return [
        line
        for line, node in found.items()
        if folder not in QUICK
        and "#" not in lines[line]
        and not lines[line - 1].lstrip().startswith("#")
        and (node.module or "" if isinstance(node, ast.ImportFrom) else node.names[0].name).partition(".")[0]
        not in NOT_EVERYWHERE
    ]


def folder(path):
    parts = path.relative_to(ROOT / "remap").parts
    return parts[1] if len(parts) > 2 else ""


@pytest.mark.parametrize(
    "found_in, most",
    [(lambda path, text: rows(text), MOST_ROWS), (lambda path, text: late(text, folder(path)), MOST_LATE)],
    ids=["rows of values", "late imports"],
)
def test_there_are_no_more(found_in, most):
    found = [f"{path.relative_to(ROOT)}: {one}" for path, text in SOURCES.items() for one in found_in(path, text)]
    assert len(found) <= most, found


def test_no_function_has_more_parameters():
    found = {str(path.relative_to(ROOT)): names for path, text in SOURCES.items() if (names := long_heads(text))}
    assert not found, found


def test_each_is_seen():
    assert rows("a, b, c = 1, {}, ''\n(d, e), f, g = h, 0, 1\ni, j = 1, 2\nk, l, m = n\n") == [1, 2]
    assert long_heads("def f(self, a, b, c, d, e, f): pass\ndef g(a, b, c, *, d, e, f, g=1): pass\n") == ["g"]
    text = "def f():\n    import json\n    import re     # why\n    # why\n    import os\n    import hal\n"
    assert late(text) == [2] and late(text, "cli") == []
