# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps, vices and fixtures: obstacles on the table, which no tool may touch.

clamp.py        a clamp, and how far places are from it
comment.py      CLAMP comments of a program -> clamps
set_ups.py      clamps of the machine, in a file
cycles/obstacles.py, cycles/detour.py    traverses of a planned cycle led round clamps, the rest refused
distance.py     how near moves of a tool come to clamps
"""
