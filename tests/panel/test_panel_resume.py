# SPDX-License-Identifier: GPL-2.0-or-later
"""Resume on the page of `chipwise panel`: what chipwise resume says and writes, with the work offsets in force, and
opened; nothing is started."""

import json
from dataclasses import replace

import pytest

from chipwise.errors import CycleError
from chipwise.panel import entry
from chipwise.stock import store
from support import panel_browser
from support.panel_rig import TOKEN, asking, posted, serving
from support.resume_page import OPTIONS, SCENE, Mdi
from support.resume_stop import Stop

pytestmark = pytest.mark.usefixtures("forked_readers")


@pytest.fixture
def shop(tmp_path):
    """(rig, machine, Stop)."""
    stop = Stop(tmp_path)
    machine = Mdi(stop.program)
    made = entry.Lines(str(stop.ini), asking(machine))
    with serving(TOKEN, lines=made) as rig:
        yield rig, machine, stop


def test_it_is_chipwise_resume(shop, tmp_path):
    """Planned on this computer without the token; written with it, byte by byte what the command writes, and opened."""
    rig, machine, stop = shop
    out = tmp_path / "part.resume.ngc"
    status, found = posted(rig, "/resume", OPTIONS, token=None)
    assert (
        status == 200
        and found["program"] == "part.ngc"
        and found["file"] == "part.resume.ngc"
        and set(found) == {"resume", "program", "said", "file"}
    )
    assert stop.resume("--plan")[1].splitlines() == found["said"]
    for token in (None, "wrong-token-9"):
        assert (
            posted(rig, "/go-on", {"resume": found["resume"]}, token=token)[0] == 403
            and not out.exists()
            and not machine.opened
        )
    assert posted(rig, "/go-on", {"resume": found["resume"]}, origin="http://evil.example")[0] == 403
    assert posted(rig, "/go-on", {"resume": found["resume"]}) == (200, {"file": "part.resume.ngc"})
    assert machine.opened == [str(out)]
    made, slot = out.read_bytes(), stop.ini.parent / "stock" / "slot9.stock"
    assert store.read(str(slot))[0].removed == pytest.approx(stop.removed, abs=1e-6)
    assert stop.resume("-o", str(tmp_path / "own.ngc"))[0] == 0 and (tmp_path / "own.ngc").read_bytes() == made
    # the new program is loaded now, and goes on with part.ngc: that one is planned again
    status, again = posted(rig, "/resume", {**OPTIONS, "seconds": 4.0, "broke": True})
    assert (
        status == 200
        and again["program"] == "part.ngc"
        and "4 s of program time before that" in " ".join(again["said"])
    ), again
    assert (
        posted(rig, "/go-on", {"resume": again["resume"]}) == (200, {"file": "part.resume.ngc"})
        and b"M0 (put a new tool" in out.read_bytes()
    )


def test_the_work_offset_that_is_in_force(shop):
    """Touched off since the start of LinuxCNC: its parameter file does not have it yet."""
    rig, machine, stop = shop
    (stop.ini.parent / "mill.var").write_text("5220 1\n5221 7.5\n5222 0\n5223 0\n")
    assert "offsets" in stop.resume("--plan")[2]
    status, found = posted(rig, "/resume", OPTIONS)
    assert status == 200 and any("0.000 mm off the path" in text for text in found["said"]), found
    machine.offsets = {**SCENE, "offset": [7.5, 0.0, 0.0]}
    assert "offsets" in posted(rig, "/resume", OPTIONS)[1]["error"]


@pytest.mark.parametrize(
    "spoil, said",
    [
        (lambda m, s: setattr(m, "state", replace(m.state, idle=False)), "a program or a command is under way"),
        (lambda m, s: setattr(m, "state", replace(m.state, program="/other.ngc")), "another program is loaded"),
        (lambda m, s: setattr(m, "state", replace(m.state, program="")), "no program is loaded"),
        (lambda m, s: setattr(m, "offsets", {**SCENE, "offset": [2.5, 0.0, 0.0]}), "work offsets"),
        (lambda m, s: (s.cut_to(s.index + 2000), s.keep()), "has changed since the plan"),
        (lambda m, s: s.journal.write_bytes(b"chipwise kept 1\nxx"), "the kept stock cannot be used"),
        (lambda m, s: s.program.with_name("part.resume.ngc").write_text("G0 X0\nM2\n"), "is not of chipwise resume"),
        (lambda m, s: s.program.with_name("part.resume.ngc").mkdir(), "is not of chipwise resume"),
    ],
)
def test_a_sentence_and_nothing_is_written(shop, spoil, said):
    rig, machine, stop = shop
    number = posted(rig, "/resume", OPTIONS)[1]["resume"]
    spoil(machine, stop)
    before = sorted(path.name for path in stop.program.parent.iterdir())
    status, words = posted(rig, "/go-on", {"resume": number})
    assert status == 409 and said in words and "\n" not in words, words
    assert (
        sorted(path.name for path in stop.program.parent.iterdir()) == before
        and not machine.opened
        and not list(stop.journal.parent.glob("slot*"))
    )
    assert "plan it again" in posted(rig, "/go-on", {"resume": number})[1]  # once


def test_what_cannot_be_planned(shop):
    rig, machine, stop = shop
    for body in (
        {"line": 0},
        {"line": "3"},
        {"line": True},
        {"line": 2.5},
        {"seconds": -1},
        {"seconds": 1e9},
        {"seconds": "3"},
        {"broke": 1},
    ):
        assert posted(rig, "/resume", {**OPTIONS, **body})[0] == 400, body
    assert posted(rig, "/go-on", {"resume": "1"})[0] == 400 and posted(rig, "/go-on", {"resume": 1})[0] == 409
    assert posted(rig, "/resume", OPTIONS, origin=None)[0] == 403
    machine.state = replace(machine.state, at_rest=False)
    assert "under way, or the machine moves" in posted(rig, "/resume", OPTIONS)[1]["error"]
    stop.journal.unlink()
    machine.state = replace(machine.state, at_rest=True)
    assert "no stock is kept in" in posted(rig, "/resume", OPTIONS)[1]["error"]


def test_where_linuxcnc_does_not_open_it(shop, tmp_path):
    """It is written all the same, and the page says that it is."""
    rig, machine, _stop = shop

    def refuses(path):
        raise CycleError("{path} is written, and LinuxCNC does not open it", "open it on its screen", path=path)

    machine.open_program = refuses
    status, words = posted(rig, "/go-on", {"resume": posted(rig, "/resume", OPTIONS)[1]["resume"]})
    assert (
        status == 409
        and "is written, and LinuxCNC does not open it; open it on its screen" in words
        and (tmp_path / "part.resume.ngc").exists()
    )


def test_a_folder_without_room(shop, monkeypatch):
    from chipwise.resume import running

    rig, machine, _stop = shop

    def full(*_values, **_names):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(running, "write_durable", full)
    status, words = posted(rig, "/go-on", {"resume": posted(rig, "/resume", OPTIONS)[1]["resume"]})
    assert (
        status == 409
        and "part.resume.ngc cannot be written: No space left on device; make room" in words
        and not machine.opened
    )


SECONDS = (
    "const i = document.getElementById('resume-seconds'); i.value = arguments[0]; i.dispatchEvent(new Event('input')); "
)


def fits(run):
    """Buttons large enough for a finger, and no wider page than the window."""
    small = run(
        "return Array.from(document.querySelectorAll('#resume button')).filter((b) => b.offsetHeight < 34 || "
        "b.offsetWidth < 34).map((b) => b.id)"
    )
    assert small == [] and run("return document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_in_a_browser(shop, tmp_path):
    """Open, read the plan, say that the tool broke, write and open."""
    rig, machine, _stop = shop
    out = tmp_path / "part.resume.ngc"
    driver = panel_browser.browser(tmp_path / "browser")
    try:
        rig.looks()
        panel_browser.opened(driver, rig.url + "/")

        def run(script, *values):
            return driver.execute_script(script, *values)

        def says(text):
            panel_browser.wait(
                driver, f"document.getElementById('resume-says').textContent.includes({json.dumps(text)})", text
            )

        run("document.getElementById('resume-open').click()")
        says("enter the token to write it")
        sentences = "return Array.from(document.querySelectorAll('#resume-said li'), (e) => e.textContent)"
        first = run(sentences)
        assert first[0].startswith("The stock is that of kept.journal") and any(
            "It goes on in line" in text for text in first
        )
        assert (
            run("return document.getElementById('resume-confirm').disabled")
            and run("return document.getElementById('resume-program').textContent") == "part.ngc"
        )
        run("sessionStorage.setItem('chipwise-token', arguments[0])", TOKEN)
        run(SECONDS + "document.getElementById('resume-plan').click()", "x")
        says("x is not a number")
        run(SECONDS + "document.getElementById('resume-broke').click()", "6.5")
        assert run(sentences) == []
        run("document.getElementById('resume-plan').click()")
        says("Nothing moves until you start it: part.resume.ngc")
        assert any("6.5 s of program time before that" in text for text in run(sentences)) and any(
            "new tool" in text for text in run(sentences)
        )
        assert not out.exists() and not machine.opened
        fits(run)
        run("document.getElementById('resume-confirm').click()")
        says("It is written and open; look at it, then start it: part.resume.ngc")
        assert (
            machine.opened == [str(out)]
            and out.exists()
            and run("return document.getElementById('resume-confirm').disabled")
        )
        assert [one["message"] for one in driver.get_log("browser") if one["level"] == "SEVERE"] == []
    finally:
        driver.quit()
