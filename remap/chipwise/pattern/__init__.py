# SPDX-License-Identifier: GPL-2.0-or-later
"""A sub run as a pattern (G75): read to its moves, transformed, repeated.

job.py        what is asked of the reader
check.py      what the text of the sub may hold
run.py        starts the reader and keeps what it found
runner.py     the reader: LinuxCNC's interpreter in a process of its own
recorded.py   what it found: moves and codes
climb.py      closed chains of a mirrored sub, run backwards
library.py    folders of subs that are listed by name
copies.py     the same sub at many places
isometry.py   mirror, rotation and shift, of points and of moves
"""
