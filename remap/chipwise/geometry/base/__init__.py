# SPDX-License-Identifier: GPL-2.0-or-later
"""The kernel's types and operations: contours, elements, polygons, clearance."""
