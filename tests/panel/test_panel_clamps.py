# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps on the page of `chipwise panel`: the set-ups of the machine's file, M256 in MDI at rest, and the picture of
those in force."""

import json
import math
from dataclasses import replace

import pytest

from chipwise.clamps import set_ups
from chipwise.clib import layout
from chipwise.entry import mdi
from chipwise.panel import colours, entry
from chipwise.stock.clamp_table import SIZE, ClampTable, rows
from support import panel_browser, panel_rig
from support.check_runs import mill_with_tools
from support.panel_rig import TOKEN, asking, posted, serving
from support.panel_client import request

VICE = (
    "[set_up.2]\nname = 'vice'\n[set_up.2.clamp.jaw]\nbox = [10, 30, -30, 40, 50, 5]\n[set_up.2.clamp.stop]\n"
    "cylinder = [70, 10, -30, 8, 12]\n[set_up.9.clamp.a]\nbox = [0, 0, 0, 1, 1, 1]\n"
)
NEW = {"set_up": 3, "title": "plate", "add": "bolt-1", "box": [1, 2, 3, 4, 5, 6]}


class Mdi:
    """entry/mdi.py of a machine that the test sets by hand; M256 writes the table, as chipwise-monitor does."""

    check = staticmethod(mdi.check)

    def __init__(self, path):
        self.state, self.sent, self.path, self.place = mdi.State(), [], path, (0.0, 0.0, 0.0)
        self.memory = bytearray(SIZE)

    def read(self):
        return self.state

    def scene(self):
        return {}

    def tip(self, frame):
        assert frame.offset == frame.g92 == (0.0, 0.0, 0.0) and frame.turn == 0.0
        return self.place

    def send(self, line):
        self.sent.append(line)
        number = int(line.partition("P")[2])
        ClampTable(self.memory, 0).put(set_ups.clamps_of(self.path, number) if number else (), 1.0)

    def rows(self):
        return rows(layout.ClampTable.from_buffer(self.memory))


@pytest.fixture
def shop(tmp_path, monkeypatch):
    """(rig, machine, path of the file)."""
    ini = mill_with_tools(tmp_path)
    path = ini.parent / "clamps.toml"
    path.write_text(VICE)
    machine = Mdi(str(path))
    monkeypatch.setattr(panel_rig.Shared, "clamps_in_force", lambda _self, _before: machine.rows())
    with serving(TOKEN, lines=entry.Lines(str(ini), asking(machine))) as rig:
        yield rig, machine, path


def listed(rig):
    rig.look()
    status, _headers, content = request(rig.url, "/clamps.json")
    assert status == 200, content
    return json.loads(content)


def test_what_is_listed_and_in_force(shop):
    rig, machine, _path = shop
    found = listed(rig)
    assert found["file"] == "clamps.toml" and found["in_force"] == [] and found["set_ups"]["2"]["name"] == "vice"
    assert found["set_ups"]["2"]["clamps"]["stop"] == {"shape": "cylinder", "min": [64, 4, -30], "max": [76, 16, 8]}
    assert posted(rig, "/clamps", {"set_up": 2}) == (200, {}) and machine.sent == ["M256 P2"]
    assert listed(rig)["in_force"] == [2] and json.loads(rig.watch.text)["clamps"][1] == [
        1,
        0.0,
        [70.0, 10.0],
        [6.0, 6.0],
        8.0,
    ]
    machine.state = replace(machine.state, incremental=True)
    assert (
        posted(rig, "/clamps", {"set_up": 0}) == (200, {})
        and listed(rig)["in_force"] == []
        and machine.sent[1:] == ["M256 P0"]
    )


def test_only_at_rest_and_with_the_token(shop):
    rig, machine, path = shop
    for token in (None, "wrong-token-9"):
        assert (
            posted(rig, "/clamps", {"set_up": 2}, token=token)[0] == posted(rig, "/clamp", NEW, token=token)[0] == 403
        )
    for state, said in (
        ({"idle": False}, "a program or a command is under way"),
        ({"at_rest": False}, "the machine moves"),
        ({"on": False}, "the machine is off"),
        ({"estop": True}, "E-stop"),
    ):
        machine.state = replace(mdi.State(), **state)
        status, words = posted(rig, "/clamps", {"set_up": 2})
        assert status == 409 and said in words and not machine.sent
    for number in (-1, 1000, "2", True, None, 2.0):
        assert posted(rig, "/clamps", {"set_up": number})[0] == 400
    assert path.read_text() == VICE


def test_a_clamp_more_and_one_less(shop):
    rig, _machine, path = shop
    assert posted(rig, "/corner", {"machine": True}, token=None) == (200, {"corner": [0.0, 0.0, 0.0]})
    assert posted(rig, "/clamp", NEW) == (200, {"file": "clamps.toml"})
    assert listed(rig)["set_ups"]["3"] == {
        "name": "plate",
        "clamps": {"bolt-1": {"shape": "box", "min": [1, 2, 3], "max": [4, 5, 6]}},
    }
    assert posted(rig, "/clamp", {"set_up": 2, "remove": "jaw"})[0] == 200 and list(
        listed(rig)["set_ups"]["2"]["clamps"]
    ) == ["stop"]
    assert posted(rig, "/clamp", {"set_up": 2, "remove": "stop"})[0] == 200 and sorted(listed(rig)["set_ups"]) == [
        "3",
        "9",
    ]
    before = path.read_text()
    for change, status, said in (
        ({"add": "bolt-1"}, 409, "has a clamp bolt-1 already"),
        ({"add": "a b"}, 409, "no name of at most 40"),
        ({"add": ""}, 409, "no name of at most 40"),
        ({"add": "x", "box": [1, 2, 3, 1, 5, 6]}, 409, "no extent in X"),
        ({"add": "x", "box": [1, 2, 3, 4, 5]}, 400, "not six"),
        ({"add": "x", "box": [1, 2, 3, 4, 5, math.nan]}, 400, ""),
        ({"add": None}, 400, "not a text"),
        ({"remove": "bolt-1"}, 400, "not a text"),
        ({"add": None, "remove": "bolt-7"}, 409, "no clamp of that name"),
        ({"set_up": 0}, 400, "from 1 to 999"),
    ):
        answer = posted(rig, "/clamp", {**NEW, **change})
        assert answer[0] == status and said in answer[1], (change, answer)
    assert path.read_text() == before
    path.write_text("[set_up.2.clamp.jaw]\nbox = [1]\n")
    assert "box is not 6 numbers" in posted(rig, "/clamp", NEW)[1] and request(rig.url, "/clamps.json")[0] == 409


PIXELS = """const v = chipwise.view, c = document.createElement('canvas');
    v.above(true); v.draw(); c.width = v.canvas.width; c.height = v.canvas.height;
    const x = c.getContext('2d'); x.drawImage(v.canvas, 0, 0);
    const data = x.getImageData(0, 0, c.width, c.height).data, ink = arguments[0];
    let found = 0;
    for (let k = 0; k < data.length; k += 4) if ([0, 1, 2].every((i) => Math.abs(ink[i] - data[k + i]) < 40)) found++;
    return found"""

FIRST_ROW = "document.querySelector('#clamps-set-ups tr').cells[3].textContent"
# The first answer with the list waits until let_go() is called; `taken` says that the page has read it.
LATE_ANSWER = """const asked = window.fetch;
    window.fetch = async (url, ...more) => {
        const answer = await asked(url, ...more);
        if (url !== 'clamps.json') return answer;
        window.fetch = asked;
        const held = new Promise((done) => { window.let_go = done; });
        await held;
        const json = answer.json.bind(answer);
        answer.json = async () => { const all = await json(); window.taken = true; return all; };
        return answer;
    }"""


class Page:
    """The page in a browser."""

    def __init__(self, driver):
        self.driver = driver

    def run(self, script, *values):
        return self.driver.execute_script(script, *values)

    def wait(self, script, what):
        panel_browser.wait(self.driver, script, what)

    def says(self, text):
        self.wait(f"document.getElementById('clamps-says').textContent.includes({json.dumps(text)})", text)

    def texts(self, selector):
        return self.run(
            f"return Array.from(document.querySelectorAll('{selector}'), (e) => Array.from(e.cells, (c) => "
            f"c.textContent).slice(0, 4))"
        )

    def press(self, name):
        self.run(f"document.getElementById('clamps-{name}').click()")

    def clamp_pixels(self):
        item = colours.load("")["clamp"].colour(self.run("return document.documentElement.dataset.theme"))
        return self.run(PIXELS, [int(item[k : k + 2], 16) for k in (1, 3, 5)])


@pytest.fixture
def page(shop, tmp_path):
    """Page and machine, with the section open and P2 in the list."""
    rig, machine, _path = shop
    driver = panel_browser.browser(tmp_path / "browser")
    try:
        rig.looks()
        panel_browser.opened(driver, rig.url + "/")
        found = Page(driver)
        found.press("open")
        found.wait("document.querySelectorAll('#clamps-rows tr').length === 2", "the clamps of P2")
        yield found, machine
        assert [one["message"] for one in driver.get_log("browser") if one["level"] == "SEVERE"] == []
    finally:
        driver.quit()


def new_clamps(page, machine):
    """Corners from the tool, added; then a box that is drawn."""
    for corner, place in enumerate(((-20.0, 5.0, -10.0), (-30.0, 15.5, 2.25))):
        machine.place = place
        page.press(f"take{corner}")
        page.wait(f"document.getElementById('clamps-n{3 * corner}').value === '{place[0]:g}'", "a corner")
    page.run("document.getElementById('clamps-name').value = 'bolt'")
    page.press("save")
    page.says("saved in clamps.toml")
    bolt = set_ups.load(machine.path)[2].clamps["bolt"]
    assert (bolt.low, bolt.high) == ((-30.0, 5.0, -10.0), (-20.0, 15.5, 2.25))
    page.run("""const svg = document.getElementById('clamps-picture');
        const to = (x, y) => new DOMPoint(x, -y).matrixTransform(svg.getScreenCTM());
        const at = (p) => ({clientX: p.x, clientY: p.y, pointerId: 1});
        const send = (kind, x, y) => svg.dispatchEvent(new PointerEvent(kind, at(to(x, y))));
        svg.setPointerCapture = () => {};
        send('pointerdown', 50, 40); send('pointermove', 20, 25);
        send('pointermove', 45, 20); send('pointerup', 45, 20)""")
    assert [
        float(page.run(f"return document.getElementById('clamps-n{k}').value")) for k in (0, 1, 3, 4)
    ] == pytest.approx([50, 40, 45, 20], abs=0.3)
    assert page.run("return document.querySelectorAll('#clamps-picture .new').length") == 1


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_in_a_browser(shop, page, tmp_path):
    """Read the list, switch a set-up on and see it in the picture, take corners from the tool, draw a box, clear."""
    (page, machine), rig = page, shop[0]
    page.says("enter the token to change clamps")
    assert page.texts("#clamps-set-ups tr") == [["P2", "vice", "2", "-"], ["P9", "", "1", "-"]] and page.texts(
        "#clamps-rows tr"
    )[0][:3] == ["jaw", "box", "10 30 -30"]
    page.run("sessionStorage.setItem('chipwise-token', arguments[0])", TOKEN)
    page.run(
        "Array.from(document.querySelectorAll('#clamps-set-ups tr button')).find((b) => b.textContent === 'Switch "
        "on').click()"
    )
    page.says("in force: P2")
    page.wait("document.querySelectorAll('#clamps-picture .on').length === 2", "both in the picture")
    page.wait(FIRST_ROW + " === 'in force'", "P2 in force in the list")
    page.wait("document.getElementById('clamps-count').textContent === 'Clamps in force: 2'", "how many are in force")
    new_clamps(page, machine)
    small = page.run(
        "return Array.from(document.querySelectorAll('#clamps button')).filter((b) => b.offsetHeight < 34 || "
        "b.offsetWidth < 34).map((b) => b.textContent)"
    )
    assert small == [] and page.run(
        "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    ) == [1024, 768]
    page.driver.save_screenshot(str(tmp_path / "section.png"))
    page.press("close")
    assert page.run("return chipwise.view instanceof HeightView") and page.clamp_pixels() > 300
    page.driver.save_screenshot(str(tmp_path / "stock.png"))
    page.press("open")
    page.press("clear")
    page.says("No clamp is in force")
    assert machine.sent == ["M256 P2", "M256 P0"]
    page.press("close")
    page.wait("chipwise.state.clamps.length === 0", "no clamp")
    assert page.clamp_pixels() < 30
    rig.machine.values["doubt"] = 2.1
    page.wait(
        "document.getElementById('stock-note').textContent === 'A probed blank: higher than the part by up to 2.10 mm'",
        "the doubt of the stock",
    )


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_an_older_answer_that_comes_later(shop, page):
    """The list was read before P2 was in force and comes after it was read again."""
    page, machine = page
    page.run(LATE_ANSWER)
    page.press("close")
    page.press("open")
    page.wait("Boolean(window.let_go)", "an answer")
    machine.send("M256 P2")
    page.wait(FIRST_ROW + " === 'in force'", "P2 in force in the list")
    page.run("let_go()")
    page.wait("Boolean(window.taken)", "the older answer")
    assert page.run("return " + FIRST_ROW) == "in force"
