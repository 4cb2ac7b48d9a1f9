# SPDX-License-Identifier: GPL-2.0-or-later
"""Curved surfaces: a model from a file, the drop cutter over it, cuts in one direction, links between them.

    model.py     a file -> triangles at their place: stl.py reads STL, png.py 16-bit depth pictures, stock_model.py
                 stock files
    clib/drop_cutter.py      the lowest tip over the triangles, at points and along segments
                             (components/offline/drop_*.c)
    scallop.py   how far apart cuts may be for the ridges between them
    needed.py    the parts of cuts that the stock needs, and their order
    raster.py    cuts in one direction as lines and arcs within a tolerance
    curve.py     lines and arcs as points for the stock, and as moves
    links.py     from the end of a cut to the start of the next, safe against model and stock
cycles/surface.py puts them together.
"""
