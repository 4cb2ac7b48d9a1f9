# SPDX-License-Identifier: GPL-2.0-or-later
"""How the tests are arranged: what imports what, and from where."""

import re

from support import ROOT

TESTS, BENCH = ROOT / "tests", ROOT / "bench"
# Files that name a root of imports, and why.
OWN_PATH = {
    "roots.py",
    "fork_server.py",  # of the benchmarks; a program that runs bin/chipwise
    "scripted_display.py",
    "robot_display.py",
    "sample_driver.py",
    "read_map.py",
    "fuzz_pins.py",
    "panel_slow_looks.py",
    "resume_visit.py",  # LinuxCNC or HAL starts them
    "shipped_machine.py",
    "panel_lan.py",  # root starts it in namespaces
    "panel_tab_host.py",  # on an X display of its own
    "second_oracles.py",  # where pip has put the libraries
    "test_foreign_memory.py",
    "test_monitor.py",
    "test_panel_tab.py",
    "test_planner.py",
    "test_headless.py",
    "test_sandbox.py",
    "test_layout.py",
    "bench_pocket.py",
    "filter_rig.py",
    "test_cam_posts.py",
    "test_load_components.py",
    "test_program_out.py",  # in the text of another process's program
    "test_docs.py",
    "test_filter.py",
    "test_words.py",
    "pocket_engagement.py",
    "test_debian.py",
    "test_on_linuxcnc.py",  # programs of tools/
    "test_forked.py",
}  # compares what programs see of themselves
IMPORT = re.compile(r"^\s*(?:from|import)\s+([\w.]+)(?:\s+import\s+([\w, ]+))?", re.M)


def sources(*folders):
    return [
        path
        for folder in folders
        for path in sorted(folder.rglob("*.py"))
        if path.name != "test_structure.py" and "__pycache__" not in path.parts
    ]


def imported(path):
    """Every dotted name that a file may import."""
    return [
        f"{module}.{name.split(' as ')[0].strip()}"
        for module, names in IMPORT.findall(path.read_text())
        for name in (names or "").split(",")
    ]


def test_no_test_is_imported():
    found = [
        (path.name, name)
        for path in sources(TESTS, BENCH)
        for name in imported(path)
        if re.search(r"(^|\.)test_|^conftest\b|(^|\.)_test\b", name)
    ]
    assert not found, found


def test_tests_and_benchmarks_share_only_support():
    own = {path.stem for path in BENCH.glob("*.py")}
    found = [(path.name, name) for path in sources(TESTS) for name in imported(path) if name.partition(".")[0] in own]
    assert not found, found
    folders = {path.name for path in TESTS.iterdir() if path.is_dir()} - {"support"}
    found = [
        (path.name, name)
        for path in sources(TESTS, BENCH)
        for name in imported(path)
        if name.partition(".")[0] in folders
    ]
    assert not found, found


def test_one_import_root():
    found = {
        path.name
        for path in sources(TESTS, BENCH)
        if re.search(r"sys\.path(\.|\[|\s*=)|syspath_prepend", path.read_text())
    }
    assert found == OWN_PATH, found ^ OWN_PATH


def test_names_of_test_files_are_unique():
    names = [path.name for path in sources(TESTS) if path.name.startswith("test_")]
    assert len(names) == len(set(names))
