# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise new-config: a folder that works where it is, and nothing of the user's replaced."""

import os
import re
import shlex

import pytest

from chipwise.cli import new_config
from chipwise.machine.sample_folder import sample_files
from support import ROOT, forked

PATHS = re.compile(
    r"(HALFILE|POSTGUI_HALFILE|PYVCP|TOOL_TABLE|TOOL_GEOMETRY|STATIONS|CLAMPS|TOPLEVEL|PATH_PREPEND|OPEN_FILE|"
    r"PROGRAM_PREFIX"
    r"|PATTERNS|SUBROUTINE_PATH) = (.*)"
)
ABSENT = "stations.toml", "clamps.toml"  # made when first needed


def chipwise(*arguments, **options):
    return forked.run([forked.CHIPWISE, *arguments], timeout=300, **options)


def content(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_line_that_starts_it_is_one_for_a_shell(tmp_path):
    """Also in a folder with blanks and other signs of the shell."""
    folder = tmp_path / "Meine Fräse (neu)"
    line = chipwise("new-config", folder).stdout.splitlines()[-1]
    assert shlex.split(line) == ["linuxcnc", f"{folder}/mill.ini"]


def test_the_default_folder_is_where_linuxcnc_keeps_configurations(tmp_path):
    done = chipwise("new-config", env={**os.environ, "HOME": str(tmp_path)})
    folder = tmp_path / "linuxcnc" / "configs" / "chipwise"
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith(f"\n  linuxcnc {folder}/mill.ini\n") and (folder / "mill.ini").is_file()


def entries(text):
    return [line.split(" = ", 1) for line in text.splitlines() if " = " in line and line[0] != "#"]


def test_every_path_holds_wherever_the_folder_is(tmp_path):
    assert chipwise("new-config", tmp_path / "machine").returncode == 0
    machines = sorted((tmp_path / "machine").glob("*.ini"))
    assert [path.name for path in machines] == sorted(path.name for path in (ROOT / "configs").glob("*.ini"))
    checked = 0
    for ini in machines:
        text = ini.read_text()
        assert "../" not in text, ini
        for key, value in entries(text):
            found = PATHS.fullmatch(f"{key} = {value}")
            for path in found[2].split(":") if found and not value.startswith("LIB:") else ():
                assert path in ABSENT or (ini.parent / path).exists(), (ini.name, key, path)
                checked += 1
            if value.startswith("LIB:"):
                assert value == "LIB:chipwise.hal" and new_config.in_library()
        command = next(value for key, value in entries(text) if key == "DISPLAY").split()[0]
        assert "/" not in command or os.access(command, os.X_OK), (ini.name, command)
    assert checked > 80


@pytest.mark.parametrize("found", ["same", "other", None])
def test_the_hal_library_is_named_if_it_has_this_chipwise_hal(found, tmp_path):
    """A repository that is not installed starts in a sandbox, and one beside another version runs with its own."""
    library, commands = tmp_path / "hallib", tmp_path / "bin"
    for folder in (library, commands):
        folder.mkdir()
    (commands / "linuxcnc_var").write_text(f"#!/bin/sh\necho {library}\n")
    (commands / "linuxcnc_var").chmod(0o755)
    if found:
        (library / "chipwise.hal").write_text((ROOT / "hal" / "chipwise.hal").read_text() if found == "same" else "old")
    assert (
        chipwise(
            "new-config", tmp_path / "machine", env={**os.environ, "PATH": f"{commands}:{os.environ['PATH']}"}
        ).returncode
        == 0
    )
    hal = [value for key, value in entries((tmp_path / "machine" / "mill.ini").read_text()) if key == "HALFILE"]
    assert hal == ["sim.hal", "LIB:chipwise.hal" if found == "same" else f"{ROOT}/hal/chipwise.hal"]


def test_it_is_the_same_machine_as_in_the_repository(tmp_path):
    """Every entry but those of paths."""
    assert chipwise("new-config", tmp_path / "machine").returncode == 0
    for ini in (tmp_path / "machine").glob("*.ini"):
        theirs, ours = (entries(path.read_text()) for path in (ROOT / "configs" / ini.name, ini))
        assert [key for key, _ in theirs] == [key for key, _ in ours]
        changed = {key for (key, old), (_, new) in zip(theirs, ours) if old != new}
        assert changed <= {
            "PROGRAM_PREFIX",
            "OPEN_FILE",
            "PATTERNS",
            "SUBROUTINE_PATH",
            "TOPLEVEL",
            "PATH_PREPEND",
            "HALFILE",
            "POSTGUI_HALFILE",
            "DISPLAY",
            "EMBED_TAB_COMMAND",
        }


@pytest.mark.parametrize("name", ["mill.ini", "notes.txt"])
def test_a_folder_with_a_file_of_the_users_is_left_as_it_is(tmp_path, name):
    (tmp_path / name).write_text("mine")
    done = chipwise("new-config", tmp_path)
    assert (done.returncode, done.stdout) == (2, "") and f"{tmp_path} is not empty" in done.stderr
    assert content(tmp_path) == {(tmp_path / name).relative_to(tmp_path): b"mine"}


def test_a_second_time_changes_nothing(tmp_path):
    folder = tmp_path / "machine"
    assert chipwise("new-config", folder).returncode == 0
    (folder / "tools.toml").write_text("[tool.1]\n")
    before = content(folder)
    assert chipwise("new-config", folder).returncode == 2 and content(folder) == before


def test_a_place_that_cannot_be_used(tmp_path):
    (tmp_path / "file").write_text("mine")
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        done = chipwise("new-config", place)
        assert done.returncode == 2 and f"{place} cannot be used" in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "file").read_text() == "mine"


def test_a_file_that_appears_meanwhile_is_kept_and_the_rest_taken_away(tmp_path):
    """Whoever writes there at the same time: their file stays, and no half folder is left that looks like one."""
    (tmp_path / "mill.ini").write_text("mine")
    with pytest.raises(FileExistsError):
        new_config.write(str(tmp_path), sample_files(str(ROOT), str(ROOT)))
    assert content(tmp_path) == {(tmp_path / "mill.ini").relative_to(tmp_path): b"mine"}


def test_a_path_that_an_ini_file_cannot_hold(monkeypatch, tmp_path):
    monkeypatch.setattr(new_config, "ROOT", "/home/me/my tools/chipwise")
    with pytest.raises(Exception, match="without blanks"):
        new_config.run(type("Options", (), {"folder": str(tmp_path / "machine")}))
    assert not (tmp_path / "machine").exists()


def test_installed_without_arguments_it_leads_to_a_folder_of_ones_own(monkeypatch, tmp_path):
    """In the repository the machines start where they are; where chipwise is installed the folder belongs to root."""
    from chipwise import cli

    assert f"linuxcnc {ROOT}/configs/mill.ini" in "\n".join(cli.machine_lines())
    monkeypatch.setattr(cli, "ROOT", str(tmp_path))
    text = "\n".join(cli.machine_lines())
    assert (
        "chipwise new-config" in text
        and "linuxcnc ~/linuxcnc/configs/chipwise/mill.ini" in text
        and str(tmp_path) not in text
    )
