# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise geometry kernel: contours of lines and arcs, offset by a tool.

Pure Python and numpy, mm and rad, no LinuxCNC import.  Called by the cycles G77, G78
and G79.  docs/design/geometry.md follows one contour through the modules.
"""
