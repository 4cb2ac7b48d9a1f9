# SPDX-License-Identifier: GPL-2.0-or-later
"""Strategies that clear a pocket: machinable regions (allowed tool centres) to Tracks (toolpaths).

Called by cycles/pocket.py.  Pure geometry, mm, no LinuxCNC import.
"""
