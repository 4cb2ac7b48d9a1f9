# SPDX-License-Identifier: GPL-2.0-or-later
"""What a user has changed survives make install and make uninstall, and is named."""

import hashlib
import os
import subprocess

import pytest
from support import ROOT

SHARE = "usr/local/share/chipwise/"
INI, TOOLS, HAL, SCREEN = (
    SHARE + "configs/mill.ini",
    SHARE + "configs/tools.toml",
    SHARE + "hal/sim.hal",
    SHARE + "configs/panel.xml",
)
MINE = "# of the user\n"


def run(action, destdir, *options):
    """-> what install.py said."""
    return subprocess.run(
        [
            "/usr/bin/python3",
            ROOT / "tools/install.py",
            action,
            "--destdir",
            destdir,
            "--prefix",
            "/usr/local",
            *options,
        ],
        check=True,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    ).stdout


def files(folder):
    """{path: content} of the regular files."""
    found = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(place, name)
            if not os.path.islink(path):
                with open(path, "rb") as handle:
                    found[os.path.relpath(path, folder)] = handle.read()
    return found


def earlier(destdir, name, text, with_hash=True):
    """Make an installed file that of an earlier version, as its manifest has it."""
    path, manifest = destdir / name, destdir / SHARE / "manifest"
    old, new = hashlib.sha256(path.read_bytes()).hexdigest(), hashlib.sha256(text.encode()).hexdigest()
    path.write_text(text)
    lines = manifest.read_text().replace(old, new)
    manifest.write_text(
        lines if with_hash else "".join(line for line in lines.splitlines(True) if not line.startswith("h "))
    )


@pytest.fixture
def destdir(tmp_path):
    run("install", tmp_path)
    return tmp_path


def test_a_changed_setting_stays_and_the_new_one_is_beside_it(destdir):
    offered = (destdir / INI).read_text()
    earlier(destdir, INI, "# of the version before\n")
    earlier(destdir, SCREEN, "<!-- of the version before -->\n")  # the user has not touched it
    (destdir / INI).write_text(MINE)
    (destdir / TOOLS).write_text(MINE)  # the version before had the same
    said = run("install", destdir)
    assert (destdir / INI).read_text() == MINE and (destdir / (INI + ".new")).read_text() == offered
    assert f"{destdir}/{INI} stays as you have changed it; the one of this version is {destdir}/{INI}.new" in said
    assert (destdir / TOOLS).read_text() == MINE and not (destdir / (TOOLS + ".new")).exists()
    assert (destdir / SCREEN).read_text() == (ROOT / "configs/panel.xml").read_text()
    assert "already installed" in run("install", destdir)
    # taken over: FILE.new goes
    (destdir / INI).write_text(offered)
    run("install", destdir)
    assert not (destdir / (INI + ".new")).exists() and (destdir / INI).read_text() == offered


def test_a_hal_file_has_to_fit_and_the_changed_one_is_beside_it(destdir):
    for text in (MINE, "# changed again\n"):
        (destdir / HAL).write_text(text)
        said = run("install", destdir)
        assert (destdir / HAL).read_text() == (ROOT / "hal/sim.hal").read_text()
        assert f"{destdir}/{HAL} is the one of this version; the one you have changed is {destdir}/{HAL}.yours" in said
    assert {(destdir / (HAL + end)).read_text() for end in (".yours", ".yours.2")} == {MINE, "# changed again\n"}


def test_an_upgrade_from_a_manifest_without_hashes_loses_nothing(destdir):
    earlier(destdir, INI, MINE, with_hash=False)
    (destdir / HAL).write_text(MINE)
    run("install", destdir)
    assert (destdir / INI).read_text() == MINE and (destdir / (HAL + ".yours")).read_text() == MINE
    assert (destdir / (INI + ".new")).read_text() == (ROOT / "configs/mill.ini").read_text()


def test_removal_leaves_and_names_what_is_the_users(destdir):
    (destdir / INI).write_text(MINE)
    stock = destdir / SHARE / "configs/stock/1.stock"
    stock.parent.mkdir()
    stock.write_bytes(b"stock")
    said = run("uninstall", destdir)
    assert files(destdir) == {INI: MINE.encode(), SHARE + "configs/stock/1.stock": b"stock"}
    for path in (destdir / INI, stock):
        assert f"chipwise: {path} is yours and stays\n" in said
    # the next installation keeps them, too
    run("install", destdir)
    assert (destdir / INI).read_text() == MINE and stock.read_bytes() == b"stock"


def test_a_package_has_no_manifest_and_nothing_compiled(tmp_path):
    run("install", tmp_path, "--package")
    names = files(tmp_path)
    assert INI in names and SHARE + "manifest" not in names
    assert not [name for name in names if name.endswith((".pyc", ".stock", ".var", ".new", ".yours"))]
