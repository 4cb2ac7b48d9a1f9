#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Words that are not to be used in this repository, and what to use instead: docs/glossary.md has the field's terms.

    tools/words.py              counts for each word and file
    tools/words.py --lines      every line
    tools/words.py --habits     counts of eight habits of English
    tools/words.py --revision R the same for a commit: figures before and after

Called by tests/docs/test_words.py.

 1. A rule is a regular expression, its replacement, and the files it is for.
 2. A rule is for the whole text of a file, comments and strings included, or for the identifiers of code only. Then it
    is matched with each part of an identifier (`lead_gate`, `LeadGate`: lead, gate).
 3. ALLOWED has the legitimate uses, each with its reason.
"""

import argparse
import io
import os
import re
import subprocess
import sys
import tokenize
from collections import Counter
from dataclasses import dataclass

from repository import repository_files

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))

CORE = r"^(components/|remap/chipwise/stock/(core|library)\.py$)"
GEOMETRY = r"remap/chipwise/(geometry|cycles)/"
CODE = r"(remap|components|bin|tests|bench|tools)/"


@dataclass(frozen=True)
class Rule:
    """word: its name in the report; pattern: regular expression; use: the replacement; where: of the path;
    names: identifiers only."""

    word: str
    pattern: str
    use: str
    where: str = ""
    names: bool = False


RULES = (
    Rule("cw_", r"\b(?:cw|CW)_", "chip_, CHIP_"),
    Rule("way", r"\b[Ww]ays?\b", "path, toolpath, segment"),
    Rule("way (name)", r"ways?", "path, toolpath, segment", CODE, names=True),
    Rule("course", r"\b[Cc]ourses?\b", "predicted path"),
    Rule("leg, stretch", r"\b(?:legs?|[Ss]tretch(?:es)?)\b", "segment"),
    Rule("piece (of a path)", r"pieces?", "segment", r"components/", names=True),
    Rule("run (of elements)", r"runs?", "chain", r"remap/chipwise/geometry/", names=True),
    Rule(
        "place (along a path)",
        r"places?",
        "station, position",
        r"^components/core/(lookahead|path|predicted_path|feed|guard)",
        names=True,
    ),
    Rule("ahead, look, view", r"look|view", "look-ahead, load profile", CORE, names=True),
    Rule("obey", r"(?i)obe(?:y\w*|dien\w+)", "override watchdog, follows or ignores the override"),
    Rule("heir, dead one", r"\b[Hh]eirs?\b|\bthe dead one\b", "takeover"),
    Rule("keeper", r"\b[Kk]eepers?\b", "stock files"),
    Rule(
        "trail, parted, foreign, fresh",
        r"trail|parted|foreign|fresh",
        "start_is_cut, flushing, external_writer, new_chain",
        CORE,
        names=True,
    ),
    Rule(
        "deepest, upward, teeth, ..",
        r"deepest|upward|teeth|turns",
        "the name of the pin and its unit",
        r"components/core/",
        names=True,
    ),
    Rule("leftovers", r"(?i)\bleftovers?\b", "rest material"),
    Rule("unreached, unreachable", r"(?i)unreach(?:ed|able)", "inaccessible"),
    Rule("mixed", r"mixed", "meeting", GEOMETRY, names=True),
    Rule("judge (product)", r"judges?", "clearance check", r"remap/chipwise/(?!(check|program)/)", names=True),
    Rule("deep, depths", r"deep|depths", "gouge_depth, depth_levels", GEOMETRY, names=True),
    Rule("gate", r"\b[Gg]ates?\b", "lead-in, lead-out"),
    Rule("gate (name)", r"gates?", "lead-in, lead-out", CODE, names=True),
    Rule("room (name)", r"room", "clearance", GEOMETRY, names=True),
    Rule("Field", r"\bFields?\b|\bfields_at\b", "machinable region"),
    Rule("spot", r"(?i)\bspots?\b|SpotPath", "point contact"),
    Rule("horn", r"(?i)\bhorns?\b", "spur"),
    Rule(
        "common_words, patent.py, regions.py",
        r"\bcommon_words\b|\bpatent\.py\b|\bregions\.py\b",
        "word_checks, reference_offset, polygons",
    ),
    Rule("kink", r"(?i)\bkink\w*", "corner"),
)

# (word of the rule, path, text around it, reason)
ALLOWED = (
    (
        "way",
        "",
        r"\b(?:one|two|three|four|all|both|either|same|other|others?|this|that|any|every|each|another|which|no|"
        r"some|wrong|right|opposite|different|such a|in a|under|reverse|such)[ -]ways?\b|\bin \w+ ways\b|"
        r"\bways? to (?:cut|choose|say|tell|read|write|do|get|know|see|the volume)\b|\bpatent's way\b",
        "a manner or a direction, not a path",
    ),
    (
        "way",
        "",
        r"\b(?:nobody's|in the|by|half|half the|all the|third of the|share of the|(?<!')on its|cleared the|"
        r"machine's|short|whole) way\b|\b[Tt]wo ways\b|\bway of writing\b|\bon the way\b(?! of)|"
        r"\bthe way (?:there|back|down|up)\b|\bwhich way\b",
        "idioms: position, progress, manner",
    ),
    ("way", r"", r"One[ -]way", "the strategy P1"),
    ("way (name)", r"", r"way", "one_way: the strategy P1"),
    ("course", "", r"[Oo]f course", "English"),
    ("Field", "", r"dataclass|import .*\bfield\b|_fields_|\bField\(|Fields of /proc", "dataclasses, ctypes, /proc"),
    ("kink", "", r"kink_accel_reduce\w*", "a member of LinuxCNC's segments"),
    ("spot", "", r"(?i)spot drill|spot G81", "spot drilling"),
    ("gate", "", r"(?i)investigate", "English"),
)
# docs/design/pins.md is written from the components, pictures by their scripts
# Identifiers with such a part that are right: a way that is a manner or a direction, LinuxCNC's names, the
# replacements.
GOOD_NAMES = re.compile(
    r"(?:one|other|same|both|two|wrong|nobodys)_?ways?|way_back|kink_accel_reduce|gouge_depths|depth_levels|"
    r"look_?ahead|turns_corner",
    re.IGNORECASE,
)

NEVER = (
    r"^(CHANGELOG\.md|LICENSE|tools/words\.py|tests/docs/test_words\.py|docs/glossary\.md|docs/design/pins\.md|"
    r".*\.svg)$"
)
TEXT = r"\.(py|c|h|comp|hal|ini|inc|in|ngc|md|toml|xml|ui|js|css|svg)$|^(bin|tools)/|Makefile$|README$"


# Habits of English that make a sentence hard to read: counted by --habits, in docs, comments and strings alike.
HABITS = (
    # "there is no tool" and "0 if there is none" are plain English
    (
        "X is no Y, X is none",
        r"(?<!there )(?<!There )\b(?:is|are|was|were|be) (?:no|none)\b"
        r"(?! (?:longer|more|less|further|nearer|faster|deeper|higher))",
    ),
    # a place may be a "where", a condition is an "if"
    (
        "Where .. for a condition",
        r"(?:^|[.;:] |# |\* )Where (?!to\b|this departs|the contour|the tool)[^.]{3,80}?, |"
        r", where (?:there is|no|that|nothing)\b",
    ),
    (
        "standing, telling, taking",
        r"\b(?:is|are|was|were|be) told\b|\btells? (?:of|the(?! operator| user))\b|"
        r"\btak(?:es?|en) (?:it |them )?for\b|"
        r"\b(?:stands?|stood) (?:there|still|where|in|on|for|so)\b|\bheld against\b",
    ),
    ("the machine as a person", r"\bwas elsewhere\b|\b(?:dis)?obey\w*|\b[Hh]e\b(?!\()|\bhis\b|\bbeliev\w+"),
    ("belongs into", r"\bbelong(?:s|ed)? into\b"),
    # "as of the last look" is a time
    ("as of X", r"\bas of (?!(?:the|its) last\b|now\b|chip_)"),
    ("Who .., for one who", r"(?:^|[.;] |\"\"\"|# |\* )Who (?!calls\b|may\b)[^.?]{3,80}?, "),
    ("dropped verbs", r": not\.|\bnone of ours\b"),
)


def habits(revision=None):
    """[(habit, path, line number, line)]."""
    return [
        (name, path, number, line.strip())
        for path, text in files(revision).items()
        if not re.search(NEVER, path)
        for number, line in enumerate(text.split("\n"), 1)
        for name, pattern in HABITS
        for _ in re.findall(pattern, line)
    ]


def names_in(path, text):
    """[(line number, identifier)] of Python or C."""
    if path.endswith(".py") or path.startswith("bin/"):
        try:
            return [
                (token.start[0], token.string)
                for token in tokenize.generate_tokens(io.StringIO(text).readline)
                if token.type == tokenize.NAME
            ]
        except (tokenize.TokenError, IndentationError):
            return []
    if not path.endswith((".c", ".h", ".comp")):
        return []
    blank = re.sub(
        r'/\*.*?\*/|//[^\n]*|"(?:[^"\\\n]|\\.)*"', lambda match: re.sub(r"[^\n]", " ", match[0]), text, flags=re.DOTALL
    )
    return [
        (number, name) for number, line in enumerate(blank.split("\n"), 1) for name in re.findall(r"[A-Za-z_]\w*", line)
    ]


def parts_of(name):
    """lead_gate, LeadGate, LEAD_GATE -> lead, gate."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


def allowed(rule, path, text, at):
    """Whether the use at this place of a line is one of ALLOWED."""
    for word, where, around, _reason in ALLOWED:
        if word == rule.word and re.search(where, path):
            if any(match.start() <= at < match.end() for match in re.finditer(around, text)):
                return True
    return False


def uses(path, text):
    """[(rule, line number, line)] of a file."""
    if re.search(NEVER, path) or not re.search(TEXT, path):
        return []
    lines = text.split("\n")
    found, names = [], None
    for rule in RULES:
        if not re.search(rule.where, path):
            continue
        if rule.names:
            names = names if names is not None else names_in(path, text)
            for number, name in names:
                if any(re.fullmatch(rule.pattern, part) for part in parts_of(name)):
                    if not GOOD_NAMES.search(name):
                        found.append((rule, number, name))
            continue
        for number, line in enumerate(lines, 1):
            for match in re.finditer(rule.pattern, line):
                if not allowed(rule, path, line, match.start()):
                    found.append((rule, number, line.strip()))
    return found


def files(revision=None):
    """{path: text} of the repository, or of a commit of it."""

    def git(*words):
        done = subprocess.run(["git", *words], cwd=ROOT, stdout=subprocess.PIPE, check=True)
        return done.stdout.decode("utf-8", "replace")

    if revision:
        return {
            path: git("show", f"{revision}:{path}")
            for path in git("ls-tree", "-r", "--name-only", revision).split("\n")
            if re.search(TEXT, path)
        }
    found = {}
    for path in sorted(repository_files()):
        full = os.path.join(ROOT, path)
        if os.path.isfile(full) and not os.path.islink(full) and re.search(TEXT, path):
            with open(full, encoding="utf-8", errors="replace") as handle:
                found[path] = handle.read()
    return found


def count(revision=None):
    """{word: Counter of paths} of all rules, and the list of uses."""
    counts, every = {rule.word: Counter() for rule in RULES}, []
    for path, text in files(revision).items():
        for rule, number, line in uses(path, text):
            counts[rule.word][path] += 1
            every.append((rule, path, number, line))
    return counts, every


def main():
    parser = argparse.ArgumentParser(description="Words that are not to be used.")
    parser.add_argument("--lines", action="store_true", help="every line")
    parser.add_argument("--revision", help="of a commit")
    parser.add_argument("--word", help="of one rule")
    parser.add_argument("--habits", action="store_true", help="habits of English instead of words")
    options = parser.parse_args()
    if options.habits:
        found = habits(options.revision)
        for name, _pattern in HABITS:
            mine = [use for use in found if use[0] == name]
            print(f"{name:40} {len(mine):5}")
            for _name, path, number, line in mine if options.lines else ():
                print(f"    {path}:{number}: {line[:200]}")
        return 0
    counts, every = count(options.revision)
    for rule in RULES:
        if options.word not in (None, rule.word):
            continue
        total = sum(counts[rule.word].values())
        print(f"{rule.word:40} {total:5}   use {rule.use}")
        if options.lines:
            for _rule, path, number, line in (use for use in every if use[0] == rule):
                print(f"    {path}:{number}: {line[:110]}")
        else:
            for path, number in counts[rule.word].most_common(6):
                print(f"        {number:4} {path}")
    print("all", sum(sum(found.values()) for found in counts.values()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
