# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/motion_headers: a LinuxCNC that does not install the headers of its motion needs its source, of the same
version."""

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
    assert headers.options("", tmp_path, lambda: "2.9.4") == [f'-I"{tmp_path}"']
    assert headers.options("") == []  # Debian's, which are on the include path


@pytest.mark.parametrize(
    "text, folder",
    [
        (
            "EMC2_HOME=/usr\nRUN_IN_PLACE=no\nifeq ($(RUN_IN_PLACE),yes)\nelse\nprefix := /usr\n"
            "EXTRA_CFLAGS := -D__MODULE__ -I${prefix}/include/linuxcnc\nendif\n",
            "/usr/include/linuxcnc",
        ),
        (
            "prefix := /opt/cnc\nEXTRA_CFLAGS := -D__MODULE__ -I$(prefix)/include/linuxcnc\n",
            "/opt/cnc/include/linuxcnc",
        ),
        (
            "EMC2_HOME=/home/u/linuxcnc\nRUN_IN_PLACE=yes\nprefix := /usr\n"
            "EXTRA_CFLAGS := -I${prefix}/include/linuxcnc\n",
            "/home/u/linuxcnc/include",
        ),
    ],
)
def test_the_headers_are_those_of_halcompile(headers, tmp_path, text, folder):
    """Another LinuxCNC on the PATH beside Debian's package."""
    (tmp_path / "Makefile.modinc").write_text(text)
    assert str(headers.header_folder(tmp_path / "Makefile.modinc")) == folder


def on_path(tmp_path, modinc):
    """motion_headers with a halcompile that says `modinc`, which has no headers of motion; Debian's are installed."""
    own = tmp_path / "bin"
    own.mkdir()
    (own / "halcompile").write_text(f"#!/bin/sh\n{modinc}\n")
    (own / "halcompile").chmod(0o755)
    return subprocess.run(
        [ROOT / "tools/motion_headers", ""],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=dict(os.environ, PATH=f"{own}:{os.environ['PATH']}"),
    )


def test_debians_headers_do_not_stand_in_for_another_linuxcnc(tmp_path):
    (tmp_path / "Makefile.modinc").write_text(f"EMC2_HOME={tmp_path}\nRUN_IN_PLACE=yes\n")
    done = on_path(tmp_path, f"echo {tmp_path}/Makefile.modinc")
    assert done.returncode == 1 and done.stdout == "" and "has not installed the headers of its motion" in done.stderr


def test_no_makefile(tmp_path):
    done = on_path(tmp_path, "exit 1")
    assert done.returncode == 1 and done.stderr.startswith("chipwise: halcompile does not say where"), done.stderr


def test_a_compiler_error_is_a_sentence(headers, source):
    (source / "src" / headers.NEEDED[0]).write_text("#include <no_such_header.h>\n")
    with pytest.raises(
        ValueError,
        match=r"do not compile with this LinuxCNC \(2\.10\.0\): no_such_header\.h: No such file or directory; they "
        r"have",
    ):
        headers.check_compiled(
            headers.options(str(source), headers.INSTALLED, lambda: "2.10.0"), headers.INSTALLED, lambda: "2.10.0"
        )


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
    done = subprocess.run(
        [ROOT / "tools/motion_headers", str(tmp_path)], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert (
        done.returncode == 1
        and done.stdout == ""
        and done.stderr.startswith(f"chipwise: LINUXCNC_SOURCE={tmp_path} has no VERSION")
    )


def test_how_the_planner_brakes(headers, source, tmp_path):
    """A planner that halves its acceleration only while two segments overlap says so in tc.h."""
    header = source / "src/emc/tp/tc.h"
    for text, option in [
        ("double tcGetTangentialMaxAccel(TC_STRUCT const * const tc);\n", False),
        ("double tcGetCycleMaxAccel(TC_STRUCT const * const tc, int in_overlap);\n", True),
    ]:
        header.write_text(text)
        assert ("-DCHIP_HALF_IN_OVERLAP=1" in headers.options(str(source), tmp_path, lambda: "2.10.0")) is option
        for name in headers.NEEDED:
            (tmp_path / os.path.basename(name)).write_text("")
        (tmp_path / "tc.h").write_text(text)
        assert ("-DCHIP_HALF_IN_OVERLAP=1" in headers.options("", tmp_path, lambda: "2.10.0")) is option
