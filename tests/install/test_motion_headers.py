# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/motion_headers: a LinuxCNC that does not install the headers of its motion needs its source, of the same version."""

import os
import subprocess

import pytest

from support import ROOT
from support.scripts import load_script


@pytest.fixture(scope="module")
def headers():
    return load_script("motion_headers")


@pytest.fixture
def source(headers, tmp_path):
    """A folder that looks like LinuxCNC's source; its name has a space."""
    root = tmp_path / "linux cnc"
    for folder in headers.FOLDERS:
        (root / "src" / folder).mkdir(parents=True)
    for name in headers.NEEDED:
        (root / "src" / name).write_text("int from_the_source;\n")
    (root / "VERSION").write_text("2.10.0\n")
    return root


def test_installed_headers_need_nothing(headers, tmp_path):
    for name in headers.NEEDED:
        (tmp_path / os.path.basename(name)).write_text("")
    assert headers.options("", tmp_path, lambda: "2.9.4") == []


def test_without_them_the_source_is_asked_for(headers, tmp_path):
    with pytest.raises(ValueError, match=r"this LinuxCNC \(2\.10\.0\) has not installed .*LINUXCNC_SOURCE"):
        headers.options("", tmp_path, lambda: "2.10.0")


def test_the_source_is_of_the_same_version(headers, source, tmp_path):
    with pytest.raises(ValueError, match=r"is version 2\.10\.0, and LinuxCNC is 2\.10\.1"):
        headers.options(str(source), tmp_path, lambda: "2.10.1")
    with pytest.raises(ValueError, match="has no VERSION"):
        headers.options(str(tmp_path), tmp_path, lambda: "2.10.0")
    (source / "src" / headers.NEEDED[1]).unlink()
    with pytest.raises(ValueError, match=r"has no src/emc/tp/tc_types\.h"):
        headers.options(str(source), tmp_path, lambda: "2.10.0")


def test_the_compiler_reads_them(headers, source, tmp_path):
    (tmp_path / "options").write_text("\n".join(headers.options(str(source), tmp_path, lambda: "2.10.0")))
    (tmp_path / "a.c").write_text("#include <motion.h>\nint *there(void) { return &from_the_source; }\n")
    subprocess.run(["gcc", f"@{tmp_path}/options", "-c", "-o", os.devnull, tmp_path / "a.c"], check=True)


def test_make_stops_with_the_reason(tmp_path):
    done = subprocess.run([ROOT / "tools/motion_headers", str(tmp_path)], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.startswith(f"chipwise: LINUXCNC_SOURCE={tmp_path} has no VERSION")
