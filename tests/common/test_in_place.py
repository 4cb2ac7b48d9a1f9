# SPDX-License-Identifier: GPL-2.0-or-later
"""A LinuxCNC that is run in place: where its modules and its lists of shared buffers are found."""

import os

import pytest

from chipwise.errors import CycleError
from chipwise.machine import covers
from chipwise.machine.kinematics import Kinematics


@pytest.fixture(name="linuxcnc")
def make_linuxcnc(tmp_path, monkeypatch):
    """The folder of one, built below a checkout that is called chipwise."""
    folder = tmp_path / "chipwise/build/linuxcnc"
    for name, text in (
        ("scripts/linuxcnc", "#!/bin/sh\n"),
        ("bin/halcompile", "#!/bin/sh\n"),
        ("configs/common/linuxcnc.nml", ""),
        ("src/Makefile.modinc", f"RTLIBDIR := {folder}/rtlib\n"),
    ):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)
    (folder / "rtlib").mkdir()
    monkeypatch.setenv("PATH", f"{folder}/bin:{folder}/scripts:{os.environ['PATH']}")
    monkeypatch.delenv("HAL_RTMOD_DIR", raising=False)
    return folder


def test_its_lists_of_shared_buffers_are_known(linuxcnc):
    assert str(linuxcnc / "configs/common/linuxcnc.nml") in covers.nml_lists()


def test_its_modules_come_before_those_of_a_package(linuxcnc):
    assert covers.module_directory() == str(linuxcnc / "rtlib")
    with pytest.raises(CycleError, match=f"there is no kinematics module nokins in {linuxcnc}/rtlib, "):
        Kinematics("nokins")


def test_a_folder_above_it_is_not_taken_for_an_installed_chipwise(linuxcnc, tmp_path):
    assert not covers.own_folder(str(tmp_path / "chipwise")) and covers.own_folder(str(linuxcnc / "chipwise"))
