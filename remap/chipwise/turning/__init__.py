# SPDX-License-Identifier: GPL-2.0-or-later
"""Turning from a drawing: from blank, part and tools to steps, ranges, passes and NC data.  Pure Python, no
interpreter, no HAL.

plan.py is the entry; profile_function.py has the functions x(z) of lines and arcs that everything is made of.
"""
