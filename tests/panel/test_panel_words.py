# SPDX-License-Identifier: GPL-2.0-or-later
"""The words and colours of the page of `chipwise panel`: each string is translated, each colour is a display item that
can be read."""

import json
import os
import re
import shutil
import subprocess

import pytest

from chipwise.host import language
from chipwise.panel import colours, page_colours, server
from support import ROOT, colour_vision
from support.panel_client import request
from support.panel_rig import serving

PAGE = ROOT / "remap/chipwise/panel/page"


@pytest.mark.parametrize(
    "accept, language", [("de-AT,de;q=0.9,en;q=0.5", "de"), ("fr,en", "en"), (None, "en"), ("x" * 2000, "en")]
)
def test_the_language_of_the_browser(rig, accept, language):
    found = json.loads(request(rig.url, "/strings.json", Accept_Language=accept)[2])
    assert found["language"] == language
    assert json.loads(request(rig.url, "/strings.json?de", Accept_Language=accept)[2])["strings"]["Tool"] == "Werkzeug"


def test_every_string_is_translated():
    text = "".join(path.read_text() for path in sorted(PAGE.iterdir()) if path.suffix in (".html", ".js"))
    wanted = set(re.findall(r'data-t="([^"]+)"', text)) | set(re.findall(r"\bt\('([^']+)'\)", text))
    for table in re.findall(r"const (?:STATUS|MODES|LIMITS|NAMES) = \{(.*?)\};", text, re.DOTALL):
        wanted |= set(re.findall(r"\w+: '([^']+)'", table))
    part = (ROOT / "remap/chipwise/locale/de.po").read_text().partition("# ---- panel/page\n")[2]
    known = language.catalogue(("de",))[1]
    assert len(wanted) > 40 and not [word for word in wanted if word not in known]
    assert set(re.findall(r'\nmsgid "(.+)"', part)) <= wanted  # nothing is left behind


def test_the_page_has_the_one_catalogue():
    name, texts = language.catalogue(("fr-CA", "de-AT", "en"))
    assert name == "de" and texts["step-over"] == "Bahnabstand" and texts["Tool"] == "Werkzeug" and "" not in texts
    assert (
        language.catalogue(("en", "de")) == ("en", {})
        and language.catalogue(()) == ("en", {})
        and language.catalogue(("../de",)) == ("en", {})
    )


def test_a_catalogue_that_is_broken(tmp_path):
    folder = tmp_path / "de" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    (folder / "chipwise.mo").write_bytes(b"\xde\x12\x04\x95 broken")
    assert language.catalogue(("de",), str(tmp_path)) == ("en", {})


def sheet(url):
    """{mode: {name: "#rrggbb"}} of the style sheet, read by itself."""
    text = request(url, "/colours.css")[2].decode()
    light, dark = re.fullmatch(r':root \{(.*)\}\n:root\[data-theme="dark"\] \{(.*)\}\n', text).groups()
    return {
        mode: dict(re.findall(r"--([a-z-]+): (#[0-9a-f]{6});", part))
        for mode, part in (("light", light), ("dark", dark))
    }


def test_the_page_has_the_colours_of_the_items(rig, tmp_path):
    found = sheet(rig.url)
    for mode in colours.MODES:
        for item, entry in colours.load("").items():
            assert found[mode][item.replace("_", "-")] == entry.colour(mode)
    path = tmp_path / "colours.toml"
    path.write_text('[tool]\nlight = "#8a2be2"\n')
    with serving(items=colours.load(str(path))) as other:
        assert sheet(other.url)["light"]["tool"] == "#8a2be2" and sheet(other.url)["dark"] == found["dark"]


def test_every_colour_that_the_page_asks_for_is_there(rig):
    text = "".join(path.read_text() for path in PAGE.iterdir() if path.suffix in (".css", ".js"))
    wanted = set(re.findall(r"var\(--([a-z-]+)\)", text)) | set(re.findall(r"\b(?:colour|rgb)\('([a-z-]+)'\)", text))
    for names in sheet(rig.url).values():
        assert len(wanted) > 15 and not wanted - set(names)
    assert not re.findall(r"#[0-9a-fA-F]{6}", text)  # no colour of its own


def test_words_are_read_in_every_state():
    """WCAG 2.1, 1.4.3: 4.5:1 for words, for every eye."""
    for mode in colours.MODES:
        names = page_colours.variables(colours.load(""), mode)
        for behind in ("box", *(name for name in names if name.startswith("state-"))):
            for word in ("ink", "faint") if behind == "box" else ("ink",):
                for eye in colour_vision.VISIONS:
                    assert colour_vision.contrast(names[word], names[behind], eye) >= 4.5, (mode, behind, word, eye)


@pytest.mark.skipif(shutil.which("node") is None, reason="no node to read JavaScript with")
@pytest.mark.parametrize("path", sorted(path for path in server.FILES if path.endswith(".js")))
def test_the_scripts_are_some(path):
    folder, name, _kind = server.FILES[path]
    done = subprocess.run(["node", "--check", os.path.join(folder, name)], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
