# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise clamps: the file of the set-ups is listed, shown and changed; what is wrong is refused, and the file is
then as before."""

import json
import os
import tomllib

import pytest

from chipwise.options.machine import UsageError
from chipwise.cli import run
from chipwise.clamps import set_ups
from chipwise.errors import CycleError
from support import forked

TEXT = """# mine
[set_up.2]
name = "vice"
height = 30                    # my own
[set_up.2.clamp.jaw]
box = [100.0, 80.0, -90.0, 220.0, 95.0, -60.0]
[set_up.2.clamp.stop]
cylinder = [90.0, 60.0, -90.0, -65.0, 12.0]
"""


def clamps(path, *arguments):
    return forked.run([forked.CHIPWISE, "clamps", *(["--file", path] if path else []), *arguments], timeout=300)


def test_list_show_add_and_remove(tmp_path):
    path = tmp_path / "clamps.toml"
    assert clamps(path).stdout == f"{path}: there are no set-ups\n"
    path.write_text(TEXT)
    assert clamps(path).stdout == clamps(path, "list").stdout == "set-up 2 (vice): 2 clamps\n"
    done = clamps(path, "show", "2", "--json", str(tmp_path / "out.json"))
    assert done.stdout.splitlines()[1:] == [
        "  jaw: box from X100.0000 Y80.0000 Z-90.0000 to X220.0000 Y95.0000 Z-60.0000",
        "  stop: cylinder from X84.0000 Y54.0000 Z-90.0000 to X96.0000 Y66.0000 Z-65.0000",
    ]
    found = json.loads((tmp_path / "out.json").read_text())["set_ups"]["2"]
    assert found["name"] == "vice" and found["clamps"]["stop"] == {
        "shape": "cylinder",
        "min": [84, 54, -90],
        "max": [96, 66, -65],
    }
    assert (
        clamps(path, "add", "7", "left", "--box", "0", "0", "-20", "10", "20", "5", "--name", "plate").returncode == 0
    )
    assert clamps(path, "add", "7", "right", "--cylinder", "50", "-10", "-20", "5", "8").returncode == 0
    document = tomllib.loads(path.read_text())
    assert document["set_up"]["7"] == {
        "name": "plate",
        "clamp": {"left": {"box": [0, 0, -20, 10, 20, 5]}, "right": {"cylinder": [50, -10, -20, 5, 8]}},
    }
    assert (
        path.read_text().startswith("# mine")
        and document["set_up"]["2"]["height"] == 30
        and "# my own" in path.read_text()
    )
    assert clamps(path, "remove", "7", "left").stdout == "set-up 2 (vice): 2 clamps\nset-up 7 (plate): 1 clamp\n"
    assert clamps(path, "remove", "7").stdout == "set-up 2 (vice): 2 clamps\n"


REFUSED = {
    "show 3": "there is no set-up 3; there are 2",
    "remove 3": "there is no set-up 3",
    "show": "the number of a set-up, none, is not from 1 to 999",
    "remove 2 left": "set-up 2 has no clamp left; it has jaw, stop",
    "add 1000 a --box 0 0 0 1 1 1": "the number of a set-up, 1000, is not",
    "add 2 a": "add needs the name of a clamp, and --box or --cylinder",
    "add 2 a/b --box 0 0 0 1 1 1": "a/b is not a name",
    "add 2 jaw --box 0 0 0 1 1 1": "set-up 2 has a clamp jaw already; remove it before",
    "list 2": "list takes no number; use show",
    "add 2 a --box 0 0 0 1 0 1": "set-up 2, clamp a: it has no extent in Y (0 to 0)",
    "add 2 a --box 0 0 0 nan 1 1": "clamp a: a number of box is not a position",
    "add 2 a --cylinder 0 0 0 1 -3": "clamp a: it has no extent in X (1.5 to -1.5)",
    "show 2 --name x": "show takes neither --box, --cylinder nor --name; use add",
}


def test_what_is_wrong_is_refused(tmp_path):
    path = tmp_path / "clamps.toml"
    path.write_text(TEXT)
    for words, said in REFUSED.items():
        with pytest.raises(UsageError) as error:
            run(["clamps", "--file", str(path), *words.split()])
        assert said in str(error.value), words
        assert path.read_text() == TEXT and os.listdir(tmp_path) == ["clamps.toml"]


@pytest.mark.parametrize(
    "text, said",
    [
        ("set_up = 3", "set_up is not a table"),
        ("[set_up.0]", "set-up 0 is not a number from 1 to 999"),
        ("[set_up.1.clamp.a]", "set-up 1, clamp a: it has not one of box and cylinder"),
        ("[set_up.1.clamp.a]\nbox = [1, 2]", "set-up 1, clamp a: box is not 6 numbers"),
        ("[set_up.1]\nclamp = 3", "set-up 1: clamp is not a table of at most 100 clamps"),
        ("[set_up.1]\nname = 3", "set-up 1: its name is not a line"),
        ('[set_up.1.clamp."a b"]', "its name has other characters"),
        ("[[", "is not TOML"),
    ],
)
def test_a_wrong_file_is_refused(tmp_path, text, said):
    path = tmp_path / "clamps.toml"
    path.write_text(text)
    with pytest.raises(CycleError) as error:
        set_ups.add(str(path), 1, "b", "box", [0, 0, 0, 1, 1, 1])
    assert (
        said in error.value.text()
        and error.value.text().startswith("chipwise: clamps.toml: ")
        and path.read_text() == text
    )
