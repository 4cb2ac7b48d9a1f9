# SPDX-License-Identifier: GPL-2.0-or-later
"""The three INI files describe one machine."""

import os
import re

import pytest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
INCH = 25.4


def entries(name):
    """-> [(section, key, value)] in the file's order."""
    found, section = [], None
    with open(os.path.join(ROOT, 'configs', name)) as handle:
        for line in handle:
            line = line.strip()
            if re.match(r'\[\w+\]$', line):
                section = line[1:-1]
            elif line and line[0] not in '#;':
                key, value = (part.strip() for part in line.split('=', 1))
                found.append((section, key, value))
    return found


def test_headless_is_the_mill_with_another_display():
    def common(name):
        return [entry for entry in entries(name)
                if entry[:2] not in (('DISPLAY', 'DISPLAY'), ('RS274NGC', 'PARAMETER_FILE'))
                and entry != ('HAL', 'HALFILE', '../hal/headless.hal')]
    assert common('mill_headless.ini') == common('mill.ini')


def test_gmoccapy_is_the_mill_with_another_screen():
    def common(name):
        return [entry for entry in entries(name)
                if entry[0] != 'DISPLAY' and entry[:2] != ('RS274NGC', 'PARAMETER_FILE')
                and not entry[2].startswith('../hal/chipwise_panel')]
    assert common('mill_gmoccapy.ini') == common('mill.ini')


LENGTHS = re.compile(r'(JOINT|AXIS)_|TRAJ$')
NUMBERS = re.compile(r'VELOCITY|ACCELERATION|LIMIT$|FERROR$|HOME$|HOME_OFFSET$')


def test_inch_is_the_metric_mill():
    metric = {entry[:2]: entry[2] for entry in entries('mill.ini')}
    inch = {entry[:2]: entry[2] for entry in entries('mill_inch.ini')}
    assert set(metric) == set(inch)
    checked = 0
    for (section, key), value in metric.items():
        if NUMBERS.search(key) and (LENGTHS.match(section) or section == 'DISPLAY'):
            assert float(inch[section, key]) * INCH == pytest.approx(float(value), abs=1e-4)
            checked += 1
        elif section in ('TASK', 'EMCMOT', 'KINS', 'HAL', 'CHIPWISE', 'PYTHON'):
            assert inch[section, key] == value
    assert checked > 40
    remaps = [[entry for entry in entries(name) if entry[1] == 'REMAP']
              for name in ('mill.ini', 'mill_inch.ini')]
    assert remaps[0] == remaps[1]


def test_files_named_exist():
    for name in ('mill.ini', 'mill_inch.ini', 'mill_headless.ini', 'mill_gmoccapy.ini', 'robot.ini'):
        folder = os.path.join(ROOT, 'configs')
        for section, key, value in entries(name):
            if (section, key) in (('HAL', 'HALFILE'), ('HAL', 'POSTGUI_HALFILE'), ('DISPLAY', 'PYVCP'), ('EMCIO', 'TOOL_TABLE'),
                                  ('CHIPWISE', 'TOOL_GEOMETRY'), ('PYTHON', 'TOPLEVEL')):
                assert os.path.exists(os.path.join(folder, value)), (name, value)
