# SPDX-License-Identifier: GPL-2.0-or-later
"""Entry by fields: random lines against an oracle and against the form, doubtful commas, a machine's own order."""

import os
import random
import re

import pytest
from support import ROOT, entry_oracle
from support.random_cases import random_count, random_seed, write_replay

from chipwise import entry
from chipwise.host import language
from chipwise.entry import typed
from chipwise.errors import CycleError

CODES = list(entry_oracle.SPEC)
LINES = 20_000


def result(code, text):
    """What entry.line makes of a text, as entry_oracle.expected puts it."""
    try:
        return entry_oracle.meaning(entry.line(code, text, ""))
    except entry.EntryError as error:
        assert error.text().startswith(f"chipwise: {code}: field {error.number}") and error.fact and error.remedy
        return error.number


def in_the_form(code, text):
    """The same texts in a form, a field each."""
    try:
        return entry.form(code, entry.split(text), "")
    except entry.EntryError as error:
        return error.number


def fault_of(code, text):
    """What is wrong with the answer to a line, "" if nothing is."""
    found, wanted = result(code, text), entry_oracle.expected(code, text)
    if found != wanted:
        return f"{code} {text!r}: {found}, expected {wanted}"
    form = in_the_form(code, text)
    places = entry.split(text)
    spaced = any(blank + "," in text or "," + blank in text for blank in " \t")
    if any(entry_oracle.doubtful(places, k, spaced) for k in range(len(places))):
        return ""  # in a form nobody types commas between the data
    line = entry.line(code, text, "") if not isinstance(found, int) else found
    return "" if form == line else f"{code} {text!r}: {line}, in the form {form}"


def run(count, seed):
    """(fault, how many lines were accepted, refused) of so many lines."""
    rng, accepted, refused = random.Random(seed), 0, 0
    for number in range(count):
        code = CODES[number % len(CODES)]
        text = entry_oracle.typed(code, rng)
        fault = fault_of(code, text)
        if fault:
            path = write_replay("entry", {"seed": seed, "number": number, "code": code, "text": text})
            return f"seed {seed}, line {number}, {path}: {fault}", accepted, refused
        if isinstance(entry_oracle.expected(code, text), int):
            refused += 1
        else:
            accepted += 1
    return "", accepted, refused


def test_random_lines():
    """Each gives the G-code line of the form, or an error at the right field."""
    count = random_count(LINES)
    fault, accepted, refused = run(count, random_seed())
    assert not fault, fault
    assert accepted > 0.3 * count and refused > 0.15 * count


@pytest.mark.parametrize(
    "name, replacement",
    [
        ("_check", lambda field, value, shown: None),
        ("_check_comma", lambda *arguments: None),
        ("_has_blanks", lambda texts: False),
        ("_SPARE_ZERO", re.compile("x")),
        ("_MINUS_ZERO", re.compile("x")),
        ("DIGITS", 99),
        ("fields", lambda code, path=None: tuple(reversed(entry.fields(code, path)))),
        ("_NUMBER", re.compile(r"([-+]?)(\d*)(?:\.(\d*))?")),
    ],
)
def test_the_checker_sees_a_fault(monkeypatch, name, replacement):
    monkeypatch.setattr(typed, name, replacement)
    assert run(20_000, 5)[0]


@pytest.mark.parametrize(
    "code, text, line",
    [
        ("G79", "100,-8,2,5", "G79 Q100 Z-8 D2 R5"),
        ("G79", "100,-8,,5\n", "G79 Q100 Z-8 R5"),
        ("G79", "100,-8", "G79 Q100 Z-8"),
        ("G79", " 100 , -8.50 , .5 ,+5. , 02", "G79 Q100 Z-8.5 D0.5 R5 P2"),
        ("G79", "100,-0.0,,-.000", "G79 Q100 Z0 R0"),
        ("G23", "", "G23"),
        ("M252", " \n", "M252"),
        ("M250", "", "M250"),
        ("M253", "00", "M253 P0"),
        ("G12", ",,10,-3", "G12 I10 Z-3"),
    ],
)
def test_lines(code, text, line):
    assert entry.line(code, text, "") == line


@pytest.mark.parametrize(
    "code, text, message",
    [
        (
            "G79",
            "100,-8,2.5,,,,,,,,,,7",
            "field 13: 13 data are given, G79 has 12; take out what comes behind H (chop)",
        ),
        ("G79", "100", "field 2, Z (final depth): nothing is given; give the final depth"),
        (
            "G79",
            "100,-8,7,2,9",
            "field 5, P (strategy): 9 is not a choice; use 0 (contour-parallel) or 1 (one-way) or 2 (zigzag) or 3 "
            "(concentric) or "
            "4 (constant engagement); write decimals with a point: 2.9",
        ),
        (
            "G79",
            "100,-8,0,25",
            "field 3, D (step-over): 0 is not above 0; give a number above 0; write decimals with a point: 0.25",
        ),
        (
            "G79",
            "100, -8, 2,5",
            "field 3, D (step-over): 2,5 looks like a number with a decimal comma; write numbers with a point: 2.5, or "
            "two data "
            "with a blank behind each comma",
        ),
        (
            "G79",
            "100,-8,1,05",
            "field 3, D (step-over): 1,05 looks like a number with a decimal comma; write numbers with a point: 1.05, "
            "or two "
            "data with a blank behind each comma",
        ),
        (
            "G79",
            "100,-0,5",
            "field 2, Z (final depth): -0,5 looks like a number with a decimal comma; write numbers with a point: "
            "-0.5, or two data "
            "with a blank behind each comma",
        ),
        (
            "G79",
            "100;-8;2,5",
            "field 1, Q (sub of the pocket): 100;-8;2 has a semicolon; put a comma between the data and a point into "
            "numbers: 1.5",
        ),
        (
            "M253",
            "1,5",
            "field 2: 2 data are given, M253 has 1; take out what comes behind P (slot); write decimals with a point: "
            "1.5",
        ),
        ("M252", "1", "field 1: 1 data are given, M252 has 0; press Enter alone"),
        ("M253", "10", "field 1, P (slot): 10 is not from 0 to 9; give a number from 0 to 9"),
        ("G75", "-1", "field 1, Q (sub of the pattern): -1 is not 0 or more; give a number 0 or more"),
        ("G77", "100,41.5", "field 2, P (side of the tool): 41.5 is not a whole number; leave the decimals out"),
        (
            "G79",
            "{x}\x07",
            "field 1, Q (sub of the pocket): {x} is not a number; use digits and a point, as 12.5 or -8",
        ),
        (
            "G79",
            "1" * 1001,
            "field 1, Q (sub of the pocket): the line has more than 1000 characters; type the data of one code",
        ),
        (
            "G79",
            "1234567890",
            "field 1, Q (sub of the pocket): 1234567890 has more than 9 digits before or behind the point; use fewer "
            "digits",
        ),
    ],
)
def test_errors_name_the_field(code, text, message):
    with pytest.raises(entry.EntryError) as caught:
        entry.line(code, text, "")
    assert str(caught.value) == f"chipwise: {code}: {message}"


def test_an_error_has_its_parts():
    with pytest.raises(entry.EntryError) as caught:
        entry.line("G79", "100,-8,x", "")
    error = caught.value
    assert (error.number, error.letter, error.name, error.code) == (3, "D", "step-over", "G79")
    assert (error.fact, error.remedy) == ("x is not a number", "use digits and a point, as 12.5 or -8")


def test_words_have_names():
    assert entry.words("G77 Q100 P41 Z-8 I0.5", path="") == (
        ("Q", "sub of the contour", "100"),
        ("P", "side of the tool", "41, left"),
        ("Z", "final depth", "-8 mm"),
        ("I", "side allowance", "0.5 mm"),
    )
    german = entry.words("M251 Q2.5 P3 R1 E100", "in", language.translator(("de",)), "")
    assert (
        german[0] == ("Q", "Zeitspanvolumen", "2.5 in3/min")
        and german[1] == ("P", "Betriebsart", "3, Fenster")
        and german[3][2] == "100 in/min"
    )
    assert entry.words("M252", path="") == ()


def test_the_words_are_those_of_the_remaps():
    """Every word of each code's argspec can be entered, and no other but F."""
    text = (ROOT / "configs" / "chipwise_codes.inc").read_text()
    specs = dict(re.findall(r"(?m)^REMAP = ([GM]\d+) .*?argspec=(\w*)N ", text))
    assert len(specs) > 12
    for code, letters in specs.items():
        assert {field.letter for field in entry.fields(code, "")} - {"F"} == set(letters.upper()), code


def test_units_and_kinds():
    for code in entry.codes(""):
        for field in entry.fields(code, ""):
            assert field.required != bool(field.default), (code, field)
            assert field.whole == (field.kind in ("whole", "sub", "choice")) and bool(field.choices) == (
                field.kind == "choice"
            )
            assert field.letter in "HLTP" or not field.unit() or not field.whole
            if field.letter in "HL":
                assert field.whole  # LinuxCNC takes whole numbers only
    (rate,) = [field for field in entry.fields("M251", "") if field.letter == "Q"]
    assert (rate.unit(), rate.unit("in")) == ("cm3/min", "in3/min")


# ---- a machine's own order ---------------------------------------------------------------------------------------

OWN = """
[G79]
title = "Tasche"
order = ["Z", "Q", "D"]
[G79.D]
name = "Zustellung"
[M251.Q]
name = "Volumen"
"""


def own(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


def test_an_order_of_ones_own(tmp_path, monkeypatch):
    path = own(tmp_path, OWN)
    assert entry.line("G79", "-8,100,2", path) == "G79 Z-8 Q100 D2"
    assert entry.title("G79", path) == "Tasche" and entry.fields("G79", path)[2].name == "Zustellung"
    assert entry.line("M251", "30", path) == "M251 Q30" and entry.fields("M251", path)[0].name == "Volumen"
    assert entry.line("G78", "1,41,-2", path) == "G78 Q1 P41 Z-2"
    with pytest.raises(
        entry.EntryError, match=r"field 4: 4 data are given, G79 has 3; take out what comes behind D \(Zustellung\)"
    ):
        entry.line("G79", "-8,100,2,5", path)
    (tmp_path / "a.ini").write_text("[CHIPWISE]\nENTRY = mine.toml\n")
    monkeypatch.setenv("INI_FILE_NAME", str(tmp_path / "a.ini"))
    assert entry.line("G79", "-8,100") == "G79 Z-8 Q100"


@pytest.mark.parametrize(
    "text, message",
    [
        ("[G99]\n", "mine.toml: ['G99'] is not a code that can be entered; use G12, "),
        ("G79 = 1", "mine.toml: G79: is not a table; write [G79]"),
        ("[G79]\norder = 'QZ'", "mine.toml: G79: order is not a list of letters; write order = ['Q', 'Z', 'D'"),
        (
            "[G79]\norder = ['Q', 'Z', 'W']",
            "mine.toml: G79: order has 'W', which is not a letter of the code; use Q, Z, D",
        ),
        ("[G79]\norder = ['Q', 'Z', 'Q']", "mine.toml: G79: order has Q twice; take one of them out"),
        ("[G79]\norder = ['Q', 'D']", "mine.toml: G79: order lacks Z (final depth), which is always needed; add Z"),
        (
            "[G79]\norders = []",
            "mine.toml: G79: 'orders' is neither title, order nor a letter of the code; use Q, Z, D",
        ),
        ("[G79.Q]\nleast = -1", "mine.toml: G79.Q: 'least' cannot be changed; change only name"),
        ("[G79]\nQ = 'sub'", "mine.toml: G79.Q: is not a table; write [G79.Q] and name = .."),
        (
            "[G79.Q]\nname = ''",
            "mine.toml: G79.Q: name = '' is not a text of 1 to 40 printable characters; correct the file",
        ),
        ('[G79.Q]\nname = "a\\u0007"', "mine.toml: G79.Q: name = 'a\\x07' is not a text"),
        ("[G79]\ntitle = 3", "mine.toml: G79: title = 3 is not a text"),
        ("[G79", "mine.toml: is not TOML: "),
        ("[G79.Q]\nname = 0x" + "1" * 5000, "mine.toml: G79.Q: name = a number of thousands of digits is not a text"),
    ],
)
def test_a_file_that_is_wrong(tmp_path, text, message):
    with pytest.raises(CycleError) as caught:
        entry.fields("G79", own(tmp_path, text))
    assert str(caught.value).startswith("chipwise: " + message)


@pytest.mark.parametrize("path", ["/nowhere/x.toml", "/dev/zero", "/"])
def test_a_file_that_cannot_be_read(path):
    with pytest.raises(CycleError, match="it cannot be read: .*; correct .CHIPWISE.ENTRY"):
        entry.codes(path)


def test_a_code_that_is_not_known():
    with pytest.raises(CycleError, match=r"'G\{99\}' is not a code that can be entered; use one of G12, "):
        entry.line("G{99}", "1", "")


# ---- names in German ---------------------------------------------------------------------------------------------


def names():
    """Every text of the two tables that is shown."""
    from chipwise.panel import colours

    found = {item.name for item in colours.load("").values()}
    for code in entry.codes(""):
        found.add(entry.title(code, ""))
        for field in entry.fields(code, ""):
            found |= {field.name, field.default, *(meaning for _number, meaning in field.choices)}
    return {name for name in found if re.search("[a-z]{2}", name)}


def test_every_name_is_translated():
    assert "de" in language.languages()
    text = (ROOT / "remap" / "chipwise" / "locale" / "de.po").read_text()
    missing = [name for name in names() if f'msgid "{name}"\n' not in text]
    assert not missing, missing
    german = language.translator(("de",))
    assert german("step-over") == "Bahnabstand" and german("nobody says this") == "nobody says this"


def test_the_language_is_found(monkeypatch, tmp_path):
    for name in ("LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.delenv(name, raising=False)
    assert language.translator()("slot") == "slot"
    monkeypatch.setenv("LANG", "de_AT.UTF-8")
    assert language.translator()("slot") == "Platz" and language.translator(("en",))("slot") == "slot"
    assert language.translator(("de-CH",))("slot") == "Platz" and language.translator(("fr", "de"))("slot") == "Platz"
    assert (
        language.translator(("../../etc",))("slot") == "slot"
        and language.translator((), str(tmp_path))("slot") == "slot"
    )
    folder = tmp_path / "de" / "LC_MESSAGES"
    os.makedirs(folder)
    (folder / "chipwise.mo").write_bytes(b"\xde\x12\x04\x95 broken")
    assert language.translator(("de",), str(tmp_path))("slot") == "slot"
