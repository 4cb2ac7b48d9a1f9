# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/on-linuxcnc: which folder is a source, which is built already, and what is copied."""

import subprocess

import pytest

from support import ROOT
from support.scripts import load_script


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    return load_script("on-linuxcnc")


@pytest.fixture
def source(tmp_path):
    """A folder that looks like LinuxCNC's source; its name has a space."""
    root = tmp_path / "linux cnc"
    for name, text in (
        ("VERSION", "2.10.0\n"),
        ("src/configure.ac", ""),
        ("src/emc/motion/motion.h", "int a;\n"),
        ("docs/a.txt", "a"),
    ):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


def test_a_source_has_a_version(tool, source):
    assert tool.version_of(source) == "2.10.0"
    (source / "src/emc/motion/motion.h").unlink()
    with pytest.raises(tool.Refusal, match="has no src/emc/motion/motion.h; give the folder of LinuxCNC's source"):
        tool.version_of(source)


def test_another_folder_is_refused(tmp_path):
    done = subprocess.run([ROOT / "tools/on-linuxcnc", tmp_path, "true"], text=True, capture_output=True)
    assert (
        done.returncode == 1
        and done.stderr == f"chipwise: {tmp_path} has no VERSION; give the folder of LinuxCNC's source\n"
    )


def test_what_is_compiled_counts(tool, source):
    first = tool.hash_of(source)
    (source / "docs/a.txt").write_text("b")
    assert tool.hash_of(source) == first
    (source / "src/emc/motion/motion.h").write_text("int b;\n")
    assert tool.hash_of(source) != first


def test_a_build_counts_where_it_was_made(tool, source):
    assert not tool.is_built(source)
    (source / "rtlib").mkdir()
    (source / "rtlib/motmod.so").write_text("")
    inc = source / "src/Makefile.inc"
    inc.write_text(f"EMC2_HOME={source}\nRUN_IN_PLACE = yes\n".replace(" cnc", "cnc"))
    assert not tool.is_built(source)  # another folder
    plain = source.rename(source.parent / "linuxcnc")
    (plain / "src/Makefile.inc").write_text(f"EMC2_HOME={plain}\nRUN_IN_PLACE = yes\n")
    assert tool.is_built(plain)
    (plain / "src/Makefile.inc").write_text(f"EMC2_HOME={plain}\nRUN_IN_PLACE = no\n")
    assert not tool.is_built(plain)
    (plain / "src/Makefile.inc").write_text(f"EMC2_HOME={plain}\nRUN_IN_PLACE = yes\n")
    (plain / "rtlib/motmod.so").unlink()
    assert not tool.is_built(plain)


def test_the_copy_is_what_git_knows(tool, tmp_path):
    """What is the same keeps its time, so that make does not build it again; what is gone is taken away; build/ is its
    own."""
    tool.copied_chipwise(tmp_path)
    makefile = tmp_path / "Makefile"
    at = makefile.stat().st_mtime_ns
    assert makefile.read_bytes() == (ROOT / "Makefile").read_bytes()
    (tmp_path / "VERSION").write_text("0.0.0\n")
    (tmp_path / "components/old.comp").write_text("")
    (tmp_path / "build").mkdir()
    (tmp_path / "build/kept").write_text("")
    tool.copied_chipwise(tmp_path)
    assert makefile.stat().st_mtime_ns == at and (tmp_path / "build/kept").exists()
    assert (tmp_path / "VERSION").read_text() == (ROOT / "VERSION").read_text() and not (
        tmp_path / "components/old.comp"
    ).exists()


def test_a_failure_is_one_sentence(tool, tmp_path):
    log = tmp_path / "log"
    with pytest.raises(tool.Refusal, match="failed in .*: configure: error: no libedit; all it said is in " + str(log)):
        tool.step(["sh", "-c", "echo checking; echo 'configure: error: no libedit'; exit 1"], tmp_path, log)
    tool.step(["true"], tmp_path, log)
