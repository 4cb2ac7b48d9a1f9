# SPDX-License-Identifier: GPL-2.0-or-later
"""Sizes of files and functions: none is longer than the rule."""

import ast
import re

import pytest
from support import ROOT
from support.scripts import load_script

FILE_LINES, FUNCTION_LINES = 350, 50
PYTHON_LINES = 450  # as ruff formats them: what were 350 before
ENDINGS = (".py", ".c", ".h", ".comp", ".js", ".sh")
GENERATED = {"remap/chipwise/clib/layout.py"}  # by tools/make_layout.py
C_HEAD = re.compile(r"(\w+)\([^;]*\)\s*\{\s*$")


def sources():
    """{path: text} of programs and scripts."""
    found = {}
    for name in sorted(load_script("repository.py").repository_files()):
        path = ROOT / name
        if path.is_file() and not path.is_symlink() and (name.endswith(ENDINGS) or not path.suffix):
            text = path.read_bytes().decode(errors="replace")
            if path.suffix or text.startswith("#!"):
                found[name] = text
    return found


def python_functions(text):
    """[(name, lines)], functions in functions and methods included."""
    return [
        (node.name, node.end_lineno - node.lineno + 1)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
    ]


def c_functions(text):
    """[(name, lines)] of those that are more than a line, from the first brace to the last, which is in the first
    column."""
    found, head, start = [], "", None
    for number, line in enumerate(text.splitlines(), 1):
        if start is None:
            head = line if re.match(r"\w", line) else head + " " + line
            begins = C_HEAD.search(head)
            if begins:
                start, name = number, begins[1]
        elif line.startswith("}"):
            found.append((name, number - start + 1))
            head, start = "", None
    return found


def functions(name, text):
    if name.endswith((".c", ".h", ".comp")):
        return c_functions(text)
    return python_functions(text) if name.endswith(".py") or re.match(r"#!.*python", text) else []


def longer(sizes, limit):
    """What is longer than the limit."""
    return [f"{what}: {lines} lines, {limit} allowed" for what, lines in sizes.items() if lines > limit]


@pytest.fixture(scope="module")
def hand_written():
    every = sources()
    assert GENERATED < set(every) and len(every) > 500
    return {name: text for name, text in every.items() if name not in GENERATED}


def test_files(hand_written):
    for is_python, limit in ((True, PYTHON_LINES), (False, FILE_LINES)):
        sizes = {
            name: len(text.splitlines()) for name, text in hand_written.items() if name.endswith(".py") == is_python
        }
        assert len(sizes) > 100
        assert not longer(sizes, limit)


def test_functions(hand_written):
    sizes = {}
    for path, text in hand_written.items():
        for name, lines in functions(path, text):
            sizes[path, name] = max(lines, sizes.get((path, name), 0))
    assert len(sizes) > 3000
    assert not longer(sizes, FUNCTION_LINES)


def test_generated_files_say_so():
    for name in GENERATED:
        assert "Made by tools/make_layout.py" in (ROOT / name).read_text()[:600]


def test_what_is_longer_is_seen():
    assert longer({"a": 11, "b": 10, "c": 9}, 10) == ["a: 11 lines, 10 allowed"]


def test_functions_are_measured():
    assert python_functions(
        "class A:\n    def b(self):\n        async def c():\n            pass\n        return c\n"
    ) == [("b", 4), ("c", 2)]
    assert c_functions(
        "int a(int b,\n      int c)\n{\n    if (b) {\n        c++;\n    }\n    return c;\n}\n"
        "static void d(void) { e(); }\nstruct f {\n    int g;\n};\nFUNCTION(_) {\n    h();\n}\n"
        "static const int k[] = {\n    1,\n};\nint m(void);\n"
    ) == [("a", 6), ("FUNCTION", 3)]
