# SPDX-License-Identifier: GPL-2.0-or-later
"""VERSION is the one source: the library, the command line tools and the man pages have it."""

import ctypes
import re
import subprocess

import pytest
from support import ROOT

from chipwise import version
from chipwise.clib.library import library

VERSION = (ROOT / "VERSION").read_text().strip()


def test_the_package_and_the_library():
    assert re.fullmatch(r"[0-9]+\.[0-9]+\.[0-9]+", VERSION)
    assert version() == VERSION
    assert ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(library(), "chip_version"))).decode() == VERSION


@pytest.mark.parametrize("program", ["chipwise", "chipwise-sandbox", "chipwise-headless"])
def test_the_programs(program):
    done = subprocess.run([ROOT / "bin" / program, "--version"], text=True, capture_output=True)
    assert (done.returncode, done.stdout) == (0, f"chipwise {VERSION}\n")


def test_the_man_pages():
    pages = sorted((ROOT / "build" / "man").iterdir())
    assert {page.name for page in pages} >= {
        "chipwise.1",
        "chipwise-sandbox.1",
        "chipwise-headless.1",
        "stock_tracker.9",
    }
    for page in pages:
        assert f'"chipwise {VERSION}"' in page.read_text(), page
