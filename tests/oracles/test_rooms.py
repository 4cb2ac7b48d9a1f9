# SPDX-License-Identifier: GPL-2.0-or-later
"""The rooms of remap/chipwise: none imports one that imports it, by however many others, and none but a few modules
stand outside of all."""

import ast

import pytest

from support import ROOT
from support.circles import circle

PACKAGE = ROOT / "remap" / "chipwise"
LOOSE = {
    "codes",
    "errors",
    "gcode_lines",
    "ini",
    "moves",
    "order",
    "rates",
    "report",
    "settings",
}  # the vocabulary of all rooms


def module(path):
    """Dotted name below chipwise, "" for the package itself."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree, modules):
    """Names, below chipwise, of the modules that a file imports anywhere in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{one.name}" for one in node.names]
        else:
            continue
        for name in names:
            package, _dot, rest = name.partition(".")
            if package == "chipwise":
                yield rest if rest in modules else rest.rpartition(".")[0]


def rooms(sources):
    """{room: rooms and loose modules that it imports} of {module: text}; a room is the folder at the top, or a loose
    module."""
    graph = {}
    for name, text in sources.items():
        room = name.partition(".")[0]
        others = {one.partition(".")[0] for one in imported(ast.parse(text), sources)} - {room, ""}
        graph.setdefault(room, set()).update(others if name else ())
    return graph


def all_sources():
    return {module(path): path.read_text() for path in PACKAGE.rglob("*.py")}


def test_no_rooms_import_each_other():
    found = circle(rooms(all_sources()))
    assert not found, " <- ".join(found)


def test_only_the_vocabulary_stands_outside():
    assert {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"} == LOOSE


@pytest.mark.parametrize(
    "texts, ring",
    [
        ({"a.one": "from chipwise.b.two import x", "b.two": "", "b.three": "from chipwise.a import one"}, {"a", "b"}),
        (
            {
                "a.one": "import chipwise.b.two",
                "b.two": "def f():\n    from chipwise.c import d",
                "c.d": "from chipwise.a.one import y",
            },
            {"a", "b", "c"},
        ),
        (
            {
                "a.one": "from chipwise.a.two import x\nimport os",
                "a.two": "from chipwise.a.one import y",
                "b.d": "from chipwise import a",
            },
            set(),
        ),
    ],
)
def test_a_circle_is_seen(texts, ring):
    assert set(circle(rooms({"": "", "a": "", "b": "", "c": "", **texts}))) == ring
