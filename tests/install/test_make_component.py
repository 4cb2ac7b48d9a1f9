# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/make_component.py: components/*.comp for a LinuxCNC 2.10, and the same for 2.9."""

import os
import re
import subprocess

import pytest

from support import ROOT
from support.scripts import load_script

SOURCES = sorted((ROOT / "components").glob("*.comp"))
NEW = {"float": "real", "bit": "bool", "s32": "si32", "u32": "ui32"}

SMALL = """component small "One";
pin in real a = 1.5 "in";
pin out bool b "out";
pin io ui32 c_#[3] "three";
param rw si32 d = -1 "set";
function _;
function fast /* nofp */;
license "GPL";
;;
EXTRA_SETUP() { return 0; }
POST_EXPORT() { d_set(7); return 0; }
FUNCTION(_) { b_set(a > 1.0); c_set(2, d); }
"""
OLD = """component small "One";
pin in float a = 1.5 "in";
pin out bit b "out";
pin io u32 c_#[3] "three";
param rw s32 d = -1 "set";
function _;
function fast nofp;
license "GPL";
;;
#define b_set(v) (b = (v))
#define c_set(i, v) (c(i) = (v))
#define d_set(v) (d = (v))
"""


@pytest.fixture(scope="module")
def tool():
    return load_script("make_component.py")


@pytest.fixture
def halcompile(tmp_path, monkeypatch):
    """A halcompile on the PATH with an exit status that the test chooses."""

    def make(status):
        program = tmp_path / "halcompile"
        program.write_text(f"#!/bin/sh\nexit {status}\n")
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    return make


def written(source, target):
    subprocess.run([ROOT / "tools/make_component.py", source, target], check=True)
    return target.read_text()


def test_old_spelling(tool):
    text = tool.old_spelling(SMALL, "small.comp")
    assert text.startswith(OLD)
    rest = text.removeprefix(OLD)
    assert (
        rest.index("#define POST_EXPORT()")
        < rest.index('#line 10 "small.comp"\nEXTRA_SETUP() {')
        < rest.index("static int extra_setup(")
    )
    assert "extra_setup" not in tool.old_spelling(SMALL.replace("POST_EXPORT() {", "other() {"), "small.comp")


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_every_component(tool, path):
    """Back to the new types it is the committed file, and each NAME_set that is used has a macro."""
    source = path.read_text()
    old = tool.old_spelling(source, path)
    head, body = old.split("\n;;\n", 1)
    back = re.sub(r"^((?:pin|param) \w+ )(\w+)", lambda found: found[1] + NEW[found[2]], head, flags=re.MULTILINE)
    assert back.replace(" nofp;", " /* nofp */;") == source.split("\n;;\n")[0]
    used, macros = (
        set(re.findall(pattern, body)) for pattern in (r"(?<!#define )\b(\w+_set)\(", r"#define (\w+_set)\(")
    )
    assert used and used <= macros


def test_a_halcompile_that_knows_the_types_gets_a_copy(halcompile, tmp_path):
    halcompile(0)
    assert written(SOURCES[0], tmp_path / "out.comp") == SOURCES[0].read_text()


def test_one_that_refuses_them_gets_the_old_ones(halcompile, tool, tmp_path):
    halcompile(1)
    assert written(SOURCES[0], tmp_path / "out.comp") == tool.old_spelling(SOURCES[0].read_text(), SOURCES[0])


def test_the_installed_one_reads_what_it_gets(tmp_path):
    path = ROOT / "components/stock_tracker.comp"
    written(path, tmp_path / "stock_tracker.comp")
    subprocess.run(
        ["halcompile", "--preprocess", tmp_path / "stock_tracker.comp"], check=True, stdout=subprocess.DEVNULL
    )
    assert "static int extra_setup(" in (tmp_path / "stock_tracker.c").read_text()
