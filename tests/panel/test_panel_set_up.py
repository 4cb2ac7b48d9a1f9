# SPDX-License-Identifier: GPL-2.0-or-later
"""Set up on the page of `chipwise panel`: the loaded program measured, its stock corrected, and the job file, which is
the one of chipwise setup."""

import json
from dataclasses import replace

import pytest

from chipwise.program.records import Frame
from chipwise.entry import mdi
from chipwise.panel import entry
from chipwise.setup import job as jobs
from support import panel_browser
from support.check_runs import mill_with_tools
from support.panel_rig import TOKEN, asking, posted, serving
from support.setup_runs import chipwise_setup
from support.scenes import SCENE

SLOT = "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG55 G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"
STOCK = [0, 0, -20, 100, 60, 0]
AT = (12.0, 34.0, 5.6)  # the tip, machine coordinates


class Mdi:
    """entry/mdi.py of a machine that the test sets by hand."""

    def __init__(self, program):
        self.state = mdi.State(program=str(program))

    def read(self):
        return self.state

    def scene(self):
        return SCENE

    def tip(self, frame):
        return (frame or Frame()).to_work(AT)


@pytest.fixture
def shop(tmp_path):
    """(rig, machine, path of the program)."""
    program, machine = tmp_path / "part.ngc", Mdi(tmp_path / "part.ngc")
    program.write_text(SLOT)
    ini = mill_with_tools(tmp_path)
    made = entry.Lines(str(ini), asking(machine))
    with serving(TOKEN, lines=made) as rig:
        yield rig, machine, program


def test_it_is_the_job_of_chipwise_setup(shop, tmp_path):
    """Measured on this computer without the token; confirmed with it; byte by byte what --yes writes."""
    rig, _machine, program = shop
    job = program.with_name("part.job.toml")
    status, found = posted(rig, "/measure", {"stock": STOCK, "material": "6061"}, token=None)
    (tool,) = found["tools"]
    assert (
        status == 200
        and found["stock"] == STOCK
        and found["source"] == "option"
        and tool["target_mm3_min"] == pytest.approx(9600, rel=0.01)
        and not found["confirmed"]
    )
    assert found["program"] == "part.ngc" and not set(found) & {"job", "frame", "path_of_program"}
    ends = [p for p in found["path"] if p[3] == 0]
    assert ends[-1][:3] == pytest.approx([110, 30, -4], abs=0.01) and any(p[3] for p in found["path"])
    for token in (None, "wrong-token-9"):
        assert posted(rig, "/confirm", {"measured": found["measured"]}, token=token)[0] == 403 and not job.exists()
    assert posted(rig, "/confirm", {"measured": found["measured"]}, origin="http://evil.example")[0] == 403
    assert posted(rig, "/confirm", {"measured": found["measured"]}) == (200, {"file": "part.job.toml"})
    written = job.read_text()
    assert jobs.read(str(job)).low == (0, 0, -20)
    job.unlink()
    status, *_ = chipwise_setup(
        tmp_path,
        None,
        "--stock",
        *map(str, STOCK),
        "--material",
        "6061",
        "--yes",
        machine=tmp_path / "machine" / "mill.ini",
    )
    assert status == 0 and job.read_text() == written
    assert posted(rig, "/measure", {"stock": STOCK, "material": "6061"})[1]["confirmed"]


def test_the_tool_is_a_corner(shop):
    """In the coordinates of the first move, which are those of G55 here."""
    rig, *_ = shop
    assert posted(rig, "/corner", {"measured": None}) == (200, {"corner": list(AT)})
    number = posted(rig, "/measure", {"stock": None, "material": ""})[1]["measured"]
    assert posted(rig, "/corner", {"measured": number})[1]["corner"] == pytest.approx(AT)


CLAMPED = SLOT.replace("T1 M6\n", "G10 L2 P1 X10 Y20 Z-5 R90\nT1 M6\n").replace("G55 ", "")
OF_MACHINE = "[set_up.2.clamp.jaw]\nbox = [40, -12, -20, 60, -2, 8]\n"
OWN = "\n[clamp.block]\ncylinder = [50, 5, -20, 3, 8]\n"


def put_clamps(program, folder):
    """Two clamps into the job file of a program: one of set-up 2 of the machine, one of its own."""
    (folder / "clamps.toml").write_text(OF_MACHINE)
    job = program.with_name("part.job.toml")
    job.write_text(job.read_text().replace("[stock]", "clamps = 2\n\n[stock]") + OWN)
    return job


def test_its_clamps(shop, tmp_path):
    """Named, in the coordinates of the first move; Confirm keeps them."""
    rig, _machine, program = shop
    program.write_text(CLAMPED)
    found = posted(rig, "/measure", {"stock": STOCK, "material": ""})[1]
    assert found["clamps"] == [] and posted(rig, "/confirm", {"measured": found["measured"]})[0] == 200
    job = put_clamps(program, tmp_path / "machine")
    found = posted(rig, "/measure", {"stock": STOCK, "material": ""})[1]
    jaw, block = found["clamps"]
    assert jaw["name"] == "clamp jaw of set-up 2" and block["name"] == "clamp block of the set-up of part.ngc"
    shape, turn, middle, half = jaw["seen"]
    assert (
        (shape, turn % 180) == (0, 90)
        and [*middle, *half] == pytest.approx([-27, -40, 10, 5])
        and [jaw["bottom"], jaw["top"]] == pytest.approx([-15, 13])
    )
    shape, _turn, middle, half = block["seen"]
    assert (
        shape == 1
        and [*middle, *half] == pytest.approx([50, 5, 4, 4])
        and [block["bottom"], block["top"]] == pytest.approx([-20, 3])
    )
    before = jobs.read(str(job))
    assert posted(rig, "/confirm", {"measured": found["measured"]})[0] == 200
    assert (jobs.read(str(job)).set_up, jobs.read(str(job)).clamps) == (2, before.clamps) and list(before.clamps) == [
        "block"
    ]


@pytest.mark.parametrize(
    "spoil, said",
    [
        (lambda m, p: setattr(m, "state", replace(m.state, idle=False)), "a program or a command is under way"),
        (lambda m, p: setattr(m, "state", replace(m.state, program="/other.ngc")), "another program is loaded"),
        (lambda m, p: p.write_text(SLOT + "\n"), "was changed while it was read"),
        (lambda m, p: p.unlink(), "was changed while it was read"),
        (lambda m, p: p.with_name("part.job.toml").write_text("]["), "is not a job file of chipwise"),
        (lambda m, p: p.with_name("part.job.toml").symlink_to(p), "is a link"),
        (lambda m, p: p.with_name("part.job.toml").mkdir(), "cannot be read"),
    ],
)
def test_a_sentence_and_nothing_is_written(shop, spoil, said):
    rig, machine, program = shop
    number = posted(rig, "/measure", {"stock": STOCK, "material": ""})[1]["measured"]
    spoil(machine, program)
    before = sorted(path.name for path in program.parent.iterdir())
    status, words = posted(rig, "/confirm", {"measured": number})
    assert status == 409 and said in words and sorted(path.name for path in program.parent.iterdir()) == before
    assert "measure it again" in posted(rig, "/confirm", {"measured": number})[1]  # once


def test_what_cannot_be_measured(shop):
    rig, machine, program = shop
    for body in (
        {"stock": [1, 2, 3], "material": ""},
        {"stock": [1, 2, 3, 4, 5, "6"], "material": ""},
        {"stock": [1, 2, 3, 4, 5, 1e9], "material": ""},
        {"stock": None, "material": "a\nb"},
        {"stock": None, "material": 5},
        {"stock": [0, 0, 0, 1, 1, True], "material": ""},
    ):
        assert posted(rig, "/measure", body)[0] == 400, body
    assert "no extent" in posted(rig, "/measure", {"stock": [0, 0, 0, -1, 1, 1], "material": ""})[1]["error"]
    program.write_text(SLOT.replace("T1 M6", "").replace("S8000", "G1 Y[1/0]\nS8000"))
    assert posted(rig, "/measure", {"stock": STOCK, "material": ""})[1]["error"]
    assert posted(rig, "/measure", {"stock": STOCK, "material": ""}, origin=None)[0] == 403
    machine.state = replace(machine.state, program="")
    assert "no program is loaded" in posted(rig, "/measure", {"stock": None, "material": ""})[1]["error"]
    assert posted(rig, "/confirm", {"measured": 1})[0] == 409 and posted(rig, "/confirm", {"measured": "1"})[0] == 400


class Page:
    """The set-up on the page in a browser."""

    def __init__(self, driver):
        self.driver = driver

    def run(self, script, *values):
        return self.driver.execute_script(script, *values)

    def says(self, text):
        panel_browser.wait(
            self.driver, f"document.getElementById('setup-says').textContent.includes({json.dumps(text)})", text
        )

    def numbers(self):
        return [self.run(f"return document.getElementById('setup-n{k}').value") for k in range(6)]


def open_it(page):
    """As assumed from the path, and a corner taken from the tool."""
    page.run("document.getElementById('setup-open').click()")
    page.says("enter the token to confirm")
    assert (
        page.run("return document.getElementById('setup-confirm').disabled")
        and page.run("return document.querySelectorAll('#setup-rows tr').length") == 1
    )
    assert page.run("return document.getElementById('setup-source').textContent") == "assumed from the path"
    page.run("sessionStorage.setItem('chipwise-token', arguments[0])", TOKEN)
    assert [float(text) for text in page.numbers()][:3] == pytest.approx([-13, 27, -4], abs=0.01)
    page.run("document.getElementById('setup-take1').click()")
    panel_browser.wait(page.driver, "document.getElementById('setup-n3').value === '12'", "the corner of the tool")


def add_an_allowance(page):
    """Numbers are corrected, 1 mm is added; the picture has it."""
    for k, text in enumerate(("0", "0", "-20", "99", "59", "-1")):
        page.run(
            "const i = document.getElementById('setup-n' + arguments[0]); i.value = arguments[1]; i.dispatchEvent(new "
            "Event('input'))",
            k,
            text,
        )
    page.run("document.getElementById('setup-allowance').value = '1'; document.getElementById('setup-add').click()")
    assert page.numbers() == ["-1", "-1", "-20", "100", "60", "0"]
    rectangles = page.run(
        "return Array.from(document.querySelectorAll('#setup-picture rect')).map((r) => [r.width.baseVal.value, "
        "r.height.baseVal.value])"
    )
    assert (
        rectangles == [[101, 61], [101, 20]]
        and page.run("return document.querySelectorAll('#setup-picture polyline').length") >= 4
    )
    assert page.run("return document.getElementById('setup-confirm').disabled")


def measure_and_confirm(page, job):
    """The table has the tool, and the job file what is confirmed."""
    page.run("document.getElementById('setup-measure').click()")
    page.says("Look at it, then confirm")
    cells = page.run("return Array.from(document.querySelectorAll('#setup-rows td')).map((c) => c.textContent)")
    assert cells[0] == "1" and cells[8].endswith("cm3/min") and cells[9] == "2 x F" and not job.exists()
    page.run("document.getElementById('setup-confirm').click()")
    page.says("part.job.toml")
    found = jobs.read(str(job))
    assert found.low == (-1, -1, -20) and found.high == (100, 60, 0) and found.source == "option"


def see_clamps(page, program, folder):
    """Jaw and block are drawn from above, then from the front."""
    assert page.run("return document.getElementById('setup-clamps').textContent") == "No clamps"
    put_clamps(program, folder)
    page.run("document.getElementById('setup-measure').click()")
    panel_browser.wait(
        page.driver,
        "document.getElementById('setup-clamps').textContent.includes('clamp block of the set-up of part.ngc')",
        "the clamps",
    )
    drawn = page.run(
        "return Array.from(document.querySelectorAll('#setup-picture polygon')).map((p) => [p.getBBox().width, "
        "p.getBBox().height])"
    )
    assert [size for pair in drawn for size in pair] == pytest.approx(
        [20, 10, 8, 8, 20, 28, 8, 23], abs=0.01
    )  # jaw and block from above, then from the front


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_in_a_browser(shop, tmp_path):
    """Open, correct a number, take a corner from the tool, add an allowance, measure, confirm."""
    rig, _machine, program = shop
    driver = panel_browser.browser(tmp_path / "browser")
    try:
        rig.looks()
        panel_browser.opened(driver, rig.url + "/")
        page = Page(driver)
        open_it(page)
        add_an_allowance(page)
        measure_and_confirm(page, program.with_name("part.job.toml"))
        see_clamps(page, program, tmp_path / "machine")
        assert [
            one["message"]
            for one in driver.get_log("browser")
            if one["level"] == "SEVERE" and "403" not in one["message"]
        ] == []
        small = page.run(
            "return Array.from(document.querySelectorAll('#setup button')).filter((b) => b.offsetHeight < 34 || "
            "b.offsetWidth < 34).map((b) => b.id)"
        )
        assert small == [] and page.run("return document.documentElement.scrollWidth <= innerWidth")
    finally:
        driver.quit()
