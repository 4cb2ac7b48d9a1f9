"""Strategies that clear a pocket: Fields (allowed tool centres) to Tracks (ways of the tool).

Called by cycles/pocket.py.  Pure geometry, mm, no LinuxCNC import.
"""
