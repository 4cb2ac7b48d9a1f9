# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/apt_repository: apt accepts what the releaser has signed, and nothing else."""

import os
import shutil
import subprocess

import pytest
from support import ROOT

TOOLS = ("apt-ftparchive", "apt-get", "dpkg-deb", "gpg")
KEY = "releaser@chipwise.example"

pytestmark = pytest.mark.skipif(not all(map(shutil.which, TOOLS)), reason="needs apt-utils, dpkg and gnupg")


def package(folder, version, text):
    """A package that has one file."""
    tree = folder / "tree"
    (tree / "DEBIAN").mkdir(parents=True, exist_ok=True)
    (tree / "DEBIAN/control").write_text(
        f"Package: chipwise\nVersion: {version}\nArchitecture: amd64\nMaintainer: a <a@b.example>\nDescription: a\n"
    )
    (tree / "file").write_text(text)
    path = folder / f"chipwise_{version}_amd64.deb"
    subprocess.run(["dpkg-deb", "--root-owner-group", "-b", tree, path], check=True, stdout=subprocess.DEVNULL)
    return path


@pytest.fixture(name="key", scope="module")
def make_key(tmp_path_factory):
    """The environment with a keyring of its own."""
    home = tmp_path_factory.mktemp("gpg")
    home.chmod(0o700)
    env = {**os.environ, "GNUPGHOME": str(home)}
    subprocess.run(
        ["gpg", "--batch", "--quiet", "--passphrase", "", "--quick-gen-key", KEY, "ed25519", "sign"],
        env=env,
        check=True,
        stderr=subprocess.DEVNULL,
    )
    yield env
    subprocess.run(["gpgconf", "--kill", "all"], env=env, stderr=subprocess.DEVNULL)


def lay(folder, env, *packages):
    return subprocess.run(
        [ROOT / "tools/apt_repository", folder, "--key", KEY, "--uri", f"file:{folder}", *packages],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def seen(tmp_path, repository, release):
    """-> (status of apt-get update, versions of chipwise that apt knows then), with an apt of its own."""
    apt = tmp_path / "apt"
    shutil.rmtree(apt, ignore_errors=True)
    for name in ("etc/sources.list.d", "etc/preferences.d", "state/lists/partial", "cache/archives/partial"):
        (apt / name).mkdir(parents=True)
    (apt / "status").touch()
    shutil.copy(repository / f"chipwise-{release}.sources", apt / "etc/sources.list.d")
    options = [
        f"Dir::Etc={apt}/etc",
        f"Dir::State={apt}/state",
        f"Dir::State::status={apt}/status",
        f"Dir::Cache={apt}/cache",
        "APT::Architecture=amd64",
        "APT::Architectures::=amd64",
        "APT::Sandbox::User=root",
        "APT::Update::Error-Mode=any",
    ]
    options = [word for option in options for word in ("-o", option)]
    updated = subprocess.run(
        ["apt-get", *options, "update"],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    known = subprocess.run(
        ["apt-cache", *options, "madison", "chipwise"], text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ).stdout
    return updated.returncode, sorted(line.split("|")[1].strip() for line in known.splitlines())


def test_each_release_sees_its_own_packages_and_older_ones_stay(tmp_path, key):
    repository = tmp_path / "repository"
    for number in (12, 13):
        done = lay(repository, key, package(tmp_path, f"0.4.0+deb{number}u1", "a"))
        assert done.returncode == 0, done.stdout
    assert lay(repository, key, package(tmp_path, "0.5.0+deb12u1", "a")).returncode == 0
    assert seen(tmp_path, repository, "bookworm") == (0, ["0.4.0+deb12u1", "0.5.0+deb12u1"])
    assert seen(tmp_path, repository, "trixie") == (0, ["0.4.0+deb13u1"])
    # a changed index is refused, and so is one signed by somebody else
    for name in ("dists/trixie/main/binary-amd64/Packages", "dists/trixie/main/binary-amd64/Packages.gz"):
        (repository / name).unlink()
    (repository / "dists/trixie/main/binary-amd64/Packages").write_text(
        "Package: chipwise\nVersion: 9\nArchitecture: amd64\n\n"
    )
    assert seen(tmp_path, repository, "trixie") == (100, [])
    text = (repository / "dists/bookworm/InRelease").read_text()
    (repository / "dists/bookworm/InRelease").write_text(text.replace("Label: chipwise", "Label: another"))
    (repository / "dists/bookworm/Release.gpg").unlink()
    assert seen(tmp_path, repository, "bookworm")[0] == 100


def test_what_is_published_is_not_replaced(tmp_path, key):
    repository = tmp_path / "repository"
    assert lay(repository, key, package(tmp_path, "0.4.0+deb12u1", "a")).returncode == 0
    done = lay(repository, key, package(tmp_path, "0.4.0+deb12u1", "b"))
    assert done.returncode == 1 and "is published with another content; raise VERSION" in done.stdout


@pytest.mark.parametrize(
    "version, owner, said",
    [("0.4.0", KEY, "is for no release"), ("0.4.0+deb12u1", "nobody@chipwise.example", "gpg has no key")],
)
def test_what_cannot_be_signed_or_placed_is_refused(tmp_path, key, version, owner, said):
    done = subprocess.run(
        [
            ROOT / "tools/apt_repository",
            tmp_path / "r",
            "--key",
            owner,
            "--uri",
            "file:/r",
            package(tmp_path, version, "a"),
        ],
        env=key,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 1 and said in done.stdout, done.stdout
