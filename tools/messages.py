#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The messages an operator can get (message_source.py), and the catalogue docs/user/messages.md that explains them.

    tools/messages.py             print every message with the files it comes from
    tools/messages.py --check     exit status 1 if the catalogue misses a message, explains one that does not exist, or
                                  has a row twice in a section
    tools/messages.py --update    bring the catalogue's rows up to date: a reworded message keeps its explanation,
                                  a new one gets an empty one

Called by tests/docs/test_docs.py.
"""

import argparse
import difflib
import glob
import os
import re
import sys
from collections import Counter

from message_source import messages

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
CATALOGUE = os.path.join("docs", "user", "messages.md")

SECTIONS = (  # (beginning of the path, heading in the catalogue)
    ("components/", "Realtime components"),
    ("remap/chipwise/rewrite/", "chipwise rewrite"),
    ("remap/chipwise/cli/rewrite", "chipwise rewrite"),
    ("remap/chipwise/check/", "chipwise check"),
    ("remap/chipwise/host/temp_folder", "chipwise check"),
    ("remap/chipwise/batch/", "chipwise check"),
    ("remap/chipwise/clamps/", "chipwise check"),
    ("remap/chipwise/setup/", "chipwise setup"),
    ("remap/chipwise/cli/setup", "chipwise setup"),
    ("remap/chipwise/resume/", "chipwise resume"),
    ("remap/chipwise/cli/resume", "chipwise resume"),
    ("remap/chipwise/importing/", "chipwise import"),
    ("remap/chipwise/cli/import", "chipwise import"),
    ("remap/chipwise/cli/check", "chipwise check"),
    ("remap/chipwise/options/", "chipwise check"),
    ("remap/chipwise/cli/filter", "Filter"),
    ("remap/chipwise/filter/", "Filter"),
    ("remap/chipwise/turning/", "chipwise turn"),
    ("remap/chipwise/cli/turn", "chipwise turn"),
    ("remap/chipwise/cli/contour", "chipwise contour"),
    ("remap/chipwise/drawing/", "chipwise contour"),
    ("remap/chipwise/entry/", "Entry and colours"),
    ("remap/chipwise/cli/enter", "Entry and colours"),
    ("remap/chipwise/panel/colours", "Entry and colours"),
    ("remap/chipwise/drawing/entered", "Entry and colours"),
    ("remap/chipwise/cli/load", "Start of LinuxCNC"),
    ("remap/chipwise/host/fit", "Start of LinuxCNC"),
    ("remap/chipwise/cli/python_section", "Start of LinuxCNC"),
    ("remap/chipwise/cli/monitor", "While the machine runs"),
    ("remap/chipwise/monitor/", "While the machine runs"),
    ("remap/chipwise/cli/", "Other commands"),
    ("remap/chipwise/machine/", "Other commands"),
    ("remap/chipwise/headless/", "Other commands"),
    ("remap/chipwise/digitise/", "Other commands"),
    ("remap/chipwise/link/", "Other commands"),
    ("bin/", "Other commands"),
    ("remap/chipwise/stock/", "Stock and stock files"),
    ("remap/chipwise/blank/", "Stock and stock files"),
    ("remap/chipwise/contour_sub", "Contour subs"),
    ("remap/chipwise/program/find_sub", "Contour subs"),
    ("remap/chipwise/program/sub_process", "Contour subs"),
    ("remap/chipwise/program/", "chipwise check"),
    ("remap/chipwise/geometry/", "Contour subs"),
    ("remap/chipwise/settings", "Settings and tool geometry"),
    ("remap/chipwise/ini", "Settings and tool geometry"),
    ("remap/chipwise/tool", "Settings and tool geometry"),
    ("remap/chipwise/host/", "Settings and tool geometry"),
    ("remap/chipwise/glue/stock_codes", "M250 to M254"),
    ("remap/chipwise/glue/volumetric", "M250 to M254"),
    ("remap/chipwise/glue/workpiece", "M250 to M254"),
    ("remap/", "Cycles"),
)


def section_of(path):
    return next(heading for beginning, heading in SECTIONS if path.startswith(beginning))


def strangers():
    """[beginning of a path in SECTIONS that no file has any more]."""
    return [beginning for beginning, _heading in SECTIONS if not glob.glob(os.path.join(ROOT, beginning + "*"))]


# ---- the catalogue -----------------------------------------------------------------------------------------------

HEAD = "| message | cause | remedy |\n|---|---|---|\n"
_ROW = re.compile(r"^\| `(.+?)` \| (.*?) ?\| (.*?) ?\|$")


def _cell(text):
    return text.replace("|", "\\|").replace("`", "'")


def catalogue_rows(text):
    """[(section, fact, cause, remedy)] of the catalogue's text."""
    rows, section = [], ""
    for line in text.split("\n"):
        if line.startswith("## "):
            section = line[3:].strip()
        match = _ROW.match(line)
        if match:
            rows.append((section, *match.groups()))
    return rows


def wanted_rows():
    """{section: [(fact, printed remedy)]} in the order of the source, as the catalogue writes them."""
    found = {}
    for (fact, remedy), paths in messages().items():
        remedy = "" if remedy == ".." else remedy
        rows = found.setdefault(section_of(paths[0]), [])
        if (_cell(fact), _cell(remedy)) not in rows:
            rows.append((_cell(fact), _cell(remedy)))
    return found


def check():
    """-> list of complaints; empty if catalogue and source agree."""
    with open(os.path.join(ROOT, CATALOGUE), encoding="utf-8") as handle:
        rows = catalogue_rows(handle.read())
    wanted = {pair for pairs in wanted_rows().values() for pair in pairs}
    explained = {}
    complaints = []
    for _section, fact, cause, remedy in rows:
        explained.setdefault(fact, []).append(remedy)
        if not cause or not remedy:
            complaints.append(f"no cause or no remedy: {fact}")
    for fact, remedy in sorted(wanted):
        if fact not in explained:
            complaints.append(f"not in {CATALOGUE}: {fact}")
        elif remedy and not any(shown.startswith(remedy) for shown in explained[fact]):
            complaints.append(f"another remedy in {CATALOGUE}: {fact}; {remedy}")
    facts = {fact for fact, _remedy in wanted}
    complaints += [f"explained but not in the source: {fact}" for fact in sorted(set(explained) - facts)]
    complaints += [f"twice in {row[0]}: {row[1]}" for row, count in Counter(rows).items() if count > 1]
    return complaints


def update():
    """Rewrite the tables of the catalogue: rows of the source, explanations of the old rows most like them."""
    path = os.path.join(ROOT, CATALOGUE)
    with open(path, encoding="utf-8") as handle:
        text = handle.read()
    old = catalogue_rows(text)
    by_fact = {}
    for _section, fact, cause, remedy in old:
        by_fact.setdefault(fact, []).append((cause, remedy))
    wanted = wanted_rows()
    facts = {fact for pairs in wanted.values() for fact, _ in pairs}
    orphans = {fact: rows for fact, rows in by_fact.items() if fact not in facts}

    def explain(fact, remedy):
        """-> (cause, remedy)."""
        rows = by_fact.get(fact)
        if rows is None:
            close = difflib.get_close_matches(fact, orphans, 1, 0.55)
            if not close:
                return "", remedy
            print(f"reworded: {close[0]}\n      to: {fact}")
            rows = orphans[close[0]]
            remedies = [row[1] for row in rows]
            return rows[0][0], remedy or remedies[0]
        for row in rows:
            if remedy and row[1].startswith(remedy):
                return row
        return rows[0][0], remedy or rows[0][1]

    def table(heading):
        """The rows of a section; what the source says in several places with the same explanation is one."""
        rows = dict.fromkeys((fact, *explain(fact, remedy)) for fact, remedy in wanted[heading])
        return HEAD + "".join("| `%s` | %s | %s |\n" % row for row in rows) + "\n"

    parts = re.split(r"(?m)^(?=## )", text)
    made, headings = [parts[0].rstrip() + "\n\n"], []
    for part in parts[1:]:
        heading = part.split("\n", 1)[0][3:].strip()
        if heading in wanted:
            before = part.split(HEAD.split("\n", 1)[0])[0].rstrip()
            part = before + "\n\n" + table(heading)
            headings.append(heading)
        made.append(part)
    for heading in wanted:
        if heading not in headings:
            made.append(f"## {heading}\n\n" + table(heading))
    with open(path, "w", encoding="utf-8") as handle:
        handle.write("".join(made).rstrip() + "\n")


def main():
    parser = argparse.ArgumentParser(description="The messages of the source and their catalogue.")
    parser.add_argument("--check", action="store_true", help="compare the catalogue with the source")
    parser.add_argument("--update", action="store_true", help="bring the catalogue's rows up to date")
    options = parser.parse_args()
    if options.update:
        update()
    if options.update or options.check:
        complaints = check()
        print("\n".join(complaints) or "every message is explained")
        return 1 if complaints else 0
    for (fact, remedy), paths in messages().items():
        print(f"{', '.join(paths)}\n    {fact}" + (f"\n    -> {remedy}" if remedy else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
