# SPDX-License-Identifier: GPL-2.0-or-later
"""The documentation against the source: messages, links, names, length of paragraphs."""

import os
import re
import sys

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools"))

import message_source  # noqa: E402
import messages  # noqa: E402
from repository import repository_files  # noqa: E402


LONGEST_PARAGRAPH = 600


def tracked(pattern=""):
    """Paths of the repository's files that match a regular expression."""
    return sorted(
        path for path in repository_files() if os.path.isfile(os.path.join(ROOT, path)) and re.search(pattern, path)
    )


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as handle:
        return handle.read()


PAGES = tracked(r"^(docs/.*|[A-Z]+)\.md$")


# ---- messages ----------------------------------------------------------------------------------------------------


def test_every_message_is_explained():
    assert messages.check() == []
    assert messages.strangers() == [], "no file has this beginning any more: its messages are in another section"


def test_the_check_sees_a_message_without_an_entry(monkeypatch):
    """A message that the catalogue misses, one reworded, and an entry without a message."""
    real = messages.messages()
    fact, remedy = next(pair for pair in real if pair[1])
    moon = {("the moon is not full", "wait"): ["remap/chipwise/gcode_lines.py"]}
    monkeypatch.setattr(messages, "messages", lambda: {**real, **moon})
    assert messages.check() == ["not in docs/user/messages.md: the moon is not full"]
    less = {pair: paths for pair, paths in real.items() if pair[0] != fact}
    monkeypatch.setattr(messages, "messages", lambda: less)
    assert messages.check() == ["explained but not in the source: " + fact.replace("`", "'")]
    other = {**real, (fact, "do something else"): ["remap/chipwise/gcode_lines.py"]}
    monkeypatch.setattr(messages, "messages", lambda: other)
    assert len(messages.check()) == 1


def test_a_row_stands_once_in_its_section(monkeypatch, tmp_path):
    """The source has a message in three places, one of another section and one with a remedy of its own."""
    row = "| `the moon is {}` | It is young. | wait |\n"
    path = tmp_path / "messages.md"
    path.write_text("# Messages\n\n## Cycles\n\n" + messages.HEAD + 2 * row.format("new") + row.format("thin"))
    found = {
        ("the moon is new", "wait"): ["remap/chipwise/codes.py"],
        ("the moon is new", ""): ["remap/chipwise/order.py", "remap/chipwise/units.py"],
        ("the moon is thin", "wait"): ["remap/chipwise/codes.py"],
    }
    monkeypatch.setattr(messages, "CATALOGUE", str(path))
    monkeypatch.setattr(messages, "messages", lambda: found)
    assert messages.check() == ["twice in Cycles: the moon is new"]
    messages.update()
    assert messages.check() == []
    assert path.read_text().endswith(messages.HEAD + row.format("new") + row.format("thin"))
    found["the moon is new", "look"] = ["remap/chipwise/codes.py"]
    found["the moon is thin", ""] = ["remap/chipwise/cli/check.py"]
    messages.update()
    assert len(messages.catalogue_rows(path.read_text())) == 4 and messages.check() == []


@pytest.mark.parametrize(
    "source, expected",
    [
        ('raise CycleError("radius I{r} is too small", "use more", r=1)', [("radius I.. is too small", "use more")]),
        ('raise CycleError(f"{a} of {n:g} mm is wrong")', [(".. of .. mm is wrong", "")]),
        ('raise UsageError("speed %g is wrong; use %d" % (a, b))', [("speed .. is wrong", "use ..")]),
        ("self.say(TEXT)", [("the tool is lost", "find it")]),
        (
            'self.say("the tool is " + ("lost now" if lost else "here again"))',
            [("the tool is lost now", ""), ("the tool is here again", "")],
        ),
        ('print("no message")', []),
        ('print("chipwise: but this is one")', [("but this is one", "")]),
    ],
)
def test_messages_are_found(tmp_path, source, expected):
    path = tmp_path / "some.py"
    path.write_text('TEXT = "the tool is lost; find it"\n\n\ndef f(self, a, b, n, lost):\n    ' + source + "\n")
    assert message_source.python_messages(str(path), set()) == expected


# ---- links -------------------------------------------------------------------------------------------------------


def headings(text):
    """Anchors of a page, as GitHub makes them."""
    text = re.sub(r"(?ms)^```.*?^```", "", text)
    found = []
    for heading in re.findall(r"(?m)^#+ +(.*)$", text):
        heading = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
        found.append(re.sub(r"[^\w\- ]", "", heading).replace(" ", "-"))
    return found


@pytest.mark.parametrize("page", PAGES)
def test_links_resolve(page):
    text = re.sub(r"(?ms)^```.*?^```", "", read(page))
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?:|mailto:", target):
            continue
        path, _, anchor = target.partition("#")
        full = os.path.normpath(os.path.join(ROOT, os.path.dirname(page), path)) if path else os.path.join(ROOT, page)
        assert os.path.exists(full), f"{page}: {target}"
        if anchor and full.endswith(".md"):
            assert anchor in headings(read(os.path.relpath(full, ROOT))), f"{page}: {target}"


def test_every_picture_is_shown():
    shown = {
        os.path.normpath(os.path.join(os.path.dirname(page), target))
        for page in PAGES
        for target in re.findall(r"!\[[^]]*\]\(([^)\s]+)\)", read(page))
    }
    assert sorted(set(tracked(r"^docs/.*\.svg$")) - shown) == []


def test_the_index_lists_every_page():
    index = read("docs/README.md")
    for page in tracked(r"^docs/.*\.md$"):
        if page != "docs/README.md":
            assert f"]({os.path.relpath(page, 'docs')})" in index, page


# ---- paragraphs --------------------------------------------------------------------------------------------------


def paragraphs(text):
    """Paragraphs and list items of a page; tables, code and headings do not count."""
    text = re.sub(r"(?ms)^```.*?^```", "", text)
    for block in re.split(r"\n\s*\n", text):
        lines = [line for line in block.split("\n") if line.strip() and not re.match(r"\||#| {4}|!\[", line)]
        for item in re.split(r"(?m)^(?=\s*(?:[-*]|\d+\.) )", "\n".join(lines)):
            if item.strip():
                yield " ".join(item.split())


@pytest.mark.parametrize("page", PAGES)
def test_paragraphs_are_short(page):
    for paragraph in paragraphs(read(page)):
        assert len(paragraph) <= LONGEST_PARAGRAPH, f"{page}: {len(paragraph)} characters: {paragraph[:80]}.."


# ---- names -------------------------------------------------------------------------------------------------------

SHORT_ROOTS = (
    "",
    "remap/chipwise/",
    "remap/chipwise/cycles/",
    "components/",
    "remap/chipwise/geometry/",
    "remap/chipwise/geometry/base/",
    "remap/chipwise/geometry/offset/",
    "remap/chipwise/geometry/pocket/",
    "remap/chipwise/check/",
    "components/core/",
    "configs/",
    "hal/",
    "nc_files/",
    "tests/machine/",
    "tests/components/",
    "tests/core/",
)
NOT_OURS = re.compile(
    r"rs274ngc_\w+\.(?:cc|hh)|interp_\w+\.cc|remap\.py$|test\.hal|stimulus\.py|check\.py$|"
    r"part\.ngc|100\.ngc|build/|sim/|program\.ngc|tools?\.toml|panel\.xml"
)


def find(path):
    """The file that a short name of the docs means, None if there is none."""
    for root in SHORT_ROOTS:
        if os.path.exists(os.path.join(ROOT, root + path)):
            return root + path
    return None


@pytest.mark.parametrize("page", PAGES)
def test_files_and_symbols_exist(page):
    """`path/name.py` exists; `path/name.py: symbol` is in it."""
    if page == "CHANGELOG.md":
        return
    text = re.sub(r"(?ms)^```.*?^```", "", read(page))
    names = r"`([\w./-]+\.(?:py|c|h|comp|hal|ini|inc|ngc|toml|md|svg|html))(?:: (\w+)(?:\(\))?)?`"
    for path, symbol in re.findall(names, text):
        if NOT_OURS.search(path) and not path.startswith(("tests/", "tools/", "bench/", "remap/", "check/", "cli/")):
            continue
        found = find(path)
        assert found, f"{page}: `{path}` does not exist"
        if symbol:
            assert re.search(r"\b%s\b" % symbol, read(found)), f"{page}: `{path}` has no {symbol}"
    for path in re.findall(r"`((?:tests|remap|tools|bench|components|configs|bin|hal|nc_files)/[\w./-]*)`", text):
        assert os.path.exists(os.path.join(ROOT, path)), f"{page}: `{path}` does not exist"


def docs_text(*shelves):
    return "\n".join(read(page) for shelf in shelves or ("docs",) for page in tracked(rf"^{shelf}/.*\.md$"))


def remaps():
    """{code: words of its argspec} of the INI files."""
    found = {}
    for path in tracked(r"^configs/.*\.(ini|inc)$"):
        for code, rest in re.findall(r"(?m)^REMAP\s*=\s*(\w+)(.*)$", read(path)):
            spec = re.search(r"argspec=(\S+)", rest)
            found.setdefault(code, set()).update(letter.upper() for letter in spec[1] if letter.islower())
    return found


@pytest.mark.parametrize("code", sorted(remaps()))
def test_codes_and_their_words_are_explained(code):
    pages = [read(page) for page in tracked(r"^docs/user/.*\.md$")]
    about = [text for text in pages if re.search(r"(?m)^#+ .*\b%s\b" % code, text)]
    assert about, f"no heading with {code} in docs/user"
    for letter in remaps()[code]:
        row = re.compile(r"(?m)^\|[^|\n]*`%s(?:\d+)?`" % letter)
        assert any(row.search(text) for text in about), f"{code}: word {letter} has no row"


def test_pins_are_listed():
    import pins

    page = read("docs/design/pins.md")
    for component, found in pins.names().items():
        assert found, component
        section = re.split(r"(?m)^## ", page.split(f"## {component}\n")[1])[0]
        for name in found:
            assert f"`{name}`" in section, f"{component}: {name}; run tools/pins.py"
    for path, least in (("remap/chipwise/monitor/component.py", 60), ("remap/chipwise/panel/display.py", 7)):
        made = re.search(r"(?ms)^(?:PINS = |def make_component).*?(?=^def (?!make_component)|\Z)", read(path))[0]
        names = re.findall(r"""['"]([a-z][a-z0-9]*(?:-[a-z0-9]+)*)['"]""", made)
        assert len(names) >= least, path
        for name in names:
            if name not in ("net", "none", "defined", "cm3", "in3"):
                assert f"`{name}`" in page, f"{path}: {name}"


def test_settings_parameters_and_commands_are_explained():
    from chipwise import cli, settings
    from chipwise.glue import named

    page = read("docs/user/settings.md")
    for key in settings.SETTINGS:
        assert f"| `{key}` |" in page, key
    codes = read("docs/user/codes.md")
    for name in named.KNOWN:
        assert f"| `#<{name}>` |" in codes, name
    commands = read("docs/user/commands.md")
    _parser, modules = cli.build_parser()
    for name in modules:
        assert f"`chipwise {name}`" in commands, name
    tool_keys = re.search(r"(?ms)^## Tool geometry.*?(?=^## )", page)[0]
    from chipwise.tool_data.geometry import KEYS

    for key in KEYS:
        assert key in tool_keys, key


def test_modes_faults_and_limits_are_explained():
    """Every fault code of the monitor's table has a row in hal.md."""
    from chipwise.monitor.messages import FAULTS

    faults = {str(int(fault)) for fault in FAULTS}
    listed = set(re.findall(r"\d+", " ".join(re.findall(r"(?m)^\| ([\d, ]+) \|", read("docs/design/hal.md")))))
    assert faults and faults <= listed, faults - listed
