# SPDX-License-Identifier: GPL-2.0-or-later
"""Digitise: what a tracer head has touched becomes a height map, a surface and a program.

    record.py       the log of a trace: centres of the stylus' ball, mm
    height_map.py   ball centres -> heights of the model, as a stock file
    rim.py          cells at the rim that only the flank of a ball has passed
    mesh.py         heights -> an STL file
    program.py      ball centres -> G-code for a ball tool as large as the stylus

Called by cli/digitise.py.  Pure but for the files: no HAL, no LinuxCNC.
"""
