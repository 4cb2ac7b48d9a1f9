# SPDX-License-Identifier: GPL-2.0-or-later
"""Contour subs: from an O-sub number to loops of lines and arcs.  Pure Python: no interpreter object, no HAL.

read.py is the entry; job.py has what goes in and comes out; program/find_sub.py, check.py and run.py are the steps;
runner.py is the process that runs a sub.
"""
