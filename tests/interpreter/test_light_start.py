# SPDX-License-Identifier: GPL-2.0-or-later
"""What LinuxCNC's interpreter loads when it starts: task, preview, and each process that reads a sub.  Plans have a
process of their own with numpy."""

from support import canon

HEAVY = ("numpy", "shapely", "chipwise.planner.plans", "chipwise.geometry.base.contour", "chipwise.surface")


def loaded(*lines):
    """The modules in the interpreter after some lines of a program."""
    trace = canon.run_rs274(
        "\n".join([*lines, ";py,import sys; print('loaded:', *sorted(sys.modules))", "M2", ""]), started=True
    )
    assert not trace.error, trace.error
    return next(line for line in trace.output.splitlines() if line.startswith("loaded: ")).split()[1:]


def test_it_loads_no_libraries():
    found = loaded("G21 G0 X1")
    assert "chipwise.codes" in found
    assert not [name for name in found if name.startswith(HEAVY)]


def test_nor_for_a_cycle():
    """A hole is planned elsewhere."""
    found = loaded("G21", "T1 M6", "S5000 M3", "F600", "G0 X0 Y0 Z5", "G13 X0 Y0 Z-2 R2 I5 J1")
    assert "chipwise.codes" in found
    assert not [name for name in found if name.startswith(HEAVY)]
