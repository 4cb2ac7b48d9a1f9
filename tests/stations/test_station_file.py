# SPDX-License-Identifier: GPL-2.0-or-later
"""The file of the stations: read however it has been written, changed without losing what else is in it."""

import os

import pytest

from chipwise.host import files
from chipwise.errors import CycleError
from chipwise.stations import store

MINE = """# my fixtures
[station.12]
name = "left vice"          # by hand
1 = [1, 2.5, -3]            # the origin
2 = [100.0, 2.5, -3.0]

[station.3]
1 = [0.0, 0.0, 0.0]
"""


def test_without_a_file(tmp_path):
    path = str(tmp_path / "new" / "stations.toml")
    assert store.load(path) == {}
    store.teach(path, 3, 1, (1.0, -2.0000000001, 1 / 3))
    assert store.load(path) == {3: {1: (1.0, -2.0, 0.333333333)}}


def test_comments_and_other_keys_stay(tmp_path):
    path = tmp_path / "stations.toml"
    path.write_text(MINE)
    store.teach(str(path), 12, 2, (7.0, 8.0, 9.0))
    store.teach(str(path), 12, 3, (1.0, 1.0, 1.0))
    text = path.read_text()
    assert all(words in text for words in ("# my fixtures", 'name = "left vice"          # by hand', "# the origin"))
    assert store.load(str(path)) == {12: {1: (1, 2.5, -3), 2: (7, 8, 9), 3: (1, 1, 1)}, 3: {1: (0, 0, 0)}}
    store.teach(str(path), 12, 1, (5.0, 5.0, 5.0), anew=True)
    assert store.load(str(path))[12] == {1: (5, 5, 5)} and "left vice" in path.read_text()
    store.remove(str(path), 12)
    assert store.load(str(path)) == {3: {1: (0, 0, 0)}} and "# my fixtures" in path.read_text()


@pytest.mark.parametrize(
    "text, words",
    [
        ("[station.3]\n1 = [1, 2]\n", "station 3: point 1 is not three numbers"),
        ('[station.3]\n1 = [1, 2, "x"]\n', "station 3: point 1 is not three numbers"),
        ("[station.3]\n1 = [true, 2, 3]\n", "station 3: point 1 is not three numbers"),
        ("[station.3]\n1 = [nan, 2, 3]\n", "station 3: point 1 is not a position"),
        ("[station.3]\n1 = [1e9, 2, 3]\n", "station 3: point 1 is not a position"),
        ("[station.3]\n100 = [1, 2, 3]\n", "station 3: point 100 is not a number from 1 to 99"),
        ("[station.0]\n1 = [1, 2, 3]\n", "station 0 is not a number from 1 to 999"),
        ("[station.left]\n1 = [1, 2, 3]\n", "station left is not a number from 1 to 999"),
        ("station = 3\n", "station is not a table"),
        ("[station]\n3 = 1\n", "station 3: is not a table"),
        ("[station.3\n", "is not TOML"),
        ("\xff\xfe", "is not TOML"),
        (b"\xff\xfe", "it is not UTF-8"),
        ("x = " + "[" * 5000, "is not TOML"),
    ],
)
def test_a_wrong_file_is_refused_and_kept(tmp_path, text, words):
    path = tmp_path / "stations.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    before = path.read_bytes()
    for action in (
        lambda: store.load(str(path)),
        lambda: store.teach(str(path), 3, 1, (0.0, 0.0, 0.0)),
        lambda: store.remove(str(path), 3),
    ):
        with pytest.raises(CycleError, match="stations.toml: ") as caught:
            action()
        assert words in str(caught.value)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["stations.toml"]


def test_a_fifo_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "stations.toml")
    with pytest.raises(CycleError, match="it is not a regular file"):
        store.load(str(tmp_path / "stations.toml"))


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_write_cut_off_leaves_the_old_file(tmp_path, monkeypatch, step):
    path = tmp_path / "stations.toml"
    path.write_text(MINE)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, step, full)
    with pytest.raises(CycleError, match="cannot be written: No space left"):
        store.teach(str(path), 3, 1, (1.0, 1.0, 1.0))
    assert path.read_text() == MINE and os.listdir(tmp_path) == ["stations.toml"]
