# SPDX-License-Identifier: GPL-2.0-or-later
"""What the page of `chipwise panel` shows in a real browser, of a machine that the test sets by hand: walls, legend,
tables, reasons, ends."""

import time

import pytest

from chipwise.panel import entry
from chipwise.panel import visitors
from chipwise.panel.tool_log import Use
from chipwise.clib.layout import Fault, GuardReason, LimitedBy
from support import ROOT, panel_browser
from support.panel_rig import TOKEN, serving

pytestmark = pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")

LOW, HIGH = (-5.0, 8.0, -6.0), (65.0, 34.0, -6.0)  # of a slot of 6 mm, slanted to the cells
# First cut pixel from above at each place of a list of [x, y] of the canvas, within 14 pixels of it: below the place,
# null where there is none.
EDGE = """const v = chipwise.view, c = document.createElement('canvas'), m = v.matrix();
    c.width = v.canvas.width; c.height = v.canvas.height;
    const x = c.getContext('2d'); x.drawImage(v.canvas, 0, 0);
    return arguments[0].map((p) => {
        const at = [0, 1].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
        const px = Math.round((at[0] + 1) / 2 * c.width), py = (1 - at[1]) / 2 * c.height;
        for (let y = Math.round(py) - 14; y <= py + 14; y++) {
            const [r, , b] = x.getImageData(px, y, 1, 1).data;
            if (b > r + 30) return y - py;
        }
        return null;
    })"""
BAND = """const c = document.getElementById('chart'), w = chipwise;
    const rows = arguments[0].map(([s, rate, target]) => [s, rate, target, 1]);
    const style = getComputedStyle(document.documentElement);
    drawChart(c, rows, w.loads.chart(null, (v) => v / 1000), (name) => style.getPropertyValue('--' + name).trim());
    return Array.from(c.getContext('2d').getImageData(0, 0, c.width, Math.round(20 * devicePixelRatio)).data)"""


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    found = panel_browser.browser(tmp_path_factory.mktemp("browser"))
    yield found
    found.quit()


@pytest.fixture
def rig():
    """A machine whose lines run when the test says so."""

    def ask(order):
        return (
            {"line": "M252", "unit": "mm", "svg": "", "figures": [], "messages": [], "refused": "", "state": {}}
            if order["do"] == "plan"
            else {}
        )

    with serving(TOKEN, lines=entry.Lines(str(ROOT / "configs/mill.ini"), ask)) as found:
        found.looks()
        yield found


def opened(driver, rig, query="", size=(1024, 768)):
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False},
    )
    panel_browser.opened(driver, rig.url + "/" + query)
    driver.execute_script("sessionStorage.clear()")


def text(driver, name):
    return driver.execute_script("return document.getElementById(arguments[0]).textContent", name)


def reached(driver, name, words):
    panel_browser.wait(driver, f"document.getElementById('{name}').textContent.includes('{words}')", words)


def gauge(driver):
    """[what the gauge shows, the value of the mark, its words]."""
    return driver.execute_script(
        "const [value, marks, unit, words] = chipwise.loads.gauge(chipwise.state, (v) => v); return [value, "
        "marks.target, words]"
    )


def curves(driver):
    """Value, mark and share of the newest row of the chart, and its names."""
    return driver.execute_script(
        "const p = chipwise.loads.chart(chipwise.state, (v) => v), r = chipwise.rows[chipwise.rows.length - 1];"
        "return [p.value(r), p.mark(r), p.share(r), p.names.value, p.names.share]"
    )


def test_the_nearest_limit_is_shown(driver, rig):
    """The gauge has the share of it, the chart too, the figures those of all; without a limit of the tooth the rate as
    ever."""
    opened(driver, rig)
    reached(driver, "share", "-")
    rate = driver.execute_script("return document.getElementById('gauge').toDataURL()")
    assert driver.find_element("id", "gauge-next").get_attribute("title") == "No other limit is known"
    rig.machine.values.update(target=6000.0, mrr=4500.0, chip=0.024, max_chip=0.03)
    reached(driver, "share", "largest chip 80 %, Removal rate 75 %".replace(" ", "\u00a0").replace(",\u00a0", ", "))
    assert gauge(driver) == [80, 100, "% largest chip"] and curves(driver) == [
        4500,
        6000,
        0.8,
        "Removal rate",
        "Share of the limit",
    ]
    assert driver.execute_script("return document.getElementById('gauge').toDataURL()") != rate


@pytest.mark.parametrize("language", ["de", "en"])
def test_a_press_shows_another_limit(driver, rig, language):
    """From the nearest one over each that has a bound to the power that is measured, and round; gone, its place is the
    nearest one's."""
    rig.machine.values.update(
        target=6000.0,
        mrr=4500.0,
        chip=0.024,
        max_chip=0.03,
        power=400.0,
        max_power=500.0,
        force=30.0,
        max_force=100.0,
        spindle_load=0.4,
        spindle_load_scale=2000.0,
        load_idle=300.0,
        load_ratio=1.26,
        load_factor=1.31,
    )
    opened(driver, rig, f"?lang={language}")
    reached(driver, "measured", "500 W, 96 %")
    assert text(driver, "predicted") == "400 W"
    inside, needed = driver.execute_script(
        "const e = document.getElementById('load'); return [e.clientWidth, e.scrollWidth]"
    )
    assert needed <= inside
    words = {
        "en": ["Removal rate", "largest chip", "spindle power", "bending of the tool"],
        "de": ["Zeitspanvolumen", "größter Span", "Spindelleistung", "Durchbiegung des Werkzeugs"],
    }[language]
    for share, name in zip([0.75, 0.8, 0.8, 0.3], words):
        driver.find_element("id", "gauge-next").click()
        assert gauge(driver) == [pytest.approx(100 * share), 100, "% " + name]
        assert curves(driver)[2] == share and curves(driver)[4].endswith(", " + name)
    driver.find_element("id", "gauge-next").click()
    assert gauge(driver) == [500, 400, "W measured" if language == "en" else "W gemessen"] and curves(driver)[:3] == [
        500,
        400,
        0,
    ]
    rig.machine.values["load_idle"] = 0.0
    panel_browser.wait(driver, "document.getElementById('measured').hidden", "no power that is measured")
    assert gauge(driver)[2] == "% " + words[1]


@pytest.mark.parametrize(
    "cell, high", [(0.25, (60.0, 40.0, 0.0)), (0.1, (60.0, 40.0, 0.0))], ids=["every cell", "thinned"]
)
def test_the_wall_of_a_slanted_slot_is_straight(driver, cell, high):
    """Along the upper edge of the slot's far wall: one pixel for the rounding, one for the cell; never above the stock.
    It was a row of teeth of 10 pixels."""
    with serving(cell=cell, high=high) as rig:
        rig.machine.cut(LOW, HIGH)
        rig.machine.tip = (0.0, 0.0, 50.0)
        rig.looks()
        opened(driver, rig, size=(1280, 800))
        (x0, y0, _z), (x1, y1, _w) = LOW, HIGH
        long = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
        normal = (-(y1 - y0) / long, (x1 - x0) / long)
        places = [
            (x0 + (x1 - x0) * k / 400 + 3 * normal[0], y0 + (y1 - y0) * k / 400 + 3 * normal[1], 10.0)
            for k in range(60, 360)
        ]
        off = driver.execute_script(panel_browser.BARE + EDGE, places)
        assert None not in off and -2.0 <= min(off) and max(off) <= 3.0, (min(off), max(off))


def test_the_legend_is_beside_the_curves(driver, rig):
    opened(driver, rig)
    empty = driver.execute_script(BAND, [[0, 0, 0]])
    full = driver.execute_script(BAND, [[k / 10, 30000 if k % 20 < 10 else 0, 30000] for k in range(600)])
    assert empty == full and len(set(empty)) > 5


@pytest.mark.parametrize("size", [(1024, 768), (1280, 800)])
@pytest.mark.parametrize("language", ["de", "en"])
def test_the_table_of_tools_is_whole(driver, rig, size, language):
    for number in (3, 12):
        use = rig.watch.log.tools.uses[number] = Use(number, 6.0)
        use.cut_s, use.volume, use.peak, use.stops, use.limited_s[1] = 12345.6, 2e6, 123456.0, 12, 1234.5
    opened(driver, rig, f"?lang={language}", size)
    panel_browser.wait(driver, "document.querySelectorAll('#tool-rows tr').length === 2", "the tools")
    inside, needed = driver.execute_script(
        "const e = document.getElementById('load'); return [e.clientWidth, e.scrollWidth]"
    )
    assert needed <= inside
    right = driver.execute_script(
        "return Math.max(...Array.from(document.querySelectorAll('#tools th, #tools td'), (e) => "
        "e.getBoundingClientRect().right))"
    )
    assert right <= driver.execute_script("return document.getElementById('load').getBoundingClientRect().right")


@pytest.mark.parametrize(
    "language, words, part", [("en", "Assumed stock", "New part"), ("de", "Angenommenes Rohteil", "Neues Teil")]
)
def test_an_assumed_stock_is_marked(driver, rig, language, words, part):
    """What depends on it has a star, as has a tool that only comments describe; a confirmed stock has neither.  All of
    it fits into the column."""
    star = (
        "return Array.from(document.querySelectorAll('dt'), (e) => getComputedStyle(e, "
        "'::after').content.includes('*') ? e.nextElementSibling.id : '').filter(String)"
    )
    shown = "return ['assumed', 'assumed-figures'].map((id) => document.getElementById(id).offsetHeight > 0)"
    opened(driver, rig, f"?lang={language}")
    assert (
        driver.execute_script(shown) == [False, False]
        and driver.execute_script(star) == []
        and text(driver, "air") == "-"
    )
    rig.machine.values.update(
        certain=0.0,
        tool_assumed=1.0,
        cut_time=69.0,
        air_time=31.0,
        peak_rate=41000.0,
        mean_rate=9000.0,
        run_time=7200.0,
        mrr=123456.0,
    )
    rig.machine.tasks["running"] = True
    reached(driver, "air", "31 %")
    assert (
        driver.execute_script(shown) == [True, True]
        and text(driver, "assumed").startswith(words)
        and text(driver, "new-part") == part
    )
    assert driver.execute_script(star) == "rate share predicted area ahead depth tool peak mean air removed".split()
    inside, needed = driver.execute_script(
        "const e = document.getElementById('load'); return [e.clientWidth, e.scrollWidth]"
    )
    assert needed <= inside
    driver.find_element("id", "new-part").click()
    reached(driver, "part-answer", "Locked" if language == "en" else "Gesperrt")
    rig.machine.values.update(certain=1.0, tool_assumed=0.0)
    panel_browser.wait(driver, "document.getElementById('assumed').hidden", "a confirmed stock")


def test_the_feed_that_is_cut(driver, rig):
    rig.machine.values.update(current_vel=9.7, programmed_vel=16.6, requested_vel=30.0)
    opened(driver, rig)
    reached(driver, "feed", "582 mm/min")
    assert text(driver, "programmed") == "996 mm/min"
    rig.machine.tasks["inch"] = True
    reached(driver, "feed", "22.91 in/min")


@pytest.mark.parametrize(
    "turns, inch, words",
    [(50.0, False, "0.0970 mm"), (-50.0, True, "0.00382 in"), (0.0, False, "-")],
    ids=["forward", "backward", "at rest"],
)
def test_the_feed_per_tooth(driver, rig, turns, inch, words):
    """9.7 mm/s by two edges at 3,000 turns a minute."""
    rig.machine.values.update(current_vel=9.7, flutes=2.0, revolutions=turns)
    rig.machine.tasks["inch"] = inch
    opened(driver, rig)
    reached(driver, "feed", "582 mm/min" if not inch else "22.91 in/min")
    assert text(driver, "tooth") == words
    rig.machine.values["flutes"] = 0.0
    panel_browser.wait(driver, "document.getElementById('tooth').textContent === '-'", "unknown edges")


def test_the_part_of_the_work(driver, rig):
    rig.machine.values["work"] = 35.0
    opened(driver, rig)
    reached(driver, "work", "35 %")


def unlocked(driver):
    assert panel_browser.enter_token(driver, TOKEN)[1:] == ["", "Unlocked"]


@pytest.mark.parametrize("failed, words", [(False, "it has ended"), (True, "ended with an error")])
def test_a_line_that_has_ended(driver, rig, failed, words):
    opened(driver, rig)
    unlocked(driver)
    driver.find_element("id", "enter").click()
    panel_browser.wait(driver, "document.getElementById('code').options.length", "the codes")
    assert panel_browser.typed(driver, "M252", "")["run"]
    rig.machine.tasks["idle"] = False
    assert panel_browser.pressed_run(driver).startswith("running")
    looks = rig.watch.number
    rig.wait(lambda: rig.watch.number > looks + 10)
    assert text(driver, "entry-says").startswith("running")
    rig.machine.tasks.update(idle=True, failed=failed)
    reached(driver, "entry-says", words)


# What comes of the stream waits until let_go() is called.
HELD = """const read = ReadableStreamDefaultReader.prototype.read;
    const held = new Promise((done) => { window.let_go = done; });
    ReadableStreamDefaultReader.prototype.read = async function () {
        const found = await read.call(this);
        await held;
        return found;
    }"""


def test_looks_of_before_it_do_not_end_a_line(driver, rig):
    """A page that is late reads them when the line is handed over: the machine was idle in them."""
    opened(driver, rig)
    unlocked(driver)
    driver.find_element("id", "enter").click()
    panel_browser.wait(driver, "document.getElementById('code').options.length", "the codes")
    assert panel_browser.typed(driver, "M252", "")["run"]
    driver.execute_script(HELD)
    looks = rig.watch.number
    rig.wait(lambda: rig.watch.number > looks + 5)
    rig.machine.tasks["idle"] = False
    assert panel_browser.pressed_run(driver).startswith("running")
    looks = rig.watch.number
    driver.execute_script("let_go()")
    panel_browser.wait(driver, f"chipwise.state.look > {looks + 2}", "the looks after it")
    assert text(driver, "entry-says").startswith("running")
    rig.machine.tasks["idle"] = True
    reached(driver, "entry-says", "it has ended")


def test_the_alarm_of_a_move_of_mdi(driver, rig):
    rig.machine.tasks["auto"] = False
    rig.machine.values.update(guard_reason=float(GuardReason.RAPID_CONTACT), guard_line=4711.0, guard_distance=3.1)
    opened(driver, rig)
    panel_browser.wait(driver, "document.querySelector('#alarm-list li')", "the alarm")
    shown = driver.find_element("css selector", "#alarm-list li").text
    assert "MDI" in shown and "4711" not in shown


# ---- why a button cannot be pressed ----------------------------------------------------------------------------------


def reason(driver, name, where):
    """Press a button that cannot be pressed; -> its hint, the words that appear.  An answer about a line, late on a
    busy computer, may take their place: once more."""
    button = driver.find_element("id", name)
    panel_browser.wait(driver, f"document.getElementById('{name}').hasAttribute('aria-disabled')", name)
    assert button.get_attribute("aria-disabled") == "true"
    for _ in range(3):
        driver.execute_script("document.getElementById(arguments[0]).textContent = ''", where)
        button.click()
        if text(driver, where) == button.get_attribute("title"):
            break
    return button.get_attribute("title"), text(driver, where)


def test_reasons(driver, rig):
    """As a hint for a pointer, as words after a press for a finger."""
    opened(driver, rig)
    panel_browser.wait(
        driver, "document.getElementById('guard-rapid').title.startsWith('Locked')", "the reason of the guard"
    )
    for name, where, words in (
        ("guard-rapid", "guard-answer", "Locked: enter the token first"),
        ("this-run", "stock-note", "No program has begun on this stock yet"),
        ("before", "stock-note", "No program has begun on this stock yet"),
    ):
        assert reason(driver, name, where) == (words, words)
    unlocked(driver)
    driver.find_element("id", "enter").click()
    panel_browser.wait(driver, "document.getElementById('code').options.length", "the codes")
    panel_browser.typed(driver, "G13", "1", enter=False)
    for name, words in (("entry-run", "Draw the line first"), ("entry-copy", "There is no line yet")):
        assert reason(driver, name, "entry-says") == (words, words)
    rig.machine.tasks["idle"] = False
    panel_browser.wait(
        driver, "document.getElementById('guard-flute').title.includes('under way')", "the guard's reason"
    )


def test_the_reason_on_another_computer(driver, rig, monkeypatch):
    monkeypatch.setattr(visitors, "is_local", lambda _address, _served: False)
    opened(driver, rig)
    driver.find_element("id", "enter").click()
    panel_browser.wait(driver, "document.getElementById('code').options.length", "the codes")
    words = "From another computer a line is drawn with the token only"
    assert reason(driver, "entry-draw", "entry-says") == (words, words)
    unlocked(driver)
    assert panel_browser.typed(driver, "M252", "")["run"]


def test_no_button_is_without_a_reason(driver, rig):
    opened(driver, rig)
    time.sleep(0.5)
    bare = driver.execute_script(
        "return Array.from(document.querySelectorAll('button')).filter((e) => e.disabled || "
        "e.hasAttribute('aria-disabled') && !e.title).map((e) => e.id)"
    )
    assert bare == []


def test_what_limits_the_feed_at_a_fault(driver, rig):
    """A fault leaves the feed at F although stock and tool are known; its sentence is among the alarms."""
    rig.machine.values.update(mode=1.0, target=6000.0, limited_by=float(LimitedBy.FALLBACK))
    opened(driver, rig)
    reached(driver, "limit", "no stock or tool known: F as programmed")
    rig.machine.values.update(fault=1.0, fault_code=float(Fault.NO_MONITOR), ready=0.0)
    reached(driver, "limit", "a fault, see Alarms: F as programmed")
    reached(driver, "alarm-list", "chipwise-monitor does not answer; start")
