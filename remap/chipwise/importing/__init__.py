# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawings to contour subs: from a .dxf or .svg file to closed loops of lines and arcs.  Pure Python: no interpreter
object, no HAL.

run.py is the entry.  dxf.py and svg.py read a file into Curves; fit.py makes lines and arcs of what is neither; join.py
makes chains of them; sub.py writes the program.  ezdxf and svgelements are asked for only when a drawing is read.
"""
