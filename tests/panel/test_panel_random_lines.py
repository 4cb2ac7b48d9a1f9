# SPDX-License-Identifier: GPL-2.0-or-later
"""Random comma lines through the request that the panel page sends: the G-code line of the form, or an error at the
field that the oracle names."""

import json
import random
import urllib.parse

import pytest

from chipwise import entry
from chipwise.panel import entry as lines
from chipwise.panel import server
from support import ROOT, entry_oracle
from support.panel_client import request
from support.panel_rig import serving
from support.random_cases import random_count, random_seed, write_replay

MILL = str(ROOT / "configs/mill.ini")
CODES = list(entry_oracle.SPEC)
LINES, OVER_HTTP = 4000, 60


class Page(server.Handler):
    """The Handler of the server without a connection: what get() answers to a path."""

    def __init__(self, ini):
        self.server = type("Server", (), {"lines": lines.Lines(ini), "in_time": lambda self, connection: None})()
        self.headers, self.connection, self.path, self.found = {}, None, "", None

    def send(self, status, content, kind):
        self.found = status, kind, content

    def ask(self, path):
        self.path = path
        self.get()
        return self.found


def query(code, text):
    """As URLSearchParams of entry.js writes it."""
    return "/line.json?" + urllib.parse.urlencode({"code": code, "text": text})


def result(status, content):
    """An answer as entry_oracle.expected() has it."""
    assert status == 200, (status, content)
    found = json.loads(content)
    if set(found) == {"line"}:
        return entry_oracle.meaning(found["line"])
    assert (
        set(found) == {"error", "number"} and f"field {found['number']}" in found["error"] and ";" in found["error"]
    ), found
    return found["number"]


def in_a_form(code, text):
    """The line of the same data in a form, a field each; None if a field refuses its text."""
    try:
        return entry.form(code, entry.split(text), "")
    except entry.EntryError:
        return None


def fault_of(code, text, status, content):
    """What is wrong with the answer to a line, "" if nothing is."""
    found, wanted = result(status, content), entry_oracle.expected(code, text)
    if found != wanted:
        return f"{code} {text!r}: {found}, expected {wanted}"
    line = json.loads(content).get("line")
    return (
        ""
        if line is None or line == in_a_form(code, text)
        else f"{code} {text!r}: {line}, in a form {in_a_form(code, text)}"
    )


def run(count, seed, ask):
    """(fault, how many lines were accepted, refused) of so many lines; ask: path -> (status, .., content)."""
    rng, accepted = random.Random(seed), 0
    for number in range(count):
        code = CODES[number % len(CODES)]
        text = entry_oracle.typed(code, rng)
        status, _kind, content = ask(query(code, text))
        fault = fault_of(code, text, status, content)
        if fault:
            path = write_replay("panel_line", {"seed": seed, "number": number, "code": code, "text": text})
            return f"seed {seed}, line {number}, {path}: {fault}", accepted, number - accepted
        accepted += b'"line"' in content
    return "", accepted, count - accepted


def test_random_lines_of_the_page():
    count = random_count(LINES)
    fault, accepted, refused = run(count, random_seed(), Page(MILL).ask)
    assert not fault, fault
    assert accepted > 0.3 * count and refused > 0.15 * count
    print(f"{count} lines: {accepted} accepted, {refused} refused")


def test_random_lines_over_http():
    with serving(lines=lines.Lines(MILL)) as rig:
        fault, accepted, refused = run(OVER_HTTP, random_seed() + 1, lambda path: request(rig.url, path))
    assert not fault, fault
    assert accepted > 10 and refused > 5


@pytest.mark.parametrize(
    "name, replacement",
    [
        (
            "words",
            lambda self, *names: [part.partition("=")[2].replace("%2C", ",") for part in self.query.split("&")],
        ),  # not decoded
        (
            "words",
            lambda self, *names: [urllib.parse.parse_qs(self.query).get(name, [""])[0].strip(",") for name in names],
        ),
    ],
)
def test_the_checker_sees_a_fault_of_the_request(monkeypatch, name, replacement):
    monkeypatch.setattr(server.Handler, name, replacement)
    assert run(3000, 5, Page(MILL).ask)[0]


def test_the_checker_sees_a_wrong_field(monkeypatch):
    line = lines.Lines.line

    def other(self, *values):
        found = line(self, *values)
        return (
            {
                **found,
                "number": found["number"] + 1,
                "error": found["error"].replace(f"field {found['number']}", f"field {found['number'] + 1}"),
            }
            if "error" in found
            else found
        )

    monkeypatch.setattr(lines.Lines, "line", other)
    assert run(300, 5, Page(MILL).ask)[0]
