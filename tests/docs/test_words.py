# SPDX-License-Identifier: GPL-2.0-or-later
"""Words that are not to be used stay out: tools/words.py has the rules, their replacements and the legitimate uses."""

import os
import re
import sys

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools"))

import words  # noqa: E402

pytestmark = pytest.mark.xdist_group("words")  # one process reads the whole tree, once


@pytest.fixture(scope="module")
def every():
    return words.count()[1]


@pytest.fixture(scope="module")
def habits():
    return words.habits()


@pytest.mark.parametrize("rule", words.RULES, ids=lambda rule: rule.word)
def test_word_stays_out(every, rule):
    found = [f"{path}:{number}: {line[:100]}" for used, path, number, line in every if used == rule]
    assert not found, f"{rule.word}: use {rule.use}\n" + "\n".join(found[:40])


@pytest.mark.parametrize("habit", [name for name, _pattern in words.HABITS])
def test_habit_stays_out(habits, habit):
    found = [f"{path}:{number}: {line[:100]}" for name, path, number, line in habits if name == habit]
    assert not found, "\n".join(found[:40])


@pytest.mark.parametrize(
    "text",
    [
        "A slot is no pocket.",
        "Where the load jumps, the feed drops.",
        "The tracker is told the tool.",
        "The load is taken for high.",
        "The thread believes the pin.",
        "`H0` on the line: not.",
        "The length belongs into the table.",
        "path: as of the table.",
        "Who asks first, gets it.",
    ],
)
def test_the_habits_are_seen(text):
    assert any(re.search(pattern, text) for _name, pattern in words.HABITS)


@pytest.mark.parametrize(
    "path, text, word",
    [
        ("components/core/feed.c", "int cw_feed;\n", "cw_"),
        ("docs/user/holes.md", "The way ahead is long.\n", "way"),
        ("docs/user/holes.md", "in one way or the other way\n", None),
        ("remap/chipwise/gcode_lines.py", "one_way = 1\n", None),
        ("remap/chipwise/gcode_lines.py", "def way_from(a):\n    return a\n", "way (name)"),
        ("remap/chipwise/cycles/hole.py", "class _LeadGate:\n    pass\n", "gate (name)"),
        ("components/core/path.c", "/* a piece of cake */ int piece_count;\n", "piece (of a path)"),
        ("components/core/path.c", "/* a piece of cake */\n", None),
        ("docs/user/holes.md", "Of course, of course.\n", None),
    ],
)
def test_the_rules_see_it(path, text, word):
    found = {rule.word for rule, _number, _line in words.uses(path, text)}
    assert found == ({word} if word else set())
