# SPDX-License-Identifier: GPL-2.0-or-later
"""The C files of core/ and offline/: none calls one that calls it, by however many others, and no header includes one
that includes it."""

import re
import subprocess

import pytest

from support import ROOT
from support.circles import circle

COMPONENTS = ROOT / "components"
FOLDERS = "core", "offline"
INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)


def symbols():
    """{C file: names it defines}, {C file: names it needs from others}, of the compiled files."""
    sources = [path.relative_to(COMPONENTS) for folder in FOLDERS for path in sorted((COMPONENTS / folder).glob("*.c"))]
    objects = {str(ROOT / "build" / name.with_suffix(".o")): str(name) for name in sources}
    text = subprocess.run(
        ["nm", "--print-file-name", "--extern-only", *objects], check=True, capture_output=True, text=True
    ).stdout
    defined, needed = {name: set() for name in objects.values()}, {name: set() for name in objects.values()}
    for line in text.splitlines():
        path, _colon, rest = line.partition(":")
        *_address, kind, name = rest.split()
        (needed if kind == "U" else defined)[objects[path]].add(name)
    return defined, needed


def calls(defined, needed):
    """{C file: C files whose functions it calls}."""
    home = {name: path for path, names in defined.items() for name in names}
    return {path: {home[name] for name in names if name in home} - {path} for path, names in needed.items()}


def includes(texts):
    """{header: headers it includes} of {path below components: text}; a name is looked up beside the header first."""
    return {
        path: {
            found
            for name in INCLUDE.findall(text)
            for found in [f"{path.rpartition('/')[0]}/{name}" if f"{path.rpartition('/')[0]}/{name}" in texts else name]
            if found in texts
        }
        for path, text in texts.items()
    }


def test_no_c_files_call_each_other():
    graph = calls(*symbols())
    assert "core/cell.c" in graph["core/stock.c"] and "core/sweep.c" in graph["core/tracker_cut.c"]
    found = circle(graph)
    assert not found, " <- ".join(found)


def test_no_headers_include_each_other():
    graph = includes({str(path.relative_to(COMPONENTS)): path.read_text() for path in COMPONENTS.rglob("*.h")})
    assert "core/cell.h" in graph["core/stock.h"] and "core/tool.h" in graph["offline/swept.h"]
    found = circle(graph)
    assert not found, " <- ".join(found)


@pytest.mark.parametrize(
    "defined, needed, ring",
    [
        ({"a.c": {"f"}, "b.c": {"g"}}, {"a.c": {"g", "sqrt"}, "b.c": {"f"}}, {"a.c", "b.c"}),
        ({"a.c": {"f"}, "b.c": {"g"}, "c.c": {"h"}}, {"a.c": {"g"}, "b.c": {"h"}, "c.c": {"f"}}, {"a.c", "b.c", "c.c"}),
        ({"a.c": {"f"}, "b.c": {"g"}}, {"a.c": {"g"}, "b.c": {"sqrt"}}, set()),
    ],
)
def test_a_circle_of_calls_is_seen(defined, needed, ring):
    assert set(circle(calls(defined, needed))) == ring


def test_a_circle_of_headers_is_seen():
    texts = {
        "core/a.h": '#include "b.h"\n',
        "core/b.h": '#include <math.h>\n#include "core/a.h"\n',
        "offline/c.h": '#include "core/a.h"\n',
    }
    assert set(circle(includes(texts))) == {"core/a.h", "core/b.h"}
