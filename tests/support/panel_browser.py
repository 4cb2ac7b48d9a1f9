#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Opens the page of `chipwise panel` in Debian's chromium, reads, clicks and types, and prints what it saw as one JSON
object.

    panel_browser.py URL FOLDER [TOKEN]         a whole visit, in the LinuxCNC of a test; FOLDER: chromium's own
    panel_browser.py URL FOLDER TOKEN LINES     the same for lines that are typed and run
    picture(url, path)                          one screenshot, of a section with the button that opens it
    (tools/pictures/panel.py)

The colours come from the page's own canvas, in CSS pixels along its middle column and row; what they should be,
panel_colours says.
"""

import json
import os
import re
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
ITEMS = os.path.join(ROOT, "remap", "chipwise", "panel", "colours.toml")
SIZE = (1024, 768)
WAIT_S = 200.0
LATE = ("No answer from LinuxCNC", "Keine Antwort von LinuxCNC")
STARTS = 3  # selenium gives chromedriver 30 s, and that chromium 60 s, which a busy computer may need
AHEAD_S = 380.0  # the process that reads the path is a nice one, and the cut of test_panel_browser.py takes 420 s
# Pixels of the canvas along its middle column, from the top, and along a row at a share of its height.
COLUMN = """const v = chipwise.view.canvas, c = document.createElement('canvas');
    c.width = v.width; c.height = v.height;
    const x = c.getContext('2d'); x.drawImage(v, 0, 0);
    return Array.from(x.getImageData(v.width >> 1, 0, 1, v.height).data)"""


BARE = """chipwise.ahead.show({path: false, loops: false}); chipwise.view.path([]);
    chipwise.view.tool(null); chipwise.view.draw();
    chipwise.ahead.show({path: true, loops: true});"""
# How many pixels of the stock's picture have nearly the colours of the second argument, drawn with or without path
# ahead and contours.
INKS = """const v = chipwise.view, c = document.createElement('canvas');
    chipwise.ahead.show({path: arguments[0], loops: arguments[0]}); v.path([]); v.tool(null); v.draw();
    chipwise.ahead.show({path: true, loops: true});
    c.width = v.canvas.width; c.height = v.canvas.height;
    const x = c.getContext('2d'); x.drawImage(v.canvas, 0, 0);
    const data = x.getImageData(0, 0, c.width, c.height).data, found = arguments[1].map(() => 0);
    for (let k = 0; k < data.length; k += 4) {
        arguments[1].forEach((rgb, n) => {
            if (rgb.every((value, i) => Math.abs(value - data[k + i]) < 25)) found[n]++;
        });
    }
    return found"""


def missing():
    """Why no browser can be used here, "" if one can."""
    import importlib.util
    import shutil

    if not shutil.which("chromium") or not shutil.which("chromedriver") or importlib.util.find_spec("selenium") is None:
        return "no browser: apt-get install chromium chromium-driver python3-selenium"
    return ""


def browser(folder, size=SIZE):
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    for word in (
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--no-first-run",
        "--disable-dev-shm-usage",
        f"--user-data-dir={folder}/chromium",
        "--lang=en",
        "--hide-scrollbars",
    ):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    options.binary_location = "/usr/bin/chromium"
    for more in range(STARTS - 1, -1, -1):
        try:
            driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
            break
        except WebDriverException:
            if not more:
                raise
    driver.set_script_timeout(WAIT_S)
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False},
    )
    return driver


def wait(driver, script, what, patience_s=WAIT_S):
    """Until a script gives something true; -> it."""
    end = time.monotonic() + patience_s
    while True:
        found = driver.execute_script("return " + script)
        if found:
            return found
        assert time.monotonic() < end, (
            f"not reached: {what}; the page has {driver.execute_script('return JSON.stringify(chipwise.state)')}"
        )
        time.sleep(0.05)


def opened(driver, url):
    """Open the page and wait for its first picture."""
    driver.get(url)
    wait(driver, "window.chipwise && chipwise.firstPicture", "the first picture")


def picture(url, path, folder, dark=False, section="", reached="true"):
    driver = browser(folder)
    try:
        opened(driver, url)
        if dark != (driver.execute_script("return document.documentElement.dataset.theme") == "dark"):
            driver.find_element("id", "theme").click()
        wait(driver, "chipwise.ageMs.length > 10", "some pictures")
        if section:
            driver.find_element("id", section).click()
            wait(driver, reached, section)
        driver.save_screenshot(path)
    finally:
        driver.quit()


def figures(driver):
    """What the page shows while it has an answer: a busy computer may be late with one for a moment, and the page says
    so."""
    end = time.monotonic() + WAIT_S
    while (found := shown(driver))["status"] in LATE:
        assert time.monotonic() < end, found
    return found


def shown(driver):
    return {
        name: driver.find_element("id", name).text
        for name in (
            "status",
            "program",
            "rate",
            "target",
            "mode",
            "limit",
            "override",
            "area",
            "depth",
            "tool",
            "line",
            "peak",
            "mean",
            "rights",
        )
    }


def above(driver):
    """RGB along the middle column of the stock from above, drawn anew."""
    driver.find_element("id", "above").click()
    flat = driver.execute_script(BARE + COLUMN)  # in one: the page draws ten times a second
    return [flat[k : k + 3] for k in range(0, len(flat), 4)]


def run_column(driver):
    """As above(), what the program has cut in its colour; of the stock as it is, and as it was before the program; None
    without that."""
    if driver.execute_script("return document.getElementById('this-run').hasAttribute('aria-disabled')"):
        return None
    driver.find_element("id", "this-run").click()
    now = above(driver)
    driver.find_element("id", "this-run").click()
    driver.find_element("id", "before").click()
    return now, above(driver)


def ahead(driver):
    """What of the program is ahead: {points: the next ones, contours, pixels of each colour with and without, whether
    the button hides the path}."""
    driver.find_element("id", "above").click()
    inks = [[round(255 * v) for v in item_colours("light")[item]] for item in ("path_ahead", "target")]
    found = {
        "points": driver.execute_script("return chipwise.ahead.points.slice(0, 8)"),
        "contours": driver.execute_script("return chipwise.ahead.contours"),
        "with": driver.execute_script(INKS, True, inks),
        "without": driver.execute_script(INKS, False, inks),
    }
    for shown in ("hidden", "shown"):
        driver.find_element("id", "path-ahead").click()
        found[shown] = driver.execute_script("return chipwise.ahead.points.length")
    return found


def targets(driver):
    """[name, width, height] of what can be pressed, CSS pixels."""
    return driver.execute_script("""return Array.from(document.querySelectorAll('button, input, select'))
        .filter((e) => e.offsetParent)
        .map((e) => [e.id, e.getBoundingClientRect().width, e.getBoundingClientRect().height])""")


def visit(url, folder, token):
    driver = browser(folder)
    try:
        opened(driver, url)
        wait(driver, "chipwise.ageMs.length > 6", "some pictures")
        found = {
            "figures": figures(driver),
            "first_ms": driver.execute_script("return chipwise.firstPicture"),
            "late_ms": driver.execute_script("return chipwise.ageMs"),
            "webgl": driver.execute_script("return chipwise.view instanceof HeightView"),
            "targets": targets(driver),
            "state": driver.execute_script("return chipwise.state"),
            "column": above(driver),
            "overflow": driver.execute_script(
                "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
            ),
        }
        found["alarms"] = row_texts(driver, "#alarm-list li")
        wait(driver, "chipwise.ahead.points.length", "the path ahead", AHEAD_S)
        found["ahead"] = ahead(driver)
        found["background"] = driver.execute_script("return document.body.dataset.state")
        found["log"] = log(driver)
        if token:
            found["token"] = enter_token(driver, token)
        driver.find_element("id", "clear").click()
        found["after_clear"] = row_texts(driver, "#alarm-list li.active, #alarm-list li")
        found["messages"] = [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
        found["run_column"] = run_column(driver)
        opened(driver, url + "/?flat&lang=de")
        found["flat"] = not driver.execute_script("return chipwise.view instanceof HeightView")
        found["flat_column"], found["german"] = above(driver), figures(driver)
        found["flat_run_column"] = run_column(driver)
        wait(driver, "chipwise.ahead.points.length", "the path ahead")
        found["flat_ahead"] = ahead(driver)
        return found
    finally:
        driver.quit()


def log(driver):
    """Rows of the log as it is shown: those of tools and of operations, each a list of texts; closed again."""
    driver.find_element("id", "log-open").click()
    wait(driver, "document.querySelectorAll('#log-operations tr').length", "the log")
    rows = [
        driver.execute_script(
            f"return Array.from(document.querySelectorAll('#{name} tr'), (row) => Array.from(row.cells, (e) => "
            f"e.textContent))"
        )
        for name in ("log-tools", "log-operations")
    ]
    overflow = driver.execute_script(
        "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    )
    driver.find_element("id", "log-close").click()
    return {
        "tools": rows[0],
        "operations": rows[1],
        "overflow": overflow,
        "stock": driver.find_element("id", "view").is_displayed(),
    }


def enter_token(driver, token):
    """A wrong one, then the right one; -> [what the page says to each, who may change]."""
    said = []
    driver.find_element("id", "unlock").click()
    for typed in ("wrong" + token, token):
        field = driver.find_element("id", "token-text")
        field.clear()
        field.send_keys(typed + "\n")
        wait(
            driver,
            "document.getElementById('token-answer').textContent || document.getElementById('token').hidden",
            "an answer",
        )
        said.append(driver.find_element("id", "token-answer").get_attribute("textContent"))
        driver.execute_script("document.getElementById('token-answer').textContent = ''")
    return [*said, driver.find_element("id", "rights").text]


# ---- a typed line -----------------------------------------------------------------------------------------------


def row_texts(driver, selector):
    """Texts of the rows that are shown, read at once: the page may draw them anew between two questions."""
    return driver.execute_script(
        "return Array.from(document.querySelectorAll(arguments[0])).map((row) => "
        "row.getClientRects().length ? row.innerText.replace(/[\\t ]+/g, ' ').trim() : '')",
        selector,
    )


def typed(driver, code, text, chop="", enter=True):
    """Choose a code and type its data and a chop size; -> what the page says after Enter, or while it is typed."""
    from selenium.webdriver.support.select import Select

    Select(driver.find_element("id", "code")).select_by_value(code)
    field = driver.find_element("id", "entry-line")
    field.clear()
    if chop:
        driver.find_element("id", "chop-size").clear()
        driver.find_element("id", "chop-size").send_keys(chop)
    driver.execute_script("document.getElementById('entry-says').textContent = ''")
    field.send_keys(text + ("\n" if enter else ""))
    wait(
        driver, "!['', 'Planning'].includes(document.getElementById('entry-says').textContent)", "words about the line"
    )
    wait(driver, "((e) => e.hidden || e.complete)(document.getElementById('entry-drawing'))", "the drawing")
    return {
        "line": driver.find_element("id", "entry-gcode").text,
        "says": driver.find_element("id", "entry-says").text,
        "wrong": row_texts(driver, "#field-rows tr.wrong"),
        "rows": row_texts(driver, "#field-rows tr"),
        "run": not driver.find_element("id", "entry-run").get_attribute("aria-disabled")
        and driver.find_element("id", "entry-run").is_displayed(),
        "drawn": driver.execute_script(
            "const e = document.getElementById('entry-drawing'); return e.hidden ? 0 : e.naturalWidth"
        ),
    }


def pressed_run(driver):
    """-> what the page says about the line that is to run."""
    before = driver.find_element("id", "entry-says").text
    driver.find_element("id", "entry-run").click()
    wait(driver, f"document.getElementById('entry-says').textContent !== {json.dumps(before)}", "an answer")
    return driver.find_element("id", "entry-says").text


def pressed_guard(driver, name):
    """-> [what the guard's button shows, what the page says], when one of them has changed and the switch is done."""
    shown = (
        "[document.getElementById('guard-%s').textContent, document.getElementById('guard-answer').textContent]" % name
    )
    wait(
        driver,
        f"['', 'A program or a command is under way'].includes(document.getElementById('guard-{name}').title)",
        "the right to switch",
    )
    driver.execute_script("document.getElementById('guard-answer').textContent = ''")
    before = driver.execute_script("return " + shown)
    driver.find_element("id", "guard-" + name).click()
    wait(driver, f"{shown}.join() !== {json.dumps(','.join(before))}", "the guard")
    # the pin may be seen before the answer has come, and until then nothing else can be changed
    wait(driver, f"document.getElementById('guard-{name}').title !== 'Being switched'", "the answer about the guard")
    return driver.execute_script("return " + shown)


def tool_changes(driver, number, texts):
    """Give a tool flute lengths in the section of tools; -> its rows at last, what the page says to each, its size and
    what can be pressed."""
    driver.find_element("id", "geometry-open").click()
    wait(driver, "document.querySelectorAll('#geometry-rows tr').length", "the tools")
    driver.execute_script(
        f"Array.from(document.querySelectorAll('#geometry-rows button')).find((e) => e.textContent === "
        f"'{number}').click()"
    )
    said = []
    for text in texts:
        field = driver.find_element("id", "geometry-flute_length")
        field.clear()
        field.send_keys(text + "\n")
        wait(driver, "document.getElementById('geometry-says').textContent", "words about the tool")
        said.append(driver.find_element("id", "geometry-says").text)
    rows = driver.execute_script(
        "return Array.from(document.querySelectorAll('#geometry-rows tr'), (row) => Array.from(row.cells, (e) => "
        "e.textContent))"
    )
    overflow = driver.execute_script(
        "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    )
    return {"rows": rows, "said": said, "overflow": overflow, "targets": targets(driver)}


def entry(url, folder, token, lines):
    """Type lines [[code, text, chop size or nothing], ..], and run each one that can be; change a tool before."""
    driver = browser(folder)
    try:
        opened(driver, url)
        found = []
        driver.find_element("id", "enter").click()
        wait(driver, "document.getElementById('code').options.length", "the codes")
        found.append(typed(driver, *lines[0]))
        enter_token(driver, token)
        guards = [pressed_guard(driver, "flute") for _ in range(2)]
        tools = tool_changes(driver, 1, ["x", "0", "21.5"])
        driver.find_element("id", "enter").click()
        for line in lines:
            answer = typed(driver, *line)
            found.append({**answer, "ran": pressed_run(driver) if answer["run"] else ""})
        return {
            "lines": found,
            "guards": guards,
            "tools": tools,
            "targets": targets(driver),
            "overflow": driver.execute_script(
                "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
            ),
            "messages": [one["message"] for one in driver.get_log("browser") if one["level"] == "SEVERE"],
        }
    finally:
        driver.quit()


# ---- what the colours should be ------------------------------------------------------------------------------------


def item_colours(theme):
    """{display item: (r, g, b) from 0 to 1} of colours.toml."""
    with open(ITEMS, encoding="utf-8") as file:
        found = re.findall(rf'\[(\w+)\][^\[]*?\n{theme} = "#(\w{{6}})"', re.sub(r"groups = .*\n", "", file.read()))
    return {name: tuple(int(value[k : k + 2], 16) / 255 for k in (0, 2, 4)) for name, value in found}


def level_colour(theme, depth_share):
    """RGB (0..255) of a level surface: 35 % everywhere, 65 % by the cosine to a lamp at (-0.4, -0.5, 0.8); what is cut,
    by its depth."""
    colours, light = item_colours(theme), 0.35 + 0.65 * 0.8 / (0.16 + 0.25 + 0.64) ** 0.5
    base = (
        colours["stock"]
        if depth_share <= 0
        else tuple(a + (b - a) * depth_share for a, b in zip(colours["stock_cut"], colours["stock_deep"]))
    )
    return [255 * light * value for value in base]


def parts(column, theme, shares):
    """How many pixels of a column have the colour of each depth (share of the box)."""
    wanted = [level_colour(theme, share) for share in shares]
    return [sum(max(abs(a - b) for a, b in zip(pixel, colour)) <= 3 for pixel in column) for colour in wanted]


if __name__ == "__main__":
    done = (
        entry(*sys.argv[1:4], json.loads(sys.argv[4]))
        if len(sys.argv) > 4
        else visit(sys.argv[1], sys.argv[2], "".join(sys.argv[3:]))
    )
    print(json.dumps(done))
