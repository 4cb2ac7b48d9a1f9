# SPDX-License-Identifier: GPL-2.0-or-later
"""M251 P2 and P3 without Q: taken where chip or power of the tool in the spindle is limited, refused where nothing
is."""

import hashlib
import re

import pytest

from chipwise.resume import text
from chipwise.settings import parse_settings
from chipwise.setup import job as jobs
from support.canon import run_preview, run_rs274, write_ini

BEGIN = "G21\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nF400\n"
TOOL = {1: 6.0}
CHIP, FLUTES = "[tool.1]\nflutes = 2\nchip_load = 0.04\n", "[tool.1]\nflutes = 2\n"
NONE = "chipwise: M251: word Q (removal rate) is missing, and no limit of chip or power is known for tool 1; add Q, or "
TO_FILE = " of tool 1 to [CHIPWISE]TOOL_GEOMETRY"


def test_resume_keeps_it():
    """The line that resume writes."""
    assert (
        text._volume((2.0, 0.0, 0.0, 3000.0)) == "M251 P2 E3000"
        and text._volume((3.0, 0.0, 2000.0, 0.0)) == "M251 P3 R2"
    )
    assert text._volume((2.0, 6000.0, 0.0, 3000.0)) == "M251 P2 Q6 E3000"


def ini_of(folder, tools, power="", material=""):
    (folder / "tools.toml").write_text(tools)
    ini = write_ini(folder, TOOL_GEOMETRY=str(folder / "tools.toml"))
    ini.write_text(
        re.sub(
            r"(?m)^(\[CHIPWISE\])$",
            rf"\1\nSPINDLE_POWER = {power}\nMATERIAL = {material}" if power else r"\1",
            ini.read_text(),
            count=1,
        )
    )
    return ini


@pytest.mark.parametrize("line", ["M251 P2 E3000", "M251 P3 R2 E900", "M251 P3 R2", "M251 P2 E3000 Q6"])
def test_taken_by_the_chip(tmp_path, line):
    ini = ini_of(tmp_path, CHIP)
    assert run_preview(BEGIN + line + "\nM2\n", tools=TOOL, ini=ini).error == ""
    assert run_rs274(BEGIN + line + "\nM2\n", tools=TOOL, ini=ini).error == ""


def test_taken_by_the_power(tmp_path):
    assert (
        run_preview(
            "(MATERIAL,NAME=6061)\n" + BEGIN + "M251 P2 E3000\nM2\n", tools=TOOL, ini=ini_of(tmp_path, FLUTES, "800")
        ).error
        == ""
    )
    assert (
        run_preview(BEGIN + "M251 P2 E3000\nM2\n", tools=TOOL, ini=ini_of(tmp_path, FLUTES, "800", "C45")).error == ""
    )


def test_taken_by_the_material_of_a_set_up(tmp_path):
    """Which is that of the program as it is now."""
    ini, program = ini_of(tmp_path, FLUTES, "800"), tmp_path / "part.ngc"
    text = BEGIN + "M251 P2 E3000\nM2\n"
    program.write_text(text)
    digest = hashlib.sha256(program.read_bytes()).hexdigest()
    jobs.write(
        str(tmp_path / "part.job.toml"),
        jobs.Job(
            "part.ngc", digest, (0.0, 0.0, -10.0), (60.0, 40.0, 0.0), "option", "C45", {1: jobs.JobTool(6.0, None, 1.0)}
        ),
    )
    settings = parse_settings({})
    assert jobs.material_of(str(program), settings) == "C45"
    assert run_preview(text, tools=TOOL, ini=ini).error != ""  # of another name
    program.write_text(text + "\n")
    assert (
        jobs.material_of(str(program), settings) == "" and jobs.material_of(str(tmp_path / "none.ngc"), settings) == ""
    )


def test_taken_by_the_default_chip(tmp_path):
    """With a material and DEFAULT_CHIP, and not without."""
    ini, text = ini_of(tmp_path, FLUTES), "(MATERIAL,NAME=6061)\n" + BEGIN + "M251 P2 E3000\nM2\n"
    assert run_preview(text, tools=TOOL, ini=ini).error == ""
    ini.write_text(ini.read_text().replace("[CHIPWISE]\n", "[CHIPWISE]\nDEFAULT_CHIP = no\n", 1))
    assert run_preview(text, tools=TOOL, ini=ini).error == NONE + "chip_load" + TO_FILE


@pytest.mark.parametrize(
    "tools, power, remedy",
    [
        ("", "", "flutes and chip_load" + TO_FILE),
        ("[tool.1]\nchip_load = 0.04\n", "800", "flutes and chip_load" + TO_FILE),
        (FLUTES, "", "chip_load" + TO_FILE + ", or (MATERIAL,NAME=..) to the program"),
        (FLUTES, "800", "chip_load" + TO_FILE + ", or (MATERIAL,NAME=..) to the program"),
        (CHIP.replace("1", "2"), "", "flutes and chip_load" + TO_FILE),
    ],
)
def test_refused(tmp_path, tools, power, remedy):
    ini = ini_of(tmp_path, tools, power)
    for line in ("M251 P2 E3000", "M251 P3 R2"):
        assert run_preview(BEGIN + line + "\nM2\n", tools=TOOL, ini=ini).error == NONE + remedy


@pytest.mark.parametrize(
    "line, message",
    [
        ("M251", "word Q (removal rate, cm3/min) is missing; add Q"),
        ("M251 P1", "word Q (removal rate, cm3/min) is missing; add Q"),
        ("M251 P2", "word E (ceiling of the feed) is missing; mode P2 replaces F; add E"),
        ("M251 P3 E900", "word R (lower removal rate, cm3/min) is missing; add R"),
        ("M251 P2 Q0 E900", "removal rate Q0 cm3/min is not above 0; give Q above 0"),
    ],
)
def test_what_is_needed_all_the_same(tmp_path, line, message):
    assert (
        run_preview(BEGIN + line + "\nM2\n", tools=TOOL, ini=ini_of(tmp_path, CHIP)).error
        == "chipwise: M251: " + message
    )
