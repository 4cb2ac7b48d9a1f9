#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Presses Resume on the page of `chipwise panel` in Debian's chromium, reads the plan, writes and opens the program,
and prints what it saw as one JSON object.

    resume_visit.py URL FOLDER TOKEN        FOLDER: chromium's own, and for two pictures of the page

If a program cannot be planned or written, the page's words say so, in "plan" or "done".
"""

import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.dirname(HERE))

from support import panel_browser  # noqa: E402  the folder is put on the path above

SAYS = "document.getElementById('resume-says').textContent"
ASKED = ["The stop is being looked for", "Being done: "]


def pressed(driver, button):
    """Press a button of the section; -> what the page says to it at last."""
    driver.execute_script("document.getElementById('resume-says').textContent = ''")
    driver.find_element("id", button).click()
    panel_browser.wait(
        driver, f"!{json.dumps(ASKED)}.some((text) => {SAYS}.startsWith(text)) && {SAYS}", f"an answer to {button}"
    )
    return driver.find_element("id", "resume-says").text


def visit(url, folder, token):
    driver = panel_browser.browser(folder)
    try:
        panel_browser.opened(driver, url)
        panel_browser.enter_token(driver, token)
        found = {
            "plan": pressed(driver, "resume-open"),
            "said": panel_browser.row_texts(driver, "#resume-said li"),
            "program": driver.find_element("id", "resume-program").text,
            "file": "",
            "done": "",
        }
        driver.save_screenshot(os.path.join(folder, "plan.png"))
        if driver.find_element("id", "resume-confirm").is_enabled():
            found["done"] = pressed(driver, "resume-confirm")
            driver.save_screenshot(os.path.join(folder, "done.png"))
        found["overflow"] = driver.execute_script(
            "return [document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
        )
        found["messages"] = [one["message"] for one in driver.get_log("browser") if one["level"] == "SEVERE"]
        return found
    finally:
        driver.quit()


if __name__ == "__main__":
    print(json.dumps(visit(*sys.argv[1:4])))
