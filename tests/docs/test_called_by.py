# SPDX-License-Identifier: GPL-2.0-or-later
"""The lists "Called by a.py, b.py and c.py" of modules: each file that they name imports the module, or names it to
start it."""

import ast
import functools
import re

import pytest

from support import ROOT

PACKAGE = ROOT / "remap" / "chipwise"
MODULES = sorted(
    path for folder in ("remap", "tests/support", "tools", "bench/lib") for path in (ROOT / folder).rglob("*.py")
)
LOOKED_UP_IN = PACKAGE, ROOT, ROOT / "tests/support", ROOT / "bench", ROOT / "tools"
NAME = r"[\w-]+(?:/[\w-]+)*\.py\b"
LIST = re.compile(rf"\b(?:[Cc]alled|Used) by ({NAME}(?:,? (?:and )?(?:by )?{NAME})*)(,? (?:through|in the child) )?")


def called_by(text):
    """Names in the lists of a module's docstring; a list that ends with "through .." says what is not seen here, and is
    left out."""
    words = " ".join((ast.get_docstring(ast.parse(text)) or "").split())
    return [name for names, indirect in LIST.findall(words) if not indirect for name in re.findall(NAME, names)]


@functools.lru_cache(maxsize=None)
def needs(path):
    """What a file imports, as dotted names, and the texts in it, docstrings left out: one may be of a program that it
    starts."""
    found, tree = [], ast.parse(path.read_text())
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [f"{node.module}.{one.name}" for one in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            found.append(node.value)
    return found


def callers(path, name):
    """The files that a name in the docstring of a module can mean: the one beside it, else one of a folder, else all of
    that name."""
    for folder in (path.parent, *LOOKED_UP_IN):
        if (folder / name).is_file():
            return [folder / name]
    return [found for folder in (ROOT / "tests", ROOT / "remap") for found in folder.rglob(name)]


def is_needed(path, text):
    """Whether a text names a module: dotted, or as a file or program."""
    stem = re.escape(path.parent.name if path.stem == "__init__" else path.stem)
    return re.search(rf"\b{stem}\.py\b|[./]{stem}\b|\bimport .*\b{stem}\b|^{stem}(?:\.\w|$)", text)


def wrong(path, text):
    """Names in the lists of a module's text that do not call it."""
    return [
        name
        for name in called_by(text)
        if not any(is_needed(path, one) for caller in callers(path, name) for one in needs(caller))
    ]


def test_who_is_named_calls():
    texts = {path: path.read_text() for path in MODULES}
    assert sum(len(called_by(text)) for text in texts.values()) > 400
    found = {str(path.relative_to(ROOT)): names for path, text in texts.items() if (names := wrong(path, text))}
    assert not found


@pytest.mark.parametrize(
    "words, names",
    [
        ("Called by planner/plans.py and run.py.", ["run.py"]),
        ("What it is.  Called by planner/plans.py, and by\nnobody.py at each look.", ["nobody.py"]),
        ("Called by run.py, through codes.py.", []),
        ("The cycles call it.", []),
    ],
)
def test_a_wrong_name_is_seen(words, names):
    """Of the module of G13's cycle."""
    assert wrong(PACKAGE / "cycles/hole.py", f'"""{words}"""') == names
