# SPDX-License-Identifier: GPL-2.0-or-later
"""debian/: what is in which package, which LinuxCNC it needs, and what its scripts do with a user's files.

The packages themselves are built and tried by tools/try_packages.
"""

import fnmatch
import os
import subprocess
import sys

import pytest
from support import ROOT
from support.scripts import load_script

PACKAGES = ("chipwise", "chipwise-data", "chipwise-doc")
BOOKWORM, TRIXIE = "2.9.0~pre1+git20230208.f1270d6ed7-1+deb12u2", "1:2.9.4-2"


def wanted_by(package):
    """Patterns of the paths of a package."""
    return (ROOT / "debian" / (package + ".install")).read_text().split()


def is_in(path, patterns):
    return any(path.startswith(pattern + "/") or fnmatch.fnmatch(path, pattern) for pattern in patterns)


def test_each_file_that_is_installed_is_in_one_package(tmp_path):
    subprocess.run(
        [sys.executable, ROOT / "tools/install.py", "install", "--package", "--destdir", tmp_path, "--prefix", "/usr"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    paths = [
        os.path.relpath(os.path.join(place, name), tmp_path)
        for place, folders, names in os.walk(tmp_path)
        for name in names + [one for one in folders if os.path.islink(os.path.join(place, one))]
    ]
    of = {path: [package for package in PACKAGES if is_in(path, wanted_by(package))] for path in paths}
    assert not {path: found for path, found in of.items() if len(found) != 1}
    assert {of[path][0] for path in paths if path.endswith(".so")} == {"chipwise"}
    assert {of[path][0] for path in paths if "/hallib/" in path} == {"chipwise"}
    assert {of[path][0] for path in paths if path.endswith((".py", ".ini", ".1", ".9", ".mo"))} == {"chipwise-data"}
    unused = [
        pattern
        for package in PACKAGES
        for pattern in wanted_by(package)
        if pattern != "etc/chipwise" and not any(is_in(path, [pattern]) for path in paths)
    ]
    assert not unused


def test_what_is_a_setting_is_in_etc():
    """debian/rules moves the files that users include and change; a file in /etc is a conffile."""
    settings = (ROOT / "debian/rules").read_text().split("SETTINGS = ")[1].split("\n")[0].split()
    assert sorted(settings) == sorted({path.name.removesuffix(".in") for path in (ROOT / "configs").glob("*.inc*")})


def is_allowed(built_with, version):
    """Whether a version of linuxcnc-uspace meets the dependency of modules built with another."""
    text = subprocess.run(
        [ROOT / "tools/linuxcnc_range", built_with], check=True, text=True, stdout=subprocess.PIPE
    ).stdout
    bounds = [part.split("(")[1].rstrip(")\n ").split() for part in text.split(", ")]
    assert [bound[0] for bound in bounds] == [">=", "<<"] and text.count("linuxcnc-uspace (") == 2
    return all(subprocess.run(["dpkg", "--compare-versions", version, *bound]).returncode == 0 for bound in bounds)


@pytest.mark.parametrize(
    "built_with, version, allowed",
    [
        (BOOKWORM, BOOKWORM, True),
        (BOOKWORM, BOOKWORM[:-1] + "9", True),
        (BOOKWORM, TRIXIE, False),
        (BOOKWORM, "2.9.0~pre1+git20230209.aaaaaaaaaa-1", False),
        (BOOKWORM, "1:2.9.0", False),
        (BOOKWORM, "2.9.0-1", False),
        (TRIXIE, TRIXIE, True),
        (TRIXIE, "1:2.9.4", True),
        (TRIXIE, "1:2.9.4-1~bpo12+1", True),
        (TRIXIE, "1:2.9.4-2+deb13u1", True),
        (TRIXIE, "1:2.9.5-1", False),
        (TRIXIE, "1:2.9.4.1", False),
        (TRIXIE, "1:2.9.4+git3-1", False),
        (TRIXIE, "1:2.9.4~pre1-1", False),
        (TRIXIE, "1:2.9.3-9", False),
        (TRIXIE, "2.9.4-2", False),
        (TRIXIE, BOOKWORM, False),
        ("1:2.9.4", "1:2.9.4", True),
        ("1:2.9.4", "1:2.9.5", False),
    ],
)
def test_only_the_linuxcnc_that_it_was_built_with(built_with, version, allowed):
    assert is_allowed(built_with, version) == allowed


def test_without_a_linuxcnc_no_dependency_is_made_up():
    done = subprocess.run([ROOT / "tools/linuxcnc_range", ""], text=True, capture_output=True)
    assert done.returncode == 2 and "linuxcnc-uspace" in done.stderr and not done.stdout


@pytest.mark.parametrize(
    "text, suffix", [('ID=debian\nVERSION_ID="12"\n', "+deb12u1"), ('VERSION_ID="13"\nID=debian\n', "+deb13u1")]
)
def test_the_version_names_the_release(monkeypatch, text, suffix):
    monkeypatch.syspath_prepend(ROOT / "tools")
    monkeypatch.delenv("CHIPWISE_DEB_REVISION", raising=False)
    tree = load_script("deb_tree.py")
    assert tree.release_suffix(text) == suffix
    assert tree.changelog("0.4.0" + suffix, "trixie", "A <a@b>", 0).startswith(
        f"chipwise (0.4.0{suffix}) trixie; urgency=medium\n"
    )
    with pytest.raises(SystemExit, match="built on Debian 12 or 13, and this is Ubuntu"):
        tree.release_suffix('ID=ubuntu\nVERSION_ID="24.04"\nPRETTY_NAME="Ubuntu"')
    assert subprocess.run(["dpkg", "--compare-versions", "0.4.0+deb12u1", "lt", "0.4.0+deb13u1"]).returncode == 0


# --- the functions of the maintainer scripts --------------------------------


@pytest.fixture(name="scripts")
def make_scripts(tmp_path):
    """call(TEXT) -> what the functions of yours.sh print, with a dpkg that has seen the files in `verified` change."""
    programs = tmp_path / "bin"
    programs.mkdir()
    (tmp_path / "verified").touch()
    (programs / "dpkg").write_text(f"#!/bin/sh\n[ \"$1\" = --verify ] && cat '{tmp_path}/verified'\nexit 1\n")
    (programs / "dpkg").chmod(0o755)

    def call(text):
        return subprocess.run(
            ["sh", "-ec", f'. "$0"; kept="$1"; {text}', ROOT / "debian/yours.sh", tmp_path / "kept"],
            check=True,
            text=True,
            env={"PATH": f"{programs}:/usr/bin:/bin"},
            stdout=subprocess.PIPE,
        ).stdout

    return call


def test_a_changed_file_comes_back_after_an_upgrade(tmp_path, scripts):
    mine, other = tmp_path / "kept/a sample.ini", tmp_path / "hallib/chipwise.hal"
    for path in (mine, other):
        path.parent.mkdir()
        path.write_text("mine")
    (tmp_path / "verified").write_text(
        f"??5??????   {mine}\n??5?????? c /etc/chipwise/chipwise.inc\n??5??????   {other}\nmissing     /gone\n"
    )
    scripts("set_aside chipwise-data")
    for path in (mine, other):
        path.write_text("of the package")  # dpkg
    said = scripts(f'give_back "$kept"; name_changed "{tmp_path}/hallib"')
    assert (mine.read_text(), (tmp_path / "kept/a sample.ini.new").read_text()) == ("mine", "of the package")
    assert (other.read_text(), (tmp_path / "hallib/chipwise.hal.yours").read_text()) == ("of the package", "mine")
    assert (
        f"{mine} is as you changed it; the one of this version is {mine}.new" in said
        and f"yours is {other}.yours" in said
    )
    # what the user changes next does not cost the first file
    other.write_text("mine too")
    scripts("set_aside chipwise-data")
    assert {path.read_text() for path in other.parent.glob("*.yours*")} == {"mine", "mine too"}


def test_a_changed_file_is_left_by_a_removal(tmp_path, scripts):
    mine = tmp_path / "kept/mill.ini"
    mine.parent.mkdir()
    mine.write_text("mine")
    (tmp_path / "kept/1.stock").write_text("stock")
    (tmp_path / "kept/mill.ini.new").write_text("of an upgrade before")
    (tmp_path / "verified").write_text(f"??5??????   {mine}\n")
    scripts("set_aside chipwise-data")
    mine.unlink()  # dpkg
    said = scripts('give_back "$kept"; name_left "$kept"')
    assert mine.read_text() == "mine" and {path.name for path in mine.parent.iterdir()} == {"mill.ini", "1.stock"}
    assert [line.split()[1] for line in said.splitlines()] == [str(tmp_path / "kept/1.stock"), str(mine)]
    # the next installation would write over it
    scripts("set_left_aside")
    mine.write_text("of the package")
    scripts('give_back "$kept"')
    assert mine.read_text() == "mine" and (tmp_path / "kept/mill.ini.new").read_text() == "of the package"


@pytest.mark.parametrize("idle", [False, True])
def test_the_packages_own_test_of_the_sample_programs(tmp_path, idle):
    """debian/tests/interpreter passes over the programs of the repository, and sees one that does nothing."""
    shim = tmp_path / "bin/chipwise"
    shim.parent.mkdir()
    shim.write_text(
        f'#!/bin/sh\n{ROOT}/bin/chipwise "$@" || exit\n'
        + ('[ "$1" != new-config ] || echo M2 >"$2/nc_files/tracer/back.ngc"\n' if idle else "")
    )
    shim.chmod(0o755)
    done = subprocess.run(
        [ROOT / "debian/tests/interpreter"],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "AUTOPKGTEST_TMP": str(tmp_path), "PATH": f"{shim.parent}:{os.environ['PATH']}"},
    )
    last = done.stdout.splitlines()[-1]
    if idle:
        assert (
            done.returncode != 0 and last == "nc_files/tracer/back.ngc on tracer.ini: nothing moves or is switched"
        ), done.stdout
    else:
        assert done.returncode == 0 and last.startswith("nc_files/tracer/trace.ngc on tracer.ini: "), done.stdout
