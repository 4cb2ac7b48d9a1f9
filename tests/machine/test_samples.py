# SPDX-License-Identifier: GPL-2.0-or-later
"""README's lines on stock copies of LinuxCNC's sample machines; tools/samples tries all of them."""

import os

import pytest

from support import samples, samples_table

pytestmark = pytest.mark.machine

IN_TEST = ["lathe", "gmoccapy", "remap/getting-started", "remap/getting-started, docs/user/install.md", "qtplasmac"]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    return samples.stage(str(tmp_path_factory.mktemp("installed")))


@pytest.mark.parametrize("name", IN_TEST)
def test_sample(name, installed, tmp_path):
    sample = samples.named(name)
    if samples.missing(sample):
        pytest.skip(samples.missing(sample))
    assert samples.verdict(sample, samples.run(sample, str(tmp_path), installed)) == ""


def test_twopass_is_refused_and_leaves_nothing_in_tmp(installed, tmp_path):
    """LinuxCNC's twopass.tcl writes each HAL file into /tmp, for good; in the sandbox it is a file of the sandbox."""
    name = f"mine{os.getpid()}.hal"

    def edit(ini):
        with open(os.path.join(os.path.dirname(ini), name), "w") as handle:
            handle.write("loadrt and2\naddf and2.0 servo-thread\n")
        replaced(os.path.basename(ini), "HALFILE = chipwise.hal", f"HALFILE = {name}\nHALFILE = chipwise.hal")(ini)

    sample = samples.named("twopass")
    result = samples.run(sample, str(tmp_path), installed, edit=edit)
    assert samples.verdict(sample, result) == ""
    assert f"twopass:found ./{name}" in result["output"]
    assert not os.path.exists(f"/tmp/tmp_{name}")


def test_a_rotary_axis_that_turns_ends_the_stock(installed, tmp_path):
    """The table with the stock on it turns by 5 degrees: said once, and M251 is refused until M250."""
    sample = samples.named("xyzac-trt")
    result = samples.run(sample, str(tmp_path), installed, after=["G1 C5 F6000", "G4 P0.5", "M251 P1 Q6"])
    assert result["pins"][samples.PINS[1]] == "FALSE" and result["pins"][samples.PINS[2]] == "23", result["pins"]
    said = {text for text in result["said"] if "since the stock was defined" in text or "M251" in text}
    assert len(said) == 2 and any("M251: no stock is defined" in text for text in said), result["said"]


def replaced(name, old, new):
    """edit(ini): in a file beside the INI file."""

    def edit(ini):
        path = os.path.join(os.path.dirname(ini), name)
        with open(path) as handle:
            text = handle.read()
        assert old in text, (path, old)
        with open(path, "w") as handle:
            handle.write(text.replace(old, new))

    return edit


@pytest.mark.parametrize(
    "line, words",
    [
        ("net mine motion.adaptive-feed", "motion.adaptive-feed is in use (signal mine)"),
        (
            "net mine motion.analog-out-01",
            "motion.analog-out-01 is in use (signal mine); load motmod with num_aio=7 and set [CHIPWISE]ANALOG_OUT = 4",
        ),
    ],
)
def test_a_pin_that_must_be_chipwises_alone(line, words, installed, tmp_path):
    def edit(ini):
        path = os.path.join(os.path.dirname(ini), "mine.hal")
        with open(path, "w") as handle:
            handle.write(line + "\n")
        replaced(os.path.basename(ini), "HALFILE = chipwise.hal", "HALFILE = mine.hal\nHALFILE = chipwise.hal")(ini)

    result = samples.run(samples.named("axis_mm"), str(tmp_path), installed, edit=edit)
    assert not result["started"] and any(words in said for said in result["said"]), result["output"]


EVERY_PIN = [
    "axis.x.pos-cmd",
    "axis.y.pos-cmd",
    "axis.z.pos-cmd",
    "motion.tooloffset.x",
    "motion.tooloffset.y",
    "motion.tooloffset.z",
    "motion.distance-to-go",
    "motion.requested-vel",
    "motion.current-vel",
    "motion.motion-type",
    "motion.program-line",
    "motion.coord-mode",
    "iocontrol.0.tool-number",
    "motion.feed-hold",
    "motion.feed-inhibit",
]
WRITTEN = EVERY_PIN[-2:]


@pytest.mark.parametrize("before", [True, False])
def test_every_pin_is_connected_by_others(before, installed, tmp_path):
    """Before chipwise.hal, and after it; in the second case the two pins chipwise writes are its own by then."""
    pins = [pin for pin in EVERY_PIN if before or pin not in WRITTEN]

    def edit(ini):
        path = os.path.join(os.path.dirname(ini), "mine.hal")
        with open(path, "w") as handle:
            handle.write("".join(f"net mine-{number} {pin}\n" for number, pin in enumerate(pins)))
        order = ["HALFILE = mine.hal", "HALFILE = chipwise.hal"]
        replaced(os.path.basename(ini), order[1], "\n".join(order if before else order[::-1]))(ini)

    sample = samples.named("axis_mm")
    sample = samples.Sample(
        sample.name, sample.path, sample.screen, joined=tuple(pin for pin in pins if pin not in WRITTEN)
    )
    assert samples.verdict(sample, samples.run(sample, str(tmp_path), installed, edit=edit)) == ""


def test_the_table_in_the_docs_is_that_of_the_rows():
    cells = samples_table.table_cells()
    assert set(cells) == {sample.name for sample in samples.SAMPLES}
    with open(samples_table.TABLE) as handle:
        assert handle.read().splitlines()[-len(samples.SAMPLES) - 2 :] == samples_table.table_lines(cells)


def test_a_run_in_which_axis_gave_up_is_done_again(monkeypatch):
    """As often as DRIVES; any other refusal is the row's."""

    def runs(**result):
        calls = []
        monkeypatch.setattr(
            samples, "driven", lambda: calls.append(0) or {"errors": [], "started": False, "output": "", **result}
        )
        samples.drive()
        return len(calls)

    assert runs(output=f"{samples.AXIS_WAITED}<0>, s.kinematics_type<0>") == samples.DRIVES
    assert runs() == runs(started=True, output=samples.AXIS_WAITED) == 1
    assert runs(started=True, paused=samples.PAUSE_S, errors=[samples.AWAY]) == samples.DRIVES


def test_the_checker_sees_what_is_wrong():
    """No cut, a cut of another size, an operator error, a screen that is gone, a pin that is not the
    configuration's."""
    sample = samples.named("gmoccapy")
    good = {
        "done": True,
        "screen_alive": True,
        "errors": [],
        "trouble": "",
        "output": "",
        "started": True,
        "said": [],
        "pins": {samples.PINS[0]: "196.3", samples.PINS[2]: "0"},
        "signals": {"motion.tooloffset.x": "tooloffset-x"},
    }
    assert samples.verdict(sample, good) == ""
    for key, value in (
        ("pins", {samples.PINS[0]: "0", samples.PINS[2]: "0"}),
        ("errors", ["x"]),
        ("screen_alive", False),
        ("done", False),
        ("pins", {samples.PINS[0]: "205", samples.PINS[2]: "0"}),
        ("signals", {"motion.tooloffset.x": ""}),
        ("signals", {"motion.tooloffset.x": "chipwise-tlo-x"}),
    ):
        assert samples.verdict(sample, {**good, key: value}) != "", key
    lathe = samples.named("lathe")
    assert samples.verdict(lathe, good) != ""
    assert samples.verdict(lathe, {**good, "started": False, "said": ["chipwise: this machine has no Y axis"]}) == ""
