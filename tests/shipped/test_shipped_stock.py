# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of an ordinary user over save, quit, kill -9 and the start of another user."""

import os

import pytest

pytestmark = pytest.mark.machine

MOTION_KEY = 100  # LinuxCNC 2.9 leaves motion's memory behind
VICTIMS = ["chipwise monitor", "chipwise panel", "milltask", "rtapi_app", "/bin/linuxcnc", "all"]


def test_saved_restored_and_kept(scene):
    """M253, M254, KEEP_STOCK: the files are the user's, the map is cell by cell what it was, also after quit and
    start."""
    found = scene("scenes.stock")
    first, more, restored = found["sums"]
    assert found["errors"] == [] and first[1] > 300 and more[1] > first[1] + 1000
    assert restored == first and found["again"] == first and found["again_errors"] == []
    assert sorted(found["files"]) == ["kept.stock", "kept.stock.note", "slot3.stock"]
    assert all(
        uid == found["uid"] and size > (1000 if name.endswith(".stock") else 0)
        for name, (uid, size) in found["files"].items()
    ), found["files"]
    assert found["left"][0] == [] and set(found["left"][1]) <= {MOTION_KEY}, "processes or memory outlive LinuxCNC"


def test_whatever_is_killed_the_next_start_works(scene):
    """kill -9 of each process, and of all: the next start cuts the same; after all, it has the stock as saved while the
    machine worked, and says so."""
    found = scene("scenes.killed", victims=VICTIMS)
    assert [one["victim"] for one in found["seen"]] == [*VICTIMS, ""]
    volumes = [float(one["volume"]) for one in found["seen"][:-1]]
    assert min(volumes) > 300 and max(volumes) - min(volumes) < 0.01 * volumes[0]
    assert all(one["fault"] == "0" for one in found["seen"][:-1])
    last = found["seen"][-1]
    assert not last["kept"], "all was killed, so nothing has been kept at an end"
    before, said, after = last["answers"][1], last["answers"][2], last["answers"][-1]
    assert before[1].split()[0] == "TRUE" and float(before[1].split()[1]) == pytest.approx(volumes[-1], rel=0.001), (
        before,
        volumes,
    )
    assert len(said) == 1 and said[0].startswith(
        "chipwise: LinuxCNC did not end in order (power loss, crash): the stock is as saved "
    ), said
    assert after[1].split()[0] == "TRUE" and float(after[1].split()[1]) == pytest.approx(volumes[0], rel=0.01)
    assert found["left"] == [] and set(found["memory"]) <= {MOTION_KEY}, "processes or memory outlive LinuxCNC"


def test_a_second_user(scene):
    """Another user's map: refused with its owner and who may remove it, at the end of what LinuxCNC prints; the remedy
    works."""
    found = scene("scenes.second_user")
    first, second = found["uids"]
    assert first != second and found["owner of the map"] == first
    status, said = found["refused"]
    lines = [line for line in said.splitlines() if line.strip()]
    reason = (
        "chipwise: the shared memory of the stock map belongs to user op, whose LinuxCNC runs or was killed; end that "
        "LinuxCNC, then run "
        "`ipcrm -M 0x43575354` as op or as root"
    )
    assert status != 0 and reason in lines[-10:], said[-3000:]
    assert found["not allowed"][0] != 0 and found["remedy"][0] == 0
    assert float(found["then"][-2][0]) > 300 and found["then"][-1] == []


def test_nothing_of_this_stays_on_the_machine():
    """The users of the scenes are nobody here."""
    with open("/etc/passwd") as file:
        assert not [line for line in file if line.startswith("op:") and os.path.isdir("/home/op")]
