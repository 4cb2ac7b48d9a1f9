# SPDX-License-Identifier: GPL-2.0-or-later
"""make install and uninstall: everything in its place, and nothing left behind."""

import hashlib
import os
import re
import subprocess

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def make(target, destdir, prefix="/usr/local"):
    return subprocess.run(
        ["make", "--no-print-directory", target, "DESTDIR=%s" % destdir, "PREFIX=" + prefix],
        cwd=ROOT,
        text=True,
        check=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    ).stdout


def everything(folder):
    return sorted(
        os.path.relpath(os.path.join(place, name), folder)
        for place, folders, names in os.walk(folder)
        for name in folders + names
    )


@pytest.mark.parametrize(
    "prefix, root_name", [("/usr/local", "root"), ("/opt/chip wise", "x'q"), ("/usr/local", 'a "b" ;c &d `e` *')]
)
def test_install_and_uninstall(tmp_path, prefix, root_name):
    destdir = tmp_path / root_name
    (destdir / "usr").mkdir(parents=True)
    (destdir / "usr" / "mine").write_text("stays")
    before = everything(destdir)

    make("install", destdir, prefix)
    share = str(destdir) + prefix + "/share/chipwise"
    for name in ("configs/mill.ini", "hal/sim.hal", "remap/toplevel.py", "bin/chipwise-headless"):
        assert os.path.isfile(os.path.join(share, name)), name
    # the relative paths of the INI files hold where they are installed
    assert os.path.samefile(share + "/configs/remap", share + "/remap")
    assert os.path.isfile(share + "/configs/../bin/chipwise-headless")
    for name in ("chipwise", "chipwise-headless", "chipwise-sandbox"):
        assert os.access(str(destdir) + prefix + "/bin/" + name, os.X_OK)
    installed = everything(destdir)
    built = os.path.join(ROOT, "build", "modules")
    for module in os.listdir(built) if os.path.isdir(built) else []:
        assert any(path.endswith("/" + module) for path in installed), module
    assert not [path for path in installed if path.endswith(".var")]
    # Python compiles where it is used, never in a folder that becomes another system's
    assert not [path for path in installed if path.endswith(".pyc")]

    assert "already installed" in make("install", destdir, prefix)
    said = subprocess.run(
        [str(destdir) + prefix + "/bin/chipwise", "--version"], check=True, text=True, stdout=subprocess.PIPE
    ).stdout
    assert said == "chipwise %s\n" % open(os.path.join(ROOT, "VERSION")).read().strip()
    for page in ("man1/chipwise.1", "man9/stock_tracker.9", "man9/chipwise_inputs.9"):
        assert os.path.isfile(str(destdir) + prefix + "/share/man/" + page), page
    assert os.path.isfile(str(destdir) + prefix + "/share/doc/chipwise/docs/user/settings.md")
    # what LinuxCNC's configuration selector offers names the installed tree, never DESTDIR
    offered = str(destdir) + "/usr/share/linuxcnc/aux_examples/chipwise"
    text = open(offered + "/mill.ini").read()
    assert (
        f"TOPLEVEL = {prefix}/share/chipwise/remap/toplevel.py\n" in text
        and str(destdir) not in text
        and "../" not in text
    )
    assert os.readlink(str(destdir) + "/usr/share/linuxcnc/ncfiles/chipwise") == prefix + "/share/chipwise/nc_files"

    make("uninstall", destdir, prefix)
    assert everything(destdir) == before
    assert "nothing is installed" in make("uninstall", destdir, prefix)


def test_reinstall_replaces_and_removes(tmp_path):
    """A changed file is renewed; one no longer part of the package goes."""
    make("install", tmp_path)
    share = tmp_path / "usr/local/share/chipwise"
    (share / "VERSION").write_text("0.0.0")
    (share / "hal/gone.hal").write_text("of an earlier version")
    manifest = share / "manifest"
    gone = "/usr/local/share/chipwise/hal/gone.hal"
    manifest.write_text(
        manifest.read_text() + "f %s\nh %s %s\n" % (gone, hashlib.sha256(b"of an earlier version").hexdigest(), gone)
    )
    make("install", tmp_path)
    assert (share / "VERSION").read_text() == open(ROOT + "/VERSION").read()
    assert not (share / "hal/gone.hal").exists()
    make("uninstall", tmp_path)
    assert everything(tmp_path) == []


def test_never_replaces_what_is_not_ours(tmp_path):
    path = tmp_path / "usr/local/bin/chipwise"
    path.parent.mkdir(parents=True)
    path.write_text("someone else's")
    with pytest.raises(subprocess.CalledProcessError) as failure:
        make("install", tmp_path)
    assert "not from chipwise" in failure.value.output
    assert everything(tmp_path) == ["usr", "usr/local", "usr/local/bin", "usr/local/bin/chipwise"]


def test_a_file_of_a_package_is_named_with_its_package(tmp_path, monkeypatch):
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "dpkg").write_text('#!/bin/sh\necho "chipwise-data: $2"\n')
    (programs / "dpkg").chmod(0o755)
    monkeypatch.setenv("PATH", "%s:%s" % (programs, os.environ["PATH"]))
    path = tmp_path / "root/usr/local/bin/chipwise"
    path.parent.mkdir(parents=True)
    path.write_text("of the package")
    done = subprocess.run(
        [
            "/usr/bin/python3",
            os.path.join(ROOT, "tools/install.py"),
            "install",
            "--destdir",
            str(tmp_path / "root"),
            "--prefix",
            "/usr/local",
        ],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert (
        done.returncode == 1
        and "is of the package chipwise-data; remove that first: apt remove chipwise-data" in done.stdout
    )
    assert path.read_text() == "of the package"


def test_links_of_the_installed_pages_lead_to_installed_files(tmp_path):
    """Pictures too; other files of the repository are named, without a link."""
    make("install", tmp_path)
    pages, missing = sorted((tmp_path / "usr/local/share/doc/chipwise").rglob("*.md")), set()
    assert len(pages) > 50
    for page in pages:
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
            if not re.match(r"[a-z]+:", target) and not (page.parent / target).exists():
                missing.add((page.name, target))
    assert not missing


def test_build_twice_does_nothing():
    subprocess.run(["make", "build"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    done = subprocess.run(["make", "--no-print-directory", "build"], cwd=ROOT, text=True, stdout=subprocess.PIPE)
    assert "Nothing to be done" in done.stdout
