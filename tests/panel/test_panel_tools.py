# SPDX-License-Identifier: GPL-2.0-or-later
"""The editor of the tool geometry on the page: the file is changed only with the token, at rest and as it was seen."""

import json
import os
import re
from dataclasses import replace

import pytest

from chipwise.tool_data import editor
from chipwise.entry import mdi
from chipwise.panel import entry
from chipwise.panel import server
from chipwise.tool_data.geometry import KEYS, load_tools
from support.panel_client import request
from support.panel_rig import TOKEN, asking, post, serving
from support.tool_files import FILE, written


class Mdi:
    """entry/mdi.py of a machine that the test sets by hand."""

    def __init__(self):
        self.state = mdi.State(tool=1)

    def read(self):
        return self.state


@pytest.fixture
def shop(tmp_path):
    """(rig, machine, path of the file)."""
    path, machine = written(tmp_path), Mdi()
    (tmp_path / "a.tbl").write_text("T1 P1 D6\nT2 P2 D4\n")
    (tmp_path / "a.ini").write_text(
        "[CHIPWISE]\nTOOL_GEOMETRY = tools.toml\n[EMCIO]\nTOOL_TABLE = a.tbl\n[TRAJ]\nLINEAR_UNITS = mm\n"
    )
    made = entry.Lines(str(tmp_path / "a.ini"), asking(machine))
    with serving(TOKEN, lines=made) as rig:
        yield rig, machine, path


def wanted(path, **values):
    return {"tool": 1, "values": values or {"flutes": 3}, "checksum": editor.checksum(path.read_bytes())}


def test_the_page_changes_a_tool(shop):
    rig, _machine, path = shop
    found = json.loads(request(rig.url, "/tools.json")[2])
    assert (
        found["file"] == "tools.toml"
        and found["tools"]["2"] == {"shape": "ball", "max_rate": 1000}
        and list(found["tools"]) == ["1", "2", "10"]
    )
    status, _headers, content = post(rig, "/tool", {"tool": 1, "values": {"flutes": 3}, "checksum": found["checksum"]})
    assert status == 200 and json.loads(content)["tools"]["1"]["flutes"] == 3 == load_tools(str(path))[1].flutes
    status, _headers, words = post(rig, "/tool", {"tool": 1, "values": {"flutes": 4}, "checksum": found["checksum"]})
    assert status == 409 and b"tools.toml has changed since this page has read it" in words


def test_a_rate_of_before_is_shown_and_written_in_the_new_unit(shop):
    """Never both keys: the page reads and writes cm3/min."""
    rig, _machine, path = shop
    path.write_text(FILE.replace("max_rate = 1_000", "max_removal_rate = 12_500"))
    found = json.loads(request(rig.url, "/tools.json")[2])
    assert found["tools"]["2"] == {"shape": "ball", "max_rate": 12.5}
    status, _headers, content = post(
        rig, "/tool", {"tool": 2, "values": {**found["tools"]["2"], "flutes": 2}, "checksum": found["checksum"]}
    )
    assert status == 200 and json.loads(content)["tools"]["2"] == {"shape": "ball", "max_rate": 12.5, "flutes": 2}
    assert path.read_text() == FILE.replace("max_rate = 1_000\t# steel\n", "max_rate = 12.5\t# steel\nflutes = 2\n")


def test_the_page_has_the_keys_of_the_file(root):
    """What geometry.js shows and writes is what tool_data/geometry.py reads."""
    text = (root / "remap" / "chipwise" / "panel" / "page" / "geometry.js").read_text()
    assert re.findall(r"'(\w+)'", re.search(r"KEYS = \[(.*?)\]", text)[1]) == list(KEYS)


@pytest.mark.parametrize("change", [{"idle": False}, {"at_rest": False}])
def test_no_tool_is_changed_in_a_cut(shop, change):
    rig, machine, path = shop
    machine.state = replace(machine.state, **change)
    status, _headers, words = post(rig, "/tool", wanted(path))
    assert (
        status == 409
        and b"the tool is not changed: a program or a command is under way" in words
        and path.read_text() == FILE
    )


def test_a_corner_that_the_tool_does_not_have(shop):
    rig, _machine, path = shop
    status, _headers, words = post(rig, "/tool", wanted(path, shape="bull", corner_radius=3.5))
    assert (
        status == 409
        and words == b"corner_radius 3.5 mm is larger than half of the diameter of tool 1, 6 mm; give at most 3 mm"
        and path.read_text() == FILE
    )
    assert post(rig, "/tool", wanted(path, shape="bull", corner_radius=3))[0] == 200
    assert (
        post(rig, "/tool", {**wanted(path, shape="bull", corner_radius=99), "tool": 20})[0] == 200
    )  # a tool that the table does not have yet


@pytest.mark.parametrize(
    "how",
    [{"token": None}, {"token": "wrong-token"}, {"token": ""}, {"origin": None}, {"origin": "http://evil.example"}],
)
def test_nothing_without_token_and_origin(shop, how, monkeypatch):
    rig, _machine, path = shop
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    assert post(rig, "/tool", wanted(path), **how)[0] == 403 and path.read_text() == FILE


@pytest.mark.parametrize(
    "body, status",
    [
        ({}, 400),
        ({"tool": True}, 400),
        ({"tool": "1"}, 400),
        ({"tool": 1.0}, 400),
        ({"tool": [1]}, 400),
        ({"values": []}, 400),
        ({"values": None}, 400),
        ({"checksum": 5}, 400),
        ({"checksum": None}, 400),
        ({"checksum": ""}, 409),
        ({"values": {"flutes": [2]}}, 400),
        ({"values": {"flutes": {}}}, 400),
        ({"values": {"flutes": True}}, 400),
        ({"values": {"flutes": float("nan")}}, 400),
        ({"values": {"flutes": float("inf")}}, 400),
        ({"values": {"flutes": 1e400}}, 400),
        ({"values": {"__class__": "x"}}, 409),
        ({"values": {"shape": 'x"\n[tool.1]\nflutes = 1'}}, 409),
        ({"values": {"../..": 1}}, 409),
        ({"tool": -5}, 409),
        ({"tool": 10**30}, 409),
        ({"values": {"flutes": 10**300}}, 409),
        ({"values": {"flutes": -1}}, 409),
        ({"values": {"corner_radius": "x"}}, 409),
        ({"values": {"shape": "x" * 5000}}, 413),
    ],
)
def test_requests_of_strangers(shop, body, status):
    rig, _machine, path = shop
    found, _headers, words = post(rig, "/tool", {**wanted(path), **body} if body else {})
    assert (
        found == status
        and b"Traceback" not in words
        and path.read_text() == FILE
        and sorted(os.listdir(path.parent)) == ["a.ini", "a.tbl", "tools.toml"]
    )


def test_a_machine_without_a_file(tmp_path):
    (tmp_path / "a.ini").write_text("[TRAJ]\nLINEAR_UNITS = mm\n")
    with serving(TOKEN, lines=entry.Lines(str(tmp_path / "a.ini"))) as rig:
        status, _headers, words = request(rig.url, "/tools.json")
        assert (
            status == 409
            and words == b"this machine has no file of tool geometry; set [CHIPWISE]TOOL_GEOMETRY in the INI file"
        )
