# SPDX-License-Identifier: GPL-2.0-or-later
"""The three INI files describe one machine."""

import ast
import json
import os
import re

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
INCH = 25.4


def entries(name):
    """-> [(section, key, value)] in the file's order."""
    found, section = [], None
    with open(os.path.join(ROOT, "configs", name)) as handle:
        for line in handle:
            line = line.strip()
            if re.match(r"\[\w+\]$", line):
                section = line[1:-1]
            elif line and line[0] not in "#;":
                key, value = (part.strip() for part in line.split("=", 1))
                found.append((section, key, value))
    return found


@pytest.mark.parametrize("machine", ["mill", "lathe", "robot"])
def test_headless_is_the_machine_with_another_display(machine):
    def common(name):
        return [
            entry
            for entry in entries(name)
            if entry[:2] not in (("DISPLAY", "DISPLAY"), ("RS274NGC", "PARAMETER_FILE"))
            and entry != ("HAL", "HALFILE", "../hal/headless.hal")
        ]

    assert common(f"{machine}_headless.ini") == common(f"{machine}.ini")


def test_gmoccapy_is_the_mill_with_another_screen():
    def common(name):
        return [
            entry
            for entry in entries(name)
            if entry[0] != "DISPLAY"
            and entry[:2] != ("RS274NGC", "PARAMETER_FILE")
            and not entry[2].startswith("../hal/chipwise_panel")
        ]

    assert common("mill_gmoccapy.ini") == common("mill.ini")


LENGTHS = re.compile(r"(JOINT|AXIS)_|TRAJ$")
NUMBERS = re.compile(r"VELOCITY|ACCELERATION|LIMIT$|FERROR$|HOME$|HOME_OFFSET$")


@pytest.mark.parametrize("machine", ["mill", "lathe"])
def test_inch_is_the_metric_machine(machine):
    metric = {entry[:2]: entry[2] for entry in entries(f"{machine}.ini")}
    inch = {entry[:2]: entry[2] for entry in entries(f"{machine}_inch.ini")}
    assert set(metric) == set(inch)
    checked = 0
    for (section, key), value in metric.items():
        if NUMBERS.search(key) and (LENGTHS.match(section) or section == "DISPLAY"):
            assert float(inch[section, key]) * INCH == pytest.approx(float(value), abs=1e-4)
            checked += 1
        elif section in ("TASK", "EMCMOT", "KINS", "HAL", "CHIPWISE", "PYTHON"):
            assert inch[section, key] == value
    assert checked > {"mill": 40, "lathe": 25}[machine]
    remaps = [
        [entry for entry in entries(name) if entry[1] == "REMAP"] for name in (f"{machine}.ini", f"{machine}_inch.ini")
    ]
    assert remaps[0] == remaps[1] and remaps[0]


def test_the_lathes_codes_for_other_machines_are_those_of_the_lathe():
    with open(os.path.join(ROOT, "configs", "chipwise_lathe_codes.inc")) as handle:
        lines = [line.strip() for line in handle if line.startswith("REMAP")]
    assert lines == [f"REMAP = {value}" for _section, key, value in entries("lathe.ini") if key == "REMAP"]


def test_the_inch_tools_are_the_metric_ones():
    def tools(name):
        with open(os.path.join(ROOT, "configs", name)) as handle:
            return [(re.sub(r" D[0-9.]+", "", line), float(re.search(r" D([0-9.]+)", line)[1])) for line in handle]

    for (rest, metric), (other, inch) in zip(tools("lathe.tbl"), tools("lathe_inch.tbl")):
        assert rest == other and inch * INCH == pytest.approx(metric, abs=1e-4)


def test_files_named_exist():
    for name in (
        "mill.ini",
        "mill_inch.ini",
        "mill_headless.ini",
        "mill_gmoccapy.ini",
        "robot.ini",
        "lathe.ini",
        "lathe_inch.ini",
        "lathe_headless.ini",
        "tracer.ini",
        "tracer_slave.ini",
    ):
        folder = os.path.join(ROOT, "configs")
        for section, key, value in entries(name):
            if (section, key) in (
                ("HAL", "HALFILE"),
                ("HAL", "POSTGUI_HALFILE"),
                ("DISPLAY", "PYVCP"),
                ("EMCIO", "TOOL_TABLE"),
                ("CHIPWISE", "TOOL_GEOMETRY"),
                ("PYTHON", "TOPLEVEL"),
            ):
                assert os.path.exists(os.path.join(folder, value)), (name, value)


def test_both_panels_have_the_same_words():
    """PyVCP's and gmoccapy's; what leaves the feed at F may be a fault, too."""
    with open(os.path.join(ROOT, "configs", "panel.xml")) as handle:
        rows = [json.loads(row) for row in re.findall(r"<legends>(.*?)</legends>", handle.read())]
    with open(os.path.join(ROOT, "configs", "panel_gmoccapy.py")) as handle:
        tree = ast.parse(handle.read())
    words = next(ast.literal_eval(node.value) for node in tree.body if ast.unparse(node).startswith("WORDS = "))
    assert rows == [list(texts.values()) for texts in words.values()]
    assert words["by"]["by-fallback"] == "fault or no stock/tool: F"
