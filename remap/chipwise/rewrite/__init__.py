# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewrites whole programs: flute.py (CN105492980), feed.py (JP3131045); program.py reads, calls.py writes
calls and loops out, text.py writes, read_back.py reads back."""
