# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs of LinuxCNC started from outside: its interpreter (program/rs274.py), a private machine (sandbox.py)."""
