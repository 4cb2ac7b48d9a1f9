# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise.report: lines arrive whole, and nothing ever stops a cycle."""

import multiprocessing

from chipwise import report


def test_nothing_without_the_variable(monkeypatch):
    monkeypatch.delenv(report.VARIABLE, raising=False)
    monkeypatch.delenv(report.HEADLESS, raising=False)
    assert report.path() is None
    report.record("hole", chopped=True)


def test_a_headless_run_has_a_default(monkeypatch, tmp_path):
    monkeypatch.delenv(report.VARIABLE, raising=False)
    monkeypatch.setenv(report.HEADLESS, "panel.ngc")
    monkeypatch.setenv("HOME", str(tmp_path))
    report.record("hole", chopped=True)
    assert report.path().startswith(str(tmp_path))
    assert len(report.read(report.path())) == 1


def test_lines_come_back(monkeypatch, tmp_path):
    path = str(tmp_path / "report")
    monkeypatch.setenv(report.VARIABLE, path)
    assert report.read(path) == []
    report.record("hole", chopped=True, largest_piece_mm=2.5)
    report.record("hole", chopped=False)
    assert report.read(path) == [
        {"kind": "hole", "chopped": True, "largest_piece_mm": 2.5},
        {"kind": "hole", "chopped": False},
    ]


def test_unwritable_and_odd_values_are_swallowed(monkeypatch, tmp_path):
    monkeypatch.setenv(report.VARIABLE, str(tmp_path / "no" / "such" / "folder"))
    report.record("hole")
    monkeypatch.setenv(report.VARIABLE, str(tmp_path / "report"))
    report.record("hole", shape={1, 2})
    loop = []
    loop.append(loop)
    report.record("hole", shape=loop)


def write_many(letter):
    for _number in range(200):
        report.record("hole", text=letter * 300)


def test_appends_are_atomic(monkeypatch, tmp_path):
    path = str(tmp_path / "report")
    monkeypatch.setenv(report.VARIABLE, path)
    with multiprocessing.get_context("fork").Pool(4) as pool:
        pool.map(write_many, "abcd")
    lines = report.read(path)
    assert len(lines) == 800
    assert all(len(set(line["text"])) == 1 for line in lines)
