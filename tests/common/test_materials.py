# SPDX-License-Identifier: GPL-2.0-or-later
"""The table of materials, files of one's own, and the comment that names one."""

import re
import tomllib

import pytest
from chipwise import settings
from chipwise.tool_data import geometry, materials
from chipwise.errors import CycleError

GOOD = "[A1]\nkc11 = 500\nmc = 0.2\n"


def table():
    with open(materials.TABLE, "rb") as handle:
        return tomllib.load(handle)


def test_the_table_has_what_it_needs():
    """15 and more, each with a group, plausible figures and their source; a chip of 0.05 mm takes more than one of 1
    mm, for its area."""
    found = table()
    assert len(found) >= 15
    for name, values in found.items():
        one = materials.find_material(name)
        assert (one.name, one.kc11, one.mc) == (name, values["kc11"], values["mc"])
        assert one.group in materials.GROUPS and re.match(r"VDI \d+: .{10}", one.source)
        assert 600 <= one.kc11 <= 3500 and 0.15 <= one.mc <= 0.3
    steel, aluminium, titanium = (materials.find_material(name).kc11 for name in ("42CrMo4", "6061", "TiAl6V4"))
    assert aluminium < steel < titanium


def test_every_material_is_documented(root):
    """The page has the table's own figures."""
    text = (root / "docs" / "user" / "materials.md").read_text()
    for name, values in table().items():
        assert f"| `{name}` | {', '.join(values['names'])} | {values['kc11']} | {values['mc']:.2f} |" in text


@pytest.mark.parametrize(
    "name, own",
    [
        ("6061-t6", "6061"),
        (" En aw 6061 ", "6061"),
        ("ti6al4v", "TiAl6V4"),
        ("C45 + QT", "C45-QT"),
        ("c45", "C45"),
        ("x5crni18/10", "X5CrNi18-10"),
        ("316l", "X2CrNiMo17-12-2"),
    ],
)
def test_names(name, own):
    assert materials.find_material(name).name == own


@pytest.mark.parametrize("name", ["", "-", "6", "unobtainium", "{x}", "x" * 500])
def test_unknown_names(name):
    with pytest.raises(
        CycleError, match="^chipwise: the material .* is not known; use a name of docs/user/materials.md"
    ):
        materials.find_material(name)


@pytest.mark.parametrize(
    "name, like",
    [
        ("6016", "6061"),
        ("Inconel 718", "Inconel-718"),
        ("TiAl64V", "TiAl6V4"),
        ("42CrMo5", "42CrMo4"),
        ("brasss", "CuZn39Pb3"),
    ],
)
def test_names_like_a_wrong_one(name, like, tmp_path):
    if like == "Inconel-718":  # a blank makes no difference
        assert materials.find_material(name).name == like
        return
    with pytest.raises(
        CycleError,
        match=f"^chipwise: the material {name} is not known; use .*{like}.*, or another name of docs/user/materials.md",
    ):
        materials.find_material(name)
    (tmp_path / "m.toml").write_text("[brasso]\nkc11 = 700\nmc = 0.2\n")
    assert (
        materials.near("brasss", str(tmp_path / "m.toml")) == ["CuZn39Pb3", "brasso"] and materials.near("zzzzz") == []
    )


@pytest.mark.parametrize(
    "text, name",
    [
        ("G21\n(MATERIAL,NAME=6061)\nM2", "6061"),
        ("( material , name = EN AW-6061 )", "EN AW-6061"),
        ("G0 X1 (MATERIAL,NAME=C45) (x)\n(MATERIAL,NAME=6061)", "C45"),
        ("; (MATERIAL,NAME=6061)", None),
        ("(MATERIALS: 6061)", None),
        ("(Material Size X 3)", None),
        ("", None),
        ("(MATERIAL,NAME=C45", None),
    ],
)
def test_the_comment_of_a_program(text, name):
    assert materials.named_in(text) == name


@pytest.mark.parametrize("inside", ["6061", "NAME=", "NAME", "KIND=6061", ""])
def test_a_comment_without_a_name(inside):
    with pytest.raises(CycleError, match=r"names no material; write \(MATERIAL,NAME=6061\)"):
        materials.named_in(f"(MATERIAL,{inside})")


def test_program_before_setting(tmp_path):
    own = tmp_path / "m.toml"
    own.write_text(GOOD + "[6061]\nkc11 = 900\nmc = 0.1\n")
    assert materials.material_of("", "") is None
    assert materials.material_of("", "C45").name == "C45"
    assert materials.material_of("(MATERIAL,NAME=6082)", "C45", job="316").name == "6082"
    assert (
        materials.material_of("", "C45", job="6082").name == "6082"
        and materials.material_of("", job="6082").name == "6082"
    )
    assert materials.material_of("", "a 1", str(own)).kc11 == 500
    assert materials.material_of("(MATERIAL,NAME=6061)", "", str(own)).kc11 == 900  # one's own goes before
    assert materials.material_of("(MATERIAL,NAME=6061-T6)", "", str(own)).kc11 == 800
    own.write_text(GOOD.replace("500", "501.5"))
    assert materials.find_material("A1", str(own)).kc11 == 501.5
    with pytest.raises(
        CycleError, match="none.toml: cannot be read: No such file or directory; correct .CHIPWISE.MATERIALS"
    ):
        materials.find_material("A1", str(tmp_path / "none.toml"))


@pytest.mark.parametrize(
    "text, message",
    [
        ("[A1", "m.toml: is not TOML: "),
        ("A1 = 3", "m.toml: A1: is not a material; write [NAME]"),
        ("['-']\nkc11 = 3", "m.toml: -: is not a material"),
        ("[A1]\nmc = 0.2", "m.toml: A1: kc11 is missing; add kc11 = .., a specific force from 10 to 20000 N/mm2"),
        ("[A1]\nkc11 = 500", "m.toml: A1: mc is missing; add mc = .., an exponent from 0 to 0.6"),
        ("[A1]\nkc11 = nan\nmc = 0.2", "m.toml: A1: kc11 = nan is not a specific force"),
        ("[A1]\nkc11 = true\nmc = 0.2", "m.toml: A1: kc11 = True is not"),
        ("[A1]\nkc11 = '5'\nmc = 0.2", "m.toml: A1: kc11 = 5 is not"),
        ("[A1]\nkc11 = 500\nmc = -0.1", "m.toml: A1: mc = -0.1 is not an exponent from 0 to 0.6"),
        ("[A1]\nkc11 = 500\nmc = inf", "m.toml: A1: mc = inf is not"),
        (GOOD + "kc1.1 = 3", "m.toml: A1: kc1 is not a key; use names, group, kc11"),
        (GOOD + "group = 'Q'", "m.toml: A1: group = Q is not one of P, M, K"),
        (GOOD + "group = 'PM'", "m.toml: A1: group = PM is not one of"),
        (GOOD + "group = [1]", "m.toml: A1: group = [1] is not one of"),
        (GOOD + "names = 'x'", "m.toml: A1: names is not a list of names"),
        (GOOD + "names = ['x', 3]", "m.toml: A1: names is not"),
        (GOOD + "names = ['']", "m.toml: A1: names is not"),
        (GOOD + GOOD.replace("A1", "a-1"), "m.toml: a-1: a-1 is the name of A1, too; remove one of them"),
    ],
)
def test_files_that_are_wrong(text, message):
    with pytest.raises(CycleError) as caught:
        materials.parse_materials(text, "/configs/m.toml")
    assert str(caught.value).startswith("chipwise: " + message)


def test_settings():
    found = settings.parse_settings({"MATERIAL": "6061", "MATERIALS": "m.toml"}, "/configs")
    assert found["MATERIAL"] == "6061" and found.path("MATERIALS") == "/configs/m.toml"
    assert settings.parse_settings({})["MATERIAL"] == "" and settings.parse_settings({}).path("MATERIALS") == ""


def test_what_a_tool_may_take():
    text = "[tool.3]\nchip_load = 0.04\nchip_least = 0.005\ndeflection = 0.02\nstick_out = 25\nmaterial = 'hss'"
    found = geometry.parse_tools(text)[3]
    assert (found.chip_load, found.chip_least, found.deflection, found.stick_out, found.material) == (
        0.04,
        0.005,
        0.02,
        25,
        "hss",
    )
    assert geometry.parse_tools("[tool.3]")[3] == geometry.ToolGeometry()


@pytest.mark.parametrize(
    "text, message",
    [
        ("chip_load = 0", "chip_load = 0 is not a thickness above 0, at most 10 mm"),
        ("chip_load = 11", "chip_load = 11 is not a thickness"),
        ("chip_load = '0.1'", "chip_load = '0.1' is not a thickness"),
        ("chip_least = -1", "chip_least = -1 is not a thickness"),
        ("chip_least = 0.1\nchip_load = 0.05", "chip_least = 0.1 mm is more than chip_load = 0.05 mm"),
        ("deflection = nan", "deflection = nan is not a length"),
        ("material = 'wood'", "material = 'wood' is unknown; use one of carbide, hss"),
        ("material = ['hss']", "material = ['hss'] is unknown"),
    ],
)
def test_what_no_tool_may_take(text, message):
    with pytest.raises(CycleError) as caught:
        geometry.parse_tools("[tool.3]\n" + text, "/configs/t.toml")
    assert str(caught.value).startswith(f"chipwise: t.toml: tool 3: {message}")
