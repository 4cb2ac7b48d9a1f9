# SPDX-License-Identifier: GPL-2.0-or-later
"""What CI and the releases run is what the Makefile has."""

import re

import pytest

from support import ROOT

WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
TARGETS = set(re.findall(r"^([a-z][\w -]*?):(?!=)", (ROOT / "Makefile").read_text(), re.M))
NAMES = {name for line in TARGETS for name in line.split()}
ACTIONS = {"actions/checkout@v4", "actions/upload-artifact@v4", "actions/download-artifact@v4"}


def made(text):
    """Names of the make targets that a workflow calls, those of its matrix included."""
    own = re.findall(r"^ *- run: make (.+)$", text, re.M)
    rows = [item.strip(' "') for row in re.findall(r"^ *target: \[(.+)\]", text, re.M) for item in row.split(",")]
    words = [word for call in own + rows for word in re.sub(r"\$\{\{.*?\}\}", "", call).split()]
    return {word for word in words if "=" not in word}


def unknown(text):
    return made(text) - NAMES


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_calls_make_targets_that_there_are(path):
    text = path.read_text()
    assert made(text) and not unknown(text)
    assert set(re.findall(r"uses: (\S+)", text)) <= ACTIONS
    assert re.search(r"^permissions:\n  contents: read$", text, re.M)


def test_the_check_sees_a_target_that_is_gone():
    assert unknown("      - run: make moon\n        target: [test, tides]\n") == {"moon", "tides"}


def test_the_release_takes_its_notes_from_the_changelog():
    """The same command as the workflow's, for the newest release."""
    call = re.search(r'sed -n "(.+)" CHANGELOG', (ROOT / ".github/workflows/release.yml").read_text())[1]
    text = (ROOT / "CHANGELOG.md").read_text()
    newest = re.search(r"^## (\d\S*)$", text, re.M)[1]
    first, last = re.fullmatch(
        r"/(.+)/,/(.+)/\{/\^## /d;p\}", call.replace("${GITHUB_REF_NAME#v}", re.escape(newest))
    ).groups()
    assert re.search(first, f"## {newest}") and re.match(last, "## 0.3.0") and re.search(first, text, re.M)
