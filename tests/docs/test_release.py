# SPDX-License-Identifier: GPL-2.0-or-later
"""VERSION and CHANGELOG.md agree: the topmost heading with a number is the version, and what is not released is above
it."""

import re

import pytest
from support import ROOT

VERSION = (ROOT / "VERSION").read_text().strip()


def faults(changelog, version):
    """What is wrong with the headings of a changelog."""
    headings = re.findall(r"^## (.*)$", changelog, re.M)
    released = [heading for heading in headings if heading != "Next"]
    found = [f"{heading} is not a version" for heading in released if not re.fullmatch(r"\d+\.\d+\.\d+", heading)]
    if "Next" in headings[1:]:
        found.append("Next is not the first")
    if released[:1] != [version]:
        found.append(f"the newest version is {released[:1]}, VERSION {version}")
    numbers = [tuple(map(int, heading.split("."))) for heading in released] if not found else []
    return found + ["not newest first"] * (numbers != sorted(set(numbers), reverse=True))


def test_version_is_the_newest_of_the_changelog():
    assert faults((ROOT / "CHANGELOG.md").read_text(), VERSION) == []


@pytest.mark.parametrize(
    "changelog, fault",
    [
        ("## Next\n\n## 1.2.3\n\n## 1.2.0\n", None),
        ("## 1.2.3\n", None),
        ("## Next\n\n## 1.2.2\n", "the newest version is"),
        ("## Next\n", "the newest version is"),
        ("## 1.2.4\n\n## 1.2.3\n", "the newest version is"),
        ("## 1.2.3\n\n## Next\n", "Next is not the first"),
        ("## Next\n\n## Next\n\n## 1.2.3\n", "Next is not the first"),
        ("## 1.2.3\n\n## 1.3\n", "1.3 is not a version"),
        ("## 1.2.3\n\n## 1.3.0\n", "not newest first"),
        ("## 1.2.3\n\n## 1.2.3\n", "not newest first"),
    ],
)
def test_faults_are_seen(changelog, fault):
    found = faults(changelog, "1.2.3")
    assert any(fault in one for one in found) if fault else found == []
