# SPDX-License-Identifier: GPL-2.0-or-later
"""settings.py and tool_data/geometry.py: defaults, broken values, messages."""

import pytest

from chipwise import settings
from chipwise.tool_data import geometry
from chipwise.errors import CycleError, format_length
from chipwise.ini import section_of


def parse(text):
    return settings.parse_settings(section_of(text.splitlines(), settings.SECTION), "/configs")


def test_defaults():
    found = parse("")
    assert found["CELL"] == 0.25 and found["MAP_SIZE"] == (300.0, 200.0) and found["CHOP_SIZE"] == 0.0
    assert found["APPROACH_ANGLE"] == 30.0 and found["RAMP_ANGLE"] == 3.0 and found["ANALOG_OUT"] == 0
    assert found.path("TOOL_GEOMETRY") == ""
    for key, setting in settings.SETTINGS.items():
        assert setting.allowed(found[key]), f"the default of {key} is not allowed"


def test_reads_one_section_only():
    found = parse(
        "[RS274NGC]\nCELL = 9\n[CHIPWISE]\n# CELL = 8\ncell = 0.5 # mm\nMAP_SIZE = 400, 250\nCELL = 7\n"
        "TOOL_GEOMETRY = a.toml\n[TRAJ]\nCELL = 6\n"
    )
    assert found["CELL"] == 0.5
    assert found["MAP_SIZE"] == (400, 250)
    assert found.path("TOOL_GEOMETRY") == "/configs/a.toml"


@pytest.mark.parametrize(
    "line, message",
    [
        ("CELL = 0", "[CHIPWISE]CELL = 0 is not a length from 0.01 to 10 mm; correct the INI file"),
        ("CELL = nan", "[CHIPWISE]CELL = nan is not a length from 0.01 to 10 mm; correct the INI file"),
        ("MAP_SIZE = 300", "[CHIPWISE]MAP_SIZE = 300 is not two lengths above 0 mm, X and Y; correct the INI file"),
        (
            "CHOP_SIZE = {x}",
            "[CHIPWISE]CHOP_SIZE = {x} is not 0 (never chop) or a length of 0.1 mm or more; correct the INI file",
        ),
        (
            "ANALOG_OUT = 1.5",
            "[CHIPWISE]ANALOG_OUT = 1.5 is not " + settings.SETTINGS["ANALOG_OUT"].rule + "; correct the INI file",
        ),
        ("SEAM_OVERLAP = 101", "[CHIPWISE]SEAM_OVERLAP = 101 is not a length from 0 to 100 mm; correct the INI file"),
        ("RAMP_ANGLE = 91", "[CHIPWISE]RAMP_ANGLE = 91 is not an angle from 0.1 to 90 degrees; correct the INI file"),
    ],
)
def test_broken_values(line, message):
    with pytest.raises(CycleError) as caught:
        parse("[CHIPWISE]\n" + line)
    assert str(caught.value) == "chipwise: " + message


def test_unknown_key():
    with pytest.raises(CycleError, match=r"\[CHIPWISE\]CHOPSIZE is not a setting; use one of .*CHOP_SIZE"):
        parse("[CHIPWISE]\nCHOPSIZE = 3")


def test_load_follows_changes(tmp_path, monkeypatch):
    ini = tmp_path / "a.ini"
    ini.write_text("[CHIPWISE]\nCHOP_SIZE = 3\n")
    monkeypatch.setenv("INI_FILE_NAME", str(ini))
    assert settings.load_settings()["CHOP_SIZE"] == 3
    ini.write_text("[CHIPWISE]\nCHOP_SIZE = 41\n")
    import os

    os.utime(ini, (1, 1))
    assert settings.load_settings()["CHOP_SIZE"] == 41
    with pytest.raises(CycleError, match="No such file"):
        settings.load_settings(str(tmp_path / "none.ini"))


def test_every_key_is_documented(root):
    text = (root / "docs" / "user" / "settings.md").read_text()
    for key in settings.SETTINGS:
        assert f"`{key}`" in text


def test_shipped_tools(root):
    found = geometry.load_tools(str(root / "configs" / "tools.toml"))
    assert found[5] == geometry.ToolGeometry("bull", 0.5, None, 20, 2, 12000)
    assert geometry.tool_geometry(str(root / "configs" / "tools.toml"), 99) is None
    assert geometry.load_tools("") == {}


@pytest.mark.parametrize(
    "text, message",
    [
        ("[tool.3", "t.toml: is not TOML: "),
        (
            "[tool.3]\nshape = 'cone'",
            "t.toml: tool 3: shape = 'cone' is unknown; use one of flat, ball, bull, vee, tapered-ball",
        ),
        ("[tool.3]\nshape = 'bull'", "t.toml: tool 3: shape bull needs corner_radius; add corner_radius = ..."),
        ("[tool.3]\nlength = 3", "t.toml: tool 3: length is not a key; use shape, corner_radius, "),
        ("[tool.3]\nflute_length = 0", "t.toml: tool 3: flute_length = 0 is not a length above 0 mm; correct the file"),
        (
            "[tool.3]\nflute_length = nan",
            "t.toml: tool 3: flute_length = nan is not a length above 0 mm; correct the file",
        ),
        (
            "[tool.3]\nflutes = 2.5",
            "t.toml: tool 3: flutes = 2.5 is not a whole number from 1 to 100; correct the file",
        ),
        (
            "[tool.3]\nmax_rate = 0",
            "t.toml: tool 3: max_rate = 0 is not a rate above 0, at most 10000 cm3/min; correct the file",
        ),
        (
            "[tool.3]\nmax_rate = -3",
            "t.toml: tool 3: max_rate = -3 is not a rate above 0, at most 10000 cm3/min; correct the file",
        ),
        (
            "[tool.3]\nmax_rate = nan",
            "t.toml: tool 3: max_rate = nan is not a rate above 0, at most 10000 cm3/min; correct the file",
        ),
        (
            "[tool.3]\nmax_rate = 12000",
            "t.toml: tool 3: max_rate = 12000 is not a rate above 0, at most 10000 cm3/min; correct the file",
        ),
        (
            "[tool.3]\nmax_removal_rate = 1e8",
            "t.toml: tool 3: max_removal_rate = 100000000.0 is not a rate above 0, at most 10000000 mm3/min; correct "
            "the file",
        ),
        (
            "[tool.3]\nmax_rate = 5\nmax_removal_rate = 0",
            "t.toml: tool 3: max_removal_rate = 0 is not a rate above 0, at most 10000000 mm3/min",
        ),
        (
            "[tool.3]\ntip_angle = '90'",
            "t.toml: tool 3: tip_angle = '90' is not an angle of 0.1 degrees or more, below 180",
        ),
        ("[tool.three]\nflutes = 2", "t.toml: tool three: is not a tool number; use [tool.N], N a whole number"),
        ("[tools.3]\nflutes = 2", "t.toml: [tools] is unknown; use [tool.N], on a lathe [lathe.N], N the tool number"),
        ("tool = 3", "t.toml: tool is not a table"),
        ("[tool]\n3 = 5", "t.toml: tool 3: is not a table; write [tool.3]"),
    ],
)
def test_broken_tools(text, message):
    with pytest.raises(CycleError) as caught:
        geometry.parse_tools(text, "/configs/t.toml")
    assert str(caught.value).startswith("chipwise: " + message)


BOTH = (
    "max_rate (cm3/min) and max_removal_rate (mm3/min) are both given, the smaller counts: {} cm3/min; remove "
    "max_removal_rate"
)


@pytest.mark.parametrize(
    "text, rate, note",
    [
        ("max_rate = 30", 30000, ""),
        ("max_rate = 1.5", 1500, ""),
        ("flutes = 2", None, ""),
        ("max_rate = 10_000", 1e7, ""),
        ("max_removal_rate = 30000", 30000, "max_removal_rate is in mm3/min; write max_rate = 30 (cm3/min)"),
        ("max_removal_rate = 1234.5", 1234.5, "max_removal_rate is in mm3/min; write max_rate = 1.2345 (cm3/min)"),
        ("max_removal_rate = 30000\nmax_rate = 20", 20000, BOTH.format(20)),
        ("max_removal_rate = 30000\nmax_rate = 40", 30000, BOTH.format(30)),
    ],
)
def test_rates_are_cm3_per_minute(tmp_path, text, rate, note):
    """The old key is read, and named with what to write."""
    path = tmp_path / "t.toml"
    path.write_text(f"[tool.3]\n{text}\n")
    assert geometry.tool_geometry(str(path), 3).max_removal_rate == (pytest.approx(rate, rel=1e-12) if rate else None)
    assert geometry.old_rates(str(path)) == ([f"t.toml: tool 3: {note}"] if note else [])


@pytest.mark.parametrize("text", ["10001", "-1", "nan", "inf", "30000"])
def test_the_rate_of_the_filter_is_a_possible_one(text):
    with pytest.raises(
        CycleError, match=r"\[CHIPWISE\]FILTER_RATE = \S+ is not a removal rate from 0 \(none\) to 10000 cm3/min"
    ):
        settings.parse_settings({"FILTER_RATE": text})


def test_no_sample_has_the_old_key(root):
    for path in (*(root / "configs").glob("*.toml"), root / "docs" / "user" / "settings.md"):
        assert "max_removal_rate = " not in path.read_text(), path


@pytest.mark.parametrize(
    "mm, unit, text",
    [
        (2, "mm", "2 mm"),
        (2.5, "mm", "2.5 mm"),
        (-0.00001, "mm", "0 mm"),
        (25.4, "in", "1 in"),
        (1, "in", "0.03937 in"),
        (100, "mm", "100 mm"),
    ],
)
def test_lengths_in_messages(mm, unit, text):
    assert format_length(mm, unit) == text


@pytest.mark.parametrize(
    "key", [key for key, setting in settings.SETTINGS.items() if isinstance(setting.default, bool)]
)
def test_switches_take_linuxcncs_own_forms(key):
    for text, value in (("1", True), ("0", False), ("YES", True), ("off", False), ("true", True), ("No", False)):
        assert settings.parse_settings({key: text})[key] is value
    with pytest.raises(CycleError):
        settings.parse_settings({key: "2"})
