# SPDX-License-Identifier: GPL-2.0-or-later
"""What `make coverage` makes of gcov's counts, and the lines that docs/proof/coverage.md names."""

import importlib.machinery
import importlib.util
import json

import pytest

from support import ROOT

_loader = importlib.machinery.SourceFileLoader("coverage_tool", str(ROOT / "tools/coverage"))
tool = importlib.util.module_from_spec(importlib.util.spec_from_loader("coverage_tool", _loader))
_loader.exec_module(tool)

HEADER, SOURCE = "components/core/a.h", "components/core/a.c"
TEXTS = {
    SOURCE: ["int a(int b)", "{", "    if (b)", "        return 0;", "    return some_other_function(b);", "}"],
    HEADER: ["inline int c(int d)"],
}


def file(name, *lines):
    return {
        "file": name,
        "lines": [
            {"line_number": number, "count": times, "branches": [{"count": count} for count in branches]}
            for number, times, branches in lines
        ],
    }


def counts(*files):
    return "\n".join(json.dumps({"files": list(part)}) for part in files)


def test_a_header_is_run_if_one_file_runs_it():
    found = tool.counted(
        counts(
            [file(SOURCE, (3, 2, [2, 0])), file(HEADER, (1, 0, [0, 0]))],
            [file(HEADER, (1, 4, [0, 4])), file("/usr/include/x.h", (1, 0, []))],
        )
    )
    assert found == {SOURCE: {3: [2, [2, 0]]}, HEADER: {1: [4, [0, 4]]}}


@pytest.mark.parametrize(
    "reasons, sentences",
    [
        ({}, ["components/core/a.c:4: no test runs it: if (b) return 0;"]),
        ({("core/a.c", "if (b) return 0;"): "never"}, []),
        (
            {("core/a.c", "if (b) return 0;"): "never", ("core/a.c", "return some_other_function(b);"): "never"},
            ["docs/proof/coverage.md names a line that is run, or gone: core/a.c: return some_other_function(b);"],
        ),
    ],
)
def test_a_line_is_run_or_named(reasons, sentences):
    sources = tool.counted(counts([file(SOURCE, (3, 2, [2, 0]), (4, 0, []), (5, 2, []))]))
    rows, wrong = tool.judged(sources, TEXTS, reasons)
    assert rows == [(SOURCE, 2, 3, 1, 2)] and wrong == sentences


def test_named_lines_are_in_the_source():
    reasons = tool.named(tool.PAGE.read_text())
    assert len(reasons) == tool.PAGE.read_text().count("| `` ") > 0
    for name, text in reasons:
        lines = (ROOT / "components" / name).read_text().splitlines()
        assert text in {tool.text_of(lines, number) for number in range(1, len(lines) + 1)}, (name, text)
