# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole C core under ASan and UBSan: each C program of this folder, and the tests that call the library from
Python."""

import pytest

from support import ROOT, sanitized, unchanged
from support.library_tests import GROUPS, sanitized_arguments

PROGRAMS = sorted(path.stem for path in (ROOT / "tests/core").glob("*.c"))


@pytest.mark.inputs(lambda name: unchanged.c_program(name))
@pytest.mark.parametrize("name", PROGRAMS)
def test_program(name):
    status, text = sanitized.run([sanitized.folder() / "tests" / name])
    assert status == 0, text


@pytest.mark.inputs(
    lambda group: [*unchanged.c_files(), *GROUPS[group], *(unchanged.package() if group == "programs" else ())]
)
@pytest.mark.parametrize("group", GROUPS)
def test_library(group):
    status, text = sanitized.run_tests(sanitized.folder() / "libchipwise.so", *sanitized_arguments(group))
    assert status == 0, text[-8000:]


@pytest.mark.inputs(lambda: [*unchanged.c_files(), "tests/surface/test_arcs.py"])
def test_a_read_behind_an_array_is_reported(tmp_path):
    """One fault compiled in (fault.h): the last station's successor is read, 8 bytes behind an array of numpy's."""
    library = sanitized.library_with(tmp_path, "offline/chain_fit", "STATION_BEYOND")
    status, text = sanitized.run_tests(library, "tests/surface/test_arcs.py::test_every_station_is_in_its_band")
    assert status != 0 and "AddressSanitizer: heap-buffer-overflow" in text and "line_reach" in text, text[-8000:]
