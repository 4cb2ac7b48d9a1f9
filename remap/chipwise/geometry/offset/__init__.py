# SPDX-License-Identifier: GPL-2.0-or-later
"""The offset of a contour by a tool: centre paths, rough shapes, inaccessible regions."""
