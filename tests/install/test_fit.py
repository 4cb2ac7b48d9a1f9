# SPDX-License-Identifier: GPL-2.0-or-later
"""Components, programs and LinuxCNC of different versions do not run together: remap/chipwise/host/fit.py,
clib/library.py."""

import ctypes
import shutil
import subprocess
import sys

import pytest
from support import ROOT

from chipwise import version
from chipwise.host import fit
from chipwise.errors import CycleError, LibraryError
from chipwise.host.fit import MARK, MODULES, Stamp, check_fit, check_stamp, fingerprint, stamp_of
from chipwise.clib import library

MADE = ROOT / "build/modules"
WANTED = Stamp("0.5.0", "2.9.4", "aa")


def test_every_component_has_the_stamp_of_this_build():
    stamps = {stamp_of(path) for path in MADE.glob("*.so")}
    assert stamps == {Stamp(version(), fit.linuxcnc_version(), fingerprint())}
    assert (
        {path.stem for path in MADE.glob("*.so")}
        == {path.stem for path in (ROOT / "components").glob("*.comp")}
        >= set(MODULES)
    )


def test_a_stamp_survives_strip(tmp_path):
    subprocess.run(["strip", "-o", tmp_path / "a.so", MADE / "stock_tracker.so"], check=True)
    assert stamp_of(tmp_path / "a.so") == stamp_of(MADE / "stock_tracker.so")


@pytest.mark.parametrize(
    "stamp, said",
    [
        (None, "earlier chipwise, without a stamp"),
        (WANTED._replace(chipwise="0.4.0"), "is of chipwise 0.4.0, and the programs are 0.5.0"),
        (WANTED._replace(linuxcnc="2.9.0"), "built for LinuxCNC 2.9.0, and this is LinuxCNC 2.9.4"),
        (WANTED._replace(headers="bb"), "other headers of LinuxCNC 2.9.4"),
    ],
)
def test_what_differs_is_refused_with_the_remedy(stamp, said):
    with pytest.raises(CycleError, match=said) as refused:
        check_stamp("stock_tracker.so", stamp, WANTED)
    assert str(refused.value).startswith("chipwise: stock_tracker.so ") and "rebuild: `make install`" in str(
        refused.value
    )


def test_headers_that_are_not_there_are_not_compared():
    for stamp, wanted in (
        (WANTED, WANTED),
        (WANTED._replace(headers="none"), WANTED),
        (WANTED, WANTED._replace(headers="none")),
    ):
        check_stamp("stock_tracker.so", stamp, wanted)


def test_the_fingerprint_is_of_names_and_texts(tmp_path):
    found = [fingerprint(tmp_path)]
    for name, text in (("motion.h", "int a;"), ("motion.h", "int a, b;"), ("tc.h", ""), ("readme", "no header")):
        (tmp_path / name).write_text(text)
        found.append(fingerprint(tmp_path))
    assert found[0] == "none" and len(set(found)) == 4 and found[3] == found[4]


def test_of_the_package_the_remedy_is_apt(monkeypatch):
    monkeypatch.setattr(fit, "ROOT", "/usr/share/chipwise")
    assert "apt install --reinstall" in fit.remedy()


@pytest.fixture(name="modules")
def copy_modules(tmp_path, monkeypatch):
    folder = tmp_path / "modules"
    folder.mkdir()
    for name in MODULES:
        shutil.copy(MADE / (name + ".so"), folder)
    monkeypatch.setattr(fit, "module_folder", lambda: folder)
    return folder


def make_old(path):
    """Give a component the stamp of another chipwise."""
    content = path.read_bytes()
    changed = content.replace(MARK + version().encode() + b" ", MARK + b"9" * len(version()) + b" ")
    assert changed != content
    path.write_bytes(changed)


@pytest.mark.parametrize("name", MODULES)
def test_one_old_or_lost_component_is_enough(modules, name):
    check_fit()
    make_old(modules / (name + ".so"))
    with pytest.raises(CycleError, match=name + r"\.so is of chipwise 99"):
        check_fit()
    (modules / (name + ".so")).unlink()
    with pytest.raises(CycleError, match=name + r"\.so cannot be read: No such file"):
        check_fit()


def test_another_linuxcnc_is_refused(modules, monkeypatch):
    monkeypatch.setenv("LINUXCNCVERSION", "2.9.99")
    with pytest.raises(CycleError, match=r"was built for LinuxCNC .*, and this is LinuxCNC 2\.9\.99"):
        check_fit()


def test_chipwise_load_refuses_and_loads_nothing(modules):
    """In a sandbox, where LinuxCNC's folder of modules has these."""
    make_old(modules / "chipwise_guard.so")
    done = subprocess.run(
        [ROOT / "bin/chipwise-sandbox", "--modules", modules, "--", ROOT / "bin/chipwise", "load"],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
    )
    assert done.returncode == 1
    assert done.stderr.strip().endswith("rebuild: `make install` in chipwise's folder"), done.stderr
    assert (
        f"chipwise: chipwise_guard.so is of chipwise {'9' * len(version())}, and the programs are {version()}"
        in done.stderr
    )


def test_a_library_of_another_version_is_refused(tmp_path):
    path = tmp_path / "libchipwise.so"
    content = (ROOT / "build/libchipwise.so").read_bytes()
    assert content.count(version().encode() + b"\0") == 1
    path.write_bytes(content.replace(version().encode() + b"\0", b"9" * len(version()) + b"\0"))
    with pytest.raises(LibraryError, match="is of chipwise 9+, and the programs are"):
        library._check_version(ctypes.CDLL(str(path)), path)


def test_make_builds_again_for_another_linuxcnc(tmp_path):
    """The stamp is compared at each make, whatever the dates of the files are."""
    program = "from chipwise.host.fit import Stamp; print(Stamp('1', '2', '3').text())"
    printed = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT / "remap", text=True, check=True, capture_output=True
    ).stdout
    assert printed == "chipwise-stamp 1 2 3\n"
    asked = subprocess.run(
        ["make", "-n", "build/modules/tracer.so"],
        cwd=ROOT,
        text=True,
        check=True,
        stdout=subprocess.PIPE,
        env={"PATH": "/usr/bin:/bin", "LINUXCNCVERSION": "2.9.99"},
    ).stdout
    assert "build_stamp" in asked and "halcompile --compile" in asked
